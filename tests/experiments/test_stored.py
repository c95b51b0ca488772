"""A folder of results that was cut off, edited or made by others: one sentence, with its place."""

from __future__ import annotations

import json
import lzma
import re
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from forestall.cli.main import call
from forestall.experiments.folder import ABOUT, EFFORT, ROWS

MADE = Path(__file__).parents[1] / "fuzz" / "corpus" / "results" / "all"

Edit = Callable[[dict[str, Any]], object]

LINES: list[tuple[str, Edit | str, str]] = [
    (EFFORT, lambda d: d.pop("asked"), "effort.jsonl, line 1: asked: Field required"),
    (EFFORT, lambda d: d["asked"][0].pop("set"), "effort.jsonl, line 1: asked.0.set: Field req"),
    (EFFORT, lambda d: d.update(asked="\x1b[31m"), "effort.jsonl, line 1: asked: "),
    (EFFORT, lambda d: d["asked"][0].update(episodes=1e308), "asked.0.episodes: "),
    (EFFORT, lambda d: d["asked"][0].update(strategy=[None]), "asked.0.strategy: "),
    (EFFORT, lambda d: d.update(machine=7), "machine: Input should be a valid string, got 7"),
    (EFFORT, lambda d: d.update(seconds="2"), "seconds: Input should be a valid number"),
    (EFFORT, "{}", "effort.jsonl, line 1: jobs: Field required"),
    (EFFORT, "[]", "effort.jsonl, line 1: the document: "),
    (EFFORT, '{"jobs": NaN}', "effort.jsonl, line 1: damaged: NaN is no number"),
    (EFFORT, "[" * 10_000, "effort.jsonl, line 1: damaged: it nests too deeply"),
    (EFFORT, '{"a": 1, "a": 1}', "'a' is given twice"),
    (ROWS, lambda d: d.pop("judged"), "episodes.jsonl, line 1: judged: "),
    (ROWS, lambda d: d.update(seed="1"), "episodes.jsonl, line 1: seed: "),
    (ROWS, lambda d: d.update(more=1), "more: "),
    (ROWS, lambda d: d["judged"][0].update(score="high"), "judged.0.score: "),
    (ROWS, "null", "a result of format None"),
    (ROWS, '{"format"', "line 1: damaged or truncated"),
]


def broken(tmp_path: Path, file: str, edit: Edit | str) -> Path:
    folder = Path(shutil.copytree(MADE, tmp_path / "results"))
    lines = (folder / file).read_text().splitlines()
    if callable(edit):
        data = json.loads(lines[0])
        edit(data)
        edit = json.dumps(data)
    (folder / file).write_text("\n".join([edit, *lines[1:]]) + "\n")
    return folder


@pytest.mark.parametrize(("file", "edit", "says"), LINES)
def test_a_line_that_is_none(
    file: str, edit: Edit | str, says: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert call(["bench", "report", str(broken(tmp_path, file, edit))]) == 2
    told = capsys.readouterr().err
    assert says in told and told.count("\n") == 1 and str(tmp_path) in told


ABOUTS: list[tuple[Edit | str, str]] = [
    ("", "experiment.json is empty"),
    ("{", "experiment.json: damaged or truncated"),
    ("7", "experiment.json: no experiment"),
    (lambda d: d.pop("split"), "experiment.json: split: Field required"),
    (lambda d: d.update(rounds="1"), "rounds: Input should be a valid integer, got '1'"),
    (lambda d: d.update(settings=[]), "settings: "),
    (lambda d: d["settings"].update(parts={"world": {}}), "settings.parts.world.name"),
]


@pytest.mark.parametrize(("edit", "says"), ABOUTS)
def test_a_description_that_is_none(
    edit: Edit | str, says: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    folder = Path(shutil.copytree(MADE, tmp_path / "results"))
    if callable(edit):
        data = json.loads((folder / ABOUT).read_text())
        edit(data)
        edit = json.dumps(data)
    (folder / ABOUT).write_text(edit)
    assert call(["bench", "report", str(folder)]) == 2
    told = capsys.readouterr().err
    assert says in told and told.count("\n") == 1


def test_packed_rows_give_the_same_tables_elsewhere(tmp_path: Path) -> None:
    whole, packed, out = tmp_path / "whole", tmp_path / "packed", tmp_path / "out"
    shutil.copytree(MADE, whole)
    shutil.copytree(MADE, packed)
    rows = packed / ROWS
    rows.with_name(f"{ROWS}.xz").write_bytes(lzma.compress(rows.read_bytes()))
    rows.unlink()
    assert call(["bench", "report", str(whole)]) == 0
    assert call(["bench", "report", str(packed), "--out", str(out)]) == 0
    for table in (whole / "tables").iterdir():
        assert (out / "tables" / table.name).read_bytes() == table.read_bytes()
    assert not (packed / "tables").exists()


@pytest.mark.parametrize(
    ("content", "why"),
    [
        (b"no xz at all", "packed with xz"),
        (lzma.compress(b'{"format": 2}\n' * 999)[:-30], "cut off|packed with xz"),
        (lzma.compress(b"\xff\xfe\n"), "not UTF-8 text"),
    ],
)
def test_damaged_packed_rows_are_named(
    tmp_path: Path, content: bytes, why: str, capsys: pytest.CaptureFixture[str]
) -> None:
    shutil.copytree(MADE, tmp_path / "all")
    (tmp_path / "all" / ROWS).unlink()
    (tmp_path / "all" / f"{ROWS}.xz").write_bytes(content)
    assert call(["bench", "report", str(tmp_path / "all")]) == 2
    error = capsys.readouterr().err
    assert re.search(f"{ROWS}.xz .*({why})", error), error
