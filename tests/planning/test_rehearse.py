"""A whole plan in the mind: what it spoils, and where the answer hangs on what nobody saw."""

from __future__ import annotations

from dataclasses import replace

import pytest

from forestall.planning.rehearse import PlanOutcome, left_broken, rehearse
from forestall.types.facts import Literal
from forestall.types.graph import SceneGraph
from forestall.types.plan import Plan
from forestall.types.task import Goal
from planning.corpus import DOMAIN, GOALS, PLANS, goal, home_of, scene
from planning.wrong_plans import WRONG, Wrong

LEFT_ON = {"heat_left_on": "so does the task's own plan"}
NOT_SEEN = ("no such thing here", "unknown instance", "lost mug")


def plan(steps: str) -> Plan:
    return Plan.parse(steps.split("; "))


def unobserved(graph: SceneGraph, name: str, attribute: str) -> SceneGraph:
    nodes = [
        replace(n, states=tuple((a, None if a == attribute else v) for a, v in n.states))
        if n.id == name
        else n
        for n in graph.nodes
    ]
    return replace(graph, nodes=tuple(nodes))


@pytest.mark.parametrize("task", sorted(PLANS))
def test_right_plans_run_and_spoil_nothing_that_the_task_does_not_spoil_itself(task: str) -> None:
    home = scene(home_of(task))
    usual = left_broken(PLANS[task], home, DOMAIN)
    assert usual == ({"heat_left_on"} if task in ("boil-water", "cook-egg") else set())
    found = rehearse(PLANS[task], home, GOALS[task], DOMAIN, dict.fromkeys(usual, "usual"))
    assert found.outcome is PlanOutcome.RUNS
    assert {s.what for s in found.spoils} == usual
    if usual:
        assert rehearse(PLANS[task], home, GOALS[task], DOMAIN).outcome is PlanOutcome.FAILS


@pytest.mark.parametrize("case", WRONG, ids=lambda c: c.name)
def test_wrong_plans_fail_unless_they_are_about_what_nobody_saw(case: Wrong) -> None:
    found = rehearse(case.plan, case.scene, case.goal, DOMAIN, LEFT_ON)
    if case.name in NOT_SEEN:
        assert found.outcome is PlanOutcome.OPEN
        assert found.unobserved[0].predicate == "located"
    else:
        assert (found.outcome, found.unobserved) == (PlanOutcome.FAILS, ())


def test_what_was_assumed_and_not_tried_otherwise_leaves_the_answer_open(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    home = unobserved(scene(home_of("heat-potato")), "Potato-1", "temperature")
    goal = Goal("")
    assert rehearse(plan("navigate_to_obj(Potato)"), home, goal, DOMAIN).outcome is PlanOutcome.RUNS
    monkeypatch.setattr("forestall.planning.rehearse._MOST_TRIED", 0)
    found = rehearse(plan("navigate_to_obj(Potato)"), home, goal, DOMAIN)
    assert found.outcome is PlanOutcome.OPEN
    assert Literal.parse("temperature(Potato-1)=room") in found.unobserved


def test_what_the_goal_forbids_is_named_with_its_step() -> None:
    case = next(c for c in WRONG if c.name == "irreversible: coffee into a dirty mug")
    (spoilt,) = rehearse(case.plan, case.scene, case.goal, DOMAIN).spoils
    assert spoilt.what == "spoiled(Mug-1)"
    assert spoilt.step is not None
    assert str(case.plan.subtasks[spoilt.step]) == "toggle_on(CoffeeMachine)"


def test_a_door_that_nobody_saw_decides_and_a_colour_does_not() -> None:
    graph = scene("Microwave-1 is open, CounterTop-1, Plate-1 held")
    step = plan("navigate_to_obj(Microwave); put_in(Plate, Microwave)")
    wish = goal("inside(Plate, Microwave)")
    assert rehearse(step, graph, wish, DOMAIN).outcome is PlanOutcome.RUNS
    found = rehearse(step, unobserved(graph, "Microwave-1", "open"), wish, DOMAIN)
    assert found.outcome is PlanOutcome.OPEN
    assert found.unobserved == (Literal("open", ("Microwave-1",), "closed"),)
    dusty = rehearse(step, unobserved(graph, "Plate-1", "dirty"), wish, DOMAIN)
    assert dusty.outcome is PlanOutcome.RUNS
    assert Literal("dirty", ("Plate-1",), "clean") in dusty.check.assumed


def test_the_inside_that_nobody_saw_decides_where_it_must_be_empty() -> None:
    graph = scene("Microwave-1 hidden, CounterTop-1, Plate-1 on CounterTop-1")
    steps = plan(
        "navigate_to_obj(Microwave); open_obj(Microwave); navigate_to_obj(Plate); pick_up(Plate); "
        "navigate_to_obj(Microwave); put_in(Plate, Microwave); close_obj(Microwave)"
    )
    found = rehearse(steps, graph, goal("inside(Plate, Microwave)"), DOMAIN)
    assert found.check.ok
    assert found.unobserved == (Literal("vacant", ("Microwave-1",)),)


def test_what_was_broken_before_is_no_fault_of_the_plan() -> None:
    graph = scene("Fridge-1 is open, CounterTop-1, Plate-1 on CounterTop-1")
    steps = plan("navigate_to_obj(Plate); pick_up(Plate)")
    found = rehearse(steps, graph, Goal(""), DOMAIN)
    assert [(s.what, bool(s.excused)) for s in found.spoils] == [("cold_let_out", True)]
    assert found.outcome is PlanOutcome.RUNS
    opening = rehearse(
        plan("navigate_to_obj(Fridge); open_obj(Fridge)"),
        scene("Fridge-1 is closed, CounterTop-1"),
        Goal(""),
        DOMAIN,
    )
    assert [s.sentence for s in opening.spoils] == ["Fridge-1 is left open"]
    assert opening.outcome is PlanOutcome.FAILS
