"""What the robot faces where it matters, told by the plan that led it there."""

from forestall.domain.facing import minds_facing, way_here
from forestall.planning.validate import GraphValidator
from forestall.strategies.intervention import rest_of
from forestall.types.facts import Literal
from forestall.types.plan import Plan, Subtask
from forestall.types.runtime import BoundaryContext
from forestall.types.scene import SceneNeeds
from forestall.types.task import Goal, Task
from planning.corpus import DOMAIN, scene

KITCHEN = "Egg-1 held, Pan-1 on StoveBurner-1, StoveKnob-1, CounterTop-1, Bowl-1 on CounterTop-1"
FRIED = Goal("an egg in the pan", literals=(Literal("inside", ("EggCracked", "Pan-1")),))


def steps(*texts: str) -> tuple[Subtask, ...]:
    return tuple(map(Subtask.parse, texts))


def test_an_egg_is_cracked_into_what_stands_there_and_a_mug_taken_wherever_it_is() -> None:
    assert minds_facing(Subtask.parse("crack_obj(Egg-1)"), DOMAIN)
    assert not minds_facing(Subtask.parse("pick_up(Mug-1)"), DOMAIN)
    assert not minds_facing(Subtask.parse("fly(Mug-1)"), DOMAIN)


def test_the_way_is_the_drive_before_or_to_where_the_last_step_was_done() -> None:
    graph = scene(KITCHEN)
    on = "toggle_on(StoveBurner-1)"
    for plan, index, way in (
        (steps("navigate_to_obj(Pan-1)", "crack_obj(Egg-1)"), 1, steps("navigate_to_obj(Pan-1)")),
        (steps(on, "crack_obj(Egg-1)"), 1, steps("navigate_to_obj(StoveBurner-1)")),
        (steps(on, "navigate_to_obj(Pan-1)", "crack_obj(Egg-1)"), 1, ()),
        (steps(on, "close_obj(Fridge-1)"), 1, ()),
        (steps("crack_obj(Egg-1)"), 0, ()),
        (steps("pick_up(Egg-1)", "crack_obj(Egg-1)"), 1, ()),
        (steps("toggle_on(Faucet-9)", "crack_obj(Egg-1)"), 1, ()),
    ):
        assert way_here(plan, index, graph, DOMAIN) == way, plan


def test_after_the_burner_was_turned_on_the_egg_still_goes_into_the_pan() -> None:
    """A plan that was found to run is not alarmed at when all of it but the last step is done."""
    graph = scene(KITCHEN)
    plan = Plan(
        steps("navigate_to_obj(StoveBurner-1)", "toggle_on(StoveBurner-1)", "crack_obj(Egg-1)")
    )
    check = GraphValidator(DOMAIN).check
    assert check(plan, graph, FRIED).ok
    task = Task("cook-egg", "", FRIED, plan, SceneNeeds())
    context = BoundaryContext(task, plan, 2, 2, plan.subtasks[2], graph, graph, None)
    assert check(rest_of(context, DOMAIN), graph, FRIED).ok
    assert not check(Plan(plan.subtasks[2:]), graph, FRIED).ok, "nobody knows where it would go"
