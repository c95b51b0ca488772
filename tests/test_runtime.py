"""The whole loop on a world without geometry: the true rules, perception replaced by the truth.

What the real pictures add is tested in test_end_to_end.py; here every decision of the loop is
checked in milliseconds.
"""

from collections.abc import Mapping
from dataclasses import replace
from functools import cache

import pytest

from forestall.assembly.configuration import RunConfig, run_config
from forestall.assembly.make import make_strategy
from forestall.domain.model import Domain
from forestall.errors import PerceptionError
from forestall.memory.recording import demonstration_from
from forestall.perception.config import ScopeConfig
from forestall.perception.scope import scope
from forestall.runtime import Runtime, RuntimeConfig
from forestall.strategies.none import NoReplanning
from forestall.tasks.faults import apply_plan_faults, apply_scene_faults, wrap
from forestall.tasks.files import load_scenario, load_task, scenario_names, task_names
from forestall.tasks.goals import TruthGoalChecker
from forestall.types.decision import Outcome
from forestall.types.demonstration import Demonstration
from forestall.types.episode import (
    BoundaryRecord,
    EpisodeEnd,
    EpisodeRecord,
    SkillOutcome,
    SkillStatus,
    TroubleKind,
)
from forestall.types.graph import SceneGraph, Seen
from forestall.types.observation import Observation
from forestall.types.plan import Plan, Subtask
from forestall.types.runtime import BoundaryContext, StrategyAnswer, When
from forestall.types.verdict import Decision, ReplanOutcome
from forestall.worlds.kitchen.environment import KitchenEnvironment
from forestall.worlds.kitchen.flat_world import flat_environment

ON_FLAT_WORLDS = sorted(set(scenario_names("examples")) - {"knife-blocked"})
"""A flat world knows no place in front of another, so nothing can be moved out of the way there."""

TASKS = [
    name
    if name in ("cook-egg", "heat-potato", "make-coffee")
    else pytest.param(name, marks=pytest.mark.slow)
    for name in task_names()
]
"""Every task; most of them in the whole suite only."""


class TruthPerceiver:
    """Perception that is always right."""

    def __init__(self, kitchen: KitchenEnvironment, domain: Domain) -> None:
        self._kitchen = kitchen
        self._domain = domain

    def reset(self) -> None:
        pass

    def perceive(self, observation: Observation) -> SceneGraph:
        return self._kitchen.oracle.truth()

    def scope(self, graph: SceneGraph, subtask: Subtask) -> SceneGraph:
        return scope(graph, subtask, self._domain, ScopeConfig())

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
    needs = apply_scene_faults(loaded.task.scene, faults, loaded.domain)
    kitchen = flat_environment(needs, loaded.domain)

    def score(record: EpisodeRecord) -> EpisodeRecord:
        strict, weak, why = TruthGoalChecker(loaded.domain).check(record.task.goal, kitchen.oracle)
        return replace(record, success=strict, weak_success=weak, failures=why)

    runtime = Runtime(
        wrap(kitchen, faults, kitchen, loaded.domain),
        perceiver(kitchen, loaded.domain),
        make_strategy(config, loaded.domain, demonstrations),
        loaded.domain,
        config=limits,
    )
    plan = apply_plan_faults(loaded.task.plan, faults, loaded.domain)
    return runtime.run(loaded.task, plan, config.seed, config.scenario, score)


@cache
def memory() -> list[Demonstration]:
    """Four demonstrations of each task."""
    found = []
    for task in task_names():
        for seed in range(1000, 1004):
            config = run_config(task, strategy="none", seed=seed)
            record = play(config, limits=RuntimeConfig(final_look=True))
            demonstration = demonstration_from(record, "test")
            assert demonstration is not None, (task, seed, record.failures)
            assert demonstration.final is not None
            assert len(demonstration.steps) == len(record.executed)
            found.append(replace(demonstration, id=f"{task}-{seed}"))
    return found


