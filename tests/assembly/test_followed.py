"""A robot of somebody's own is seen while it works; a disk that fails holds nobody up."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest

from forestall import Monitor, Outcome
from forestall.assembly.followed import Followed
from forestall.errors import InputError
from forestall.records.record import RunRecorder, read_record
from forestall.types.episode import EpisodeEnd
from forestall.view.index import Index
from forestall.view.rows import Outcome as Stand
from forestall.view.rows import outcome_of

STEPS = ["grasp(peg-1)", "insert(peg-1, hole-1)"]
LYING, HELD, SEATED = "peg-1 lies_in tray-1", "peg-1 held_by gripper", "peg-1 seated_in hole-1"


def scene(peg: str, hole: str = "clean") -> dict[str, object]:
    things = {"peg-1": {}, "hole-1": {"surface": hole}, "tray-1": {}}
    return {"objects": things, "relations": [peg]}


@pytest.fixture
def monitor() -> Monitor:
    good = [(STEPS[0], scene(LYING)), (STEPS[1], scene(HELD)), scene(SEATED)]
    return Monitor.from_demonstrations([good] * 12)


def ticking() -> Iterator[float]:
    yield from (float(k) for k in range(1000))


def test_a_robot_is_seen_at_work_and_its_run_is_kept(tmp_path: Path, monitor: Monitor) -> None:
    clock = ticking()
    with Followed(monitor, tmp_path / "arm-1", lambda: next(clock)) as robot:
        run = robot.start(STEPS)
        assert robot.before(scene(LYING)).outcome is Outcome.PROCEED
        robot.after("done")
        (row,) = Index(tmp_path).now().runs.values()
        assert row.place == f"arm-1/{run.name}" and row.executed == 1
        assert outcome_of(row, run) is Stand.RUNNING
        held = robot.before(scene(HELD, "dirty"))
        assert not held.may_start
        record = robot.end(success=False, failures=["the hole is dirty"])
    assert record is not None and record.end is EpisodeEnd.STOPPED
    read = read_record(run)
    assert read.failures == ("the hole is dirty",) and read.success is False
    assert [b.outcome for b in read.boundaries] == [Outcome.PROCEED, held.outcome]
    assert [b.time_s for b in read.boundaries] == sorted(b.time_s for b in read.boundaries)
    assert [str(e.subtask) for e in read.executed] == [STEPS[0]]
    (row,) = Index(tmp_path).now().runs.values()
    assert outcome_of(row, run) is Stand.FAILED


def test_a_second_run_ends_the_first_and_has_a_folder_of_its_own(
    tmp_path: Path, monitor: Monitor
) -> None:
    with Followed(monitor, tmp_path) as robot:
        first, second = robot.start(STEPS), robot.start(STEPS)
        assert first != second and (first / "record.json").is_file()
        assert not (second / "record.json").is_file()
    assert (second / "record.json").is_file()
    with pytest.raises(InputError, match="call start"):
        Followed(monitor, tmp_path)._tell("on_end")


def test_a_disk_that_fails_holds_nobody_up(
    tmp_path: Path, monitor: Monitor, monkeypatch: pytest.MonkeyPatch
) -> None:
    def full(*_: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(RunRecorder, "on_boundary", full)
    with Followed(monitor, tmp_path) as robot:
        robot.start(STEPS)
        assert robot.before(scene(LYING)).may_start
        robot.after("done")
        robot.end()
        assert "RunRecorder failed in on_boundary" in robot.notes[0]
