"""The file reads back equal; what is none is refused in one sentence with its place."""

from __future__ import annotations

from pathlib import Path

import pytest
from calibration_tables import runs, table

from forestall.calibration.file import calibration_toml, read_calibration, write_calibration
from forestall.calibration.scores import JudgedRun, Parts
from forestall.errors import FileFormatError

OPTIONS = {"likeness": {"floor": 0.5, "k": None, "parts": ("a", 'b "c"'), "on": True, "name x": 3}}


def test_it_reads_back_equal(tmp_path: Path) -> None:
    quiet = JudgedRun("quiet", "new\ttask", runs()[0].boundaries[1:2])
    made = table(
        [*runs(many=3, few=2), quiet],
        parts=Parts.UNDO,
        level=0.2,
        by_task=False,
        options=OPTIONS,
        memory="0123abcd",
        demonstrations=6,
        held_out=True,
        looks={"likeness": 1},
    )
    path = tmp_path / "calibration.toml"
    write_calibration(path, made)
    again = read_calibration(path)
    assert again == made
    assert again.fit("many") == made.fit("many")
    assert calibration_toml(again) == path.read_text(encoding="utf-8")


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("format = 2", "format = 7", "format: 2, as this version writes it, is expected, got 7"),
        ("format = 2", "format = 1", "run forestall calibrate again"),
        ("level = 0.05", "level = 1.5", "level 1.5"),
        ("level = 0.05", "level = 'high'", "level: a number is expected"),
        ('parts = "none"', 'parts = "room"', "parts: one of 'none', 'undo', 'skill' is expected"),
        ("scores = [0.", "scores = [0.1, 0.", "groups[0].runs[0].scores: a list of 1 scores"),
        ("scores = [0.", "scores = ['?'], x = [0.", "groups[0].runs[0].scores[0]: a number"),
        ("share = 1.0", "share = 0.0", "every share of the budget is above 0"),
        ("few-1", "few-0", "one is there twice"),
        ("by_task = true", "by_tasks = true", "unknown key 'by_tasks': known are format, level"),
        ("by_task = true\n", "", "the document lacks 'by_task'"),
        ("[[groups]]", "[[groups", "not valid TOML"),
    ],
)
def test_what_is_none_is_refused(tmp_path: Path, old: str, new: str, said: str) -> None:
    path = tmp_path / "calibration.toml"
    text = calibration_toml(table(runs(many=3, few=2)))
    assert old in text
    path.write_text(text.replace(old, new, 1), encoding="utf-8")
    with pytest.raises(FileFormatError) as refused:
        read_calibration(path)
    assert str(path) in str(refused.value)
    assert said in str(refused.value)


def test_a_file_that_is_not_there(tmp_path: Path) -> None:
    with pytest.raises(FileFormatError, match=r"gone\.toml"):
        read_calibration(tmp_path / "gone.toml")