def alarms(record: EpisodeRecord) -> list[BoundaryRecord]:
    """Boundaries with an alarm that the reasoner, or a check, confirmed."""
    return [
        b
        for b in record.boundaries
        if b.verdict is not None
        and b.verdict.decision is Decision.REPLAN
        and b.diagnosis is not None
        and b.diagnosis.must_change
    ]


@pytest.mark.parametrize("task", TASKS)
def test_undisturbed_runs_succeed_with_and_without_monitor(task: str) -> None:
    plain = play(run_config(task, strategy="none", seed=5))
    assert plain.success
    assert plain.end is EpisodeEnd.PLAN_FINISHED
    assert [e.subtask.skill for e in plain.executed] == [s.skill for s in plain.task.plan]
    for strategy in ("proactive", "online", "post-hoc", "watch"):
        record = play(run_config(task, strategy=strategy, seed=5), memory())
        assert record.success, strategy
        assert [e.subtask for e in record.executed] == [e.subtask for e in plain.executed]
        assert [
            str(b.subtask)
            for b in record.boundaries
            if b.verdict is not None and b.verdict.decision is not Decision.PROCEED
        ] == [], strategy


@pytest.mark.parametrize("scenario", ON_FLAT_WORLDS)
def test_scenarios_fail_unwatched_and_succeed_watched(scenario: str) -> None:
    task = load_scenario(scenario).task
    assert play(run_config(task, scenario, strategy="none", seed=3)).success is False
    watched = play(run_config(task, scenario, seed=3), memory())
    assert watched.success, watched.failures
    assert any(b.replan is not None and b.replan.plan is not None for b in watched.boundaries)


@pytest.mark.parametrize("task", TASKS)
def test_without_demonstrations_undisturbed_runs_go_through(task: str) -> None:
    for strategy in ("plan-check", "retry-once"):
        record = play(run_config(task, strategy=strategy, seed=5))
        assert record.success, (strategy, record.failures)
        assert len(record.executed) == len(record.initial_plan), strategy
        assert not alarms(record)


@pytest.mark.parametrize("scenario", ON_FLAT_WORLDS)
def test_the_plan_check_saves_what_the_domain_knows_without_a_demonstration(scenario: str) -> None:
    record = play(run_config(load_scenario(scenario).task, scenario, seed=3, strategy="plan-check"))
    assert record.success, record.failures
    first = alarms(record)[0]
    assert first.verdict is not None and first.verdict.detector == "plan check"


def test_a_skill_that_fails_once_is_tried_once_more() -> None:
    class Slipping(KitchenEnvironment):
        failures = 1

        def execute(self, subtask: Subtask) -> SkillOutcome:
            if subtask.skill == "pick_up" and self.failures:
                self.failures -= 1
                return SkillOutcome(SkillStatus.FAILED, 1.0, "it slipped")
            return super().execute(subtask)

    loaded = load_task("make-coffee")
    planned = [s for s in loaded.task.plan if s.skill == "pick_up"]
    config = run_config("make-coffee", strategy="retry-once")
    for failures, repeated in ((0, 0), (1, 1), (1000, len(planned))):
        kitchen = flat_environment(loaded.task.scene, loaded.domain)
        kitchen.__class__ = Slipping
        kitchen.failures = failures  # type: ignore[attr-defined]
        strategy = make_strategy(config, loaded.domain, None)
        runtime = Runtime(kitchen, TruthPerceiver(kitchen, loaded.domain), strategy, loaded.domain)
        record = runtime.run(loaded.task, loaded.task.plan, 0)
        done, _, _ = TruthGoalChecker(loaded.domain).check(loaded.task.goal, kitchen.oracle)
        assert done is (failures < 1000)
        tries = [e for e in record.executed if e.subtask.skill == "pick_up"]
        assert len(tries) == len(planned) + repeated


def test_the_alarm_comes_before_the_subtask_and_names_the_cause() -> None:
    record = play(run_config("heat-potato", "microwave-occupied", seed=3), memory())
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
    one, two = (play(run_config("cook-egg", "pan-dirty", seed=3), memory()) for _ in range(2))
    assert [str(e.subtask) for e in one.executed] == [str(e.subtask) for e in two.executed]
    assert [b.graph for b in one.boundaries] == [b.graph for b in two.boundaries]


