"""What the robot refused is done another way, or it is said why there is none."""

from __future__ import annotations

from dataclasses import replace

import pytest

from forestall.planning.refused import unexplained
from forestall.planning.validate import GraphValidator, observed
from forestall.replanning.anew import GoalReplanner
from forestall.replanning.symbolic import PlannerReplanner
from forestall.types.plan import Plan, Subtask
from forestall.types.scene import SceneNeeds
from forestall.types.task import Goal, Task
from forestall.types.verdict import Diagnosis, Replan, ReplanOutcome
from planning.corpus import DOMAIN, KITCHEN, PLANS, goal, plan, scene
from planning.episodes import context

VALIDATOR = GraphValidator(DOMAIN)
AWAY = goal("inside(?knife, Drawer)", knife="Knife")
PLAN = plan(
    """
    navigate_to_obj(Drawer)
    open_obj(Drawer)
    navigate_to_obj(Knife)
    pick_up(Knife)
    navigate_to_obj(Drawer)
    put_in(Knife, Drawer)
    """
)


def answer(
    where: str,
    *refused: str,
    wanted: Goal = AWAY,
    current: Plan = PLAN,
    kind: type[PlannerReplanner] | type[GoalReplanner] = PlannerReplanner,
) -> Replan:
    """The corrected plan after some refusals; what must change is what of the goal is unmet."""
    graph = scene(KITCHEN, where)
    known = context("make-coffee", PLANS["make-coffee"], 0, graph)
    known = replace(
        known,
        task=Task("own", "own", wanted, current, SceneNeeds()),
        plan=current,
        subtask=current.subtasks[0],
        refused=tuple(map(Subtask.parse, refused)),
    )
    unmet = VALIDATOR.check(Plan(()), graph, wanted).unmet
    return kind(VALIDATOR, DOMAIN).replan(known, Diagnosis("it was refused", unmet))


OTHERWISE = {
    "another drawer": ("Drawer-2", "open_obj(Drawer-1)", "put_in(Knife-1, Drawer-2)"),
    "another place in the end": (
        "Drawer-2, Drawer-1 is open, Knife-1 held",
        "put_in(Knife-1, Drawer-1)",
        "put_in(Knife-1, Drawer-2)",
    ),
    "another thing": (
        "Knife-2 on CounterTop-2",
        "pick_up(Knife-1)",
        "put_in(Knife-2, Drawer-1)",
    ),
    "where it can drive to": (
        "Drawer-2",
        "navigate_to_obj(Drawer-1)",
        "put_in(Knife-1, Drawer-2)",
    ),
    "another thing, something else in the hand": (
        "Knife-2 on CounterTop-2, Apple-1 held",
        "pick_up(Knife-1)",
        "put_in(Knife-2, Drawer-1)",
    ),
}


@pytest.mark.parametrize("kind", [PlannerReplanner, GoalReplanner])
@pytest.mark.parametrize("name", sorted(OTHERWISE))
def test_another_way_is_found(
    name: str, kind: type[PlannerReplanner] | type[GoalReplanner]
) -> None:
    where, refused, last = OTHERWISE[name]
    found = answer(where, refused, kind=kind)
    assert found.outcome is ReplanOutcome.SOLVED, found.note
    assert found.plan is not None and found.check is not None and found.check.plan is not None
    assert found.check.ok
    assert refused not in [*found.plan.texts(), *found.check.plan.texts()]
    assert found.plan.texts()[-1] == last


@pytest.mark.parametrize("kind", [PlannerReplanner, GoalReplanner])
def test_where_there_is_no_other_it_is_said(
    kind: type[PlannerReplanner] | type[GoalReplanner],
) -> None:
    found = answer("", "open_obj(Drawer-1)", kind=kind)
    assert found.outcome in (ReplanOutcome.UNSOLVABLE, ReplanOutcome.NOT_FOUND)
    assert found.plan is None
    assert "open_obj(Drawer-1) was refused, and there is no other Drawer" in found.note


def test_all_of_a_kind_can_be_refused() -> None:
    found = answer("Drawer-2", "open_obj(Drawer)")
    assert found.plan is None
    assert "open_obj(Drawer) was refused, and no other will do" in found.note


def test_what_the_state_itself_forbids_is_tried_once_it_has_changed() -> None:
    found = answer("Pot-1 on CounterTop-1, Pot-1 blocks Knife-1", "pick_up(Knife-1)")
    assert found.plan is not None, found.note
    texts = found.plan.texts()
    assert texts.index("pick_up(Pot-1)") < texts.index("pick_up(Knife-1)")
    assert len(set(texts) - {t for t in texts if "navigate" in t}) == len(
        [t for t in texts if "navigate" not in t]
    )


def test_a_support_is_named_where_another_of_its_kind_was_refused() -> None:
    wanted, current = goal("on_top_of(Apple-1, CounterTop)"), plan("put_on(Apple, CounterTop)")
    found = answer("Apple-1 held", "put_on(Apple-1, CounterTop-1)", wanted=wanted, current=current)
    assert found.plan is not None, found.note
    assert found.plan.texts()[-1] == "put_on(Apple-1, CounterTop-2)"


def test_only_a_need_about_its_own_arguments_explains_a_refusal() -> None:
    mug, knife, drawer = map(
        Subtask.parse, ("pick_up(Mug-1)", "pick_up(Knife-1)", "open_obj(Drawer-1)")
    )
    full = observed(scene(KITCHEN, "Apple-1 held"), DOMAIN)
    assert unexplained(full, [mug]) == {mug}
    blocked = observed(scene(KITCHEN, "Pot-1 on CounterTop-1, Pot-1 blocks Knife-1"), DOMAIN)
    assert unexplained(blocked, [mug, knife, drawer]) == {mug, drawer}
