"""What is published follows from the rows that lie beside it."""

import json
import lzma
import shutil
from pathlib import Path

import pytest

from experiments.published import DOCUMENTS, SHOWN, filled
from forestall.experiments import robustness
from forestall.experiments.results import present
from forestall.experiments.stored import PACKED

ROOT = Path(__file__).parents[2]
PUBLISHED = sorted(p.parent for p in ROOT.glob(f"results/*/episodes.jsonl{PACKED}"))
MOST_BYTES = 5_000_000


def test_something_is_published() -> None:
    assert PUBLISHED
    packed = [p for folder in PUBLISHED for p in folder.rglob("*")]
    assert sum(p.stat().st_size for p in packed if p.is_file()) < MOST_BYTES


@pytest.mark.slow
@pytest.mark.parametrize("folder", PUBLISHED, ids=lambda f: f.name)
def test_the_tables_are_those_of_the_rows(folder: Path, tmp_path: Path) -> None:
    present(folder, tmp_path)
    made = {p.name: p.read_text(encoding="utf-8") for p in (tmp_path / "tables").iterdir()}
    kept = {p.name: p.read_text(encoding="utf-8") for p in (folder / "tables").iterdir()}
    assert kept
    assert {name: made[name] for name in kept} == kept


@pytest.mark.parametrize("judge", ["plan-check", "preconditions", "scene-graph"])
def test_robustness_is_that_of_its_rows(judge: str, tmp_path: Path) -> None:
    kept = ROOT / "results" / "robustness"
    rows = lzma.decompress((kept / f"rows.jsonl{PACKED}").read_bytes())
    (tmp_path / "episodes.jsonl").write_bytes(rows)
    shutil.copy(kept / "experiment.json", tmp_path)
    made = robustness.present(tmp_path, judge)
    assert made.csv() == (kept / f"{judge}.csv").read_text(encoding="utf-8")


@pytest.mark.parametrize("folder", PUBLISHED, ids=lambda f: f.name)
def test_nothing_of_the_machine_that_made_them_is_in_the_rows(folder: Path) -> None:
    about = json.loads((folder / "experiment.json").read_text(encoding="utf-8"))
    assert about["split"] == "test"
    texts = [p.read_text(encoding="utf-8") for p in folder.glob("*.json*") if p.suffix != PACKED]
    assert not any("/root" in text or "/work" in text or "/home" in text for text in texts)


@pytest.mark.parametrize("document", DOCUMENTS, ids=lambda d: d.name)
def test_documents_show_the_tables_as_they_are(document: Path) -> None:
    text = document.read_text(encoding="utf-8")
    assert filled(text) == text


def test_the_results_are_shown() -> None:
    shown = [m for d in DOCUMENTS for m in SHOWN.findall(d.read_text(encoding="utf-8"))]
    assert shown
