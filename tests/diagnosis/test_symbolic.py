from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import replace
from itertools import takewhile

import pytest

from forestall import Monitor
from forestall.comparison.preconditions import mine, violations
from forestall.diagnosis.symbolic import SymbolicReasoner, explain
from forestall.domain.model import Domain
from forestall.planning.execute import Refusal, apply
from forestall.planning.validate import GraphValidator, observed, unmet
from forestall.replanning.symbolic import PlannerReplanner
from forestall.types.facts import Literal, Truth, category_of
from forestall.types.graph import ObjectNode, Relation, SceneGraph
from forestall.types.plan import Plan, Subtask
from forestall.types.runtime import When
from forestall.types.verdict import (
    Calibration,
    Decision,
    Diagnosis,
    Precondition,
    ReplanOutcome,
    Verdict,
    Violation,
)
from planning.corpus import DOMAIN, GOALS, PLANS, home_of, scene
from planning.episodes import context, demonstrations, ground, seen

ALARM = Verdict(Decision.REPLAN, "test", 0.5, 0.9, Calibration.FIXED)
REASONER = SymbolicReasoner(mine, violations, DOMAIN)


def diagnose(task: str, before: str, where: str, plan: Plan | None = None) -> Diagnosis:
    """The diagnosis at the first boundary before a subtask of a nominal plan."""
    steps = plan or PLANS[task]
    index = steps.texts().index(before)
    known = demonstrations(task)[PLANS[task].texts().index(before)]
    state = observed(scene(home_of(task), where), DOMAIN)
    graph = seen(state)
    return REASONER.diagnose(context(task, steps, index, graph, known), ALARM)


CAUSES: dict[str, tuple[str, str, str, str, str, tuple[str, ...]]] = {
    "bowl in the microwave": (
        "heat-potato",
        "put_in(Plate, Microwave)",
        "Potato-1 on Plate-1, Plate-1 held, Bowl-1 in Microwave-1, Microwave-1 is open",
        (
            "Bowl-1 is inside Microwave-1, which is empty in all 4 demonstrations "
            "before put_in(Plate, Microwave)"
        ),
        "vacant(Microwave-1)",
        ("Bowl-1", "Microwave-1"),
    ),
    "dirty plate": (
        "heat-potato",
        "put_on(Potato, Plate)",
        "Potato-1 held, Plate-1 is dirty",
        "Plate-1 is dirty; it was clean in all 4 demonstrations",
        "dirty(Plate-1)=clean",
        ("Plate-1",),
    ),
    "closed microwave": (
        "heat-potato",
        "put_in(Plate, Microwave)",
        "Potato-1 on Plate-1, Plate-1 held",
        "Microwave-1 is closed; it was open in all 4 demonstrations",
        "open(Microwave-1)=open",
        ("Microwave-1",),
    ),
    "dropped mug": (
        "make-coffee",
        "put_in(Mug, CoffeeMachine)",
        "Mug-1 on Floor-1",
        "the gripper is empty; it held Mug-1 in all 4 demonstrations",
        "held_by(Mug-1, gripper)",
        ("Mug-1",),
    ),
    "cup in the coffee machine": (
        "make-coffee",
        "put_in(Mug, CoffeeMachine)",
        "Mug-1 held, Cup-1 in CoffeeMachine-1",
        "Cup-1 is inside CoffeeMachine-1, which is empty",
        "vacant(CoffeeMachine-1)",
        ("Cup-1", "CoffeeMachine-1"),
    ),
    "potato in the pan": (
        "cook-egg",
        "pick_up(Pan)",
        "Egg-1 on CounterTop-1, StoveBurner-1 is on, Potato-1 in Pan-1",
        "Potato-1 is inside Pan-1, which is empty",
        "vacant(Pan-1)",
        ("Potato-1", "Pan-1"),
    ),
    "wine in the bowl": (
        "make-salad",
        "navigate_to_obj(Bowl)",
        "Lettuce-1 held, Bowl-1 is wine",
        "Bowl-1 is filled with wine; it was empty in all 4 demonstrations",
        "filled(Bowl-1)=empty",
        ("Bowl-1",),
    ),
    "blocked knife": (
        "toast-bread",
        "pick_up(Knife)",
        "Pot-1 on CounterTop-1, Pot-1 blocks Knife-1",
        "Pot-1 stands in front of Knife-1; nothing did in all 4 demonstrations",
        "unblocked(Knife-1)",
        ("Pot-1", "Knife-1"),
    ),
}


