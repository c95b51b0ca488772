"""Recording: one by one, taken up again, made again where the cache is damaged."""

from __future__ import annotations

import inspect
import os
import sqlite3
import sys
from collections.abc import Callable
from pathlib import Path
from types import FrameType

import pytest

from forestall.assembly import recording
from forestall.assembly.configuration import run_config
from forestall.assembly.demonstrations import load_memory, ready_made
from forestall.assembly.recording import RecordingJob, jobs_for, keyed, record_into, record_one
from forestall.config import cache_dir
from forestall.errors import ForestallError, MemoryFileError
from forestall.files import alone
from forestall.fingerprint import JUDGING
from forestall.memory.store import open_store
from forestall.types.demonstration import Demonstration

TASK = "hand-over-washer"
JOBS = jobs_for([TASK])


@pytest.fixture
def recorded(monkeypatch: pytest.MonkeyPatch) -> list[RecordingJob]:
    """The jobs that were recorded."""
    found: list[RecordingJob] = []

    def record(job: RecordingJob) -> Demonstration:
        demonstration = record_one(job)
        found.append(job)
        return demonstration

    monkeypatch.setattr(recording, "record_one", record)
    return found


def test_what_was_recorded_is_kept_and_not_recorded_again(
    tmp_path: Path, recorded: list[RecordingJob], monkeypatch: pytest.MonkeyPatch
) -> None:
    told: list[tuple[int, int]] = []

    def stopped(done: int, total: int, _: str) -> None:
        told.append((done, total))
        if done == 2:
            raise KeyboardInterrupt

    with open_store(tmp_path / "m.db", create=True) as store:
        with pytest.raises(KeyboardInterrupt):
            record_into(store, JOBS, 1, stopped)
        assert len(store) == 2
        assert record_into(store, JOBS, 1) == 2
        assert record_into(store, JOBS, 1) == 0
        assert len(store) == len(store.recorded()) == 4
        assert record_into(store, jobs_for([TASK], kitchens=5), 1) == 1
    assert told == [(0, 4), (1, 4), (2, 4)]
    assert [j.first_seed for j in recorded] == [1_000_000 + 10 * k for k in range(5)]


def test_what_another_process_has_recorded_meanwhile_is_left_out(
    tmp_path: Path, recorded: list[RecordingJob], monkeypatch: pytest.MonkeyPatch
) -> None:
    first, second = JOBS[:2]
    key = next(k for k, job in keyed(JOBS).items() if job == second)

    def meanwhile(done: int, total: int, _: str) -> None:
        if done == 1:
            with open_store(tmp_path / "m.db") as other:
                other.add(record_one(second), key)

    with open_store(tmp_path / "m.db", create=True) as store:
        assert record_into(store, [first, second], 1, meanwhile) == 1
        assert len(store) == 2
    assert recorded == [first]


@pytest.mark.slow
def test_several_processes_make_the_same_memory(tmp_path: Path) -> None:
    digests = []
    for workers in (1, 2):
        with open_store(tmp_path / f"{workers}.db", create=True) as store:
            assert record_into(store, JOBS, workers) == 4
            assert record_into(store, JOBS, workers) == 0
            digests.append(store.digest())
    assert digests[0] == digests[1]


def emptied(path: Path) -> None:
    path.write_bytes(b"")


def cut(path: Path) -> None:
    path.write_bytes(path.read_bytes()[:9000])


def no_memory(path: Path) -> None:
    path.write_bytes(b"something else" * 100)


def half(path: Path) -> None:
    with sqlite3.connect(path) as connection:
        connection.execute("DELETE FROM recordings WHERE rowid = 1")
    connection.close()


def deep(path: Path) -> None:
    with sqlite3.connect(path) as connection:
        connection.execute("UPDATE steps SET subtask = 'pick(Nut-7)'")
    connection.close()


