"""From rows to summary, tables and page: the same whatever the number of workers is."""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path

import pytest

from experiments.episodes import computed_row
from forestall.cli.main import call
from forestall.errors import FileFormatError
from forestall.experiments.conduct import Experiment, conduct
from forestall.experiments.folder import ABOUT, ROWS
from forestall.experiments.results import SUMMARY, present
from forestall.experiments.runs import Choice
from forestall.statistics import intervals

pytestmark = pytest.mark.slow
"""Every figure of an experiment is drawn, several times."""


@pytest.fixture(autouse=True)
def _few_draws(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    monkeypatch.setattr(intervals, "RESAMPLES", 30)
    intervals._draws.cache_clear()
    yield
    intervals._draws.cache_clear()


def made(out: Path, workers: int) -> None:
    engine = "inline" if workers == 1 else "local"
    experiment = Experiment(
        Choice("all", "development", limit=4, profiles=("kind",), part=1.0), workers, engine
    )
    conduct(experiment, out, lambda *a: None, computed_row, lambda *a: None)


def test_tables_do_not_depend_on_how_many_worked(tmp_path: Path) -> None:
    for workers in (1, 3):
        made(tmp_path / str(workers), workers)
        present(tmp_path / str(workers))
    one, three = tmp_path / "1", tmp_path / "3"
    files = sorted(p.relative_to(one) for p in (one / "tables").iterdir())
    assert len(files) > 20
    for file in files:
        assert (one / file).read_bytes() == (three / file).read_bytes(), file
    data = json.loads((one / SUMMARY).read_text())
    found = data["profiles"][data["shown"]]
    metric = found["strategies"]["proactive"]["robofail"]["success"]
    assert {"value", "low", "high", "n"} <= metric.keys()
    assert "fdr@0.90" in found["detectors"]["scene-graph"]
    page = (one / "index.html").read_text()
    assert "stand-in" in page and "roc" in page
    assert "run: 4 of 100 cases of robofail" in page


def test_what_was_asked_for_and_is_not_there_is_said(tmp_path: Path) -> None:
    made(tmp_path, 1)
    lines = (tmp_path / ROWS).read_text().splitlines(keepends=True)
    (tmp_path / ROWS).write_text("".join(x for x in lines if '"strategy": "online"' not in x))
    data, tables = present(tmp_path)
    assert "missing: 4 episodes of online on irreversible, kind" in data["episodes"]["notes"]
    assert all("missing: 4 episodes of online on irreversible" in t.note for t in tables)


def test_what_other_code_was_asked_for_is_missed_as_it_was_asked(tmp_path: Path) -> None:
    made(tmp_path, 1)
    about = json.loads((tmp_path / ABOUT).read_text())
    (tmp_path / ABOUT).write_text(json.dumps(about | {"sources": "0123456789abcdef"}))
    lines = (tmp_path / ROWS).read_text().splitlines(keepends=True)
    (tmp_path / ROWS).write_text("".join(x for x in lines if '"strategy": "online"' not in x))
    notes = present(tmp_path)[0]["episodes"]["notes"]
    assert "run: 4 of 100 cases of robofail, kind" in notes
    assert [n for n in notes if n.startswith("missing")] == [
        "missing: 4 episodes of online on irreversible, kind"
    ]


def test_the_command_makes_the_page_again_and_names_what_is_no_experiment(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    made(tmp_path / "made", 1)
    assert call(["bench", "report", str(tmp_path / "made")]) == 0
    assert "index.html" in capsys.readouterr().out
    assert call(["bench", "report", str(tmp_path)]) == 2
    assert "holds no experiment" in capsys.readouterr().err
    assert call(["bench", "all", "--split", "tests", "--out", str(tmp_path / "x")]) == 2
    assert "did you mean test" in capsys.readouterr().err
    (tmp_path / "made" / ROWS).write_text("")
    with pytest.raises(FileFormatError, match="no finished episode"):
        present(tmp_path / "made")
