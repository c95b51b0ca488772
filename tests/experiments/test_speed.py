"""Timings: one line of a folder for each group, taken up again, never mixed."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from forestall.errors import FileFormatError, InputError
from forestall.experiments import speed
from forestall.experiments.boundary_speed import boundary_times
from forestall.experiments.engines import make_lanes
from forestall.experiments.folder import ROWS
from forestall.experiments.speed import GROUPS, Timed, Timing, measure
from forestall.types.demonstration import Demonstration, DemonstrationStep
from forestall.types.plan import Subtask
from planning.corpus import DOMAIN, scene

TAKE = speed.take  # the real one, which the others do without
taken: list[str] = []


def fake(job: Timing) -> Timed:
    """A timing that takes no time."""
    taken.append(job.group)
    row = {"what": job.group, "unit": "ms", "median": 1.0, "least": 1.0, "most": 1.0, "n": 1}
    return Timed(job.group, ({**row, "aim": None},), {})


@pytest.fixture(autouse=True)
def _at_once(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(speed, "take", fake)
    monkeypatch.setattr(speed, "make_lanes", lambda *_: make_lanes("inline", 1))
    taken.clear()


def test_a_measurement_goes_on_where_it_was(tmp_path: Path) -> None:
    told: list[tuple[int, int]] = []
    whole = measure(3, 0, tmp_path, lambda done, total, what: told.append((done, total)))
    assert [r["what"] for r in whole["rows"]] == list(GROUPS)
    assert whole["machine"]["cores"]
    table = (tmp_path / "speed.csv").read_text().splitlines()
    assert table[0] == "what,median,least,most,unit,aim,median / aim"
    assert [line.partition(",")[0] for line in table[1:]] == list(GROUPS)
    assert told == [(k, len(GROUPS)) for k in range(len(GROUPS) + 1)]
    lines = (tmp_path / ROWS).read_text().splitlines(keepends=True)
    (tmp_path / ROWS).write_text(lines[0] + lines[1][:9])
    taken.clear()
    assert measure(3, 0, tmp_path, lambda *_: None)["rows"] == whole["rows"]
    assert taken == list(GROUPS[1:])


def test_timings_of_another_kind_are_not_mixed_in(tmp_path: Path) -> None:
    measure(3, 0, tmp_path, lambda *_: None)
    with pytest.raises(InputError, match="repeat 3"):
        measure(4, 0, tmp_path, lambda *_: None)
    (tmp_path / ROWS).write_text("{}\n")
    with pytest.raises(FileFormatError, match="line 1: the document lacks 'key'"):
        measure(3, 0, tmp_path, lambda *_: None)


def test_a_boundary_is_timed_at_every_step_of_a_run_once_a_round() -> None:
    steps = []
    for index, text in enumerate(("navigate_to_obj(Mug-1)", "pick_up(Mug-1)")):
        step = Subtask.parse(text)
        seen = scene("Mug-1 on CounterTop-1, CounterTop-1, Sink-1, Faucet-1")
        steps.append(DemonstrationStep(index, step, replace(seen, subtask=step), seen))
    runs = [Demonstration("make-coffee", "room", k, tuple(steps), id=f"d{k}") for k in range(2)]
    times = boundary_times(runs, 5, 3, DOMAIN)
    assert len(times) == 3 * len(steps) and min(times) > 0


@pytest.mark.slow
@pytest.mark.simulator
@pytest.mark.parametrize("group", GROUPS[:2])
def test_the_timings_themselves_can_be_taken(group: str) -> None:
    taken_now = TAKE(Timing(group, 1, 0))
    assert taken_now.rows and all(row["n"] >= 1 and row["median"] > 0 for row in taken_now.rows)
