"""Demonstrations like people's: seeded, different, and each reaches its goal strictly."""

from __future__ import annotations

from dataclasses import replace

import pytest

from forestall.errors import InputError
from forestall.tasks.faults import FailedAction
from forestall.tasks.files import LoadedTask, Scenario, load_task, task_names
from forestall.tasks.judging import play
from forestall.tasks.variation import (
    CHANCES,
    Variation,
    fixtures_of,
    room_fixtures,
    variations,
    vary,
)
from forestall.testing.part import SymbolicWorlds
from forestall.types.plan import Plan

TASKS = (*task_names(None),)
ROOM = ("DiningTable", "Fridge", "CoffeeMachine")


def _reaches(name: str, one: Variation, seed: int) -> bool:
    """Whether a variant, slips and all, runs without a refusal to strict success."""
    loaded = load_task(name)
    task = replace(loaded.task, plan=one.plan, scene=one.scene)
    slips = Scenario("slips", name, "", "", "", one.slips)
    played = play(SymbolicWorlds(), LoadedTask(task, loaded.domain), slips, seed)
    return played.success and not played.refused


@pytest.mark.parametrize("name", TASKS)
def test_every_variant_reaches_the_goal_strictly(name: str) -> None:
    loaded = load_task(name)
    for seed in range(4):
        one = vary(loaded.task, loaded.domain, seed)
        assert _reaches(name, one, seed=500 + seed), one.varied
        assert bool(one.varied) == (one.plan != loaded.task.plan)


@pytest.mark.parametrize("sort", CHANCES)
def test_every_sort_of_difference_is_found(sort: str) -> None:
    name = "heat-potato" if sort == "place" else "water-plant"
    loaded = load_task(name)
    one = vary(loaded.task, loaded.domain, 1, only=[sort], fixtures=ROOM)
    assert [v.split(":")[0] for v in one.varied] == [sort]
    assert one.plan != loaded.task.plan
    assert bool(one.slips) == (sort == "slip")
    assert (one.scene != loaded.task.scene) == (sort == "substitute")
    assert _reaches(name, one, seed=7)


def test_a_slip_is_mended_by_doing_the_step_again() -> None:
    loaded = load_task("boil-water")
    one = vary(loaded.task, loaded.domain, 0, only=["slip"])
    steps = one.plan.subtasks
    again = [k for k in range(1, len(steps)) if steps[k] == steps[k - 1]]
    assert len(again) == 1 == len(one.slips)
    assert isinstance(one.slips[0], FailedAction)
    assert one.slips[0].step == str(steps[again[0]])
    mended = Plan((*steps[: again[0]], *steps[again[0] + 1 :]), one.plan.goal)
    assert mended == loaded.task.plan


def test_the_same_seed_gives_the_same_and_another_seed_another() -> None:
    loaded = load_task("heat-potato")
    first = variations(loaded.task, loaded.domain, 8)
    assert first == variations(loaded.task, loaded.domain, 8)
    assert first[0] == Variation(loaded.task.plan, loaded.task.scene)
    assert len({v.plan for v in first}) == 8
    assert variations(loaded.task, loaded.domain, 8, seed=100)[1:] != first[1:]


def test_only_what_the_room_has_is_used() -> None:
    loaded = load_task("heat-potato")
    own = fixtures_of(loaded.task, loaded.domain)
    assert own == {"CounterTop", "DiningTable", "Microwave"}
    for seed in range(8):
        one = vary(loaded.task, loaded.domain, seed, only=["place", "detour"])
        named = {a.rpartition("-")[0] or a for s in one.plan for a in s.args}
        assert named <= own | {"Potato", "Plate"}


def test_a_room_is_known_by_what_its_tasks_name() -> None:
    kitchen = room_fixtures(load_task("heat-potato"))
    assert {"Fridge", "Toaster", "Sink", "StoveBurner"} <= kitchen
    assert "Television" not in kitchen
    assert "Television" in room_fixtures(load_task("switch-devices"))


@pytest.mark.parametrize("count", [0, 33])
def test_one_to_thirty_two_are_possible(count: int) -> None:
    loaded = load_task("boil-water")
    with pytest.raises(InputError, match=f"{count} variants of a plan: 1 to 32"):
        variations(loaded.task, loaded.domain, count)
