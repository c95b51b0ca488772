"""The whole loop on a world without geometry: the true rules, perception replaced by the truth.

What the real pictures add is tested in test_end_to_end.py; here every decision of the loop is
checked in milliseconds.
"""

from collections.abc import Mapping
from dataclasses import replace
from functools import cache

import pytest

from forestall.benchmark.faults import apply_plan_faults, apply_scene_faults, wrap
from forestall.benchmark.files import load_scenario, load_task, scenario_names, task_names
from forestall.benchmark.goals import TruthGoalChecker
from forestall.build import RunConfig, make_strategy
from forestall.envs.kitchen.environment import KitchenEnvironment
from forestall.envs.kitchen.flat_world import flat_environment
from forestall.errors import PerceptionError
from forestall.memory.recording import demonstration_from
from forestall.perception.config import ScopeConfig
from forestall.perception.scope import scope
from forestall.runtime import Runtime, RuntimeConfig
from forestall.types.demonstration import Demonstration
from forestall.types.episode import EpisodeEnd, EpisodeRecord, SkillStatus
from forestall.types.graph import SceneGraph, Seen
from forestall.types.observation import Observation
from forestall.types.plan import Subtask
from forestall.types.verdict import Decision, ReplanOutcome
from forestall.vocabulary import Vocabulary

ON_FLAT_WORLDS = sorted(set(scenario_names("examples")) - {"knife-blocked"})
"""A flat world knows no place in front of another, so nothing can be moved out of the way there."""


class TruthPerceiver:
    """Perception that is always right."""

    def __init__(self, kitchen: KitchenEnvironment, vocabulary: Vocabulary) -> None:
        self._kitchen = kitchen
        self._vocabulary = vocabulary

    def reset(self) -> None:
        pass

    def perceive(self, observation: Observation) -> SceneGraph:
        return self._kitchen.oracle.truth()

    def scope(self, graph: SceneGraph, subtask: Subtask) -> SceneGraph:
        return scope(graph, subtask, self._vocabulary, ScopeConfig())

    def describe(self) -> Mapping[str, str]:
        return {"segmenter": "truth", "state_estimator": "truth"}


def play(
    config: RunConfig,
    demonstrations: list[Demonstration] | None = None,
    limits: RuntimeConfig | None = None,
    perceiver: type[TruthPerceiver] = TruthPerceiver,
) -> EpisodeRecord:
    loaded = load_task(config.task)
    faults = () if config.scenario is None else load_scenario(config.scenario).faults
    needs = apply_scene_faults(loaded.task.scene, faults, loaded.vocabulary)
    kitchen = flat_environment(needs, loaded.vocabulary)

    def score(record: EpisodeRecord) -> EpisodeRecord:
        strict, weak, why = TruthGoalChecker().check(record.task.goal, kitchen.oracle)
        return replace(record, success=strict, weak_success=weak, failures=why)

    runtime = Runtime(
        wrap(kitchen, faults, kitchen, loaded.vocabulary),
        perceiver(kitchen, loaded.vocabulary),
        make_strategy(config, loaded.vocabulary, demonstrations),
        loaded.vocabulary,
        config=limits,
    )
    plan = apply_plan_faults(loaded.task.plan, faults)
    return runtime.run(loaded.task, plan, config.seed, config.scenario, score)


@cache
def memory() -> list[Demonstration]:
    """Four demonstrations of each task."""
    found = []
    for task in task_names():
        for seed in range(1000, 1004):
            record = play(RunConfig(task, strategy="none", seed=seed))
            demonstration = demonstration_from(record, "test")
            assert demonstration is not None, (task, seed, record.failures)
            found.append(replace(demonstration, id=f"{task}-{seed}"))
    return found


@pytest.mark.parametrize("task", task_names())
def test_undisturbed_runs_succeed_with_and_without_monitor(task: str) -> None:
    plain = play(RunConfig(task, strategy="none", seed=5))
    watched = play(RunConfig(task, seed=5), memory())
    assert plain.success and watched.success
    assert plain.end is EpisodeEnd.PLAN_FINISHED
    assert [e.subtask.skill for e in plain.executed] == [s.skill for s in plain.task.plan]
    assert [
        str(b.subtask)
        for b in watched.boundaries
        if b.verdict is None or b.verdict.decision is not Decision.PROCEED
    ] == []