@pytest.mark.parametrize("name", sorted(CAUSES))
def test_the_cause_names_the_thing(name: str) -> None:
    task, before, where, cause, fact, culprits = CAUSES[name]
    found = diagnose(task, before, where)
    assert cause in found.cause
    assert Literal.parse(fact) in found.must_change
    assert found.culprits[: len(culprits)] == culprits
    assert found.producer == "preconditions"


def test_what_held_in_the_demonstrations_and_holds_now_must_stay() -> None:
    found = diagnose(*CAUSES["bowl in the microwave"][:3])
    assert found.must_change == (Literal("vacant", ("Microwave-1",)),)
    for fact in ("held_by(Plate-1, gripper)", "open(Microwave-1)=open", "dirty(Plate-1)=clean"):
        assert Literal.parse(fact) in found.must_stay


@pytest.mark.parametrize("task", sorted(PLANS))
def test_undisturbed_runs_have_nothing_to_change(task: str) -> None:
    known = demonstrations(task)
    state = observed(scene(home_of(task)), DOMAIN)
    for index, subtask in enumerate(PLANS[task].subtasks):
        graph = seen(state)
        found = REASONER.diagnose(context(task, PLANS[task], index, graph, known[index]), ALARM)
        assert found.must_change == (), f"{subtask}: {found.cause}"
        assert "nothing is violated that the demonstrations show to matter before" in found.cause
        after = apply(state, subtask)
        assert not isinstance(after, Refusal)
        state = after


def test_unobserved_facts_do_not_alarm() -> None:
    graph = scene(home_of("heat-potato"), "Potato-1 held, Plate-1 unseen dirty")
    index = PLANS["heat-potato"].texts().index("put_on(Potato, Plate)")
    known = demonstrations("heat-potato")[index]
    found = REASONER.diagnose(
        context("heat-potato", PLANS["heat-potato"], index, graph, known), ALARM
    )
    assert found.must_change == ()


def test_no_demonstration_is_said() -> None:
    graph = scene(home_of("heat-potato"))
    found = REASONER.diagnose(context("heat-potato", PLANS["heat-potato"], 0, graph), ALARM)
    assert found.must_change == ()
    assert "no demonstration" in found.cause


def scripted(lifted: str, ground_fact: str, support: int = 4) -> Diagnosis:
    """The diagnosis of one scripted violation in a kitchen scene."""
    rule = Precondition("put_in", Literal.parse(lifted), support, 4)

    def mined(references: object, domain: object, **_: object) -> Sequence[Precondition]:
        return (rule,)

    def broken(
        preconditions: Sequence[Precondition], graph: SceneGraph, subtask: Subtask, domain: Domain
    ) -> Sequence[Violation]:
        return (Violation(rule, Literal.parse(ground_fact), Truth.FALSE),)

    graph = scene(home_of("make-coffee"), "Cup-1 held, Potato-1 on Plate-1, Mug-1 is hot")
    index = PLANS["make-coffee"].texts().index("put_in(Mug, CoffeeMachine)")
    known = demonstrations("make-coffee", 1)[index]
    reasoner = SymbolicReasoner(mined, broken, DOMAIN)
    return reasoner.diagnose(
        context("make-coffee", PLANS["make-coffee"], index, graph, known), ALARM
    )


@pytest.mark.parametrize(
    ("lifted", "fact", "cause"),
    [
        ("hand_empty()", "hand_empty()", "the gripper holds Cup-1; it was empty"),
        (
            "held_by(?object, gripper)",
            "held_by(Mug-1, gripper)",
            "the gripper holds Cup-1; it held",
        ),
        ("not held_by(?object, gripper)", "not held_by(Cup-1, gripper)", "it did not hold Cup-1"),
        ("accessible(?object)", "accessible(Egg-1)", "Egg-1 is inside Fridge-1, which is closed"),
        ("located(?object)", "located(Mug-1)", "the place of Mug-1 is not known"),
        ("inside(?object, Bowl)", "inside(Mug-1, Bowl-1)", "Mug-1 is not inside Bowl-1"),
        (
            "not on_top_of(?object, Plate)",
            "not on_top_of(Potato-1, Plate-1)",
            "Potato-1 is on top of Plate-1, unlike in all 4 demonstrations",
        ),
        ("toggled(?target)=on", "toggled(Faucet-1)=on", "Faucet-1 is off; it was on"),
        ("temperature(?object)=room", "temperature(Mug-1)=room", "Mug-1 is hot; it was at room"),
        ("vacant(?target)", "vacant(Plate-1)", "Potato-1 is on top of Plate-1, which is empty"),
    ],
)
def test_causes_are_readable(lifted: str, fact: str, cause: str) -> None:
    assert cause in scripted(lifted, fact).cause


