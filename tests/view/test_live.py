from __future__ import annotations

import json
from pathlib import Path

import pytest

from forestall.errors import FileFormatError
from forestall.records.record import LINES_NAME, RunRecorder
from forestall.view.live import happened, progress
from report import records


def test_a_run_is_read_on_from_where_it_was_read(tmp_path: Path) -> None:
    record = records.potato_record()
    recorder = RunRecorder(tmp_path)
    recorder.on_start(records.begun(record))
    path = tmp_path / LINES_NAME
    begun, offset = happened(path, 0)
    assert [e["event"] for e in begun] == ["start"]
    assert happened(path, offset) == ([], offset)
    for boundary, context in records.calls(record)[:2]:
        recorder.on_boundary(boundary, context)
    more, offset = happened(path, offset)
    assert [e["event"] for e in more] == ["boundary", "boundary"]
    assert offset == path.stat().st_size


def test_half_a_line_is_left_for_the_next_time(tmp_path: Path) -> None:
    records.follow(RunRecorder(tmp_path), records.potato_record(), 3)
    path = tmp_path / LINES_NAME
    data = path.read_bytes()
    path.write_bytes(data[:-40])
    events, offset = happened(path, 0)
    path.write_bytes(data)
    rest, end = happened(path, offset)
    assert len(rest) == 1 and end == len(data)
    assert len(events) + 1 == data.count(b"\n")


def test_progress_says_how_far_a_run_has_come(tmp_path: Path) -> None:
    record = records.potato_record()
    records.follow(RunRecorder(tmp_path), record, records.ALARM_INDEX + 1)
    found = progress(happened(tmp_path / LINES_NAME, 0)[0])
    assert found.task == record.task.title and found.scenario == "microwave-occupied"
    assert len(found.done) == records.ALARM_INDEX and found.done[0] == (
        "✓",
        "navigate_to_obj(Potato)",
    )
    assert found.left[:2] == records.INSERTED
    assert found.alarms == 1 and found.time_s == 28.0 and not found.end
    newest = found.lines[0]
    assert newest.look == "alarm" and newest.said == records.SENTENCE
    assert newest.score == "0.734 / 0.90"
    assert found.picture is not None and (tmp_path / found.picture).is_file()


def test_a_run_that_ended_and_values_that_nobody_expects() -> None:
    start = {"event": "start", "task": "t", "title": "", "initial_plan": ["a(B)", 3]}
    found = progress(
        [
            start,
            {"event": "boundary", "boundary": {"image": "../x.jpg", "verdict": 5}, "alarm": None},
            {"event": "executed", "executed": {"subtask": "a(B)", "status": "odd"}},
            {"event": "end", "end": "held"},
        ]
    )
    assert found.picture is None and found.end == "held"
    assert found.done == (("?", "a(B)"),) and found.task == "t"


@pytest.mark.parametrize("line", ["no json", "[]", json.dumps({"event": "start", "kind": "x"})])
def test_lines_of_something_else_are_refused(tmp_path: Path, line: str) -> None:
    (tmp_path / LINES_NAME).write_text(line + "\n")
    with pytest.raises(FileFormatError):
        happened(tmp_path / LINES_NAME, 0)
