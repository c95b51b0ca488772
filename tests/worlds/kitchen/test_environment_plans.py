"""The ten nominal plans of the household and the ten shipped scenarios under the true rules."""

import pytest

from forestall.domain.load import shipped
from forestall.seams import Environment
from forestall.tasks.faults import apply_plan_faults, apply_scene_faults, wrap
from forestall.tasks.files import load_scenario, load_task, scenario_names
from forestall.tasks.goals import TruthGoalChecker
from forestall.types.episode import SkillStatus
from forestall.types.plan import Plan, Subtask
from forestall.worlds.kitchen.environment import KitchenEnvironment
from forestall.worlds.kitchen.flat_world import flat_environment

DOMAIN = shipped("household")
PLANS = {
    "boil-water": """
        navigate_to_obj(Pot) pick_up(Pot) navigate_to_obj(Sink) put_in(Pot,Sink)
        toggle_on(Faucet) toggle_off(Faucet) pick_up(Pot) navigate_to_obj(StoveBurner-4)
        put_on(Pot,StoveBurner-4) toggle_on(StoveBurner-4)
    """,
    "cook-egg": """
        navigate_to_obj(Fridge) open_obj(Fridge) pick_up(Egg) close_obj(Fridge)
        navigate_to_obj(StoveBurner-1) toggle_on(StoveBurner-1) navigate_to_obj(Pan)
        put_on(Egg,CounterTop) pick_up(Pan) navigate_to_obj(StoveBurner-1)
        put_on(Pan,StoveBurner-1) navigate_to_obj(Egg) pick_up(Egg) navigate_to_obj(Pan)
        crack_obj(Egg) put_in(EggCracked,Pan)
    """,
    "heat-potato": """
        navigate_to_obj(Potato) pick_up(Potato) put_on(Potato,Plate) pick_up(Plate)
        navigate_to_obj(Microwave) put_on(Plate,CounterTop) open_obj(Microwave) pick_up(Plate)
        put_in(Plate,Microwave) close_obj(Microwave) toggle_on(Microwave)
    """,
    "make-coffee": """
        navigate_to_obj(Mug) pick_up(Mug) navigate_to_obj(Sink) put_on(Mug,SinkBasin)
        toggle_on(Faucet) toggle_off(Faucet) pick_up(Mug) pour(Mug,Sink)
        navigate_to_obj(CoffeeMachine) put_in(Mug,CoffeeMachine) toggle_on(CoffeeMachine)
        toggle_off(CoffeeMachine) pick_up(Mug) put_on(Mug,CounterTop)
    """,
    "make-salad": """
        navigate_to_obj(Lettuce) pick_up(Lettuce) navigate_to_obj(Bowl)
        put_on(Lettuce,CounterTop) navigate_to_obj(Tomato) pick_up(Tomato) navigate_to_obj(Bowl)
        put_on(Tomato,CounterTop) navigate_to_obj(Potato) pick_up(Potato) navigate_to_obj(Bowl)
        put_on(Potato,CounterTop) navigate_to_obj(Knife) pick_up(Knife) navigate_to_obj(Bowl)
        slice_obj(Lettuce) slice_obj(Potato) slice_obj(Tomato) put_on(Knife,CounterTop)
        pick_up(LettuceSliced) put_in(LettuceSliced,Bowl) pick_up(PotatoSliced)
        put_in(PotatoSliced,Bowl) pick_up(TomatoSliced) put_in(TomatoSliced,Bowl)
        navigate_to_obj(Fridge) open_obj(Fridge) navigate_to_obj(Bowl) pick_up(Bowl)
        navigate_to_obj(Fridge) put_in(Bowl,Fridge) close_obj(Fridge)
    """,
    "store-egg": """
        navigate_to_obj(Fridge) open_obj(Fridge) pick_up(Egg) navigate_to_obj(CounterTop)
        put_on(Egg,CounterTop) navigate_to_obj(Fridge) close_obj(Fridge) navigate_to_obj(Egg)
        pick_up(Egg) navigate_to_obj(Bowl) put_in(Egg,Bowl) navigate_to_obj(Fridge)
        open_obj(Fridge) navigate_to_obj(Bowl) pick_up(Bowl) navigate_to_obj(Fridge)
        put_in(Bowl,Fridge) close_obj(Fridge)
    """,
    "switch-devices": """
        navigate_to_obj(Laptop) close_obj(Laptop) pick_up(Laptop) navigate_to_obj(TVStand)
        put_on(Laptop,TVStand) navigate_to_obj(RemoteControl) pick_up(RemoteControl)
        navigate_to_obj(Television) toggle_on(Television) put_on(RemoteControl,TVStand)
    """,
    "toast-bread": """
        navigate_to_obj(Knife) pick_up(Knife) navigate_to_obj(Bread) slice_obj(Bread)
        put_on(Knife,CounterTop) pick_up(BreadSliced) navigate_to_obj(Toaster)
        put_in(BreadSliced,Toaster) toggle_on(Toaster)
    """,
    "warm-water": """
        navigate_to_obj(Mug) pick_up(Mug) navigate_to_obj(Sink) put_in(Mug,Sink)
        toggle_on(Faucet) toggle_off(Faucet) pick_up(Mug) navigate_to_obj(Microwave)
        put_on(Mug,CounterTop) open_obj(Microwave) pick_up(Mug) put_in(Mug,Microwave)
        close_obj(Microwave) toggle_on(Microwave) toggle_off(Microwave) open_obj(Microwave)
        pick_up(Mug) navigate_to_obj(DiningTable) put_on(Mug,DiningTable)
    """,
    "water-plant": """
        navigate_to_obj(Pot) pick_up(Pot) navigate_to_obj(Sink) put_in(Pot,Sink)
        toggle_on(Faucet) toggle_off(Faucet) pick_up(Pot) navigate_to_obj(HousePlant)
        pour(Pot,HousePlant)
    """,
}


