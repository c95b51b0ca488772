"""A page of runs that went wrong: from their records alone, with a frame around the culprit."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from forestall.cli.main import call
from forestall.reading.pictures import read_picture
from forestall.records.record import write_record
from forestall.report.gallery import _FRAME, WIDTH, _outlined
from forestall.report.in_picture import Framed

from . import records


def test_a_run_is_shown_at_the_alarm_that_changed_its_plan(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    record = records.potato_record(frames=2)
    write_record(tmp_path / "run", record)
    assert call(["gallery", str(tmp_path / "docs"), str(tmp_path / "run")]) == 0
    assert capsys.readouterr().out.strip() == str(tmp_path / "docs" / "gallery.md")
    page = (tmp_path / "docs" / "gallery.md").read_text("utf-8")
    assert page.startswith("# Failures, in pictures")
    assert record.task.title in page and records.SENTENCE in page
    for number, step in enumerate(records.INSERTED, 1):
        assert f"{number}. `{step}`" in page
    (picture,) = (tmp_path / "docs" / "gallery").iterdir()
    assert f"](gallery/{picture.name})" in page
    assert read_picture(picture, "RGB").width <= WIDTH


def test_what_the_alarm_speaks_about_has_a_frame() -> None:
    rgb = np.full((120, 160, 3), 90, np.uint8)
    drawn = _outlined(rgb, [Framed("Bowl-1", 25.0, 50.0, 50.0, 25.0, True)])
    assert tuple(drawn[60, 40]) == _FRAME and tuple(drawn[75, 80]) == (90, 90, 90)
    assert (rgb == 90).all()


def test_a_run_without_such_an_alarm_is_named(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    write_record(tmp_path / "quiet", records.unjudged_record())
    assert call(["gallery", str(tmp_path / "docs"), str(tmp_path / "quiet")]) == 2
    assert "this run has no alarm" in capsys.readouterr().err
    assert not (tmp_path / "docs").exists()
    assert call(["gallery", str(tmp_path / "docs")]) == 2
    assert "no run was named" in capsys.readouterr().err