@pytest.mark.parametrize("scenario", ON_FLAT_WORLDS)
def test_scenarios_fail_unwatched_and_succeed_watched(scenario: str) -> None:
    task = load_scenario(scenario).task
    assert play(RunConfig(task, scenario, "none", seed=3)).success is False
    watched = play(RunConfig(task, scenario, seed=3), memory())
    assert watched.success, watched.failures
    assert any(b.replan is not None and b.replan.plan is not None for b in watched.boundaries)


def test_the_alarm_comes_before_the_subtask_and_names_the_cause() -> None:
    record = play(RunConfig("heat-potato", "microwave-occupied", seed=3), memory())
    alarms = [
        b
        for b in record.boundaries
        if b.verdict is not None and b.verdict.decision is Decision.REPLAN and b.diagnosis
    ]
    first = alarms[0]
    assert first.diagnosis is not None
    assert "Bowl-1" in first.diagnosis.cause
    assert "Bowl-1" in first.diagnosis.culprits
    placed = next(e for e in record.executed if str(e.subtask) == "put_in(Plate-1, Microwave-1)")
    assert first.index < placed.index
    assert placed.outcome.status is SkillStatus.SUCCEEDED
    assert "pick_up(Bowl-1)" in [str(e.subtask) for e in record.executed]


def test_a_run_is_the_same_twice() -> None:
    one, two = (play(RunConfig("cook-egg", "pan-dirty", seed=3), memory()) for _ in range(2))
    assert [str(e.subtask) for e in one.executed] == [str(e.subtask) for e in two.executed]
    assert [b.graph for b in one.boundaries] == [b.graph for b in two.boundaries]


def test_limits_end_an_episode() -> None:
    short = play(RunConfig("make-salad", strategy="none"), limits=RuntimeConfig(max_subtasks=3))
    assert short.end is EpisodeEnd.SUBTASK_LIMIT
    assert len(short.executed) == 3
    never = play(
        RunConfig("heat-potato", "microwave-left-closed", seed=3),
        memory(),
        RuntimeConfig(max_replans=0),
    )
    assert never.success is False
    assert never.end is EpisodeEnd.REPLAN_LIMIT


def test_an_error_in_the_middle_is_recorded() -> None:
    class Broken(TruthPerceiver):
        calls = 0

        def perceive(self, observation: Observation) -> SceneGraph:
            self.calls += 1
            if self.calls > 3:
                raise PerceptionError("the camera is gone")
            return super().perceive(observation)

    loaded = load_task("make-coffee")
    kitchen = flat_environment(loaded.task.scene, loaded.vocabulary)
    config = RunConfig("make-coffee", strategy="none")
    strategy = make_strategy(config, loaded.vocabulary, None)
    runtime = Runtime(kitchen, Broken(kitchen, loaded.vocabulary), strategy, loaded.vocabulary)
    record = runtime.run(loaded.task, loaded.task.plan, 0)
    assert record.end is EpisodeEnd.ERROR
    assert record.failures == ("the run broke off: the camera is gone",)
    assert len(record.executed) == len(record.boundaries) == 2


class Forgetful(TruthPerceiver):
    """Loses sight of a mug that lies on the floor."""

    def perceive(self, observation: Observation) -> SceneGraph:
        graph = super().perceive(observation)
        if "Floor-1" not in graph.parents("Mug-1"):
            return graph
        return SceneGraph(
            tuple(
                replace(n, centroid_m=None, box_m=None, seen=Seen.UNOBSERVED)
                if n.id == "Mug-1"
                else n
                for n in graph.nodes
            ),
            tuple(r for r in graph.relations if "Mug-1" not in (r.subject, r.object)),
        )


def test_a_lost_thing_is_looked_for_and_then_the_run_stops_safely() -> None:
    record = play(RunConfig("make-coffee", "mug-dropped", seed=3), memory(), perceiver=Forgetful)
    assert record.end is EpisodeEnd.STOPPED
    assert record.success is False
    first, second = record.boundaries[-2:]
    assert (first.looks, second.looks) == (1, 2)
    assert first.index == second.index
    assert second.replan is not None
    assert second.replan.outcome is ReplanOutcome.UNSOLVABLE
    assert "Mug-1" in second.replan.note
    assert "stopped" in second.why


def test_without_a_near_reference_nothing_is_claimed() -> None:
    others = [d for d in memory() if d.task == "switch-devices"]
    record = play(RunConfig("make-coffee", seed=3), others)
    assert record.success
    assert all(b.verdict is not None and b.verdict.score is None for b in record.boundaries)
    assert all("nothing was judged" in b.verdict.note for b in record.boundaries if b.verdict)
