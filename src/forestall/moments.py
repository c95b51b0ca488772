"""One moment of a run: what is seen is believed, judged and recorded, or the robot holds.

Called by the monitor with the state of the run; calls perceiver and strategy (`supervised.py`) and
`conclusion.py`. Whatever of ours fails here is a "hold" that names the part, and never an answer.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import replace

from forestall.conclusion import MonitorConfig, conclude
from forestall.domain.model import Domain
from forestall.errors import ObservationError, PartError
from forestall.in_a_row import Streaks
from forestall.records.boundary import boundary_record
from forestall.records.sentences import in_sentences
from forestall.run_state import RunState
from forestall.supervised import SupervisedParts
from forestall.supervision import part_error
from forestall.types.decision import Hold, MonitorDecision, Outcome
from forestall.types.facts import GRIPPER
from forestall.types.graph import SceneGraph
from forestall.types.observation import Observation
from forestall.types.plan import Subtask
from forestall.types.runtime import BoundaryContext, StrategyAnswer, When
from forestall.types.verdict import Decision


class Moments:
    """Judges moments.

    Args:
        parts: perceiver and strategy.
        config: bounds and policies.
        strategy: its name, for reasons.
    """

    def __init__(self, parts: SupervisedParts, config: MonitorConfig, strategy: str) -> None:
        self._parts, self._config, self._strategy = parts, config, strategy
        self.failed: PartError | None = None

    def see(self, run: RunState, observation: Observation | SceneGraph) -> None:
        """Believe what is seen.

        Raises:
            PartError: it cannot be what the robot sees, or the perceiver failed or was late.
        """
        try:
            run.senses.check(observation)
        except ObservationError as error:
            raise part_error("senses", error) from error
        if isinstance(observation, SceneGraph):
            run.graph = replace(observation, subtask=None)
            hand = observation.get(GRIPPER)
            if hand is not None and hand.centroid_m is not None:
                run.robot_world_m = hand.centroid_m
            return
        run.graph = self._parts.perceive(observation)
        run.robot_world_m = observation.robot_position_world_m
        run.time_s = observation.time_s

    def judge(
        self,
        run: RunState,
        when: When,
        index: int,
        subtask: Subtask | None,
        observation: Observation | SceneGraph,
        ask: Callable[[BoundaryContext], StrategyAnswer],
    ) -> MonitorDecision:
        """One look of one moment; `subtask` is the next one where it is None."""
        try:
            return self._judged(run, when, index, subtask, observation, ask)
        except PartError as error:
            return self._failed(run, error, when, index, subtask, observation)
        except Exception as error:  # noqa: BLE001 - a mistake of ours is no answer
            named = part_error("monitor", error)
            named.__cause__ = error
            return self._failed(run, named, when, index, subtask, observation)

    def conclude(
        self, run: RunState, context: BoundaryContext, answer: StrategyAnswer
    ) -> MonitorDecision:
        """What a strategy's answer comes to; a new plan is adopted here."""
        decision = conclude(context, answer, self._config, self._strategy)
        steps_in = not answer.only_watched  # who interrupts nothing is not interrupted
        if steps_in and (why := run.streaks.after(decision, self._config.limits)):
            run.streaks = Streaks()
            hold = Hold.TOO_MANY
            return replace(
                decision, outcome=Outcome.HOLD, may_start=False, plan=None, hold=hold, why=why
            )
        if decision.plan is not None:
            replan = decision.replan
            run.adopt(decision.plan, replan is not None and bool(replan.looking_for))
        elif decision.outcome is Outcome.LOOK:
            return replace(decision, look_at=run.views(context.subtask))
        elif context.when is When.BEFORE:
            return replace(decision, command=run.command(context.subtask, context.index))
        return decision

    def look(self, run: RunState, subtask: Subtask, why: str) -> MonitorDecision:
        """Ask for another look."""
        views = run.views(subtask)
        return MonitorDecision(Outcome.LOOK, False, subtask, look_at=views, why=why)

    def hold_for(self, error: PartError, subtask: Subtask) -> MonitorDecision:
        """A part failed, was late, or cannot believe what the robot sees."""
        self.failed = error
        hold = Hold.SENSES if error.senses else Hold.INTERNAL
        return MonitorDecision(Outcome.HOLD, False, subtask, hold=hold, why=str(error))

    def too_many(self, run: RunState, subtask: Subtask) -> MonitorDecision | None:
        """Hold where something went wrong too often; whoever goes on then counts anew."""
        why = run.streaks.too_many(self._config.limits)
        if not why:
            return None
        run.streaks = Streaks()
        return MonitorDecision(Outcome.HOLD, False, subtask, hold=Hold.TOO_MANY, why=why)

    def _judged(
        self,
        run: RunState,
        when: When,
        index: int,
        subtask: Subtask | None,
        observation: Observation | SceneGraph,
        ask: Callable[[BoundaryContext], StrategyAnswer],
    ) -> MonitorDecision:
        """Fuse, ask the strategy, conclude, record."""
        with run.phase("perceive"):
            self.see(run, observation)
            picture = observation if isinstance(observation, Observation) else None
            subtask = run.ground() if subtask is None else subtask
            looks = self._config.max_looks
            context = run.context(when, index, subtask, self._parts.scope, picture, looks)
        started = time.perf_counter()
        answer = self._parts.judge(ask, context)
        spent = time.perf_counter() - started
        for name, seconds in answer.seconds:
            run.book(name, seconds)
        run.book("strategy", max(0.0, spent - sum(s for _, s in answer.seconds)))
        decision = self.conclude(run, context, answer)
        if when is When.BEFORE:
            run.last, run.ready = context, decision.outcome is not Outcome.REPLAN
        return self._recorded(run, decision, context, answer)

    def _failed(
        self,
        run: RunState,
        error: PartError,
        when: When,
        index: int,
        subtask: Subtask | None,
        observation: Observation | SceneGraph,
    ) -> MonitorDecision:
        """Hold on what was known before; what the robot sees may be looked at once more."""
        if subtask is None:
            subtask = run.plan.subtasks[run.position]
        picture = observation if isinstance(observation, Observation) else None
        context = run.context(when, index, subtask, _whole, picture, self._config.max_looks)
        decision = self.hold_for(error, subtask)
        if error.senses and context.may_look:
            decision = self.look(run, subtask, str(error))
        run.ready = False
        return self._recorded(run, decision, context, StrategyAnswer(Decision.STOP, why=str(error)))

    def _recorded(
        self,
        run: RunState,
        decision: MonitorDecision,
        context: BoundaryContext,
        answer: StrategyAnswer,
    ) -> MonitorDecision:
        """The decision with the record of its moment, which is over unless another look follows."""
        after = context.when is When.AFTER
        sentence = _told(context, decision, answer, self._parts.domain)
        record = boundary_record(
            run.boundary - after,
            context,
            answer,
            decision.outcome,
            run.since,
            run.seconds,
            run.time_s,
            sentence,
        )
        run.mark()
        if decision.outcome is Outcome.LOOK:
            run.looks = context.looks
        else:
            run.looks = 0
            run.boundary += not after
        return replace(
            decision, context=context, record=record, seconds=record.seconds, sentence=sentence
        )


def _told(
    context: BoundaryContext, decision: MonitorDecision, answer: StrategyAnswer, domain: Domain
) -> str:
    """What the owner is told; words that cannot be found change no decision."""
    try:
        return in_sentences(context, decision, answer, domain)
    except Exception:  # noqa: BLE001 - facts of somebody's own part may be about anything
        return decision.why


def _whole(graph: SceneGraph, subtask: Subtask) -> SceneGraph:
    return replace(graph, subtask=subtask)
