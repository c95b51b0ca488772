"""Pages and demonstrations from the folders of runs, finished or not."""

import json
from dataclasses import replace
from pathlib import Path

import pytest

from forestall.cli.main import call
from forestall.memory.store import open_store
from forestall.records.record import IMAGES_NAME, RunRecorder, write_record
from forestall.report.page import page_html
from forestall.types.decision import Outcome
from report import records


def test_a_page_from_a_folder_is_the_page_of_the_run(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    record = records.potato_record(frames=2)
    write_record(tmp_path, record)
    assert call(["page", str(tmp_path)]) == 0
    assert capsys.readouterr().out.strip() == str(tmp_path / "index.html")
    drawn = (tmp_path / "index.html").read_text("utf-8")

    def without_pictures(page: str) -> list[str]:
        return [part.partition('"')[2] for part in page.split("data:image/jpeg;base64,")]

    assert without_pictures(drawn) == without_pictures(page_html(record))
    assert call(["page", str(tmp_path / "record.json"), "--out", str(tmp_path / "b.html")]) == 0
    assert (tmp_path / "b.html").read_text("utf-8") == drawn


def test_a_page_of_a_killed_run(tmp_path: Path) -> None:
    records.follow(RunRecorder(tmp_path), records.potato_record(), 9)
    assert call(["page", str(tmp_path)]) == 0
    text = (tmp_path / "index.html").read_text("utf-8")
    assert "unfinished" in text and "Not scored" in text
    assert records.CAUSE in text and "data:image/jpeg" in text


def test_a_picture_that_is_gone_is_missing_and_one_that_is_broken_is_told(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    write_record(tmp_path, records.potato_record())
    first, *others = sorted((tmp_path / IMAGES_NAME).iterdir())
    for path in others:
        path.unlink()
    assert call(["page", str(tmp_path)]) == 0
    assert "data:image/jpeg" in (tmp_path / "index.html").read_text("utf-8")
    first.write_bytes(b"no picture")
    assert call(["page", str(tmp_path)]) == 2
    assert f"{first.name} is not a picture" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("", "is empty"),
        (json.dumps({"kind": "episode", "format": 1}), "record format 1: this version reads 3"),
    ],
)
def test_no_page_without_a_record(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], text: str, says: str
) -> None:
    (tmp_path / "record.json").write_text(text)
    assert call(["page", str(tmp_path)]) == 2
    assert says in capsys.readouterr().err
    assert not (tmp_path / "index.html").exists()


def smooth(folder: Path, seed: int) -> Path:
    """The folder of a run that went through without an alarm."""
    record = records.potato_record()
    fine = tuple(
        replace(records.boundary(e.index, e.subtask), outcome=Outcome.PROCEED)
        for e in record.executed
    )
    write_record(folder, replace(record, boundaries=fine, seed=seed))
    return folder


def test_runs_become_demonstrations(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    memory = tmp_path / "memory.db"
    runs = [str(smooth(tmp_path / str(seed), seed)) for seed in (1, 2)]
    assert call(["demos", "add", str(memory), *runs]) == 0
    assert "2 demonstrations added" in capsys.readouterr().out
    with open_store(memory) as store:
        found = store.required()
    assert sorted(d.scene for d in found) == ["kitchen-1", "kitchen-2"]
    assert len(found[0].steps) == 13
    assert found[0].steps[0].graph == records.boundary(0, found[0].steps[0].subtask).scoped


def test_a_run_with_a_new_plan_is_no_demonstration_and_nothing_is_added(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    memory = tmp_path / "memory.db"
    good = smooth(tmp_path / "good", 1)
    write_record(tmp_path / "replanned", records.potato_record())
    assert call(["demos", "add", str(memory), str(good), str(tmp_path / "replanned")]) == 2
    assert "is no demonstration" in capsys.readouterr().err
    assert call(["demos", "add", str(memory)]) == 2
    assert not memory.exists()
