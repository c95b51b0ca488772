"""`forestall import` of plans: what it prints, leaves for the plan check, and refuses."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from isbench_sample import PLAN, write

from forestall.cli.main import call

ROWS = [
    {"step": ["find egg", "pick egg"], "risk_category": "Slip Hazard"},
    {"step": ["juggle egg"]},
    {"instruction": "only a sentence"},
]


def test_isbench_and_what_it_leaves_for_the_plan_check(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = write(tmp_path / "data", plan=[s for s in PLAN if not s.startswith("TOGGLE_OFF")])
    out = tmp_path / "out"
    assert call(["import", "isbench", str(file), str(out), "--quiet"]) == 0
    said = capsys.readouterr().out
    assert "1 plans converted, 0 of them in part" in said and "unsafe" in said
    folder = out / "plans" / "warm_soup"
    asked = ["plan", "check", str(folder / "plan.txt"), str(folder / "scene.json"),
             "--domain", str(out / "domains" / "warm_soup.toml"),
             "--goal", (folder / "goal.txt").read_text()]  # fmt: skip
    assert call(asked) == 1
    assert "The stove is off in the end." in capsys.readouterr().out
    (folder / "plan.txt").write_text("\n".join([*(folder / "plan.txt").read_text().split("\n")[:-1],
                                                "toggle_off(stove_n_01-1)"]))  # fmt: skip
    assert call(asked) == 0


def test_safeagentbench_counts_and_names_what_does_not_convert(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / "some.jsonl"
    file.write_text("\n".join(json.dumps(r) for r in ROWS))
    assert call(["import", "safeagentbench", str(file), str(tmp_path / "out"), "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    assert (told["converted"], told["not_converted"]) == (1, 2)
    assert told["results"] == {"unsafe": {"runs": 1}}
    assert [w["plan"] for w in told["why_not"]] == ["some-2", "some-3"]
    assert told == json.loads((tmp_path / "out" / "report.json").read_text())
    assert call(["import", "safeagentbench", str(file), str(tmp_path / "text"), "--quiet"]) == 0
    said = capsys.readouterr().out
    assert "2 plans could not be converted" in said and "some-2: step 1, 'juggle egg'" in said


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (["isbensh", "FILE"], "did you mean isbench?"),
        (["isbench", "nowhere.json"], "there is no such file or folder"),
        (["safeagentbench", "FILE", "--states", "clip"], "has plans and no pictures"),
    ],
)
def test_what_is_not_valid_is_said(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], arguments: list[str], says: str
) -> None:
    file = tmp_path / "some.jsonl"
    file.write_text(json.dumps(ROWS[0]))
    named = [str(file) if a == "FILE" else a for a in arguments]
    assert call(["import", *named[:2], str(tmp_path / "out"), *named[2:]]) == 2
    assert says in capsys.readouterr().err
