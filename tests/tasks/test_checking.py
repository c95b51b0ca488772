"""Everything that is wrong with a task or scenario file is said at once, and how it would do."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from forestall.cli.main import call
from forestall.domain.load import load_domain
from forestall.tasks.checking import check_file
from forestall.tasks.files import SETS, load_scenario, load_task, task_names

TASK = """
name = "seat-peg"
title = "Seat the peg"
domain = "bench"
plan = ["pick(RoundPeg)", "insert(RoundPeg, RoundHole)"]

[goal]
text = "."
all = ["seated_in(RoundPeg, RoundHole)"]
"""

WRONG = """
name = "Fetch Mug"
title = "x"
plann = 1
plan = ["navigate_to_obj(Mugg)", "pik_up(Mug)", "put_on(Mug)", "put_on(Mug"]

[goal]
text = "t"
variables = { mug = "Mug", "?b" = "Bowll" }
all = ["on_top_of(?mug, DiningTable)", "dirtyy(Mug)=clean", "dirty(Mug)=cleann"]
nevr = []

[[scene.objects]]
category = "Mugg"

[[scene.objects]]
category = "Mug"
places = ["Countertopp"]
states = { dirty = "cleaan", opn = "x" }

[scene.fixtures]
Microwave = { open = "opened" }

[attributes.ripe]
valuess = ["a", "b"]

[categories.Ladle]
tags = ["pickupabel"]
"""

SAID = {
    "name": "String should match pattern",
    "plann": "did you mean plan?",
    "goal.nevr": "did you mean never?",
    "attributes.ripe": "did you mean values?",
    "categories.Ladle": "did you mean pickupable?",
    "plan[1]": "unknown object category 'Mugg': did you mean Mug?",
    "plan[2]": "did you mean pick_up?",
    "plan[3]": "put_on takes 2 argument(s)",
    "plan[4]": "put_on(Mug",
    "goal.variables.mug": "must start with '?'",
    "goal.variables.?b": "did you mean Bowl?",
    "goal.all[1]": "unknown goal variable '?mug'",
    "goal.all[2]": "did you mean dirty?",
    "goal.all[3]": "did you mean clean?",
    "scene.objects[1].category": "did you mean Mug?",
    "scene.objects[2].states.dirty": "did you mean clean?",
    "scene.objects[2].states.opn": "known: broken, dirty",
    "scene.objects[2].places[1]": "did you mean CounterTop?",
    "scene.fixtures.Microwave.open": "did you mean open?",
}

SCENARIO = """
name = "plate-lost"
task = "heat-potato"
title = "x"
kind = "drop"
cause = "."
known = "pick_up(Mug)"

[[faults]]
kind = "dropp"
step = "pick_up(Plate)"

[[faults]]
kind = "drop"
stepp = "pick_up(Plate)"
step = "pick_up(Plate)"

[[faults]]
kind = "set_state"
object = "Plate"
attribute = "dirtyy"
value = "x"

[[faults]]
kind = "drop_step"
step = "pick_up(Mug)"
"""


def written(folder: Path, text: str) -> Path:
    path = folder / "file.toml"
    path.write_text(text, encoding="utf-8")
    return path


def test_all_faults_of_a_task_are_said_with_what_would_be_valid(tmp_path: Path) -> None:
    faults = check_file(written(tmp_path, WRONG)).faults
    for place, text in SAID.items():
        assert any(f.startswith(f"{place}: ") and text in f for f in faults), (place, faults)
    assert len(faults) == len(SAID)


def test_a_thing_of_another_kind_than_the_skill_takes_is_said_with_its_step(
    tmp_path: Path,
) -> None:
    text = TASK.replace("insert(RoundPeg, RoundHole)", "insert(Tray-1, RoundPeg)")
    peg, hole = check_file(written(tmp_path, text)).faults
    assert peg.startswith("plan[2]: insert(Tray-1, RoundPeg): Tray-1 is no peg: peg of insert")
    assert "RoundPeg" in peg.partition("can be")[2]
    assert hole.startswith("plan[2]: insert(Tray-1, RoundPeg): RoundPeg is no hole: hole of insert")
    assert "RoundHole" in hole.partition("can be")[2]


def test_all_faults_of_a_scenario_are_said(tmp_path: Path) -> None:
    checked = check_file(written(tmp_path, SCENARIO))
    assert checked.kind == "scenario" and len(checked.faults) == 5
    kinds, field, attribute, step, known = checked.faults
    assert kinds.startswith("faults[1]: ") and "'drop'" in kinds
    assert field.startswith("faults[2].drop.stepp: ") and "did you mean step?" in field
    assert attribute.startswith("faults[3]: ") and "did you mean dirty?" in attribute
    assert step.startswith("faults[4]: ") and "did you mean pick_up(Plate)" in step
    assert known == "known: 'pick_up(Mug)': the plan has pick_up(Mug) 0 time(s)"


def test_a_task_of_a_scenario_may_be_a_file(tmp_path: Path) -> None:
    text = (
        'name = "x"\ntask = "seat-peg"\ntitle = "x"\nkind = "x"\ncause = "x"\n'
        '[[faults]]\nkind = "drop_step"\nstep = "pick(RoundPeg)"\n'
    )
    scenario = written(tmp_path, text)
    (tmp_path / "task.toml").write_text(TASK, encoding="utf-8")
    (alone,) = check_file(scenario).faults
    assert "unknown task 'seat-peg'" in alone and "--task FILE" in alone
    assert load_task(str(tmp_path / "task.toml")).task.name == "seat-peg"
    assert check_file(scenario, str(tmp_path / "task.toml")).faults == []
    (other,) = check_file(scenario, "fasten-plate").faults[:1]
    assert "'seat-peg' is not 'fasten-plate'" in other


def test_what_is_read_is_what_does(tmp_path: Path) -> None:
    """No fault is said of any shipped file."""
    import forestall

    folder = Path(forestall.__file__).parent / "domains"
    files = [*folder.glob("*/tasks/*.toml"), *folder.glob("*/scenarios/*.toml")]
    sets = [path for of in SETS[1:4] for path in folder.glob(f"*/scenarios/{of}/*.toml")]
    assert len(files) > 20 and sets
    for path in (*files, *sets):
        domain = load_domain(path.relative_to(folder).parts[0])
        task = path.parent.name == "tasks"
        assert check_file(path, None, domain if task else None).faults == [], path
    assert task_names() and load_scenario("mug-dropped")


def test_what_is_no_toml_is_a_fault_of_the_file(tmp_path: Path) -> None:
    (fault,) = check_file(written(tmp_path, "name = ")).faults
    assert "not valid TOML" in fault


def test_the_command_ends_with_1_and_says_where(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = written(tmp_path, WRONG)
    assert call(["tasks", "check", str(path)]) == 1
    lines = capsys.readouterr().out.splitlines()
    assert lines[-1] == f"{len(SAID)} faults"
    assert f"{path}: plan[2]: unknown skill 'pik_up': did you mean pick_up?" in "\n".join(lines)
    assert call(["tasks", "check", str(path), "--json"]) == 1
    assert len(json.loads(capsys.readouterr().out)["faults"]) == len(SAID)
    path.write_text(TASK, encoding="utf-8")
    assert call(["tasks", "check", str(path)]) == 0
    assert capsys.readouterr().out == "ok: a task\n"
    assert call(["tasks", "check", str(tmp_path / "absent.toml")]) == 2
