"""The one episode loop: an environment around a monitor.

It drives, looks and acts where the monitor says so; the monitor judges. All strategies run in this
loop, so that a measured difference between them is theirs. Listeners are told what happened and
cannot change it (`audience.py`). Every call has a limit (`supervision.py`); whatever fails or is
late, the robot is told to hold and the record is closed with what was known.
"""

from __future__ import annotations

import traceback
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

from forestall.audience import Audience
from forestall.conclusion import MonitorConfig
from forestall.errors import PartError
from forestall.monitor import Monitor
from forestall.records.plain import plain
from forestall.seams.running import LookListener
from forestall.supervised import SupervisedWorld, described
from forestall.supervision import Limits, Supervisor, part_error
from forestall.types.decision import Hold, MonitorDecision, Outcome
from forestall.types.episode import (
    BoundaryRecord,
    EpisodeEnd,
    EpisodeRecord,
    Trouble,
    TroubleKind,
)
from forestall.types.observation import Observation, Vec3
from forestall.types.plan import Plan
from forestall.types.runtime import LooksAfter
from forestall.types.task import Task

if TYPE_CHECKING:
    from forestall.domain.model import Domain
    from forestall.seams.acting import Environment
    from forestall.seams.judging import Strategy
    from forestall.seams.perceiving import Perceiver
    from forestall.seams.running import Listener

Score = Callable[[EpisodeRecord], EpisodeRecord]

_ENDS = {
    Hold.STOPPED: EpisodeEnd.STOPPED,
    Hold.REPLAN_LIMIT: EpisodeEnd.REPLAN_LIMIT,
    Hold.SUBTASK_LIMIT: EpisodeEnd.SUBTASK_LIMIT,
}
"""Every other reason to hold ends a run as held."""

_TROUBLES = {Hold.SENSES, Hold.INTERNAL, Hold.TOO_MANY}
_AT_REST = {EpisodeEnd.PLAN_FINISHED, EpisodeEnd.SUBTASK_LIMIT}
"""Ends after which nothing is under way."""


@dataclass(frozen=True, slots=True)
class RuntimeConfig:
    """Bounds of one episode.

    Args:
        max_subtasks: how many subtasks may be executed.
        max_replans: how many corrected plans may be adopted; asking for more ends the run. Plans
            that look for something do not count: there are only so many places.
        max_looks: how many observations one boundary may take.
        keep_observations: whether pictures go into the record.
        final_look: whether to look once more when the plan is finished, also for a strategy that
            does not ask for it (demonstrations record what was known then).
        limits: how long each call may take, and how often in a row something may go wrong.
    """

    max_subtasks: int = 150
    max_replans: int = 8
    max_looks: int = 2
    keep_observations: bool = True
    final_look: bool = False
    limits: Limits = field(default_factory=Limits)

    def monitor(self) -> MonitorConfig:
        """The same bounds for the monitor.

        In a simulated run a subtask starts although nothing was judged, or although an alarm was
        not answered: what comes of it is what is measured.
        """
        return MonitorConfig(
            self.max_subtasks,
            self.max_replans,
            self.max_looks,
            on_not_judged="proceed",
            on_alarm="proceed",
            limits=self.limits,
        )


@dataclass(slots=True)
class _Episode:
    """What is kept of one episode beside what the monitor knows."""

    audience: Audience
    boundaries: list[BoundaryRecord] = field(default_factory=list)
    time_s: float = 0.0
    trouble: Trouble | None = None
    notes: list[str] = field(default_factory=list)

    def looked(self, observation: Observation) -> None:
        """Tell whoever keeps all that was seen."""
        self.audience.tell("on_look", observation, to=LookListener)