def _plan(task: str) -> Plan:
    return Plan.parse(PLANS[task].split())


def _run(env: Environment, plan: Plan, seed: int) -> list[tuple[str, str]]:
    """Every (step, reason) that did not succeed."""
    env.reset(seed)
    refused = []
    for subtask in plan:
        outcome = env.execute(subtask)
        if outcome.status is not SkillStatus.SUCCEEDED:
            refused.append((str(subtask), outcome.reason))
    return refused


@pytest.mark.parametrize("task", sorted(PLANS))
def test_a_nominal_plan_runs_and_reaches_its_goal(task: str) -> None:
    loaded = load_task(task).task
    env = flat_environment(loaded.scene, DOMAIN)
    for seed in range(8):
        assert _run(env, _plan(task), seed) == []
        assert TruthGoalChecker(DOMAIN).check(loaded.goal, env.oracle) == (True, True, ())


EXPECTED = {
    "bowl-filled-with-wine": [],
    "burner-occupied": [
        ("put_on(Pot, StoveBurner-4)", "StoveBurner-4 is full: Pan-1 is in the way")
    ],
    "coffee-machine-occupied": [
        ("put_in(Mug, CoffeeMachine)", "CoffeeMachine-1 is full: Cup-1 is in the way"),
        ("pick_up(Mug)", "the gripper is not empty: it holds Mug-1"),
    ],
    "knife-blocked": [
        ("pick_up(Knife)", "Knife-1 cannot be grasped: Pot-1 stands in front of it"),
        ("slice_obj(Bread)", "Bread-1 cannot be sliced without a knife: the gripper is empty"),
        ("put_on(Knife, CounterTop)", "Knife-1 is not in the gripper"),
        ("pick_up(BreadSliced)", "there is no bread slice here"),
        ("put_in(BreadSliced, Toaster)", "there is no bread slice here"),
    ],
    "microwave-left-closed": [("put_in(Plate, Microwave)", "Microwave-1 is closed")],
    "microwave-occupied": [
        ("put_in(Plate, Microwave)", "Microwave-1 is full: Bowl-1 is in the way")
    ],
    "mug-dropped": [("put_in(Mug, CoffeeMachine)", "Mug-1 is not in the gripper")],
    "pan-dirty": [],
    "plate-dirty": [],
    "potato-in-pan": [],
}


@pytest.mark.parametrize("name", sorted(EXPECTED))
def test_a_scenario_makes_its_task_fail_at_the_step_concerned(name: str) -> None:
    scenario = load_scenario(name)
    task = load_task(scenario.task).task
    needs = apply_scene_faults(task.scene, scenario.faults, DOMAIN)
    inner = flat_environment(needs, DOMAIN)
    env = wrap(inner, scenario.faults, inner, DOMAIN)
    plan = apply_plan_faults(_plan(task.name), scenario.faults, DOMAIN)
    assert _run(env, plan, 2) == EXPECTED[name]
    strict, _, failures = TruthGoalChecker(DOMAIN).check(task.goal, inner.oracle)
    assert not strict
    assert failures


