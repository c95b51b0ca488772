"""The hundred simulated failures of RoboFail: complete, well formed, and failing when unwatched."""

from collections import Counter

import pytest

from forestall.domain.load import shipped
from forestall.tasks.faults import (
    apply_plan_faults,
    apply_scene_faults,
    check_steps,
    parse_fault,
    wrap,
)
from forestall.tasks.files import Scenario, load_scenario, load_task, scenario_names
from forestall.tasks.goals import TruthGoalChecker
from forestall.types.episode import SkillStatus
from forestall.types.plan import Plan, Subtask
from forestall.types.scene import ObjectNeed, SceneNeeds
from forestall.worlds.kitchen.environment import KitchenEnvironment
from forestall.worlds.kitchen.flat_world import flat_environment

pytestmark = pytest.mark.slow

DOMAIN = shipped("household")
SOURCES = {
    "boil-water": "boilWater",
    "cook-egg": "cookEgg",
    "heat-potato": "heatPotato",
    "make-coffee": "makeCoffee",
    "make-salad": "makeSalad",
    "store-egg": "storeEgg",
    "switch-devices": "switchDevices",
    "toast-bread": "toastBread",
    "warm-water": "warmWater",
    "water-plant": "waterPlant",
}

KINDS = {
    "missing_step": 18,
    "wrong_plan": 17,
    "failed_action": 14,
    "drop": 10,
    "wrong_order": 10,
    "occupied": 8,
    "wrong_perception": 7,
    "blocking": 5,
    "ambiguous_plan": 4,
    "dirty": 3,
    "filled": 3,
    "wrong_execution": 1,
}

SLIPS = {"drop", "failed_action", "wrong_perception", "wrong_execution"}
SCENE = {"occupied", "blocking", "dirty", "filled"}
INSIDE_CLOSED = {"robofail-heat-potato-2", "robofail-store-egg-2", "robofail-warm-water-5"}
"""Scene changes behind a door: nobody can see them before it is opened."""

NAMES = scenario_names("robofail")


def _plan(scenario: Scenario) -> Plan:
    return apply_plan_faults(load_task(scenario.task).task.plan, scenario.faults, DOMAIN)


def _play(scenario: Scenario, seed: int) -> tuple[KitchenEnvironment, list[tuple[int, str]]]:
    """Run the starting plan unwatched; the world and every (position, reason) of a refusal."""
    loaded = load_task(scenario.task)
    needs = apply_scene_faults(loaded.task.scene, scenario.faults, loaded.domain)
    kitchen = flat_environment(needs, loaded.domain)
    env = wrap(kitchen, scenario.faults, kitchen, loaded.domain)
    env.reset(seed)
    refused = []
    for at, subtask in enumerate(_plan(scenario)):
        outcome = env.execute(subtask)
        if outcome.status is SkillStatus.REFUSED:
            refused.append((at, outcome.reason))
    return kitchen, refused


def test_all_hundred_are_there_with_their_kinds_and_sources() -> None:
    scenarios = [load_scenario(n) for n in NAMES]
    assert Counter(s.task for s in scenarios) == dict.fromkeys(SOURCES, 10)
    assert Counter(s.kind for s in scenarios) == KINDS
    assert {(s.name, s.source) for s in scenarios} == {
        (f"robofail-{task}-{n}", f"RoboFail {theirs}-{n}")
        for task, theirs in SOURCES.items()
        for n in range(1, 11)
    }
    assert len({(s.task, s.title) for s in scenarios}) == 100


BROKEN_BY_FALLING = ("robofail-cook-egg-1", "robofail-heat-potato-1", "robofail-store-egg-8")


@pytest.mark.parametrize("name", NAMES)
def test_a_scenario_fits_its_task_and_says_when_it_can_be_known(name: str) -> None:
    scenario = load_scenario(name)
    loaded = load_task(scenario.task)
    plan = _plan(scenario)
    check_steps(plan, scenario.faults, loaded.domain)
    known, effect = scenario.moments(plan)
    assert known is not None and effect is not None
    broken = name in BROKEN_BY_FALLING
    assert (known == effect + 1) if broken else (known <= effect)
    if scenario.kind in SCENE:
        assert (known == 0) == (name not in INSIDE_CLOSED)
        opened = plan.texts()[:known]
        assert known == 0 or opened.count("open_obj(Fridge)") + opened.count("open_obj(Microwave)")


@pytest.mark.parametrize("name", NAMES)
def test_nobody_steps_in_and_the_task_fails(name: str) -> None:
    scenario = load_scenario(name)
    goal = load_task(scenario.task).task.goal
    plan = _plan(scenario)
    known, effect = scenario.moments(plan)
    assert known is not None and effect is not None
    for seed in (10_000, 10_001):
        kitchen, refused = _play(scenario, seed)
        strict, _, why = TruthGoalChecker(DOMAIN).check(goal, kitchen.oracle)
        assert not strict and why
        late = [step for step, _ in refused if step >= known]
        if scenario.kind in SLIPS and name not in BROKEN_BY_FALLING:
            assert effect == (late[0] if late else len(plan))
        if refused:  # nothing is refused before the failure could be known or was done
            assert refused[0][0] >= min(known, effect)


