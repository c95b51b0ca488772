"""The set of failures that cannot be undone: each does its harm at the step that it names.

Every scenario runs on the flat world. "Afterwards" a person washes up and the planner tries again
from what is left: the strict check must not be met by that.
"""

from __future__ import annotations

from dataclasses import dataclass

import pytest

from forestall.planning.planner import Planned, plan_goal
from forestall.planning.search import SearchConfig
from forestall.planning.validate import observed
from forestall.seams import Environment
from forestall.tasks.faults import (
    apply_plan_faults,
    apply_scene_faults,
    check_steps,
    wrap,
)
from forestall.tasks.files import (
    LoadedTask,
    Scenario,
    load_scenario,
    load_task,
    scenario_names,
    task_names,
)
from forestall.tasks.goals import TruthGoalChecker, irreversible
from forestall.types.plan import Plan, Subtask
from forestall.types.verdict import ReplanOutcome
from forestall.worlds.kitchen.environment import KitchenEnvironment
from forestall.worlds.kitchen.flat_world import flat_environment

pytestmark = pytest.mark.slow

NAMES = scenario_names("irreversible")
SEEDS = (1, 2)
QUICK = SearchConfig(time_limit_s=30.0, max_expansions=1500)


@dataclass
class Run:
    """A scenario on the flat world, with the skills' faults between plan and kitchen."""

    scenario: Scenario
    loaded: LoadedTask
    plan: Plan
    kitchen: KitchenEnvironment
    faulty: Environment

    def execute(self, *steps: str | Subtask) -> None:
        for step in steps:
            self.faulty.execute(Subtask.parse(step) if isinstance(step, str) else step)

    def harmed(self) -> tuple[tuple[float, str], ...]:
        return irreversible(self.loaded.task.goal, self.kitchen.oracle, self.loaded.domain)

    def checked(self) -> tuple[bool, bool | None, tuple[str, ...]]:
        return TruthGoalChecker(self.loaded.domain).check(
            self.loaded.task.goal, self.kitchen.oracle
        )

    def planned(self) -> Planned:
        truth = observed(self.kitchen.oracle.truth(), self.loaded.domain)
        return plan_goal(truth, self.loaded.task.goal, QUICK)


def started(name: str, seed: int) -> Run:
    scenario = load_scenario(name)
    loaded = load_task(scenario.task)
    needs = apply_scene_faults(loaded.task.scene, scenario.faults, loaded.domain)
    plan = apply_plan_faults(loaded.task.plan, scenario.faults, loaded.domain)
    check_steps(plan, scenario.faults, loaded.domain)
    kitchen = flat_environment(needs, loaded.domain)
    faulty = wrap(kitchen, scenario.faults, kitchen, loaded.domain)
    faulty.reset(seed)
    return Run(scenario, loaded, plan, kitchen, faulty)


def moments(name: str) -> tuple[int, int]:
    scenario = load_scenario(name)
    loaded = load_task(scenario.task)
    plan = apply_plan_faults(loaded.task.plan, scenario.faults, loaded.domain)
    known, effect = scenario.moments(plan)
    assert known is not None and effect is not None
    return known, effect


def wash_up(run: Run) -> None:
    """Empty and wash every vessel that is dirty or full."""
    home = run.kitchen.oracle.truth()
    run.execute("toggle_off(Microwave)", "open_obj(Microwave)", "open_obj(Fridge)")
    for node in home.nodes:
        used = node.state("dirty") == "dirty" or node.state("filled") not in (None, "empty")
        if used and run.loaded.domain.is_a(node.id, "pickupable"):
            for held in run.kitchen.oracle.truth().in_hands(("gripper",)):
                run.execute(f"put_on({held}, CounterTop)")
            run.execute(
                f"pick_up({node.id})",
                f"pour({node.id}, Sink)",
                f"put_in({node.id}, Sink)",
                "toggle_on(Faucet)",
                "toggle_off(Faucet)",
                f"pick_up({node.id})",
                f"pour({node.id}, Sink)",
                f"put_on({node.id}, CounterTop)",
            )


def test_the_set_is_large_and_has_every_task_with_irreversible_outcomes() -> None:
    assert len(NAMES) >= 50
    concerned = {t for t in task_names() if load_task(t).task.goal.never}
    assert {load_scenario(n).task for n in NAMES} == concerned
    assert concerned == set(task_names()) - {"switch-devices"}


def test_most_can_be_known_before_the_harm_is_done() -> None:
    in_time = [n for n in NAMES if (m := moments(n))[0] <= m[1]]
    assert len(in_time) >= 0.8 * len(NAMES)


@pytest.mark.parametrize("name", NAMES)
def test_names_say_task_and_number(name: str) -> None:
    scenario = load_scenario(name)
    number = [n for n in NAMES if load_scenario(n).task == scenario.task].index(name) + 1
    assert name.startswith(f"irreversible-{scenario.task}-{number}-")


@pytest.mark.parametrize("seed", SEEDS)
@pytest.mark.parametrize("name", NAMES)
def test_harm_is_done_at_the_step_that_is_named_and_stays(name: str, seed: int) -> None:
    run = started(name, seed)
    _, effect = moments(name)
    for step in run.plan.subtasks[:effect]:
        run.execute(step)
    assert run.harmed() == ()
    before_s = run.kitchen.time_s
    run.execute(run.plan.subtasks[effect])
    assert run.harmed() and run.harmed()[0][0] >= before_s
    run.execute(*run.plan.subtasks[effect + 1 :])
    strict, _, failures = run.checked()
    assert not strict, failures

    wash_up(run)
    again = run.planned()
    run.execute(*again.subtasks)
    strict, _, failures = run.checked()
    assert not strict and run.harmed()
    if again.outcome is ReplanOutcome.SOLVED:
        assert all("must never be" in f for f in failures)


@pytest.mark.parametrize("name", [n for n in NAMES if (m := moments(n))[0] <= m[1]])
def test_a_corrected_plan_exists_when_the_failure_can_be_known(name: str) -> None:
    run = started(name, SEEDS[0])
    known, _ = moments(name)
    run.execute(*run.plan.subtasks[:known])
    corrected = run.planned()
    assert corrected.outcome is ReplanOutcome.SOLVED, corrected.note
    run.execute(*corrected.subtasks)
    strict, _, failures = run.checked()
    assert strict, failures
    assert run.harmed() == ()
