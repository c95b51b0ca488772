"""Replanning before a failure materialises (paper, Sec. 3): compare, explain, correct, go on.

Called by the runtime at each boundary. Retriever, detector, reasoner, replanner and validator come
through the constructor.
"""

from __future__ import annotations

import time
from dataclasses import dataclass, field, replace

from forestall.interfaces import Detector, PlanValidator, Reasoner, Replanner, Retriever
from forestall.types.episode import SkillOutcome
from forestall.types.facts import Literal
from forestall.types.plan import Plan, same_step
from forestall.types.runtime import BoundaryContext, LooksAfter, StrategyAnswer
from forestall.types.verdict import (
    Calibration,
    Decision,
    Diagnosis,
    Replan,
    ReplanOutcome,
    Verdict,
)

_GO_ON = StrategyAnswer(Decision.PROCEED)


@dataclass(slots=True)
class _Clock:
    """Compute seconds by phase."""

    seconds: dict[str, float] = field(default_factory=dict)
    _last: float = field(default_factory=time.perf_counter)

    def lap(self, name: str) -> None:
        now = time.perf_counter()
        self.seconds[name] = self.seconds.get(name, 0.0) + now - self._last
        self._last = now

    def items(self) -> tuple[tuple[str, float], ...]:
        return tuple(self.seconds.items())


