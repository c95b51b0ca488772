"""The report: people apart from programs, files for others, a page that needs nothing else."""

import csv
import json
from pathlib import Path

import pytest

from forestall.cli.main import call
from forestall.study.answers import Answer, AnswerFile, Start, file_of
from forestall.study.assigning import Design
from forestall.study.reporting import write_report
from forestall.study.simulated import Taste, simulate, write_simulated

from .studies import AGAINST, NASTY, make

TASTE = Taste({"objects": 0.3, "caption": 0.9, "image": 1.6})


def table(file: Path) -> list[dict[str, str]]:
    with file.open(newline="", encoding="utf-8") as lines:
        return list(csv.DictReader(lines))


def test_simulated_raters_are_no_people(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    study = make(tmp_path, 40, Design(15))
    write_simulated(tmp_path, simulate(study, TASTE, seed=1)[1:])
    data = write_report(tmp_path).data
    assert data["people"] is None and data["simulated"]["raters"] == 14
    assert data["simulated"]["answers"] == 14 * 40
    page = (tmp_path / "report.html").read_text()
    assert "No person has answered yet" in page and "A program answered" in page
    assert "nobody has answered yet" in page
    assert call(["study", "report", str(tmp_path)]) == 0
    said = capsys.readouterr().out
    assert "No person has answered yet" in said and "SIMULATED raters, no people: 14" in said
    file = AnswerFile(file_of(tmp_path, 1), Start(study.digest, 1, False, "a person"))
    file.add(Answer(0, "both"))
    data = write_report(tmp_path).data
    assert data["people"]["raters"] == 1 and data["people"]["answers"] <= 1
    assert data["simulated"]["raters"] == 14
    rows = table(tmp_path / "answers.csv")
    assert [r["simulated"] for r in rows].count("False") == 1 and "a person" not in str(rows)


def test_the_report_has_every_number(tmp_path: Path) -> None:
    study = make(tmp_path, 40, Design(15), NASTY)
    write_simulated(tmp_path, simulate(study, TASTE, seed=1))
    data = json.loads(write_report(tmp_path, tmp_path / "out").files[1].read_text())
    found = data["simulated"]
    assert set(found["against"]) == {*AGAINST, "all"}
    for row in found["against"].values():
        for what in ("wins", "losses", "both", "preference"):
            share = row[what]
            assert share["low"] < share["value"] < share["high"]
            assert share["method"] == "clustered by rater and item"
        assert (
            row["wins"]["count"] + row["losses"]["count"] + row["both"]["count"]
            == (row["wins"]["n"])
        )
    assert found["against"]["image"]["verdict"] == "better"
    alpha = found["alpha"]
    assert 0 < alpha["value"] < 0.5 and alpha["low"] < alpha["value"] < alpha["high"]
    assert found["alpha"]["comparisons"] == 120
    assert found["power"]["variance"]["assumed"] is False and data["paper"]["raters"] == 15
    page = (tmp_path / "out" / "report.html").read_text()
    assert "http" not in page and "<script" not in page and len(page) < 50_000


def test_what_is_shown_is_exported_blind(tmp_path: Path) -> None:
    study = make(tmp_path, 6, Design(2), ('=HYPERLINK("x")', "a\nb"))
    assert call(["study", "export", str(tmp_path)]) == 0
    shown = (tmp_path / "export" / "trials.json").read_text()
    rows, key = json.loads(shown), json.loads((tmp_path / "export" / "key.json").read_text())
    assert len(rows) == len(key) == sum(map(len, study.raters))
    assert not any(name in shown for name in (study.ours, *AGAINST, "ours", "check"))
    for row, whose in zip(rows, key, strict=True):
        trial = study.raters[whose["rater"] - 1][whose["position"] - 1]
        right = row[f"explanation_{whose['ours']}"]
        item = study.item(trial.item)
        assert right == (item.cause if trial.check else item.said_by(study.ours))
        assert (tmp_path / row["actual_picture"]).is_file()
    plain = table(tmp_path / "export" / "trials.csv")
    assert len(plain) == len(rows) and any(r["task"].startswith("'=") for r in plain)