def test_things_that_are_taken_to_hold_each_other_end_in_a_cause() -> None:
    tied = (
        Relation("Egg-1", "inside", "Bowl-1"),
        Relation("Bowl-1", "inside", "Egg-1"),
    )
    nodes = tuple(ObjectNode(n, category_of(n)) for n in ("Egg-1", "Bowl-1", "Fridge-1"))
    literal = Literal.parse("accessible(Egg-1)")
    rule = Precondition("pick_up", Literal.parse("accessible(?object)"), 4, 4)
    violation = Violation(rule, literal, Truth.FALSE)
    told = explain(violation, SceneGraph(nodes, tied), Subtask.parse("pick_up(Egg)"), DOMAIN)
    assert told.startswith("Egg-1 is inside")


def test_support_is_told() -> None:
    found = scripted("dirty(?object)=clean", "dirty(Mug-1)=clean", support=3)
    assert "in 3 of 4 demonstrations" in found.cause


def test_where_a_thing_happens_to_stand_is_no_need() -> None:
    found = scripted("on_top_of(?object, CounterTop)", "on_top_of(Mug-1, CounterTop)")
    assert found.must_change == ()


SCENARIOS: dict[str, tuple[str, str, str | None]] = {
    "microwave-occupied": ("heat-potato", "Bowl-1 in Microwave-1", None),
    "plate-dirty": ("heat-potato", "Plate-1 is dirty", None),
    "microwave-left-closed": ("heat-potato", "", "open_obj(Microwave)"),
    "coffee-machine-occupied": ("make-coffee", "Cup-1 in CoffeeMachine-1", None),
    "mug-dropped": ("make-coffee", "", None),
    "pan-dirty": ("cook-egg", "Pan-1 is dirty", None),
    "potato-in-pan": ("cook-egg", "Potato-1 in Pan-1", None),
    "burner-occupied": ("boil-water", "Pan-1 on StoveBurner-4", None),
    "bowl-filled-with-wine": ("make-salad", "Bowl-1 is wine", None),
    "knife-blocked": ("toast-bread", "Pot-1 on CounterTop-1, Pot-1 blocks Knife-1", None),
}


@pytest.mark.parametrize("name", sorted(SCENARIOS))
def test_diagnosis_and_repair_save_the_task(name: str) -> None:
    """The whole chain on symbolic states: diagnose before each subtask, repair, go on."""
    task, where, dropped = SCENARIOS[name]
    steps = Plan(tuple(s for s in PLANS[task].subtasks if str(s) != dropped))
    known = demonstrations(task)
    nominal = PLANS[task].texts()
    replanner = PlannerReplanner(GraphValidator(DOMAIN), DOMAIN)
    states = [observed(scene(home_of(task), where), DOMAIN)]
    index = repairs = 0
    resume = len(steps)  # from so many steps before the end on the plan is the nominal one
    fault = name == "mug-dropped"
    while index < len(steps):
        state = states[-1]
        if fault and str(steps.subtasks[index]) == "put_in(Mug, CoffeeMachine)":
            fault = False
            state = state.copy()
            state.add(("on_top_of", "Mug-1", "Floor-1"))
            assert state.held is None and state.root("Mug-1") == "Floor-1"
            states[-1] = state
        text = str(steps.subtasks[index])
        left = len(steps) - index
        same = [i for i, t in enumerate(nominal) if t == text]
        near = min(same, key=lambda i: abs(len(nominal) - i - left), default=None)
        if near is not None and left <= resume:
            graph = seen(state)
            here = context(task, steps, index, graph, known[near])
            diagnosis = REASONER.diagnose(here, ALARM)
            if diagnosis.must_change:
                repairs += 1
                assert repairs <= 3, diagnosis.cause
                answer = replanner.replan(here, diagnosis)
                assert answer.outcome is ReplanOutcome.SOLVED, (diagnosis.cause, answer.note)
                assert answer.plan is not None
                resume = min(resume, common_end(steps.texts(), answer.plan.texts()))
                steps, index = answer.plan, 0
                continue
        after = apply(state, ground(state, steps.subtasks[index]))
        assert not isinstance(after, Refusal), f"{text}: {after}"
        states.append(after)
        index += 1
    assert repairs >= 1
    assert unmet(tuple(states), GOALS[task]) == ()


def common_end(one: Sequence[str], other: Sequence[str]) -> int:
    pairs = zip(reversed(one), reversed(other), strict=False)
    return sum(1 for _ in takewhile(lambda pair: pair[0] == pair[1], pairs))


