"""Files that are whole or not there, and folders that one process writes at a time."""

from __future__ import annotations

import errno
import os
import subprocess
import sys
import threading
from pathlib import Path

import pytest

from forestall.errors import ForestallError, InputError
from forestall.files import HOLDER, alone, make_folder, naming, replace_file, whole_file

HOLDING = """
import sys, time
from pathlib import Path
from forestall.files import alone
with alone(Path(sys.argv[1])):
    print("held", flush=True)
    time.sleep(600)
"""


def names(folder: Path) -> list[str]:
    return sorted(p.name for p in folder.iterdir())


def test_a_write_that_fails_leaves_what_was_there_and_names_the_file(tmp_path: Path) -> None:
    path = tmp_path / "a.json"
    replace_file(path, b"old")
    with pytest.raises(OSError, match=r"No space left on device.*a\.json"), whole_file(path) as new:
        new.write(b"half")
        raise OSError(errno.ENOSPC, "No space left on device")
    assert path.read_bytes() == b"old"
    assert names(tmp_path) == ["a.json"]
    with pytest.raises(ValueError), whole_file(path):
        raise ValueError
    assert names(tmp_path) == ["a.json"]
    with pytest.raises(OSError, match=r"b\.json") as told, naming(tmp_path / "b.json"):
        raise OSError(errno.EFBIG, "File too large")
    assert told.value.errno == errno.EFBIG


def test_two_with_one_process_id_do_not_meet_in_a_partial_file(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(os, "getpid", lambda: 1)
    path = tmp_path / "a.json"
    with whole_file(path) as one, whole_file(path) as other:
        one.write(b"one")
        other.write(b"other")
    assert path.read_bytes() == b"one"
    assert names(tmp_path) == ["a.json"]


def test_the_second_is_told_who_holds_the_folder(tmp_path: Path) -> None:
    with alone(tmp_path):
        says = rf"{tmp_path} is being written by process {os.getpid()} on .*, since 20"
        with pytest.raises(InputError, match=says), alone(tmp_path):
            pass
        with alone(tmp_path, "another thing of it"):
            pass
    with alone(tmp_path):
        pass


def test_a_lock_goes_with_its_process_whatever_ids_there_are(tmp_path: Path) -> None:
    holding = subprocess.Popen(
        [sys.executable, "-c", HOLDING, str(tmp_path)], stdout=subprocess.PIPE, text=True
    )
    assert holding.stdout is not None
    assert holding.stdout.readline() == "held\n"
    with pytest.raises(InputError, match=f"process {holding.pid} "), alone(tmp_path):
        pass
    holding.kill()
    holding.communicate()
    assert (tmp_path / HOLDER).exists()
    (tmp_path / HOLDER).write_text(f"process {os.getpid()} on somewhere")  # equal ids say nothing
    with alone(tmp_path):
        pass
    assert not (tmp_path / HOLDER).exists()


def test_it_can_be_waited_for(tmp_path: Path) -> None:
    told: list[str] = []
    order: list[str] = []

    def later() -> None:
        with alone(tmp_path, waits=told.append):
            order.append("second")

    waiting = threading.Thread(target=later)
    with alone(tmp_path):
        waiting.start()
        while not told:
            pass
        order.append("first")
    waiting.join()
    assert order == ["first", "second"]
    assert told[0].startswith(f"process {os.getpid()} on ")


def test_what_a_killed_process_left_is_taken_away_and_nothing_else(tmp_path: Path) -> None:
    left = f".{'0f' * 16}.part"
    for place in (tmp_path, tmp_path / "images", tmp_path / "held"):
        place.mkdir(exist_ok=True)
        (place / left).touch()
        (place / "mine.part").touch()
    with alone(tmp_path / "held", "thing"), alone(tmp_path / "held"):
        (tmp_path / "held" / left).touch()
        with alone(tmp_path):
            assert (tmp_path / "held" / left).exists(), "another process may be writing it"
    assert names(tmp_path / "images") == ["mine.part"]
    assert left not in names(tmp_path)
    assert "mine.part" in names(tmp_path)


def test_a_folder_that_cannot_be_made_is_said(tmp_path: Path) -> None:
    (tmp_path / "file").touch()
    with pytest.raises(ForestallError, match="name another folder"):
        make_folder(tmp_path / "file" / "folder")
