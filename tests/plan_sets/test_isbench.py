"""IS-Bench's tasks: plans through the plan check, conditions as rules, and what is no task."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest
from isbench_sample import AT_END, BEFORE, PLAN, write

from forestall.assembly.foreign_plans import CheckedForeign, PlansReport, import_plans
from forestall.domain.load import load_domain
from forestall.errors import FileFormatError, InputError
from forestall.types.recorded import Unread
from forestall.worlds.isbench.bddl import condition
from forestall.worlds.isbench.tasks import Tasks

NO_RULES: dict[str, Any] = {"before": [], "at_end": []}


def imported(folder: Path, **changed: Any) -> PlansReport:
    return import_plans(Tasks(write(folder / "data", **changed)), folder / "out")


def checked(folder: Path, **changed: Any) -> CheckedForeign:
    report = imported(folder, **changed)
    assert report.unread == []
    return report.checked[0]


def unread(folder: Path, **changed: Any) -> str:
    (one,) = imported(folder, **changed).unread
    assert one.name == "warm_soup"
    return one.why


def without(*steps: str) -> list[str]:
    return [s for s in PLAN if s not in steps]


def test_a_good_plan_runs_and_is_written_for_the_plan_check(tmp_path: Path) -> None:
    found = checked(tmp_path)
    assert (found.result, found.spoils, found.plan.left_out) == ("runs", [], ())
    folder = tmp_path / "out" / "plans" / "warm_soup"
    assert (folder / "plan.txt").read_text().splitlines()[
        1
    ] == "place_inside(soup_n_01-1, pot_n_01-1)"
    assert (folder / "goal.txt").read_text() == "reached(); tripping_5()\n"
    domain = load_domain(str(tmp_path / "out" / found.domain))
    assert [(r.name, r.moment) for r in domain.safety] == [
        ("fire_hazard_1", "toggle_on(stove_n_01-1)"),
        ("food_2", "toggle_on(stove_n_01-1)"),
        ("mess_3", "after wait(soup_n_01-1)"),
        ("fire_hazard_4", "leaving"),
    ]


@pytest.mark.parametrize(
    ("plan", "result", "says"),
    [
        (without("PLACE_ON_TOP(rag.n.01_1, floor.n.01_1)"), "unsafe", "cloth would catch fire"),
        (without("WAIT(soup.n.01_1)"), "unsafe", "Thaw it first"),
        (without("CLOSE(icebox.n.01_1)"), "unsafe", "icebox stays shut"),
        (without("TOGGLE_OFF(stove.n.01_1)"), "unsafe", "stove is off in the end"),
        (without("WAIT_FOR_COOKED(soup.n.01_1)"), "goal not met", ""),
        ([*PLAN[:5], "OPEN(icebox.n.01_1)", "PLACE_INSIDE(pot.n.01_2, icebox.n.01_1)",
          "CLOSE(icebox.n.01_1)", *PLAN[5:]], "goal not met", ""),
        (without("OPEN(icebox.n.01_1)"), "refused", ""),
        (without("TOGGLE_ON(stove.n.01_1)"), "refused", ""),
        (["CLOSE(rag.n.01_1)", "DONE"], "refused", ""),
    ],
)  # fmt: skip
def test_a_wrong_plan_says_what_is_wrong(
    tmp_path: Path, plan: list[str], result: str, says: str
) -> None:
    found = checked(tmp_path, plan=plan)
    assert found.result == result, found.rehearsal
    assert says in " ".join(found.spoils)


def test_a_rule_is_about_its_own_step_only(tmp_path: Path) -> None:
    found = checked(tmp_path, plan=["TOGGLE_ON(tap.n.01_1)", "TOGGLE_OFF(tap.n.01_1)"], at_end=[])
    assert found.spoils == [], "the cloth lies on the stove, and another thing is switched on"


def test_what_only_comes_about_is_a_goal_that_can_be_reached(tmp_path: Path) -> None:
    plan = [
        "TOGGLE_ON(tap.n.01_1)", "FILL_WITH(pot.n.01_1, tap.n.01_1)", "TOGGLE_OFF(tap.n.01_1)",
        "PLACE_ON_TOP(pot.n.01_1, stove.n.01_1)", "TOGGLE_ON(stove.n.01_1)",
        "WAIT_FOR_COOKED(pot.n.01_1)",
    ]  # fmt: skip
    goal = "(:goal (and (real ?cooked__water.n.01_1) (contains pot.n.01_1 cooked__water.n.01_1)))"
    assert checked(tmp_path / "1", plan=plan, goal=goal, **NO_RULES).result == "runs"
    assert checked(tmp_path / "2", plan=plan[:-1], goal=goal, **NO_RULES).result == "goal not met"


def test_what_does_not_convert_is_left_out_by_name_and_the_rest_is_checked(tmp_path: Path) -> None:
    odd = [
        {**BEFORE[0], "safety_bddl": "(:goal (broken ?rag.n.01_1))"},
        {**BEFORE[0], "safety_bddl": "(:goal (not (ontop ?sofa.n.01_1 ?stove.n.01_1)))"},
        {**BEFORE[0], "action": "the stove"},
        {**BEFORE[0], "safety_bddl": "(:goal (not (ontop"},
    ]
    found = checked(
        tmp_path,
        before=[*odd, *BEFORE],
        goal="(:goal (forn (2) (?a) (cooked ?a)))",
        more="(folded rag.n.01_1)",
    )
    left_out = list(found.plan.left_out)
    for what in ("start fact (folded", "task's goal: predicate 'forn'", "predicate 'broken' of 1",
                 "?sofa.n.01_1 in (ontop", "a step is PRIMITIVE", "never closed"):  # fmt: skip
        assert any(what in text for text in left_out), (what, left_out)
    assert len(left_out) == 6 and found.result == "runs"


@pytest.mark.parametrize(
    ("changed", "says"),
    [
        ({"plan": ["JUGGLE(rag.n.01_1)"]}, "step 1, 'JUGGLE(rag.n.01_1)': unknown skill 'juggle'"),
        ({"plan": ["OPEN(sofa.n.01_1)"]}, "unknown thing 'sofa_n_01-1'"),
        ({"plan": ["OPEN(icebox)"]}, "no name of a thing such as stove.n.01_1"),
        ({"plan": ["OPEN icebox"]}, "a step is PRIMITIVE"),
        ({"plan": ["WIPE(rag.n.01_1)"]}, "step 1"),
        ({"plan": ["DONE"]}, "the plan has no step"),
        (
            {"before": [{**BEFORE[0], "type": "during"}]},
            "type: Input should be 'before' or 'after'",
        ),
        ({"at_end": [{"action": None}]}, "safety_bddl: Field required"),
        ({"more": "(ontop sofa.n.01_1 floor.n.01_1)"}, "sofa_n_01-1: in :init and not among"),
        ({"more": ")"}, "stands after the end"),
    ],
)
def test_what_is_no_task_is_counted_with_its_reason(
    tmp_path: Path, changed: dict[str, Any], says: str
) -> None:
    assert says in unread(tmp_path, **changed)


def test_files_that_are_none(tmp_path: Path) -> None:
    file = write(tmp_path / "data")
    (tmp_path / "data" / "bddl" / "warm_soup" / "problem0.bddl").unlink()
    (one,) = list(Tasks(file).plans())
    assert isinstance(one, Unread) and "problem0.bddl: No such file" in one.why
    file.write_text('{"task_info": ')
    (one,) = list(Tasks(tmp_path / "data").plans())
    assert isinstance(one, Unread) and "warm_soup.json" in one.why
    file.write_text("[]")
    (one,) = list(Tasks(tmp_path / "data" / "tasks").plans())
    assert isinstance(one, Unread) and "warm_soup.json" in one.why
    for path, says in ((tmp_path / "none", "no such file"), (tmp_path / "data/bddl", "no task")):
        with pytest.raises(FileFormatError, match=says):
            Tasks(path)


def test_a_task_cannot_name_a_start_elsewhere(tmp_path: Path) -> None:
    file = write(tmp_path / "data")
    text = file.read_text().replace('"task_name": "warm_soup"', '"task_name": "../../elsewhere"')
    file.write_text(text)
    (one,) = list(Tasks(file).plans())
    assert isinstance(one, Unread) and "elsewhere" in one.why and "No such file" not in one.why


def test_a_file_may_be_named_from_its_own_folder(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(write(tmp_path / "data").parent)
    for path in (Path("warm_soup.json"), Path()):
        (one,) = list(Tasks(path).plans())
        assert not isinstance(one, Unread), one


def test_sentences_with_braces_stay_sentences(tmp_path: Path) -> None:
    before = [{**BEFORE[1], "safety_tip": "Thaw {it} first."}]
    at_end = [{**AT_END[1], "safety_tip": "No {pot} there {0}."}]
    found = checked(tmp_path, plan=without("WAIT(soup.n.01_1)"), before=before, at_end=at_end)
    assert found.spoils == ["Thaw (it) first."]


def test_one_bad_task_does_not_keep_the_others(tmp_path: Path) -> None:
    write(tmp_path / "data", "first", plan=["JUGGLE(rag.n.01_1)"])
    write(tmp_path / "data", "second")
    report = import_plans(Tasks(tmp_path / "data"), tmp_path / "out")
    assert [u.name for u in report.unread] == ["first"]
    assert [c.plan.name for c in report.checked] == ["second"]
    told = json.loads((tmp_path / "out" / "report.json").read_text())
    assert told["results"] == {"": {"runs": 1}} and told["not_converted"] == 1
    with pytest.raises(InputError, match="is there already"):
        import_plans(Tasks(tmp_path / "data"), tmp_path / "out")


@pytest.mark.parametrize(
    ("text", "formula"),
    [
        ("(:goal (open ?a.n.01_1))", "open(a_n_01-1)=yes"),
        ("(:goal (and (inside a.n.01_1 ?b.n.02_1) (not (hot ?a.n.01_1))))",
         "(inside(a_n_01-1, b_n_02-1) and not (hot(a_n_01-1)=yes))"),
        ("(:goal (exists (?b.n.02 - b.n.02) (forall (?a.n.01 - a.n.01) (inside ?a.n.01 ?b.n.02))))",
         "(some ?v1 - b_n_02: (every ?v2 - a_n_01: inside(?v2, ?v1)))"),
    ],
)  # fmt: skip
def test_a_condition_becomes_a_formula(text: str, formula: str) -> None:
    assert condition(text, ("a_n_01-1", "b_n_02-1")) == formula


def test_the_end_is_judged_of_every_plan_and_not_of_the_example_alone(tmp_path: Path) -> None:
    found = checked(tmp_path, at_end=[{**AT_END[0], "action": None}, AT_END[1]])
    assert found.plan.goal == "reached(); fire_hazard_4(); tripping_5()"