def test_limits_end_an_episode() -> None:
    short = play(run_config("make-salad", strategy="none"), limits=RuntimeConfig(max_subtasks=3))
    assert short.end is EpisodeEnd.SUBTASK_LIMIT
    assert len(short.executed) == 3
    never = play(
        run_config("heat-potato", "microwave-left-closed", seed=3),
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
    kitchen = flat_environment(loaded.task.scene, loaded.domain)
    config = run_config("make-coffee", strategy="none")
    strategy = make_strategy(config, loaded.domain, None)
    runtime = Runtime(kitchen, Broken(kitchen, loaded.domain), strategy, loaded.domain)
    record = runtime.run(loaded.task, loaded.task.plan, 0)
    assert record.end is EpisodeEnd.HELD
    assert record.failures == ("the robot was held: perceiver: the camera is gone",)
    assert record.trouble is not None
    assert (record.trouble.kind, record.trouble.part) == (TroubleKind.FAILED, "perceiver")
    assert record.notes == ("hold: the robot was told and has answered",)
    assert record.boundaries[-1].outcome is Outcome.HOLD
    assert len(record.executed) == len(record.boundaries) - 1 == 2


class Forgetful(TruthPerceiver):
    """Loses sight of a mug that lies on the floor."""

    def perceive(self, observation: Observation) -> SceneGraph:
        graph = super().perceive(observation)
        if "Floor-1" not in graph.parents("Mug-1", ("inside", "on_top_of")):
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
    record = play(run_config("make-coffee", "mug-dropped", seed=3), memory(), perceiver=Forgetful)
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
    record = play(run_config("make-coffee", seed=3), others)
    assert record.success
    assert all(b.verdict is not None and b.verdict.score is None for b in record.boundaries)
    assert all("nothing was judged" in b.verdict.note for b in record.boundaries if b.verdict)


class Counting(TruthPerceiver):
    """Counts the observations that it is given."""

    looks = 0

    def perceive(self, observation: Observation) -> SceneGraph:
        type(self).looks += 1
        return super().perceive(observation)


@pytest.mark.parametrize(
    ("strategy", "final_look", "looks"),
    [
        ("none", False, 1 + 10),
        ("none", True, 1 + 10 + 1),
        ("watch", False, 1 + 10),
        ("post-hoc", False, 1 + 10 + 1),
        ("online", False, 1 + 2 * 10 + 1),
    ],
)
def test_only_who_looks_after_pays_for_it(strategy: str, final_look: bool, looks: int) -> None:
    Counting.looks = 0
    config = run_config("switch-devices", strategy=strategy, seed=5)
    record = play(config, memory(), RuntimeConfig(final_look=final_look), Counting)
    assert len(record.initial_plan) == 10
    assert Counting.looks == looks
    assert (record.final is not None) == (strategy in ("online", "post-hoc") or final_look)


def test_a_moment_after_a_subtask_shares_its_index_and_the_end_has_its_own() -> None:
    record = play(run_config("switch-devices", strategy="online", seed=5), memory())
    whens = [(b.index, b.when) for b in record.boundaries]
    both = [(i, when) for i in range(10) for when in (When.BEFORE, When.AFTER)]
    assert whens == [*both, (10, When.END)]
    assert record.boundaries[-1].graph == record.final
    for before, after in zip(record.boundaries[:-1:2], record.boundaries[1::2], strict=True):
        assert before.subtask == after.subtask
        assert before.verdict is None and after.verdict is not None


def test_why_a_skill_was_refused_is_recorded_and_not_told() -> None:
    loaded = load_task("heat-potato")
    kitchen = flat_environment(loaded.task.scene, loaded.domain)
    told = []

    class Curious(NoReplanning):
        def after_subtask(self, context: BoundaryContext, outcome: SkillOutcome) -> StrategyAnswer:
            told.append(outcome)
            return super().after_subtask(context, outcome)

    perceiver = TruthPerceiver(kitchen, loaded.domain)
    runtime = Runtime(kitchen, perceiver, Curious(), loaded.domain)
    record = runtime.run(loaded.task, Plan.parse(["pick_up(Microwave)"]), 0)
    (step,) = record.executed
    assert step.outcome.status is told[0].status is SkillStatus.REFUSED
    assert step.outcome.reason
    assert told[0].reason == ""


IRREVERSIBLE = {
    "bowl-filled-with-wine": "put_in(LettuceSliced-1, Bowl-1)",
    "pan-dirty": "put_in(EggCracked-1, Pan-1)",
}
"""Scenario → the subtask that does the harm."""


@pytest.mark.slow
@pytest.mark.parametrize("scenario", sorted(IRREVERSIBLE))
def test_what_cannot_be_undone_must_be_seen_before_it_is_done(scenario: str) -> None:
    task = load_scenario(scenario).task
    ahead, online, late = (
        play(run_config(task, scenario, strategy=strategy, seed=3), memory())
        for strategy in ("proactive", "online", "post-hoc")
    )
    assert ahead.success
    assert online.success is late.success is False
    assert any("must never be" in f for f in online.failures)
    assert alarms(ahead)[0].when is When.BEFORE
    seen = alarms(online)[0]
    assert (seen.when, str(seen.subtask)) == (When.AFTER, IRREVERSIBLE[scenario])
    assert [b.when for b in alarms(late)] == [When.END]


@pytest.mark.parametrize(
    ("scenario", "subtask", "status"),
    [
        ("microwave-occupied", "put_in(Plate-1, Microwave-1)", SkillStatus.REFUSED),
        ("microwave-left-closed", "put_in(Plate-1, Microwave-1)", SkillStatus.REFUSED),
        ("mug-dropped", "navigate_to_obj(CoffeeMachine-1)", SkillStatus.SUCCEEDED),
    ],
)
def test_what_can_be_undone_is_recovered_later(
    scenario: str, subtask: str, status: SkillStatus
) -> None:
    task = load_scenario(scenario).task
    ahead, online, late = (
        play(run_config(task, scenario, strategy=strategy, seed=3), memory())
        for strategy in ("proactive", "online", "post-hoc")
    )
    assert ahead.success and online.success and late.success
    seen = alarms(online)[0]
    assert (seen.when, str(seen.subtask)) == (When.AFTER, subtask)
    assert next(e for e in online.executed if e.index == seen.index).outcome.status is status
    (correction,) = alarms(late)
    assert correction.when is When.END
    assert correction.diagnosis is not None
    assert correction.diagnosis.cause.startswith("located at step")
    assert ahead.simulated_s <= online.simulated_s < late.simulated_s


def test_watching_changes_nothing_and_names_what_is_wrong() -> None:
    plain, watched = (
        play(run_config("heat-potato", "microwave-occupied", strategy=strategy, seed=3), memory())
        for strategy in ("none", "watch")
    )
    assert [e.subtask for e in watched.executed] == [e.subtask for e in plain.executed]
    last = {b.index: timeless(b.graph) for b in watched.boundaries}
    assert last == {b.index: timeless(b.graph) for b in plain.boundaries}
    assert watched.simulated_s > plain.simulated_s, "second looks take their time"
    first = alarms(watched)[0]
    assert first.diagnosis is not None and "Bowl-1" in first.diagnosis.cause
    judged = [b for b in watched.boundaries if b.watched]
    names = [[v.detector for v in b.watched] for b in judged]
    assert {b.index for b in judged} == set(last)
    assert all(n == names[0] for n in names)
    assert len(set(names[0])) == len(names[0]) > 1
    assert all(b.watched[0] == b.verdict for b in judged)


def timeless(graph: SceneGraph) -> SceneGraph:
    """A graph without when its things were seen."""
    return replace(graph, nodes=tuple(replace(n, last_seen_s=0.0) for n in graph.nodes))
