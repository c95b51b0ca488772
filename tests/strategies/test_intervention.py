"""What follows from an alarm: repairs that need a thing whose place nobody knows."""

from __future__ import annotations

from dataclasses import replace

from forestall.planning.validate import GraphValidator
from forestall.replanning.symbolic import PlannerReplanner
from forestall.strategies.intervention import Clock, Intervention, checked
from forestall.types.facts import Literal
from forestall.types.runtime import BoundaryContext, StrategyAnswer
from forestall.types.verdict import Decision, Diagnosis
from planning.corpus import DOMAIN, PLANS, home_of, scene
from planning.episodes import context

HELD = Diagnosis("the knife is not in the hand", (Literal.parse("held_by(Knife-1, gripper)"),))


def before_slicing(bread: bool) -> BoundaryContext:
    """Before the bread is sliced, with empty hands; the bread may be nowhere to be seen."""
    graph = scene(home_of("toast-bread"), "Drawer-1 hidden")
    if not bread:
        graph = replace(
            graph,
            nodes=tuple(n for n in graph.nodes if n.category != "Bread"),
            relations=tuple(r for r in graph.relations if not r.subject.startswith("Bread-")),
        )
    return context("toast-bread", PLANS["toast-bread"], 2, graph)


def alarmed(at: BoundaryContext) -> StrategyAnswer:
    validator = GraphValidator(DOMAIN)
    steps_in = Intervention(PlannerReplanner(validator, DOMAIN), validator, 2)
    steps_in.begin(at)
    return steps_in.alarm(at, checked("a judge", False, ""), HELD, Clock())


def test_a_thing_that_the_rest_needs_is_looked_for_before_the_repair() -> None:
    answer = alarmed(before_slicing(bread=False))
    assert answer.decision is Decision.REPLAN and answer.replan is not None
    assert answer.replan.looking_for == ("Bread",)
    assert answer.replan.plan is not None
    assert "open_obj(Drawer-1)" in answer.replan.plan.texts()


def test_nothing_is_looked_for_where_the_repair_is_found() -> None:
    answer = alarmed(before_slicing(bread=True))
    assert answer.decision is Decision.REPLAN and answer.replan is not None
    assert not answer.replan.looking_for and answer.replan.plan is not None
    assert "pick_up(Knife-1)" in answer.replan.plan.texts()
