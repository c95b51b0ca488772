"""The hundred harmless scenarios: complete, and harmless in the real kitchen."""

from __future__ import annotations

from collections import Counter

import pytest

from forestall.domain.load import shipped
from forestall.tasks.faults import apply_plan_faults, apply_scene_faults
from forestall.tasks.files import load_scenario, load_task, scenario_names, task_names
from forestall.tasks.goals import TruthGoalChecker
from forestall.types.episode import SkillStatus
from forestall.worlds.kitchen.environment import KitchenEnvironment

pytestmark = pytest.mark.simulator

NAMES = scenario_names("harmless")
KINDS = {
    *("clutter", "layout", "furniture", "colours", "light", "viewpoint"),
    *("same_kind", "irrelevant_state"),
}
SAMPLE = [name for k, name in enumerate(NAMES) if (k + k // 10) % 3 == 0]
"""Every kind of several tasks, and every task several times."""


def test_every_task_has_ten_of_every_kind() -> None:
    scenarios = [load_scenario(n) for n in NAMES]
    assert Counter(s.task for s in scenarios) == dict.fromkeys(task_names(), 10)
    for task in task_names():
        mine = [s for s in scenarios if s.task == task]
        assert {s.kind for s in mine} == KINDS
        assert all(s.name.startswith(f"harmless-{task}-") for s in mine)
    assert all(s.harmless and s.known is None and s.effect is None for s in scenarios)
    assert {load_scenario(n).task for n in SAMPLE} == set(task_names())
    assert {load_scenario(n).kind for n in SAMPLE} == KINDS


def test_they_change_the_scene_and_leave_task_and_plan_alone() -> None:
    for name in NAMES:
        scenario = load_scenario(name)
        task = load_task(scenario.task).task
        needs = apply_scene_faults(task.scene, scenario.faults, shipped("household"))
        assert needs.undisturbed == task.scene
        assert needs != task.scene
        assert needs.objects[: len(task.scene.objects)] == task.scene.objects
        assert apply_plan_faults(task.plan, scenario.faults, shipped("household")) == task.plan


@pytest.mark.parametrize("name", SAMPLE)
def test_the_plan_succeeds_in_the_real_kitchen(name: str) -> None:
    scenario = load_scenario(name)
    task = load_task(scenario.task).task
    needs = apply_scene_faults(task.scene, scenario.faults, shipped("household"))
    env = KitchenEnvironment(needs, shipped("household"))
    env.reset(10_000 + NAMES.index(name) % 10)
    for subtask in task.plan:
        outcome = env.execute(subtask)
        assert outcome.status is SkillStatus.SUCCEEDED, (str(subtask), outcome.reason)
    assert TruthGoalChecker(shipped("household")).check(task.goal, env.oracle)[0]
