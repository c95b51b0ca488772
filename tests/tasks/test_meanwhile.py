"""Somebody else changes the world while the robot works, in every world and as far as it can."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import pytest

from forestall.domain.load import shipped
from forestall.errors import InputError
from forestall.tasks.faults import check_steps, knowable, parse_fault, wrap
from forestall.testing.symbolic_world import SymbolicWorld
from forestall.types.episode import SkillStatus
from forestall.types.plan import Plan, Subtask
from forestall.types.scene import ObjectNeed, SceneNeeds
from forestall.worlds.kitchen.environment import KitchenEnvironment
from forestall.worlds.kitchen.flat_world import flat_environment

DOMAIN = shipped("household")
NEEDS = SceneNeeds(
    objects=(
        ObjectNeed("Mug-1", "Mug", ("CounterTop-1",)),
        ObjectNeed("Apple-1", "Apple", ("DiningTable-1",)),
        ObjectNeed("Pot-1", "Pot", ("StoveBurner-2",)),
    )
)
PLAN = Plan.parse(["navigate_to_obj(Mug)", "pick_up(Mug)", "open_obj(Microwave)"])


def _kitchen() -> Any:
    return KitchenEnvironment(NEEDS, DOMAIN)


WORLDS = [
    pytest.param(lambda: flat_environment(NEEDS, DOMAIN), id="flat"),
    pytest.param(lambda: SymbolicWorld(DOMAIN, NEEDS), id="symbolic"),
    pytest.param(_kitchen, id="kitchen", marks=pytest.mark.simulator),
]


def _played(make: Callable[[], Any], steps: tuple[str, ...], **table: object) -> Any:
    """The truth after some steps, all of which must work."""
    world = make()
    env = wrap(world, [parse_fault({"kind": "meanwhile", **table})], world, DOMAIN)
    env.reset(10_000)
    for step in steps:
        outcome = env.execute(Subtask.parse(step))
        assert outcome.status is SkillStatus.SUCCEEDED, (step, outcome.reason)
    return getattr(world, "oracle", world).truth()


@pytest.mark.parametrize("make", WORLDS)
def test_a_thing_is_put_elsewhere_right_after_a_step_and_once(make: Callable[[], Any]) -> None:
    table = {"step": "pick_up(Mug)", "object": "Apple-1", "place": "Fridge-1"}
    before = _played(make, ("navigate_to_obj(Mug)",), **table)
    assert before.parents("Apple-1", DOMAIN.containing) == ("DiningTable-1",)
    after = _played(make, ("pick_up(Mug)",), **table)
    assert after.parents("Apple-1", DOMAIN.containing) == ("Fridge-1",)
    assert after.in_hands(("gripper",)) == ("Mug-1",)


@pytest.mark.parametrize("make", WORLDS)
def test_a_state_is_changed_before_the_robot_begins(make: Callable[[], Any]) -> None:
    truth = _played(make, (), object="Microwave-1", attribute="open", value="open")
    assert truth.get("Microwave-1").state("open") == "open"


@pytest.mark.parametrize("make", WORLDS)
def test_what_runs_works_on_what_somebody_put_there(make: Callable[[], Any]) -> None:
    steps = ("toggle_on(StoveBurner-2)",)
    truth = _played(make, (), object="StoveBurner-2", attribute="toggled", value="on")
    assert truth.get("Pot-1").state("temperature") == "hot"
    table = {"step": steps[0], "object": "Mug-1", "place": "Sink-1"}
    assert _played(make, steps, **table).parents("Mug-1", DOMAIN.containing) == ("Sink-1",)


@pytest.mark.parametrize("make", WORLDS)
def test_a_hand_is_given_something_if_it_is_empty(make: Callable[[], Any]) -> None:
    assert _played(make, (), object="Apple-1", place="gripper").in_hands(("gripper",)) == (
        "Apple-1",
    )
    table = {"step": "pick_up(Mug)", "object": "Apple-1", "place": "gripper"}
    assert _played(make, ("pick_up(Mug)",), **table).in_hands(("gripper",)) == ("Mug-1",)


@pytest.mark.parametrize("make", WORLDS)
@pytest.mark.parametrize(
    ("thing", "place"),
    [
        *[("Mug-1", "DiningTable-1"), ("Apple-1", "StoveBurner-1")],
        *[("Plate-1", "CounterTop-1"), ("Apple-1", "DiningTable-1")],
    ],
    ids=["held by the robot", "not taken there", "not in the scene", "there already"],
)
def test_what_cannot_be_done_does_not_happen(
    make: Callable[[], Any], thing: str, place: str
) -> None:
    world = make()
    world.reset(10_000)
    assert world.execute(Subtask.parse("pick_up(Mug)")).status is SkillStatus.SUCCEEDED
    before = getattr(world, "oracle", world).truth().relations
    assert world.rearrange(thing, place) is False
    assert getattr(world, "oracle", world).truth().relations == before


@pytest.mark.parametrize("make", WORLDS)
def test_only_a_change_is_one(make: Callable[[], Any]) -> None:
    world = make()
    world.reset(10_000)
    assert world.rearrange("Mug-1", "CoffeeMachine-1") is True
    assert world.rearrange("Apple-1", "Mug-1") is False
    assert world.alter("Mug-1", "dirty", "clean") is False
    assert world.alter("Plate-1", "dirty", "dirty") is False
    assert world.alter("Mug-1", "dirty", "dirty") is True


@pytest.mark.parametrize(
    ("table", "message"),
    [
        ({"object": "Mug"}, "give either 'place', or 'attribute' and 'value'"),
        ({"object": "Mug", "attribute": "dirty"}, "give either 'place'"),
        ({"object": "Mug", "place": "Sink", "attribute": "dirty", "value": "dirty"}, "give either"),
    ],
)
def test_a_change_is_one_thing(table: dict[str, str], message: str) -> None:
    with pytest.raises(InputError, match=message):
        parse_fault({"kind": "meanwhile", **table})


@pytest.mark.parametrize(
    ("table", "message"),
    [
        ({"object": "Mugg", "place": "Sink"}, "did you mean Mug"),
        ({"object": "Mug", "place": "StoveBurner-1"}, "StoveBurner-1 does not take Mug"),
        ({"object": "Mug", "place": "Sinc"}, "did you mean Sink"),
        ({"object": "Mug", "attribute": "dirty", "value": "foul"}, "known: clean, dirty"),
        ({"object": "Mug", "place": "Sink", "step": "pick_up(Apple)"}, "comes 0 time"),
    ],
)
def test_its_names_are_checked_against_plan_and_domain(table: dict[str, str], message: str) -> None:
    fault = parse_fault({"kind": "meanwhile", **table})
    assert knowable([fault]) == "after"
    with pytest.raises(InputError, match=message):
        check_steps(PLAN, [fault], DOMAIN)
