from __future__ import annotations

import io
from dataclasses import replace

import pytest
from rich.console import Console

from forestall.records.listeners import ProgressLine
from forestall.types.decision import Outcome
from forestall.types.episode import EpisodeRecord, ExecutedRecord, SkillOutcome, SkillStatus
from forestall.types.plan import Subtask
from report import records


class Clock:
    """One second passes at each look."""

    def __init__(self) -> None:
        self.now_s = 0.0

    def __call__(self) -> float:
        self.now_s += 1.0
        return self.now_s


def written(record: EpisodeRecord, *, terminal: bool = False, quiet: bool = False) -> str:
    file = io.StringIO()
    console = Console(file=file, force_terminal=terminal, width=140, highlight=False)
    records.follow(ProgressLine(console, quiet=quiet, clock=Clock()), record)
    return file.getvalue()


def test_plain_lines_where_nobody_watches() -> None:
    lines = written(records.potato_record()).splitlines()
    assert lines[0] == "heat-potato, seed 7: 11 subtasks"
    assert lines[1].startswith("1/11 navigate_to_obj(Potato), 4 s")
    assert f"alarm before pick_up(Plate-1): {records.CAUSE}" in lines
    assert "new plan: 6 subtasks" in lines
    assert "8/13 pick_up(Bowl-1), 36 s" in lines
    assert lines[-1].startswith("heat-potato succeeded: plan finished, 13 subtasks, 1 alarm, 52 s")
    assert "\x1b" not in "".join(lines)


def test_quiet_says_only_what_matters() -> None:
    lines = written(records.potato_record(), quiet=True).splitlines()
    assert len(lines) == 3
    assert lines[0].startswith("alarm before")


def test_one_moving_line_on_a_terminal() -> None:
    text = written(records.potato_record(), terminal=True)
    assert "simulated" in text
    assert "s left" in text
    assert "1 alarm" in text
    assert text.count("\n") < 40
    assert text.endswith("s elapsed\n") or "s elapsed" in text.splitlines()[-1]


def test_names_are_not_read_as_markup_and_failures_are_said() -> None:
    record = records.troubled_record()
    text = written(record)
    assert 'failed: dropped "it" <hard>' in text
    assert "heat-potato not scored: stopped safely" in text
    odd = Subtask("pick_up", ("[red]Mug[/red]",))
    file = io.StringIO()
    line = ProgressLine(Console(file=file, width=100), clock=Clock())
    line.on_start(records.begun(record))
    done = SkillOutcome(SkillStatus.SUCCEEDED, 1.0)
    line.on_executed(ExecutedRecord(odd, done, 0), 1.0)
    assert "[red]Mug[/red]" in file.getvalue()


def test_stopping_is_said_with_its_reason() -> None:
    file = io.StringIO()
    line = ProgressLine(Console(file=file, width=100), clock=Clock())
    record = records.potato_record()
    line.on_start(records.begun(record))
    (boundary, context), *_ = records.calls(record)
    line.on_boundary(replace(boundary, outcome=Outcome.HOLD, why="no plan works"), context)
    assert "stopped before navigate_to_obj(Potato): no plan works" in file.getvalue()


def test_a_run_that_raises_gives_the_terminal_back() -> None:
    file = io.StringIO()
    record = records.potato_record()
    console = Console(file=file, force_terminal=True, width=100)
    with pytest.raises(RuntimeError), ProgressLine(console, clock=Clock()) as line:
        line.on_start(records.begun(record))
        raise RuntimeError
    assert file.getvalue().count("\x1b[?25l") == file.getvalue().count("\x1b[?25h") == 1


def test_it_writes_to_standard_error(capfd: pytest.CaptureFixture[str]) -> None:
    records.follow(ProgressLine(), records.potato_record())
    out, err = capfd.readouterr()
    assert out == ""
    assert "heat-potato succeeded" in err


def test_alarms_after_a_subtask_are_said_so() -> None:
    lines = written(records.looked_after_record()).splitlines()
    alarm = lines.index(f"alarm after put_in(Plate, Microwave): {records.CAUSE}")
    assert "put_in(Plate, Microwave) refused" in lines[alarm - 1]
    assert lines[alarm + 1] == "new plan: 6 subtasks"
    assert lines[alarm + 2].startswith("10/15 ")
