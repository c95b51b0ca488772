"""The one episode loop: look, perceive, ask the strategy, act, and look again where it asks to.

It sees only L0; environment, perceiver, strategy and listeners come through the constructor. All
strategies run in this loop, so that a measured difference between them is theirs. Listeners are
told what happened and cannot change it.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

from forestall.domain.names import executable, ground_subtask
from forestall.errors import ForestallError
from forestall.types.episode import (
    BoundaryRecord,
    EpisodeEnd,
    EpisodeRecord,
    ExecutedRecord,
    SkillStatus,
)
from forestall.types.facts import category_of, is_instance
from forestall.types.graph import SceneGraph
from forestall.types.observation import Observation, Vec3
from forestall.types.plan import Plan, Subtask
from forestall.types.runtime import BoundaryContext, LooksAfter, StrategyAnswer, When
from forestall.types.task import Task
from forestall.types.verdict import Decision

if TYPE_CHECKING:
    from collections.abc import Iterator

    from forestall.domain.model import Domain
    from forestall.seams import Environment, Listener, Perceiver, Strategy

Score = Callable[[EpisodeRecord], EpisodeRecord]


@dataclass(frozen=True, slots=True)
class RuntimeConfig:
    """Bounds of one episode.

    Args:
        max_subtasks: how many subtasks may be executed.
        max_replans: how many corrected plans may be adopted; asking for more ends the run.
        max_looks: how many observations one boundary may take.
        keep_observations: whether pictures go into the record.
        final_look: whether to look once more when the plan is finished, also for a strategy that
            does not ask for it (demonstrations record what was known then).
    """

    max_subtasks: int = 150
    max_replans: int = 8
    max_looks: int = 2
    keep_observations: bool = True
    final_look: bool = False


@dataclass(slots=True)
class _Episode:
    """What changes while one episode runs."""

    task: Task
    plan: Plan
    start: Plan
    graph: SceneGraph = field(default_factory=lambda: SceneGraph(()))
    robot_world_m: Vec3 = (0.0, 0.0, 0.0)
    time_s: float = 0.0
    index: int = 0
    replans: int = 0
    judged: int = 0
    worked_at: Vec3 | None = None
    bound: dict[str, str] = field(default_factory=dict)
    boundaries: list[BoundaryRecord] = field(default_factory=list)
    executed: list[ExecutedRecord] = field(default_factory=list)
    seconds: dict[str, float] = field(default_factory=dict)
    final: SceneGraph | None = None

    @contextmanager
    def phase(self, name: str) -> Iterator[None]:
        started = time.perf_counter()
        try:
            yield
        finally:
            self.add(name, time.perf_counter() - started)

    def add(self, name: str, seconds: float) -> None:
        self.seconds[name] = self.seconds.get(name, 0.0) + seconds


class Runtime:
    """Runs one task with one strategy."""

    def __init__(
        self,
        environment: Environment,
        perceiver: Perceiver,
        strategy: Strategy,
        domain: Domain,
        listeners: Sequence[Listener] = (),
        config: RuntimeConfig | None = None,
    ) -> None:
        self._environment = environment
        self._perceiver = perceiver
        self._strategy = strategy
        self._domain = domain
        self._listeners = tuple(listeners)
        self._config = config or RuntimeConfig()

    def run(
        self,
        task: Task,
        plan: Plan,
        seed: int,
        scenario: str | None = None,
        score: Score | None = None,
        provenance: Sequence[tuple[str, Any]] = (),
    ) -> EpisodeRecord:
        """Run one episode to its end.

        An error of the environment or of a part ends the episode; what came before is recorded.

        Args:
            task: goal and names.
            plan: the plan to start with (a scenario may have changed the nominal one).
            seed: of the scene.
            scenario: its name, for the record.
            score: fills success and history after the run; it alone sees the truth.
            provenance: configuration, versions and the like, for the record.
        """
        for listener in self._listeners:
            listener.on_start(task, plan, seed)
        episode = _Episode(task, plan, start=plan)
        end, broken = EpisodeEnd.ERROR, None
        try:
            self._begin(episode, seed)
            end = self._loop(episode)
        except Exception as error:  # noqa: BLE001 - whatever breaks, what came before is kept
            broken = error
        record = EpisodeRecord(
            task=task,
            scenario=scenario,
            strategy=self._strategy.name,
            seed=seed,
            initial_plan=plan,
            boundaries=tuple(episode.boundaries),
            executed=tuple(episode.executed),
            end=end,
            success=None if broken is None else False,
            failures=() if broken is None else (f"the run broke off: {broken}",),
            simulated_s=episode.time_s,
            compute_s=tuple(sorted(episode.seconds.items())),
            final=episode.final,
            provenance=(*provenance, ("perception", dict(self._perceiver.describe()))),
        )
        if score is not None and broken is None:
            record = score(record)
        for listener in self._listeners:
            listener.on_end(record)
        if broken is not None and not isinstance(broken, ForestallError):
            raise broken
        return record

    def _begin(self, episode: _Episode, seed: int) -> None:
        """Reset everything and look around once."""
        self._environment.reset(seed)
        self._perceiver.reset()
        with episode.phase("observe"):
            observation = self._environment.scan()
        with episode.phase("perceive"):
            episode.graph = self._perceiver.perceive(observation)
        episode.robot_world_m = observation.robot_position_world_m

    def _loop(self, episode: _Episode) -> EpisodeEnd:
        context: BoundaryContext | None = None
        while len(episode.executed) < self._config.max_subtasks:
            if episode.index >= len(episode.plan):
                if context is None:
                    return EpisodeEnd.PLAN_FINISHED
                answer = self._finish(episode, context)
                if not _asks_for_plan(answer):
                    return EpisodeEnd.PLAN_FINISHED
            else:
                context, answer = self._start(episode)
                if answer.decision is not Decision.STOP and not _asks_for_plan(answer):
                    answer = self._execute(episode, context)
            if answer.decision is Decision.STOP:
                return EpisodeEnd.STOPPED
            if _asks_for_plan(answer):
                if episode.replans >= self._config.max_replans:
                    return EpisodeEnd.REPLAN_LIMIT
                self._adopt(episode, answer)
        return EpisodeEnd.SUBTASK_LIMIT

    def _start(self, episode: _Episode) -> tuple[BoundaryContext, StrategyAnswer]:
        """Go to where the next subtask will be done, and judge what is seen there."""
        before = dict(episode.seconds)
        with episode.phase("act"):
            self._approach(episode)
        subtask = self._ground(episode)
        found = self._judge(
            episode, When.BEFORE, episode.index, subtask, self._strategy.before_subtask, before
        )
        episode.judged += 1
        return found

    def _finish(self, episode: _Episode, last: BoundaryContext) -> StrategyAnswer:
        """The plan is finished: look at the last subtask's place once more, if anybody wants to."""
        ask = self._strategy.after_episode
        if not (self._config.final_look or self._strategy.looks_after is not LooksAfter.NOTHING):
            return ask(last)
        context, answer = self._judge(episode, When.END, len(episode.plan), last.subtask, ask)
        episode.judged += 1
        episode.final = context.graph
        return answer

    def _judge(
        self,
        episode: _Episode,
        when: When,
        index: int,
        subtask: Subtask,
        ask: Callable[[BoundaryContext], StrategyAnswer],
        before: dict[str, float] | None = None,
    ) -> tuple[BoundaryContext, StrategyAnswer]:
        """Look towards what a subtask concerns, perceive, and ask the strategy.

        Every look is judged and recorded; the looks of one boundary share its index.
        """
        before = dict(episode.seconds) if before is None else before
        with episode.phase("observe"):
            observation = self._look(episode, subtask)
        for look in range(1, self._config.max_looks + 1):
            with episode.phase("perceive"):
                episode.graph = self._perceiver.perceive(observation)
                episode.robot_world_m = observation.robot_position_world_m
                if when is When.BEFORE:
                    subtask = self._ground(episode)
                context = self._context(episode, when, index, subtask, observation, look)
            started = time.perf_counter()
            answer = ask(context)
            spent = time.perf_counter() - started
            for name, seconds in answer.seconds:
                episode.add(name, seconds)
            episode.add("strategy", max(0.0, spent - sum(s for _, s in answer.seconds)))
            self._note(episode, context, answer, before)
            before = dict(episode.seconds)
            if answer.decision is not Decision.LOOK_AGAIN:
                break
            with episode.phase("observe"):
                around = self._environment.scan(thorough=True)
                ahead = self._look(episode, subtask)
                observation = replace(ahead, frames=(*around.frames, *ahead.frames))
        return context, answer

    def _note(
        self,
        episode: _Episode,
        context: BoundaryContext,
        answer: StrategyAnswer,
        before: dict[str, float],
    ) -> None:
        spent = {k: v - before.get(k, 0.0) for k, v in episode.seconds.items()}
        episode.boundaries.append(
            BoundaryRecord(
                index=episode.judged - (context.when is When.AFTER),
                subtask=context.subtask,
                graph=context.graph,
                scoped=context.scoped,
                observation=context.observation if self._config.keep_observations else None,
                looks=context.looks,
                verdict=answer.verdict,
                diagnosis=answer.diagnosis,
                replan=answer.replan,
                why=answer.why,
                seconds=tuple(sorted((k, v) for k, v in spent.items() if v > 0)),
                time_s=self._environment.time_s,
                when=context.when,
                watched=answer.watched,
            )
        )
        episode.time_s = self._environment.time_s
        for listener in self._listeners:
            listener.on_boundary(context, answer)

    def _execute(self, episode: _Episode, context: BoundaryContext) -> StrategyAnswer:
        planned = episode.plan.subtasks[episode.index]
        command = executable(context.subtask, planned, self._domain)
        with episode.phase("act"):
            outcome = self._environment.execute(command)
        for name in context.subtask.args:
            if is_instance(name):
                episode.bound[category_of(name)] = name
        if outcome.status is SkillStatus.REFUSED:
            episode.bound.clear()
        episode.worked_at = outcome.hand_world_m
        episode.time_s = self._environment.time_s
        episode.executed.append(ExecutedRecord(command, outcome, episode.judged - 1))
        for listener in self._listeners:
            listener.on_executed(command, outcome, episode.time_s)
        index, episode.index = episode.index, episode.index + 1
        outcome = replace(outcome, reason="")  # it may name what the robot has not seen
        if self._strategy.looks_after is not LooksAfter.SUBTASK:
            return self._strategy.after_subtask(context, outcome)
        _, answer = self._judge(
            episode,
            When.AFTER,
            index,
            context.subtask,
            lambda seen: self._strategy.after_subtask(seen, outcome),
        )
        return answer

    def _adopt(self, episode: _Episode, answer: StrategyAnswer) -> None:
        assert answer.replan is not None and answer.replan.plan is not None
        episode.plan = answer.replan.plan
        episode.index = 0
        episode.replans += 1

    def _ground(self, episode: _Episode) -> Subtask:
        return ground_subtask(
            episode.plan.subtasks[episode.index],
            episode.graph,
            self._domain,
            episode.robot_world_m,
            episode.bound,
        )

    def _approach(self, episode: _Episode) -> None:
        """Go where the subtask will be done and look from there.

        A skill whose target is out of reach drives there by itself; doing that first lets the
        decision be taken on what can be seen at the place and not from across the room.
        """
        subtask = self._ground(episode)
        node = episode.graph.get(subtask.args[-1])
        if (
            self._domain.skill(subtask.skill).drives
            or node is None
            or node.centroid_m is None
            or self._domain.is_open_support(node.category)
        ):
            return
        self._environment.approach(node.id)

    def _look(self, episode: _Episode, subtask: Subtask) -> Observation:
        """Towards where the hand let go last, and the arguments that it does not hold."""
        holding = episode.graph.holding
        points: list[Vec3] = [] if episode.worked_at is None else [episode.worked_at]
        for name in subtask.args:
            node = episode.graph.get(name)
            if node is not None and node.centroid_m is not None and node.id != holding:
                points.append(node.centroid_m)
        return self._environment.observe(points)

    def _context(
        self,
        episode: _Episode,
        when: When,
        index: int,
        subtask: Subtask,
        observation: Observation,
        look: int,
    ) -> BoundaryContext:
        left = len(episode.plan) - index
        return BoundaryContext(
            task=episode.task,
            plan=episode.plan,
            index=index,
            done=max(0, len(episode.start) - left),
            subtask=subtask,
            graph=episode.graph,
            scoped=self._perceiver.scope(episode.graph, subtask),
            observation=observation,
            looks=look,
            may_look=look < self._config.max_looks,
            replans=episode.replans,
            when=when,
        )


def _asks_for_plan(answer: StrategyAnswer) -> bool:
    return (
        answer.decision is Decision.REPLAN
        and answer.replan is not None
        and answer.replan.plan is not None
    )
