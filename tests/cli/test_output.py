"""What commands do where they write: two at once, over an old page, on a full disk, unwatched."""

from __future__ import annotations

import errno
import os
from pathlib import Path

import pytest

from forestall.cli.main import call
from forestall.cli.progress import bar
from forestall.cli.run import _new_folder
from forestall.files import alone
from forestall.records.record import RECORD_NAME

RUN = ["run", "hand-over-washer", "--strategy", "none", "--quiet", "--out"]


def test_two_runs_do_not_share_a_folder(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "run").mkdir()
    with alone(tmp_path / "run"):
        assert call([*RUN, str(tmp_path / "run")]) == 2
    said = capsys.readouterr().err
    assert f"{tmp_path / 'run'} is being written by process {os.getpid()} on" in said
    assert call([*RUN, str(tmp_path / "run")]) == 0


def test_pictures_are_drawn_by_one_command(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    with alone(tmp_path):
        assert call(["encoder", "pictures", "--out", str(tmp_path)]) == 2
    assert "is being written by process" in capsys.readouterr().err


def test_runs_that_begin_in_one_second_have_folders_of_their_own(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("time.strftime", lambda *_: "20260101-000000")
    made = [_new_folder("glue-peg", None, "none", 3) for _ in range(3)]
    assert len(set(made)) == 3
    assert all(folder.is_dir() for folder in made)


def full(source: object, target: object) -> None:
    raise OSError(errno.ENOSPC, "No space left on device")


def test_a_full_disk_is_one_sentence_and_leaves_no_old_page(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    out = tmp_path / "run"
    assert call([*RUN, str(out)]) == 0
    page = (out / "index.html").read_bytes()
    capsys.readouterr()
    real = os.replace

    def no_record(source: Path, target: Path) -> None:
        (full if Path(target).name == RECORD_NAME else real)(source, target)

    with monkeypatch.context() as patch:
        patch.setattr(os, "replace", no_record)
        assert call([*RUN, str(out)]) == 3
    said = capsys.readouterr().err.splitlines()[-1]
    assert said.startswith("forestall: error: ")
    assert "No space left on device" in said and RECORD_NAME in said
    assert not (out / "index.html").exists(), "a page of another run than the record's"
    assert not [p for p in out.iterdir() if p.suffix == ".part"]
    assert call([*RUN, str(out)]) == 0
    assert len((out / "index.html").read_bytes()) == pytest.approx(len(page), rel=0.01)


def test_a_folder_that_cannot_be_written_is_said_before_anything_is_run(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "file").touch()
    for command in (RUN, ["encoder", "pictures", "--out"]):
        assert call([*command, str(tmp_path / "file" / "x")]) == 2
        assert "name another folder" in capsys.readouterr().err


def test_progress_is_quiet_where_nobody_watches(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    with bar("recording") as feed:
        feed(1, 2, "a thing")
    assert capsys.readouterr() == ("", "")
    monkeypatch.setattr("sys.stderr", None)
    with bar("recording") as feed:
        feed(1, 2, "a thing")
