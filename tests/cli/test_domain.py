"""`forestall domain`: list, show, check, export."""

from __future__ import annotations

import json
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

from forestall import open_memory
from forestall.assembly.sources import demonstrations_from
from forestall.cli.main import call
from forestall.domain.load import read_domain, shipped
from stranger import TWELVE

PDDL = Path(__file__).parents[1] / "domain" / "pddl"


def test_list(capsys: pytest.CaptureFixture[str]) -> None:
    assert call(["domain", "list", "--json"]) == 0
    rows = json.loads(capsys.readouterr().out)
    found = next(r for r in rows if r["name"] == "household")
    assert found["skills"] == len(shipped("household").skills)
    assert call(["domain", "list"]) == 0
    assert "household" in capsys.readouterr().out


def test_show(capsys: pytest.CaptureFixture[str]) -> None:
    assert call(["domain", "show", str(PDDL / "lamps.pddl")]) == 0
    text = capsys.readouterr().out
    assert "lamp: movable, thing" in text
    assert "attribute light(?thing) = off | on" in text
    assert "lift(t, r): lift" in text


def test_check_says_ok_in_one_line(capsys: pytest.CaptureFixture[str]) -> None:
    assert call(["domain", "check", str(PDDL / "ferry.pddl")]) == 0
    text = capsys.readouterr().out
    assert text == "ok: ferry: 3 categories, 4 predicates, 3 skills, 0 processes, 0 safety rules\n"


def test_check_says_what_is_wrong_in_one_line(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / "bench.pddl"
    file.write_text("(define (domain bench)\n  (:requirements :durative-actions))\n")
    assert call(["domain", "check", str(file)]) == 2
    error = capsys.readouterr().err
    assert error.count("\n") == 1
    assert f"{file}, line 2: unknown or unsupported requirement ':durative-actions'" in error


def test_export(capsys: pytest.CaptureFixture[str]) -> None:
    assert call(["domain", "export", "household", "--format", "toml"]) == 0
    assert read_domain(capsys.readouterr().out, "out.toml") == shipped("household")
    assert call(["domain", "export", "household", "--format", "words"]) == 0
    assert capsys.readouterr().out.startswith("navigate_to_obj(target): navigate to\n")
    assert call(["domain", "export", "household", "--format", "schema"]) == 0
    assert "skills" in json.loads(capsys.readouterr().out)["properties"]
    assert call(["domain", "export", str(PDDL / "lamps.pddl"), "--format", "toml"]) == 0
    assert tomllib.loads(capsys.readouterr().out)["name"] == "lamps"


def test_export_to_pddl_leaves_nothing_out_unasked(capsys: pytest.CaptureFixture[str]) -> None:
    export = ["domain", "export", "household", "--format", "pddl"]
    assert call(export) == 2
    assert "what happens by itself cannot be said in PDDL" in capsys.readouterr().err
    assert call([*export, "--without-processes"]) == 2
    assert "slice_obj, crack_obj" in capsys.readouterr().err
    assert call([*export, "--without-processes", "--without-makers"]) == 0
    assert capsys.readouterr().out.startswith("(define (domain household)\n")
    assert call(["domain", "export", "household", "--format", "yaml"]) == 2


def test_a_draft_says_what_each_need_weighs_and_leaves_out_habits(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    memory, out = tmp_path / "pegs.db", tmp_path / "pegs.toml"
    with open_memory(memory, create=True) as opened:
        for demonstration in demonstrations_from(TWELVE):
            opened.add(demonstration)
    assert call(["domain", "learn", str(memory), "--out", str(out)]) == 0
    whole = read_domain(out.read_text(), "pegs.toml")
    assert call(["domain", "learn", str(memory), "--least", "0.8"]) == 0
    text = capsys.readouterr().out.split("\n", 1)[1]
    lines = [line[2:] for line in text.splitlines() if line.startswith("# insert")]
    assert lines[0] == f"{'insert':<20} 0.96  held_by(?peg, gripper)"
    assert lines[-1] == f"{'insert':<20} 0.77  vacant(?hole)  (left out)", "it never varied"
    left = [line for line in lines if line.endswith("(left out)")]
    kept = read_domain(text, "pegs.toml")
    assert {str(n.formula) for n in kept.skill("unscrew").needs} == {
        "hand_empty()",
        "thread(?lid)=tight",
    }
    assert (
        len(kept.skill("insert").needs) == len(lines) - len(left) < len(whole.skill("insert").needs)
    )
    assert call(["domain", "learn", str(memory), "--least", "2"]) == 2
    assert "--least 2.0: a weight is between 0 and 1" in capsys.readouterr().err


def test_help_loads_no_domain() -> None:
    code = (
        "import sys; from forestall.cli.main import call; call(['--help']);"
        "sys.exit(any(m.startswith('forestall.domain') for m in sys.modules))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, check=False)
    assert done.returncode == 0
