"""The drawn sets as they come with the project: complete, well formed, and as they say they are."""

from __future__ import annotations

from collections import Counter

import pytest

from forestall.domain.load import shipped
from forestall.statistics.cases import CASE_SETS, FURTHER_SETS, ROUNDS, Case, cases
from forestall.tasks.faults import apply_plan_faults, apply_scene_faults, check_steps
from forestall.tasks.files import (
    HARMLESS_SETS,
    load_scenario,
    load_task,
    long_task_names,
    scenario_names,
    task_names,
)
from forestall.tasks.judging import play
from forestall.tasks.plan_errors import RATES
from forestall.worlds.kitchen.part import Kitchens

DOMAIN = shipped("household")
DRAWN = (
    "everyday",
    "composed",
    "midrun",
    "double",
    "planner",
    "planner-harmless",
    "long",
    "hidden",
)
NAMES = [n for of in DRAWN for n in scenario_names(of)]
SAMPLE = NAMES[::19]
KITCHENS = Kitchens()


def test_the_sets_have_their_sizes_over_all_tasks() -> None:
    sizes = {of: len(scenario_names(of)) for of in DRAWN}
    assert sizes["everyday"] >= 200
    assert sizes["composed"] >= 100 and sizes["planner"] >= 100
    assert sizes["midrun"] >= 60 and sizes["double"] >= 40 and sizes["long"] >= 30
    assert sizes["hidden"] == 42
    for of in ("everyday", "composed", "midrun", "double", "planner", "hidden"):
        found = Counter(load_scenario(n).task for n in scenario_names(of))
        assert found.keys() == set(task_names())
    long = Counter(load_scenario(n).task for n in scenario_names("long"))
    assert long.keys() == set(long_task_names())


def test_half_of_the_everyday_starts_are_in_what_is_compared() -> None:
    everyday = [load_scenario(n) for n in scenario_names("everyday")]
    assert sum(s.compared is True for s in everyday) >= len(everyday) / 2
    assert len({s.kind for s in everyday}) >= 12


@pytest.mark.parametrize("name", NAMES)
def test_a_start_fits_its_task_and_says_when_it_can_be_known(name: str) -> None:
    scenario = load_scenario(name)
    loaded = load_task(scenario.task)
    apply_scene_faults(loaded.task.scene, scenario.faults, loaded.domain)
    plan = apply_plan_faults(loaded.task.plan, scenario.faults, loaded.domain)
    check_steps(plan, scenario.faults, loaded.domain)
    known, effect = scenario.moments(plan)
    assert scenario.harmless == (scenario.set in HARMLESS_SETS)
    assert (known is None) == (effect is None) == scenario.harmless
    if known is not None and effect is not None:
        assert known <= effect
    if scenario.set.startswith("planner"):
        assert scenario.kind in RATES


@pytest.mark.simulator
@pytest.mark.parametrize("name", SAMPLE)
def test_a_start_ends_in_the_real_kitchen_as_its_set_says(name: str) -> None:
    scenario = load_scenario(name)
    of_task = [n for n in scenario_names(scenario.set) if load_scenario(n).task == scenario.task]
    seed = 10_000 + of_task.index(name) % 10
    played = play(KITCHENS, load_task(scenario.task), scenario, seed)
    assert not played.problem
    assert played.success == scenario.harmless


def test_long_tasks_are_longer_than_25_steps_and_run_in_every_room() -> None:
    assert len(long_task_names()) == 3
    for name in long_task_names():
        loaded = load_task(name)
        assert len(loaded.task.plan) > 25
        assert play(KITCHENS, loaded, None, 10_000).success


def test_cases_of_the_further_sets_have_rooms_of_their_own_in_the_test_split() -> None:
    for of in FURTHER_SETS:
        found = cases(of, "test", ROUNDS)
        assert min(c.seed for c in found) == 40_000
        rooms = Counter(c.scenario or c.task for c in found)
        assert set(rooms.values()) <= {ROUNDS, ROUNDS * 10}
        assert all(c.failing == (c.scenario is not None and of not in HARMLESS_SETS) for c in found)
    assert {c.seed // 10_000 for of in CASE_SETS for c in cases(of, "test")} == {2}
    long = cases("long", "development")[0]
    assert long.twin == Case("long-undisturbed", long.task, None, long.seed)
    assert long.twin in cases("long-undisturbed", "development")