@pytest.mark.parametrize(
    ("name", "reason"),
    [
        ("boil-water-2", "Pot-1 cannot be grasped: Bread-1 stands in front of it"),
        ("boil-water-8", "StoveBurner-4 does not take Bowl-1"),
        ("cook-egg-2", "StoveBurner-1 is full: Pot-1 is in the way"),
        ("heat-potato-2", "Microwave-1 is full: Bowl-1 is in the way"),
        ("heat-potato-8", "Microwave-1 does not take Pan-1"),
        ("heat-potato-9", "Microwave-1 cannot be turned on while it is open"),
        ("heat-potato-10", "Microwave-1 does not open while it is on"),
        ("make-coffee-3", "CoffeeMachine-1 is full: Cup-1 is in the way"),
        ("make-coffee-9", "CoffeeMachine-1 does not take Bowl-1"),
        ("make-salad-1", "Potato-1 cannot be sliced without a knife: the gripper is empty"),
        ("store-egg-2", "Egg-1 cannot be grasped: Lettuce-1 stands in front of it"),
        ("store-egg-7", "Egg-1 cannot be reached: Fridge-1 is closed"),
        ("switch-devices-6", "RemoteControl-1 cannot be grasped: Bowl-1 stands in front of it"),
        ("toast-bread-3", "Toaster-1 is full: CellPhone-1 is in the way"),
        ("toast-bread-7", "Toaster-1 does not take Bread-1"),
        ("toast-bread-9", "Toaster-1 takes nothing while it is on"),
        ("warm-water-5", "Microwave-1 is full: Cup-1 is in the way"),
        ("water-plant-5", "Kettle-1 is empty"),
    ],
)
def test_the_step_that_does_the_harm_is_refused_for_the_recorded_reason(
    name: str, reason: str
) -> None:
    scenario = load_scenario(f"robofail-{name}")
    _, refused = _play(scenario, 10_000)
    assert refused[0] == (scenario.moments(_plan(scenario))[1], reason)


@pytest.mark.parametrize(
    ("name", "fact"),
    [
        ("boil-water-5", "Pan-1 on top of StoveBurner-4"),
        ("heat-potato-6", "Apple-1 on top of Plate-1"),
        ("make-coffee-6", "Bowl-1 on top of CounterTop-"),
        ("make-salad-4", "Pan-1 inside Fridge-1"),
        ("store-egg-5", "Egg-1 inside Pan-1"),
        ("store-egg-6", "Potato-1 inside Bowl-1"),
        ("warm-water-6", "Cup-1 on top of DiningTable-1"),
    ],
)
def test_the_wrong_thing_ends_where_the_right_one_should(name: str, fact: str) -> None:
    kitchen, _ = _play(load_scenario(f"robofail-{name}"), 10_001)
    assert any(str(r).startswith(fact) for r in kitchen.oracle.truth().relations)


MIXED_UP = parse_fault(
    {"kind": "wrong_object", "step": "pick_up(Mug)", "acts_on": "Bowl", "times": 2}
)


def _mixed_up(*steps: str) -> KitchenEnvironment:
    """A kitchen in which a bowl is taken for the mug, after some steps that must all work."""
    needs = SceneNeeds(objects=(ObjectNeed("Mug-1", "Mug"), ObjectNeed("Bowl-1", "Bowl")))
    kitchen = flat_environment(needs, DOMAIN)
    env = wrap(kitchen, [MIXED_UP], kitchen, DOMAIN)
    env.reset(0)
    for step in steps:
        outcome = env.execute(Subtask.parse(step))
        assert outcome.status is SkillStatus.SUCCEEDED, (step, outcome.reason)
    return kitchen


def test_what_was_picked_up_by_mistake_is_used_as_if_it_were_the_right_thing() -> None:
    steps = ("pick_up(Mug-1)", "put_in(Mug-1, Sink)", "toggle_on(Faucet)", "pick_up(Mug)")
    kitchen = _mixed_up(*steps, "pour(Mug, Sink)")
    assert kitchen.oracle.truth().in_hands(("gripper",)) == ("Bowl-1",)


def test_the_mistake_ends_when_a_step_names_the_wrong_thing() -> None:
    kitchen = _mixed_up("pick_up(Mug)", "put_on(Bowl-1, CounterTop)", "pick_up(Mug)")
    assert kitchen.oracle.truth().in_hands(("gripper",)) == ("Mug-1",)


def test_the_mistake_ends_when_it_has_happened_often_enough() -> None:
    again = ("pick_up(Mug)", "put_on(Mug, DiningTable)")
    kitchen = _mixed_up(*again, *again, *again)
    assert kitchen.oracle.truth().parents("Mug-1", DOMAIN.containing) == ("DiningTable-1",)
    assert kitchen.oracle.truth().parents("Bowl-1", DOMAIN.containing) == ("DiningTable-1",)


def test_a_reset_ends_the_mistake() -> None:
    needs = SceneNeeds(objects=(ObjectNeed("Mug-1", "Mug"), ObjectNeed("Bowl-1", "Bowl")))
    kitchen = flat_environment(needs, DOMAIN)
    env = wrap(kitchen, [MIXED_UP], kitchen, DOMAIN)
    env.reset(0)
    env.execute(Subtask.parse("pick_up(Mug)"))
    env.reset(0)
    outcome = env.execute(Subtask.parse("put_on(Mug, CounterTop)"))
    assert outcome.reason == "Mug-1 is not in the gripper"
