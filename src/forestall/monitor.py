"""The monitor: an observation in, a decision out. It knows no environment.

Whoever owns the robot calls it: the episode loop (`runtime.py`), a replay of stored data, an
executive of the user's own. It calls perceiver and strategy, which come through the constructor;
where the run stands is in `run_state.py`, what an answer comes to in `conclusion.py`. A part that
raises or does not answer in time is a "hold" that names it (`supervision.py`), never an answer.

    monitor.start(task)
    monitor.observe(first_look)
    decision = monitor.before(scene)  # proceed · look · replan · hold · not judged
    if decision.may_start:
        monitor.after(robot.execute(decision.command))  # or "done", "failed", "refused"

A scene is an observation (RGB-D), a scene graph, or one in its short form (`types.symbolic`).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import AbstractContextManager
from dataclasses import replace
from typing import TYPE_CHECKING

from forestall.conclusion import MonitorConfig
from forestall.errors import InputError, PartError, UnknownNameError
from forestall.handed import Scene, outcome_of, scene_of, subtask_of, task_of
from forestall.moments import Moments
from forestall.run_state import RunState
from forestall.senses import Senses
from forestall.supervised import SupervisedParts
from forestall.supervision import Supervisor
from forestall.types.decision import Hold, MonitorDecision, Outcome
from forestall.types.episode import ExecutedRecord, SkillOutcome, SkillStatus
from forestall.types.graph import SceneGraph
from forestall.types.observation import Observation, Vec3
from forestall.types.plan import Plan, Subtask
from forestall.types.runtime import BoundaryContext, LooksAfter, StrategyAnswer, When
from forestall.types.task import Task
from forestall.types.verdict import Decision

if TYPE_CHECKING:
    from forestall.domain.model import Domain
    from forestall.seams.judging import Strategy
    from forestall.seams.perceiving import Perceiver


class Monitor:
    """Judges one run, boundary by boundary.

    Args:
        strategy: says what is to be done about a scene.
        domain: resolves names.
        perceiver: turns observations into the scene graph; None where scene graphs are given.
        config: bounds and policies.
        scope: the part of a graph that concerns a subtask; the perceiver's own by default, without
            one the whole graph.
        supervisor: calls perceiver and strategy; one of its own by default.
    """

    def __init__(
        self,
        strategy: Strategy,
        domain: Domain,
        perceiver: Perceiver | None = None,
        config: MonitorConfig | None = None,
        scope: Callable[[SceneGraph, Subtask], SceneGraph] | None = None,
        supervisor: Supervisor | None = None,
    ) -> None:
        self._strategy = strategy
        self._domain = domain
        self._config = config or MonitorConfig()
        self._parts = SupervisedParts(
            strategy,
            perceiver,
            scope or (_whole if perceiver is None else perceiver.scope),
            domain,
            supervisor or Supervisor(self._config.limits),
        )
        self._moments = Moments(self._parts, self._config, strategy.name)
        self._state: RunState | None = None
        self._awaited: tuple[BoundaryContext, SkillOutcome] | None = None  # a look after it

    def start(self, task: Task | Plan | Sequence[str], plan: Plan | None = None) -> None:
        """A run begins; everything of an earlier one is forgotten.

        Args:
            task: goal and names; a plan alone, or a list of subtasks in text form, is a task
                without a goal condition.
            plan: the plan to start with, the task's own by default.

        Raises:
            PartError: the perceiver cannot be reset, or has not come back from an earlier run.
        """
        task = task_of(task)
        first = task.plan if plan is None else plan
        self._state = RunState(
            task, first, self._domain, first, Senses(self._config.limits.max_unchanged)
        )
        self._awaited = None
        self._moments.failed = None
        self._parts.reset()

    def check(self, scene: Scene, subtask: Subtask | str) -> MonitorDecision:
        """May this one subtask start in this scene? A run that is going on is forgotten.

        Nobody can look again here: what would call for another look was not judged.

        Args:
            scene: RGB-D with the robot's own state, a scene graph, or one in its short form.
            subtask: in text form, or as a value.

        Raises:
            InputError: the subtask's arguments do not fit, or the scene cannot be read.
        """
        wanted = subtask_of(subtask)
        if wanted.skill in self._domain.skills:
            self._domain.check(wanted)
        try:
            self.start(Plan((wanted,)))
        except PartError as error:
            return self._moments.hold_for(error, wanted)
        self._run.looks = self._config.max_looks - 1
        return self.before(scene)

    def observe(self, observation: Scene) -> None:
        """The first look around: it is remembered, nothing is judged.

        Raises:
            PartError: the perceiver failed, was late, or cannot believe what it was given.
        """
        with self._run.phase("perceive"):
            self._moments.see(self._run, self._read(observation))
        self._run.mark()

    def before(self, observation: Scene, subtask: Subtask | str | None = None) -> MonitorDecision:
        """May the next subtask start?

        Args:
            observation: RGB-D with the robot's own state, or a scene graph.
            subtask: which one; by default the plan's next. What lies between is skipped.

        Raises:
            InputError: not started, the plan is finished, or the subtask is not in what is left.
        """
        run = self._run
        run.move_to(subtask)
        if self.exhausted:
            why = f"{len(run.executed)} subtasks were executed, and no more may be"
            limit = Hold.SUBTASK_LIMIT
            return MonitorDecision(Outcome.HOLD, False, run.ground(), hold=limit, why=why)
        self._awaited, run.ready = None, False
        unknown = self._unknown_skill()
        if unknown is not None:
            return unknown
        return self._judge(
            When.BEFORE, run.position, None, observation, self._strategy.before_subtask
        )

    def after(
        self,
        outcome: SkillOutcome | str,
        observation: Scene | None = None,
        reason: str = "",
    ) -> MonitorDecision | None:
        """The subtask is over. A refusal is evidence: the same is not tried again the same way.

        Args:
            outcome: how it ended, as the robot knows it; or "done", "failed", "refused".
            observation: what is seen now. A strategy that judges after subtasks answers "look"
                where it is None, and is then asked again with the same outcome.
            reason: why, in the robot's words, where the outcome is one of the three words.

        Returns:
            None where there is nothing to say.

        Raises:
            InputError: nothing was judged before, or there is no such outcome.
        """
        run = self._run
        outcome = outcome_of(outcome, reason)
        if self._awaited is None:
            run.note_executed(outcome)
            run.mark()
            assert run.last is not None
            told = replace(outcome, reason="")  # it may name what the robot has not seen
            if outcome.status is not SkillStatus.REFUSED:
                try:
                    self._parts.acted(run.last.subtask, outcome.status is SkillStatus.SUCCEEDED)
                except PartError as error:
                    return self._moments.hold_for(error, run.last.subtask)
            if (held := self._moments.too_many(run, run.last.subtask)) is not None:
                return held
            if self._strategy.looks_after is not LooksAfter.SUBTASK:
                known = replace(run.last, refused=tuple(run.refused()))
                try:
                    answer = self._parts.judge(self._strategy.after_subtask, known, told)
                except PartError as error:
                    return self._moments.hold_for(error, run.last.subtask)
                silent = answer.decision is Decision.PROCEED and answer.verdict is None
                over = replace(run.last, when=When.AFTER, may_look=False)
                return None if silent else self._moments.conclude(run, over, answer)
            self._awaited = (run.last, told)
        context, told = self._awaited
        if observation is None:
            return self._moments.look(run, context.subtask, "what a subtask has led to is judged")
        decision = self._judge(
            When.AFTER,
            context.index,
            context.subtask,
            observation,
            lambda seen: self._strategy.after_subtask(seen, told),
        )
        if decision.outcome is not Outcome.LOOK:
            self._awaited = None
        return decision

    def finish(self, observation: Scene | None = None) -> MonitorDecision:
        """The plan is finished: is the task?

        Args:
            observation: what is seen now. A strategy that judges the end answers "look" where it is
                None.

        Raises:
            InputError: the plan is not finished.
        """
        run = self._run
        if not run.finished:
            raise InputError(f"the plan is not finished: {run.plan.subtasks[run.position]} is next")
        last = run.last
        if last is None:
            may = self._config.on_not_judged == "proceed"
            return MonitorDecision(Outcome.NOT_JUDGED, may, why="nothing was executed")
        if observation is None:
            if self._strategy.looks_after is not LooksAfter.NOTHING:
                return self._moments.look(run, last.subtask, "what the plan has led to is judged")
            try:
                answer = self._parts.judge(self._strategy.after_episode, last)
            except PartError as error:
                return self._moments.hold_for(error, last.subtask)
            return self._moments.conclude(run, replace(last, when=When.END, may_look=False), answer)
        decision = self._judge(
            When.END, len(run.plan), last.subtask, observation, self._strategy.after_episode
        )
        run.final = run.graph
        return decision

    @property
    def finished(self) -> bool:
        """Whether the plan has no further subtask."""
        return self._run.finished

    @property
    def exhausted(self) -> bool:
        """Whether as many subtasks were executed as may be."""
        return len(self._run.executed) >= self._config.max_subtasks

    @property
    def looks_after(self) -> LooksAfter:
        """After what the strategy wants the robot to look where it has just worked."""
        return self._strategy.looks_after

    @property
    def task(self) -> Task:
        """What the run is of."""
        return self._run.task

    @property
    def strategy(self) -> str:
        """The name of the strategy."""
        return self._strategy.name

    @property
    def plan(self) -> Plan:
        """The plan at hand."""
        return self._run.plan

    @property
    def executed(self) -> tuple[ExecutedRecord, ...]:
        """What was tried, and how each subtask ended."""
        return tuple(self._run.executed)

    @property
    def last(self) -> Subtask | None:
        """The newest subtask that was judged before it started, None where none was yet."""
        context = self._run.last
        return None if context is None else context.subtask

    @property
    def failed(self) -> PartError | None:
        """What the newest "hold" comes from, where a part failed or was late."""
        return self._moments.failed

    @property
    def bound(self) -> dict[str, str]:
        """Category → the instance that it means by now."""
        return dict(self._run.bound)

    @property
    def graph(self) -> SceneGraph:
        """Everything that is believed now."""
        return self._run.graph

    @property
    def final(self) -> SceneGraph | None:
        """What was known at the end of the plan, None where nobody looked."""
        return self._run.final

    @property
    def seconds(self) -> tuple[tuple[str, float], ...]:
        """Measured time of the run by phase."""
        return tuple(sorted(self._run.seconds.items()))

    @property
    def command(self) -> Subtask | None:
        """The subtask to send to the robot next, as far as names can be told."""
        run = self._run
        return None if run.finished else run.command(run.ground(), run.position)

    def wanted_views(self) -> tuple[Vec3, ...]:
        """World points to look at: where the hand worked last, the arguments that it does not hold.

        Of the next subtask; of the last one while a look after it is asked for, and at the end.
        """
        run = self._run
        if self._awaited is not None:
            return run.views(self._awaited[0].subtask)
        if not run.finished:
            return run.views(run.ground())
        return () if run.last is None else run.views(run.last.subtask)

    def best_vantage(self, eyes: Sequence[Vec3], points: Sequence[Vec3]) -> int | None:
        """For another look: from which place of the camera more would be seen around points.

        Args:
            eyes: places where it could be, metres in the world.
            points: what should be looked at, as a decision's `look_at`.

        Returns:
            A position in `eyes`; None where none is worth the way, or the perceiver cannot tell.

        Raises:
            PartError: the perceiver failed or was late.
        """
        return self._parts.best_vantage(eyes, points)

    def approach(self) -> str | None:
        """What to drive to before looking: where the next subtask will be done, None for nothing.

        A skill whose target is out of reach drives there by itself; doing that first lets the
        decision be taken on what can be seen at the place and not from across the room.
        """
        return None if self._run.finished else self._run.approach()

    def phase(self, name: str) -> AbstractContextManager[None]:
        """Book the caller's own time (driving, looking) to the boundary that is judged next."""
        return self._run.phase(name)

    @property
    def _run(self) -> RunState:
        if self._state is None:
            raise InputError("the monitor was not started: call start(task) first")
        return self._state

    def _unknown_skill(self) -> MonitorDecision | None:
        """Of a skill that the domain lacks nothing can be judged; it is not sent to the robot."""
        planned = self._run.plan.subtasks[self._run.position]
        try:
            self._domain.skill(planned.skill)
        except UnknownNameError as error:
            return MonitorDecision(Outcome.NOT_JUDGED, False, planned, why=str(error))
        return None

    def _judge(
        self,
        when: When,
        index: int,
        subtask: Subtask | None,
        scene: Scene,
        ask: Callable[[BoundaryContext], StrategyAnswer],
    ) -> MonitorDecision:
        return self._moments.judge(self._run, when, index, subtask, self._read(scene), ask)

    def _read(self, scene: Scene) -> Observation | SceneGraph:
        """What can be judged; raises InputError where it is neither a picture nor a scene."""
        return scene_of(scene, self._parts.perceives)


def _whole(graph: SceneGraph, subtask: Subtask) -> SceneGraph:
    return replace(graph, subtask=subtask)