class Runtime:
    """Runs one task with one strategy.

    Args:
        environment: the world; all calls to it come from one thread, `hold` apart.
        perceiver: turns what is seen into the scene graph.
        strategy: judges.
        domain: of the task.
        listeners: are told what happens; the first is told of the end last.
        config: bounds, and limits of every call.
    """

    def __init__(
        self,
        environment: Environment,
        perceiver: Perceiver,
        strategy: Strategy,
        domain: Domain,
        listeners: Sequence[Listener] = (),
        config: RuntimeConfig | None = None,
    ) -> None:
        self._perceiver = perceiver
        self._strategy = strategy
        self._listeners = tuple(listeners)
        self._config = config or RuntimeConfig()
        self._calls = Supervisor(self._config.limits)
        self._world = SupervisedWorld(environment, self._calls)
        self._monitor = Monitor(
            strategy, domain, perceiver, self._config.monitor(), supervisor=self._calls
        )

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

        Whatever fails or is late ends the episode: the robot is told to hold, what came before is
        recorded, and `trouble` says what it was. Nothing of that is raised.

        Args:
            task: goal and names.
            plan: the plan to start with (a scenario may have changed the nominal one).
            seed: of the scene.
            scenario: its name, for the record.
            score: fills success and history after the run; it alone sees the truth.
            provenance: configuration, versions and the like, for the record.
        """
        audience = Audience(self._listeners, self._config.limits.listen_s)
        episode = _Episode(audience)
        perception, broken = None, None
        try:
            perception = described(self._perceiver, self._calls)
        except PartError as error:
            broken = error
        known = (*provenance, ("perception", perception))
        record = EpisodeRecord(
            task=task,
            scenario=scenario,
            strategy=self._strategy.name,
            seed=seed,
            initial_plan=plan,
            boundaries=(),
            executed=(),
            end=EpisodeEnd.UNFINISHED,
            provenance=tuple((name, plain(value)) for name, value in known),
        )
        try:
            audience.tell("on_start", record)
            end = self._end(episode, task, plan, seed, broken)
            if end not in _AT_REST:
                episode.notes.append(self._world.hold())
            record = self._scored(self._closed(record, episode, end), episode, score)
            for position in reversed(range(audience.count)):
                record = replace(record, notes=(*episode.notes, *audience.notes))
                audience.tell_last(position, "on_end", record)
            return replace(record, notes=(*episode.notes, *audience.notes))
        except BaseException:  # the user breaks off: the robot must not be left moving
            self._world.hold()
            raise
        finally:
            audience.leave()

    def _end(
        self, episode: _Episode, task: Task, plan: Plan, seed: int, broken: PartError | None
    ) -> EpisodeEnd:
        """Run the episode; why it ended."""
        monitor = self._monitor
        try:
            monitor.start(task, plan)
            if broken is not None:
                raise broken
            self._world.reset(seed)
            with monitor.phase("observe"):
                around = self._world.scan()
            self._remember(episode, around)
            return self._loop(episode)
        except PartError as error:
            episode.trouble = _trouble(error)
        except Exception as error:  # noqa: BLE001 - whatever breaks, what came before is kept
            broken = part_error("the loop", error)
            broken.__cause__ = error
            episode.trouble = _trouble(broken)
        return EpisodeEnd.ERROR if episode.trouble.kind is TroubleKind.WORLD else EpisodeEnd.HELD

    def _closed(self, record: EpisodeRecord, episode: _Episode, end: EpisodeEnd) -> EpisodeRecord:
        """The record with what was known when the run ended."""
        monitor, trouble = self._monitor, episode.trouble
        said = "the run broke off" if end is EpisodeEnd.ERROR else "the robot was held"
        return replace(
            record,
            boundaries=tuple(episode.boundaries),
            executed=monitor.executed,
            end=end,
            success=None if trouble is None else False,
            failures=() if trouble is None else (f"{said}: {trouble.text}",),
            simulated_s=episode.time_s,
            compute_s=monitor.seconds,
            final=monitor.final,
            trouble=trouble,
        )

    def _scored(
        self, record: EpisodeRecord, episode: _Episode, score: Score | None
    ) -> EpisodeRecord:
        """The record with the truth; where the world does not come back nobody asks it."""
        if score is None:
            return record
        try:
            scored = self._calls.call("scorer", lambda: score(record), "score", gives=EpisodeRecord)
        except PartError as error:
            episode.notes.append(f"not scored: {error}")
            return replace(
                record, success=False, failures=(*record.failures, f"not scored: {error}")
            )
        return scored

    def _remember(self, episode: _Episode, around: Observation) -> None:
        """The first look; what cannot be believed is looked at once more."""
        episode.looked(around)
        try:
            self._monitor.observe(around)
        except PartError as error:
            if not error.senses or self._config.max_looks < 2:
                raise
            around = self._world.scan(thorough=True)
            episode.looked(around)
            self._monitor.observe(around)

    def _loop(self, episode: _Episode) -> EpisodeEnd:
        monitor = self._monitor
        while not monitor.exhausted:
            if monitor.finished:
                decision = self._finish(episode)
                over = decision.hold not in (*_TROUBLES, Hold.REPLAN_LIMIT)
                if over and decision.outcome is not Outcome.REPLAN:
                    return EpisodeEnd.PLAN_FINISHED
            else:
                decision = self._before(episode)
                if decision.may_start:
                    decision = self._execute(episode, decision) or decision
                elif decision.outcome is Outcome.NOT_JUDGED:
                    episode.trouble = Trouble(TroubleKind.FAILED, "monitor", decision.why)
                    return EpisodeEnd.HELD
            if decision.hold is not None:
                if decision.hold in _TROUBLES:
                    episode.trouble = _of_decision(decision, monitor.failed)
                return _ENDS.get(decision.hold, EpisodeEnd.HELD)
        return EpisodeEnd.SUBTASK_LIMIT

    def _before(self, episode: _Episode) -> MonitorDecision:
        """Go to where the next subtask will be done, and judge what is seen there."""
        self._approach()
        return self._judged(episode, self._monitor.before)

    def _approach(self) -> None:
        with self._monitor.phase("act"):
            place = self._monitor.approach()
            if place is not None:
                self._world.approach(place, self._monitor.graph.places())

    def _execute(self, episode: _Episode, decision: MonitorDecision) -> MonitorDecision | None:
        monitor, command = self._monitor, decision.command
        assert command is not None, "what may start has a command"
        with monitor.phase("act"):
            outcome = self._world.execute(command, monitor.graph.places())
        answer = monitor.after(outcome)
        try:
            episode.time_s = self._world.time_s()
        finally:
            episode.audience.tell("on_executed", monitor.executed[-1], episode.time_s)
        if answer is None or answer.outcome is not Outcome.LOOK:
            return answer
        return self._judged(episode, lambda seen: _some(monitor.after(outcome, seen)))

    def _finish(self, episode: _Episode) -> MonitorDecision:
        """The plan is finished: look at the last subtask's place once more, if anybody wants to."""
        monitor = self._monitor
        looks = self._config.final_look or monitor.looks_after is not LooksAfter.NOTHING
        if not looks or monitor.last is None:
            return monitor.finish()
        return self._judged(episode, monitor.finish)

    def _judged(
        self, episode: _Episode, ask: Callable[[Observation], MonitorDecision]
    ) -> MonitorDecision:
        """Look, ask, and look all around where the monitor wants another look.

        Every look is judged and recorded. Where more would be seen from elsewhere, the robot goes
        there, and back before it acts.
        """
        world, moved = self._world, False
        with self._monitor.phase("observe"):
            observation = world.observe(self._monitor.wanted_views())
        while True:
            episode.looked(observation)
            decision = ask(observation)
            self._note(episode, decision)
            if decision.outcome is not Outcome.LOOK:
                if moved and decision.may_start:  # who is held does not drive
                    self._approach()
                return decision
            with self._monitor.phase("observe"):
                moved |= self._go_to_look(decision.look_at)
                around = world.scan(thorough=True)
                ahead = world.observe(decision.look_at)
                observation = replace(ahead, frames=(*around.frames, *ahead.frames))

    def _go_to_look(self, points: Sequence[Vec3]) -> bool:
        """Go to where more would be seen around the points, if the robot can; whether it went."""
        if not points:
            return False
        eyes = self._world.vantages(points[-1])
        best = self._monitor.best_vantage(eyes, points)
        if best is None:
            return False
        self._world.look_from(eyes[best], points[-1])
        return True

    def _note(self, episode: _Episode, decision: MonitorDecision) -> None:
        record, context = decision.record, decision.context
        if record is None or context is None:
            return  # of a skill that nobody knows nothing is judged
        if not self._config.keep_observations:
            record = replace(record, observation=None)
        episode.boundaries.append(record)
        episode.audience.tell("on_boundary", record, context)
        episode.time_s = self._world.time_s()


def _some(decision: MonitorDecision | None) -> MonitorDecision:
    assert decision is not None, "what is looked at after a subtask is judged"
    return decision


def _trouble(error: PartError) -> Trouble:
    """What a part did, for the record; where in the program, if it was no error on purpose."""
    kind = TroubleKind.FAILED
    if error.senses:
        kind = TroubleKind.SENSES
    elif error.late:
        kind = TroubleKind.LATE
    elif error.world:
        kind = TroubleKind.WORLD
    elif error.internal:
        kind = TroubleKind.INTERNAL
    trace = ""
    if error.internal and error.__cause__ is not None:
        trace = "".join(traceback.format_exception(error.__cause__))[-_LONGEST_TRACE:]
    return Trouble(kind, error.part, str(error), trace)


def _of_decision(decision: MonitorDecision, failed: PartError | None) -> Trouble:
    if decision.hold is Hold.TOO_MANY or failed is None:
        return Trouble(TroubleKind.TOO_MANY, "monitor", decision.why)
    return _trouble(failed)


_LONGEST_TRACE = 4000
"""Characters; the end of it, where the error came up."""