def diagnose_after(task: str, done: str, where: str) -> Diagnosis:
    """The diagnosis after a subtask of a nominal plan, compared with what the next step saw."""
    plan = PLANS[task]
    index = plan.texts().index(done)
    runs = demonstrations(task)
    after = [
        replace(r, graph=next_step.graph)
        for r, next_step in zip(runs[index], runs[index + 1], strict=True)
    ]
    graph = seen(observed(scene(home_of(task), where), DOMAIN))
    moment = replace(context(task, plan, index, graph, after), when=When.AFTER)
    step = Subtask(moment.subtask.skill, after[0].subtask.args)
    return REASONER.diagnose(replace(moment, subtask=step), ALARM)


@pytest.mark.parametrize(
    ("task", "done", "where", "fact"),
    [
        ("heat-potato", "close_obj(Microwave)", "Microwave-1 is open", "open(Microwave-1)=closed"),
        ("heat-potato", "open_obj(Microwave)", "", "open(Microwave-1)=open"),
        ("make-coffee", "toggle_off(Faucet)", "Faucet-1 is on", "toggled(Faucet-1)=off"),
        ("heat-potato", "pick_up(Plate)", "Potato-1 on Plate-1", "held_by(Plate-1, gripper)"),
        (
            "heat-potato",
            "put_in(Plate, Microwave)",
            "Microwave-1 is open, Potato-1 on Plate-1, Plate-1 on Floor-1",
            "inside(Plate-1, Microwave-1)",
        ),
        ("make-salad", "put_on(Lettuce, CounterTop)", "Lettuce-1 on Floor-1", "on_top_of"),
    ],
)
def test_after_a_subtask_what_it_brought_about_in_the_demonstrations_is_missed(
    task: str, done: str, where: str, fact: str
) -> None:
    found = diagnose_after(task, done, where)
    assert any(fact in str(x) for x in found.must_change), found


def test_after_putting_something_down_any_counter_will_do() -> None:
    known = diagnose_after("make-salad", "put_on(Lettuce, CounterTop)", "Lettuce-1 on Floor-1")
    (wanted,) = (x for x in known.must_change if x.predicate == "on_top_of")
    other = "CounterTop-2" if wanted.args[1] == "CounterTop-1" else "CounterTop-1"
    found = diagnose_after("make-salad", "put_on(Lettuce, CounterTop)", f"Lettuce-1 on {other}")
    assert found.must_change == ()
    assert "nothing is violated that the demonstrations show to matter after" in found.cause


def test_one_answer_counts_the_same_demonstrations_wherever_it_counts_them() -> None:
    def seen_with(lid: str, held: str) -> Mapping[str, object]:
        things = {"cap-1": {}, "jug-1": {}, "box-1": {"lid": lid}, "bin-1": {"lid": "open"}}
        lying = [f"{x} lies_in tray-1" for x in ("cap-1", "jug-1") if x != held]
        relations = [*lying, f"{held} held_by gripper"] if held else lying
        return {"objects": {**things, "tray-1": {}}, "relations": relations}

    twice = [
        ("put(cap-1, box-1)", seen_with("open", "cap-1")),
        ("put(jug-1, bin-1)", seen_with("open", "jug-1")),
        seen_with("open", ""),
    ]
    monitor = Monitor.from_demonstrations([twice] * 3)
    decision = monitor.check(seen_with("shut", "cap-1"), "put(cap-1, box-1)")
    assert decision.diagnosis is not None
    assert decision.diagnosis.cause == "box-1 is shut; it was open in all 3 demonstrations"
    counted = re.findall(r"all (\d+) demonstrations", f"{decision}{decision.sentence}")
    assert set(counted) == {"3"} and "unlike in all 3 demonstrations (6 uses)" in decision.why


def test_what_is_in_the_way_is_said_where_a_relation_is_a_verb() -> None:
    def tray(*relations: str) -> Mapping[str, object]:
        return {"objects": ["cap-1", "jug-1", "box-1", "tray-1"], "relations": list(relations)}

    free = tray("cap-1 held_by gripper", "jug-1 lies_in tray-1")
    done = tray("cap-1 lies_in box-1", "jug-1 lies_in tray-1")
    monitor = Monitor.from_demonstrations([[("put(cap-1, box-1)", free), done]] * 3)
    full = tray("cap-1 held_by gripper", "jug-1 lies_in box-1")
    decision = monitor.check(full, "put(cap-1, box-1)")
    assert decision.diagnosis is not None
    assert decision.diagnosis.cause.startswith("jug-1 is lying in box-1, which is empty in all 3")