class Proactive:
    """Judges each subtask before it starts.

    Subtasks of the nominal plan are compared with demonstrations of the same point. The steps of a
    repair have no such point: there the rest of the plan is checked on what is seen, by the same
    validator that accepted the repair, and an alarm is raised when it would no longer run.

    A cause whose repair did not help after `max_attempts` attempts is left alone, so that a run
    cannot turn in circles. When a fact must change, no plan changes it, and the plan at hand does
    not check out either, the run stops safely.
    """

    name = "proactive"
    looks_after = LooksAfter.NOTHING

    def __init__(
        self,
        retriever: Retriever,
        detector: Detector,
        reasoner: Reasoner,
        replanner: Replanner,
        validator: PlanValidator,
        max_attempts: int = 2,
    ) -> None:
        self._retriever = retriever
        self._detector = detector
        self._reasoner = reasoner
        self._replanner = replanner
        self._validator = validator
        self._max_attempts = max_attempts
        self._resume_left = 0
        self._attempts: dict[tuple[Literal, ...], int] = {}

    def before_subtask(self, context: BoundaryContext) -> StrategyAnswer:
        """Retrieve, compare; on an alarm diagnose and replan."""
        if context.replans == 0:
            self._resume_left = len(context.plan)
            if context.index == 0:
                self._attempts.clear()
        clock = _Clock()
        if len(context.plan) - context.index > self._resume_left:
            return self._repairing(context, clock)
        references = tuple(
            self._retriever.retrieve(context.subtask, context.task.name, context.done)
        )
        clock.lap("retrieve")
        context = replace(context, references=references)
        verdict = self._detector.judge(context.scoped, context.observation, references)
        clock.lap("compare")
        if verdict.decision is Decision.LOOK_AGAIN and context.may_look:
            return StrategyAnswer(Decision.LOOK_AGAIN, verdict, seconds=clock.items())
        if verdict.decision is Decision.PROCEED:
            return StrategyAnswer(Decision.PROCEED, verdict, seconds=clock.items())
        verdict = replace(verdict, decision=Decision.REPLAN)
        diagnosis = self._reasoner.diagnose(context, verdict)
        clock.lap("diagnose")
        return self._alarm(context, verdict, diagnosis, clock)

    def _repairing(self, context: BoundaryContext, clock: _Clock) -> StrategyAnswer:
        """Inside a repair: does what is left of the plan still run from what is seen?"""
        rest = _rest(context)
        check = self._validator.check(rest, context.graph, context.task.goal)
        clock.lap("validate")
        verdict = Verdict(
            Decision.PROCEED if check.ok else Decision.REPLAN,
            "plan check",
            score=None,
            threshold=0.0,
            calibration=Calibration.FIXED,
            note="a step of the repair: the rest of the plan is checked instead of compared",
        )
        if check.ok:
            return StrategyAnswer(Decision.PROCEED, verdict, seconds=clock.items())
        if context.may_look:
            verdict = replace(verdict, decision=Decision.LOOK_AGAIN)
            return StrategyAnswer(
                Decision.LOOK_AGAIN, verdict, why=check.reason, seconds=clock.items()
            )
        diagnosis = Diagnosis(
            cause=f"the corrected plan would no longer work: {check.reason}",
            must_change=check.lacking or check.unmet,
            producer="plan check",
        )
        return self._alarm(context, verdict, diagnosis, clock)

    def _alarm(
        self,
        context: BoundaryContext,
        verdict: Verdict,
        diagnosis: Diagnosis,
        clock: _Clock,
    ) -> StrategyAnswer:
        if not diagnosis.must_change:
            replan = Replan(ReplanOutcome.NOTHING_TO_CHANGE, producer=self._replanner.name)
            return StrategyAnswer(
                Decision.PROCEED, verdict, diagnosis, replan, "nothing must change", clock.items()
            )
        key = tuple(sorted(diagnosis.must_change))
        if self._attempts.get(key, 0) >= self._max_attempts:
            why = f"tried {self._max_attempts} repairs of this already"
            return StrategyAnswer(Decision.PROCEED, verdict, diagnosis, None, why, clock.items())
        replan = self._replanner.replan(context, diagnosis)
        clock.lap("replan")
        if replan.outcome is ReplanOutcome.SOLVED and replan.plan is not None:
            self._attempts[key] = self._attempts.get(key, 0) + 1
            self._resume_left = min(self._resume_left, _common_suffix(replan.plan, context))
            return StrategyAnswer(
                Decision.REPLAN, verdict, diagnosis, replan, diagnosis.cause, clock.items()
            )
        if context.may_look:
            return StrategyAnswer(
                Decision.LOOK_AGAIN, verdict, diagnosis, replan, replan.note, clock.items()
            )
        return self._no_plan(context, verdict, diagnosis, replan, clock)

    def _no_plan(
        self,
        context: BoundaryContext,
        verdict: Verdict,
        diagnosis: Diagnosis,
        replan: Replan,
        clock: _Clock,
    ) -> StrategyAnswer:
        """Go on only if the plan at hand still checks out on what is seen."""
        rest = _rest(context)
        check = self._validator.check(rest, context.graph, context.task.goal)
        clock.lap("validate")
        decision = Decision.PROCEED if check.ok else Decision.STOP
        why = "no repair found; " + (
            "the plan at hand still checks out" if check.ok else f"stopped: {check.reason}"
        )
        return StrategyAnswer(decision, verdict, diagnosis, replan, why, clock.items())

    def after_subtask(self, context: BoundaryContext, outcome: SkillOutcome) -> StrategyAnswer:
        """Go on: what went wrong shows at the next boundary."""
        return _GO_ON

    def after_episode(self, context: BoundaryContext) -> StrategyAnswer:
        """Go on: proactive monitoring ends with the last subtask's start."""
        return _GO_ON


def _rest(context: BoundaryContext) -> Plan:
    """What is left of the plan, with the drive before it: where the robot stands matters."""
    start = context.index
    if start > 0 and context.plan.subtasks[start - 1].skill == "navigate_to_obj":
        start -= 1
    return Plan(context.plan.subtasks[start:], context.plan.goal)


def _common_suffix(plan: Plan, context: BoundaryContext) -> int:
    """How many subtasks at the end of a corrected plan are the old plan's own."""
    same = 0
    for new, old in zip(reversed(plan.subtasks), reversed(context.remaining()), strict=False):
        if not same_step(new, old):
            break
        same += 1
    return same
