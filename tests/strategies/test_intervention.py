"""What follows from an alarm: repairs that need a thing whose place nobody knows."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import pytest

from forestall.planning.validate import GraphValidator
from forestall.replanning.symbolic import PlannerReplanner
from forestall.strategies.intervention import Clock, Intervention, checked, would_not_work
from forestall.types.facts import Literal
from forestall.types.graph import SceneGraph
from forestall.types.plan import Plan
from forestall.types.runtime import BoundaryContext, StrategyAnswer
from forestall.types.verdict import Decision, Diagnosis
from planning.corpus import DOMAIN, PLANS, home_of, scene
from planning.episodes import context

HELD = Diagnosis("the knife is not in the hand", (Literal.parse("held_by(Knife-1, gripper)"),))


def before_slicing(bread: bool) -> BoundaryContext:
    """Before the bread is sliced, with empty hands; the bread may be nowhere to be seen."""
    graph = scene(home_of("toast-bread"), "Drawer-1 hidden")
    if not bread:
        graph = without(graph, {n.id for n in graph.nodes if n.category == "Bread"})
    return context("toast-bread", PLANS["toast-bread"], 2, graph)


def alarmed(at: BoundaryContext, why: Diagnosis = HELD) -> StrategyAnswer:
    validator = GraphValidator(DOMAIN)
    steps_in = Intervention(PlannerReplanner(validator, DOMAIN), validator, 2)
    steps_in.begin(at)
    return steps_in.alarm(at, checked("a judge", False, ""), why, Clock())


def test_a_thing_that_the_rest_needs_is_looked_for_before_the_repair() -> None:
    answer = alarmed(before_slicing(bread=False))
    assert answer.decision is Decision.REPLAN and answer.replan is not None
    assert answer.replan.looking_for == ("Bread",)
    assert answer.replan.plan is not None
    assert "open_obj(Drawer-1)" in answer.replan.plan.texts()


def test_what_is_looked_for_already_is_not_looked_for_anew_on_the_way() -> None:
    """Each step of the search finds the same fault: that must not begin it again."""
    at = before_slicing(bread=False)
    validator = GraphValidator(DOMAIN)
    steps_in = Intervention(PlannerReplanner(validator, DOMAIN), validator, 2)
    steps_in.begin(at)
    first, second = (
        steps_in.alarm(at, checked("a judge", False, ""), HELD, Clock()) for _ in range(2)
    )
    assert first.replan is not None and first.replan.looking_for == ("Bread",)
    assert second.replan is not None and not second.replan.looking_for


def test_nothing_is_looked_for_where_the_repair_is_found() -> None:
    answer = alarmed(before_slicing(bread=True))
    assert answer.decision is Decision.REPLAN and answer.replan is not None
    assert not answer.replan.looking_for and answer.replan.plan is not None
    assert "pick_up(Knife-1)" in answer.replan.plan.texts()


EARLY = PLANS["store-egg"].texts()[:5]
"""The bowl with the egg stays outside; the egg is in the fridge, which is shut."""
WRONG = [t.replace("Bowl", "Pan") if k > 4 else t for k, t in enumerate(PLANS["store-egg"].texts())]
"""A pan is put into the fridge."""


@pytest.mark.parametrize(
    ("plan", "index", "decision"),
    [
        (EARLY, 0, Decision.PROCEED),  # the robot goes to the fridge
        (EARLY, 1, Decision.PROCEED),  # and opens it: then the egg is seen, and a repair found
        (WRONG, 7, Decision.STOP),  # this very step fails
    ],
)
def test_without_a_repair_it_goes_on_as_long_as_nothing_is_lost_by_it(
    plan: Sequence[str], index: int, decision: Decision
) -> None:
    answer = without_a_repair(egg_in_the_fridge(plan, index))
    assert answer.decision is decision
    assert ("there is time yet" in answer.why) is (decision is Decision.PROCEED)


def test_without_a_repair_what_must_never_be_is_not_brought_about() -> None:
    at = egg_in_the_fridge(EARLY, 1)
    goal = replace(at.task.goal, never=(Literal.parse("open(Fridge-1)=open"),))
    answer = without_a_repair(replace(at, task=replace(at.task, goal=goal)))
    assert answer.decision is Decision.STOP


@pytest.mark.parametrize(
    ("index", "decision"),
    [
        (1, Decision.PROCEED),  # the knife is picked up, and can be put down
        (3, Decision.STOP),  # the bread would be sliced for good, and nothing would come of it
    ],
)
def test_without_a_repair_what_cannot_be_undone_is_not_begun(
    index: int, decision: Decision
) -> None:
    graph = scene(home_of("toast-bread"), *(["Knife-1 held"] if index > 1 else []))
    graph = without(graph, {n.id for n in graph.nodes if n.category == "Toaster"})
    plan = Plan(PLANS["toast-bread"].subtasks[:5])
    answer = without_a_repair(context("toast-bread", plan, index, graph))
    assert answer.decision is decision


def without(graph: SceneGraph, things: set[str]) -> SceneGraph:
    """A scene in which there is nothing to be known of these."""
    return replace(
        graph,
        nodes=tuple(n for n in graph.nodes if n.id not in things),
        relations=tuple(r for r in graph.relations if not things & {r.subject, r.object}),
    )


def egg_in_the_fridge(plan: Sequence[str], index: int) -> BoundaryContext:
    """Before a step of a plan that fails, with the egg in a shut fridge into which nobody saw."""
    graph = scene(home_of("store-egg"), "Pan-1 on CounterTop-1", "Fridge-1 hidden")
    inside = {r.subject for r in graph.relations if r.object == "Fridge-1"}
    return context("store-egg", Plan.parse(plan), index, without(graph, inside))


def without_a_repair(at: BoundaryContext) -> StrategyAnswer:
    """What follows from an alarm of the plan check, which has had its second look."""
    at = replace(at, may_look=False)
    check = GraphValidator(DOMAIN).check(Plan(at.remaining()), at.graph, at.task.goal)
    assert not check.ok
    answer = alarmed(at, would_not_work(check))
    assert answer.verdict is not None and answer.verdict.decision is Decision.REPLAN
    return answer