@pytest.mark.parametrize("damage", [emptied, cut, no_memory, half, deep])
def test_a_damaged_ready_made_memory_is_made_again(
    damage: Callable[[Path], None], recorded: list[RecordingJob]
) -> None:
    config = run_config(TASK)
    path = ready_made(config, workers=1)
    whole, _ = load_memory(config, workers=1)
    assert len(recorded) == 4
    damage(path)
    again, used = load_memory(config, workers=1)
    assert (again, used) == (whole, str(path))
    assert len(recorded) > 4
    assert sorted(p.suffix for p in path.parent.iterdir()) == [".db", ".lock"]


def test_a_ready_made_memory_goes_on_where_a_killed_process_was(
    recorded: list[RecordingJob],
) -> None:
    def stopped(done: int, total: int, _: str) -> None:
        if done == 3:
            raise KeyboardInterrupt

    config = run_config(TASK)
    with pytest.raises(KeyboardInterrupt):
        ready_made(config, progress=stopped, workers=1)
    assert list((cache_dir() / "memory").glob("*.db")) == []
    demonstrations_, _ = load_memory(config, workers=1)
    assert len(demonstrations_) == len(recorded) == 4


def test_one_that_is_being_made_is_waited_for(monkeypatch: pytest.MonkeyPatch) -> None:
    config = run_config(TASK)
    path = ready_made(config, workers=1)
    hidden = path.with_suffix(".hidden")
    path.rename(hidden)
    said: list[str] = []
    other = alone(path.parent, path.stem)

    def announce(text: str) -> None:
        said.append(text)
        hidden.rename(path)  # the other process has made it
        other.__exit__(None, None, None)

    other.__enter__()
    assert ready_made(config, announce, workers=1) == path
    assert len(said) == 1
    assert f"{TASK}: waiting for process {os.getpid()} on" in said[0]


def test_a_cache_that_cannot_be_written_is_said_in_a_sentence(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "file").touch()
    monkeypatch.setenv("FORESTALL_CACHE", str(tmp_path / "file"))
    with pytest.raises(MemoryFileError, match=r"Not a directory.*set FORESTALL_CACHE"):
        ready_made(run_config(TASK), workers=1)
    monkeypatch.delenv("FORESTALL_CACHE")
    monkeypatch.setattr("platformdirs.user_cache_path", lambda *_, **__: Path("~/.cache"))
    with pytest.raises(ForestallError, match="no home folder for the cache: set FORESTALL_CACHE"):
        cache_dir()


def test_varied_demonstrations_do_the_task_in_other_ways(
    tmp_path: Path, recorded: list[RecordingJob]
) -> None:
    jobs = jobs_for(["fasten-plate"], kitchens=6, varied=True)
    assert [job.variant for job in jobs] == [0, 1, 2, 3, 4, 5]
    assert jobs[:1] == jobs_for(["fasten-plate"], kitchens=1)
    with open_store(tmp_path / "varied.db", create=True) as store:
        assert record_into(store, jobs, 1) == 6
        assert record_into(store, jobs, 1) == 0
        assert record_into(store, jobs_for(["fasten-plate"], kitchens=6), 1) == 5
        ways = [tuple(str(s.subtask) for s in d.steps) for d in store.all()]
    assert len(set(ways)) > 3


def test_packages_that_judge_have_no_say_in_a_recording() -> None:
    """So that a change of theirs leaves what was recorded as it is."""
    called: set[str] = set()

    def tell(frame: FrameType, event: str, _: object) -> None:
        if event == "call" and frame.f_code.co_flags & inspect.CO_OPTIMIZED:
            called.add(frame.f_code.co_filename)

    sys.setprofile(tell)
    try:
        record_one(JOBS[0])
    finally:
        sys.setprofile(None)
    ours = {p.parts for f in called if "forestall" in (p := Path(f)).parts}
    assert any("tasks" in parts for parts in ours), "nothing was recorded"
    assert [p for p in ours if set(p) & set(JUDGING) and p[-1] != "options.py"] == []
