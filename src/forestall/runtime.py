"""The one episode loop: an environment around a monitor.

It drives, looks and acts where the monitor says so; the monitor judges. All strategies run in this
loop, so that a measured difference between them is theirs. Listeners are told what happened and
cannot change it.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

from forestall.conclusion import MonitorConfig
from forestall.errors import ForestallError
from forestall.monitor import Monitor
from forestall.records.plain import plain
from forestall.types.decision import Hold, MonitorDecision, Outcome
from forestall.types.episode import BoundaryRecord, EpisodeEnd, EpisodeRecord
from forestall.types.observation import Observation
from forestall.types.plan import Plan
from forestall.types.runtime import LooksAfter
from forestall.types.task import Task

if TYPE_CHECKING:
    from forestall.domain.model import Domain
    from forestall.seams import Environment, Listener, Perceiver, Strategy

Score = Callable[[EpisodeRecord], EpisodeRecord]

_ENDS = {
    Hold.STOPPED: EpisodeEnd.STOPPED,
    Hold.REPLAN_LIMIT: EpisodeEnd.REPLAN_LIMIT,
}


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
        )


@dataclass(slots=True)
class _Episode:
    """What is kept of one episode beside what the monitor knows."""

    boundaries: list[BoundaryRecord] = field(default_factory=list)
    time_s: float = 0.0


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
        self._listeners = tuple(listeners)
        self._config = config or RuntimeConfig()
        self._monitor = Monitor(strategy, domain, perceiver, self._config.monitor())

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
        known = (*provenance, ("perception", self._perceiver.describe()))
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
        for listener in self._listeners:
            listener.on_start(record)
        monitor, episode = self._monitor, _Episode()
        end, broken = EpisodeEnd.ERROR, None
        try:
            monitor.start(task, plan)
            self._environment.reset(seed)
            with monitor.phase("observe"):
                around = self._environment.scan()
            monitor.observe(around)
            end = self._loop(episode)
        except Exception as error:  # noqa: BLE001 - whatever breaks, what came before is kept
            broken = error
        record = replace(
            record,
            boundaries=tuple(episode.boundaries),
            executed=monitor.executed,
            end=end,
            success=None if broken is None else False,
            failures=() if broken is None else (f"the run broke off: {broken}",),
            simulated_s=episode.time_s,
            compute_s=monitor.seconds,
            final=monitor.final,
        )
        if score is not None and broken is None:
            record = score(record)
        for listener in self._listeners:
            listener.on_end(record)
        if broken is not None and not isinstance(broken, ForestallError):
            raise broken
        return record

    def _loop(self, episode: _Episode) -> EpisodeEnd:
        monitor = self._monitor
        while not monitor.exhausted:
            if monitor.finished:
                decision = self._finish(episode)
                goes_on = decision.outcome is Outcome.REPLAN
                if not goes_on and decision.hold is not Hold.REPLAN_LIMIT:
                    return EpisodeEnd.PLAN_FINISHED
            else:
                decision = self._before(episode)
                if decision.may_start:
                    decision = self._execute(episode, decision) or decision
            if decision.hold is not None:
                return _ENDS[decision.hold]
        return EpisodeEnd.SUBTASK_LIMIT

    def _before(self, episode: _Episode) -> MonitorDecision:
        """Go to where the next subtask will be done, and judge what is seen there."""
        with self._monitor.phase("act"):
            place = self._monitor.approach()
            if place is not None:
                self._environment.approach(place)
        return self._judged(episode, self._monitor.before)

    def _execute(self, episode: _Episode, decision: MonitorDecision) -> MonitorDecision | None:
        monitor, command = self._monitor, decision.command
        assert command is not None, "what may start has a command"
        with monitor.phase("act"):
            outcome = self._environment.execute(command)
        answer = monitor.after(outcome)
        episode.time_s = self._environment.time_s
        for listener in self._listeners:
            listener.on_executed(monitor.executed[-1], episode.time_s)
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

        Every look is judged and recorded.
        """
        with self._monitor.phase("observe"):
            observation = self._environment.observe(self._monitor.wanted_views())
        while True:
            decision = ask(observation)
            self._note(episode, decision)
            if decision.outcome is not Outcome.LOOK:
                return decision
            with self._monitor.phase("observe"):
                around = self._environment.scan(thorough=True)
                ahead = self._environment.observe(decision.look_at)
                observation = replace(ahead, frames=(*around.frames, *ahead.frames))

    def _note(self, episode: _Episode, decision: MonitorDecision) -> None:
        record, context = decision.record, decision.context
        assert record is not None and context is not None, "what was looked at is recorded"
        if not self._config.keep_observations:
            record = replace(record, observation=None)
        episode.boundaries.append(record)
        episode.time_s = self._environment.time_s
        for listener in self._listeners:
            listener.on_boundary(record, context)


def _some(decision: MonitorDecision | None) -> MonitorDecision:
    assert decision is not None, "what is looked at after a subtask is judged"
    return decision