def test_every_shipped_scenario_is_covered() -> None:
    assert set(EXPECTED) <= set(scenario_names())


CORRECTED = {
    "microwave-occupied": """
        open_obj(Microwave) pick_up(Bowl) put_on(Bowl,CounterTop)
        pick_up(Potato) put_on(Potato,Plate) pick_up(Plate) put_in(Plate,Microwave)
        close_obj(Microwave) toggle_on(Microwave)
    """,
    "plate-dirty": """
        pick_up(Plate) put_in(Plate,Sink) toggle_on(Faucet) toggle_off(Faucet) pick_up(Plate)
        put_on(Plate,CounterTop) pick_up(Potato) put_on(Potato,Plate) open_obj(Microwave)
        pick_up(Plate) put_in(Plate,Microwave) close_obj(Microwave) toggle_on(Microwave)
    """,
    "bowl-filled-with-wine": "pick_up(Bowl) pour(Bowl,Sink) put_on(Bowl,CounterTop) "
    + PLANS["make-salad"],
    "potato-in-pan": "pick_up(Potato) put_on(Potato,CounterTop) " + PLANS["cook-egg"],
    "pan-dirty": """
        pick_up(Pan) put_in(Pan,Sink) toggle_on(Faucet) toggle_off(Faucet) pick_up(Pan)
        put_on(Pan,StoveBurner-1) open_obj(Fridge) pick_up(Egg) navigate_to_obj(Pan)
        crack_obj(Egg) toggle_on(StoveBurner-1)
    """,
    "knife-blocked": "pick_up(Pot) put_on(Pot,DiningTable) " + PLANS["toast-bread"],
    "coffee-machine-occupied": "pick_up(Cup) put_on(Cup,DiningTable) " + PLANS["make-coffee"],
    "burner-occupied": "pick_up(Pan) put_on(Pan,CounterTop) " + PLANS["boil-water"],
}


@pytest.mark.parametrize("name", sorted(CORRECTED))
def test_a_scenario_can_be_overcome(name: str) -> None:
    scenario = load_scenario(name)
    task = load_task(scenario.task).task
    env = flat_environment(apply_scene_faults(task.scene, scenario.faults, DOMAIN), DOMAIN)
    assert _run(env, Plan.parse(CORRECTED[name].split()), 2) == []
    assert TruthGoalChecker(DOMAIN).check(task.goal, env.oracle)[0]


def test_a_dropped_mug_is_picked_up_again_and_the_plan_goes_on() -> None:
    scenario = load_scenario("mug-dropped")
    task = load_task(scenario.task).task
    inner = flat_environment(task.scene, DOMAIN)
    env = wrap(inner, scenario.faults, inner, DOMAIN)
    plan = _plan(task.name)
    env.reset(1)
    for subtask in plan.subtasks[:9]:
        env.execute(subtask)
    assert not inner.oracle.truth().in_hands(("gripper",))
    env.execute(Subtask.parse("pick_up(Mug)"))
    for subtask in plan.subtasks[8:]:
        assert env.execute(subtask).status is SkillStatus.SUCCEEDED
    assert TruthGoalChecker(DOMAIN).check(task.goal, inner.oracle)[0]


@pytest.mark.parametrize("task", sorted(PLANS))
def test_a_nominal_plan_reaches_its_goal_in_the_real_kitchen(task: str) -> None:
    loaded = load_task(task).task
    env = KitchenEnvironment(loaded.scene, DOMAIN)
    for seed in (101, 102):
        assert _run(env, _plan(task), seed) == []
        assert TruthGoalChecker(DOMAIN).check(loaded.goal, env.oracle) == (True, True, ())


@pytest.mark.parametrize("name", sorted(EXPECTED))
def test_a_scenario_makes_its_task_fail_in_the_real_kitchen(name: str) -> None:
    scenario = load_scenario(name)
    task = load_task(scenario.task).task
    needs = apply_scene_faults(task.scene, scenario.faults, DOMAIN)
    inner = KitchenEnvironment(needs, DOMAIN)
    env = wrap(inner, scenario.faults, inner, DOMAIN)
    plan = apply_plan_faults(_plan(task.name), scenario.faults, DOMAIN)
    assert _run(env, plan, 103)[:1] == EXPECTED[name][:1]
    assert not TruthGoalChecker(DOMAIN).check(task.goal, inner.oracle)[0]
