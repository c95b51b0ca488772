from __future__ import annotations

from dataclasses import replace

import pytest

from forestall.diagnosis.none import NoReasoning
from forestall.planning.validate import AcceptAll, GraphValidator, observed
from forestall.replanning.anew import GoalReplanner
from forestall.seams import Reasoner
from forestall.types.facts import Literal
from forestall.types.graph import SceneGraph
from forestall.types.plan import Plan
from forestall.types.runtime import BoundaryContext
from forestall.types.verdict import Calibration, Decision, Replan, ReplanOutcome, Verdict
from planning.corpus import DOMAIN, PLANS, home_of, scene
from planning.episodes import context, seen

ALARM = Verdict(Decision.REPLAN, "image", 0.5, 0.9, Calibration.FIXED)
REASONER = NoReasoning(DOMAIN)


def boundary(task: str, before: str, where: str) -> BoundaryContext:
    index = PLANS[task].texts().index(before)
    graph = seen(observed(scene(home_of(task), where), DOMAIN))
    return context(task, PLANS[task], index, graph)


CASES = {
    "bowl in the microwave": (
        "heat-potato",
        "put_in(Plate, Microwave)",
        "Potato-1 on Plate-1, Plate-1 held, Bowl-1 in Microwave-1, Microwave-1 is open",
    ),
    "dirty plate": ("heat-potato", "put_on(Potato, Plate)", "Potato-1 held, Plate-1 is dirty"),
    "dropped mug": ("make-coffee", "put_in(Mug, CoffeeMachine)", "Mug-1 on Floor-1"),
    "potato in the pan": (
        "cook-egg",
        "pick_up(Pan)",
        "Egg-1 on CounterTop-1, StoveBurner-1 is on, Potato-1 in Pan-1",
    ),
    "nothing wrong": ("make-coffee", "pick_up(Mug)", ""),
}


def replan(boundary: BoundaryContext) -> Replan:
    reasoner: Reasoner = REASONER
    replanner = GoalReplanner(GraphValidator(DOMAIN), DOMAIN)
    return replanner.replan(boundary, reasoner.diagnose(boundary, ALARM))


@pytest.mark.parametrize("name", CASES)
def test_a_plan_for_the_goal_from_what_is_seen(name: str) -> None:
    case = boundary(*CASES[name])
    found = replan(case)
    assert (found.outcome, found.producer) == (ReplanOutcome.SOLVED, "goal planner")
    assert found.plan is not None and found.check is not None
    assert found.check.ok
    assert GraphValidator(DOMAIN).check(found.plan, case.graph, case.task.goal).ok


def test_the_cause_is_not_named() -> None:
    case = boundary(*CASES["bowl in the microwave"])
    diagnosis = REASONER.diagnose(case, ALARM)
    assert diagnosis.cause == "no reasoning: the scene does not fit"
    assert (diagnosis.culprits, diagnosis.must_stay, diagnosis.producer) == ((), (), "none")
    assert set(diagnosis.must_change) == {
        Literal("inside", ("Plate-1", "Microwave")),
        Literal("cooked", ("Potato-1",), "cooked"),
    }


def test_nothing_is_done_twice() -> None:
    """The plan for the goal is not followed by what was left of the old one."""
    case = boundary(*CASES["nothing wrong"])
    found = replan(case)
    assert found.plan is not None
    assert len(found.plan) <= len(case.remaining())
    assert len([s for s in found.plan if s.skill == "toggle_on"]) <= 2


def test_where_the_goal_holds_nothing_must_change() -> None:
    case = boundary("make-coffee", "pick_up(Mug)", "")
    goal = replace(case.task.goal, literals=(Literal("dirty", ("?mug",), "clean"),))
    goal = replace(goal, variables=(("?mug", "Mug"),), never=(Literal("spoiled", ("?mug",)),))
    case = replace(case, task=replace(case.task, goal=goal))
    assert REASONER.diagnose(case, ALARM).must_change == ()
    assert replan(case).outcome is ReplanOutcome.NOTHING_TO_CHANGE


def test_what_is_not_known_anywhere_cannot_be_planned_for() -> None:
    case = boundary("store-egg", "pick_up(Egg)", "Egg-1 in Fridge-1")
    case = replace(case, graph=without(case.graph, "Egg-1"))
    diagnosis = REASONER.diagnose(case, ALARM)
    assert Literal("located", ("Egg",)) in diagnosis.must_change
    found = replan(case)
    assert (found.outcome, found.plan) == (ReplanOutcome.UNSOLVABLE, None)
    assert "Egg: its place is not known" in found.note


def without(graph: SceneGraph, name: str) -> SceneGraph:
    return replace(
        graph,
        nodes=tuple(n for n in graph.nodes if n.id != name),
        relations=tuple(r for r in graph.relations if name not in (r.subject, r.object)),
    )


def test_without_validation_every_plan_is_accepted() -> None:
    case = boundary(*CASES["dropped mug"])
    wrong = Plan.parse(["pick_up(Mug)", "pick_up(Mug)", "put_in(Mug, Sink)"])
    assert not GraphValidator(DOMAIN).check(wrong, case.graph, case.task.goal).ok
    assert AcceptAll().check(wrong, case.graph, case.task.goal).ok
