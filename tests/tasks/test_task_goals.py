"""What a person would call success or failure, and what the shipped goals say.

Each case is a run on the flat world: the nominal plan with changes, and the verdict of a person.
"""

from collections.abc import Callable
from dataclasses import replace

import pytest

from forestall.tasks.files import load_task, task_names
from forestall.tasks.goals import TruthGoalChecker
from forestall.types.plan import Subtask
from forestall.types.scene import ObjectNeed
from forestall.worlds.kitchen.flat_world import flat_environment

Steps = list[str]
Change = Callable[[Steps], Steps]


def before(step: str, *more: str) -> Change:
    def change(steps: Steps) -> Steps:
        at = steps.index(step)
        return [*steps[:at], *more, *steps[at:]]

    return change


def after(*more: str) -> Change:
    return lambda steps: [*steps, *more]


def without(*gone: str) -> Change:
    return lambda steps: [s for s in steps if s not in gone]


def need(name: str, *places: str, **states: str) -> ObjectNeed:
    return ObjectNeed(name, name.partition("-")[0], places, tuple(states.items()))


CASES: dict[str, tuple[str, tuple[ObjectNeed, ...], Change, bool]] = {
    "toast, then the toaster is turned off": (
        "toast-bread", (), after("toggle_off(Toaster)"), True),
    "toast, then served": (
        "toast-bread", (),
        after("toggle_off(Toaster)", "pick_up(BreadSliced)", "put_on(BreadSliced, CounterTop)"),
        True),
    "toast, and a tomato was sliced as well": (
        "toast-bread", (need("Tomato-1", "CounterTop"),),
        before("slice_obj(Bread)", "slice_obj(Tomato)"), False),
    "bread is never toasted": ("toast-bread", (), without("toggle_on(Toaster)"), False),
    "egg, then a tomato into the same pan": (
        "cook-egg", (need("Tomato-1", "CounterTop"),),
        after("pick_up(Tomato)", "put_in(Tomato, Pan)"), False),
    "egg, then the burner is turned off": (
        "cook-egg", (), after("toggle_off(StoveBurner-1)"), True),
    "coffee with an egg in the mug": (
        "make-coffee", (need("Egg-1", "Mug"),), after(), False),
    "coffee in a dirty mug that is not washed": (
        "make-coffee", (need("Cup-1", "CounterTop"),),
        without("toggle_on(Faucet)"), True),
    "warm water with an egg in the mug": (
        "warm-water", (need("Egg-1", "Mug"),), after(), False),
    "salad with apple slices": (
        "make-salad", (need("Apple-1", "CounterTop"),),
        before("put_on(Knife, CounterTop)", "slice_obj(Apple)"), False),
    "salad in an open fridge": ("make-salad", (), lambda s: s[:-1], False),
    "egg stored, fridge left open": ("store-egg", (), lambda s: s[:-1], False),
    "television on, laptop open": ("switch-devices", (), without("close_obj(Laptop)"), False),
    "plant without water": (
        "water-plant", (), without("toggle_on(Faucet)"), False),
    "water on a burner that is turned off again": (
        "boil-water", (), after("toggle_off(StoveBurner-4)"), False),
    "boiling water with a potato in the pot": (
        "boil-water", (need("Potato-1", "Pot"),), after(), False),
    "potato, and the microwave is turned off": (
        "heat-potato", (), after("toggle_off(Microwave)"), True),
    "raw potato": ("heat-potato", (), without("toggle_on(Microwave)"), False),
}  # fmt: skip


def finished(task: str, more: tuple[ObjectNeed, ...], change: Change) -> tuple[bool, object]:
    loaded = load_task(task)
    needs = replace(loaded.task.scene, objects=(*loaded.task.scene.objects, *more))
    kitchen = flat_environment(needs, loaded.domain)
    kitchen.reset(1)
    for step in change(loaded.task.plan.texts()):
        kitchen.execute(Subtask.parse(step))
    strict, _, why = TruthGoalChecker(loaded.domain).check(loaded.task.goal, kitchen.oracle)
    return strict, why


@pytest.mark.parametrize("name", sorted(CASES))
def test_the_strict_check_agrees_with_a_person(name: str) -> None:
    task, more, change, person = CASES[name]
    strict, why = finished(task, more, change)
    assert strict is person, why


@pytest.mark.parametrize("task", task_names())
def test_nominal_plans_reach_their_goals(task: str) -> None:
    strict, why = finished(task, (), after())
    assert strict, why


@pytest.mark.parametrize(
    ("task", "broken"),
    [("store-egg", "Egg"), ("heat-potato", "Plate"), ("make-coffee", "Mug")],
)
def test_what_broke_on_the_way_is_not_forgotten(task: str, broken: str) -> None:
    loaded = load_task(task)
    twice = replace(
        loaded.task.scene,
        objects=(*loaded.task.scene.objects, ObjectNeed(f"{broken}-2", broken, ("CounterTop",))),
    )
    kitchen = flat_environment(twice, loaded.domain)
    kitchen.reset(1)
    kitchen.execute(Subtask.parse(f"pick_up({broken}-2)"))
    assert kitchen.drop_held(hard=True) == f"{broken}-2"
    for subtask in loaded.task.plan:
        kitchen.execute(subtask)
    strict, _, why = TruthGoalChecker(loaded.domain).check(loaded.task.goal, kitchen.oracle)
    assert not strict and any("never" in w for w in why)
