"""The trace of the truth: right on faultless runs, and the first to know of a failure."""

from __future__ import annotations

import pytest

from forestall.assembly.configuration import run_config
from forestall.assembly.make import make_strategy
from forestall.runtime import Runtime
from forestall.tasks.faults import apply_plan_faults, apply_scene_faults, wrap
from forestall.tasks.files import load_scenario, load_task, task_names
from forestall.tasks.truth import TrueMoment, TruthTrace
from forestall.worlds.kitchen.flat_world import flat_environment
from test_runtime import TruthPerceiver


def traced(task: str, scenario: str | None, seed: int = 4) -> list[TrueMoment]:
    loaded = load_task(task)
    faults = () if scenario is None else load_scenario(scenario).faults
    kitchen = flat_environment(
        apply_scene_faults(loaded.task.scene, faults, loaded.domain), loaded.domain
    )
    trace = TruthTrace()
    trace.attach(kitchen.oracle, loaded.domain)
    Runtime(
        wrap(kitchen, faults, kitchen, loaded.domain),
        TruthPerceiver(kitchen, loaded.domain),
        make_strategy(run_config(task, strategy="none"), loaded.domain, None),
        loaded.domain,
        [trace],
    ).run(loaded.task, apply_plan_faults(loaded.task.plan, faults, loaded.domain), seed)
    return trace.moments


@pytest.mark.parametrize("task", task_names())
def test_on_a_faultless_run_all_is_well_at_every_boundary(task: str) -> None:
    moments = traced(task, None)
    assert len(moments) == len(load_task(task).task.plan)
    assert set(moments) == {TrueMoment(possible=True, reachable=True)}


def test_a_full_microwave_stops_the_plan_from_the_start_and_the_step_when_it_comes() -> None:
    moments = traced("heat-potato", "microwave-occupied")
    assert not any(m.reachable for m in moments)
    assert [m.possible for m in moments][:9] == [True] * 8 + [False]


def test_a_loss_on_the_way_is_true_only_after_it() -> None:
    moments = traced("make-coffee", "mug-dropped")
    assert [m.reachable for m in moments][:10] == [True] * 9 + [False]
