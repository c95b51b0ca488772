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
from forestall.types.plan import Plan
from forestall.types.runtime import BoundaryContext, StrategyAnswer
from forestall.types.verdict import Decision, Diagnosis, Replan, ReplanOutcome, Verdict

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

    Within a repair the facts that the repair is about to restore do not alarm again. A cause whose
    repair did not help after `max_attempts` attempts is left alone, so that a run cannot turn in
    circles. When a fact must change, no plan changes it, and the plan at hand does not check out
    either, the run stops safely.
    """

    name = "proactive"

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
        self._pending: frozenset[Literal] = frozenset()
        self._resume_left = -1
        self._attempts: dict[tuple[Literal, ...], int] = {}

    def before_subtask(self, context: BoundaryContext) -> StrategyAnswer:
        """Retrieve, compare; on an alarm diagnose and replan."""
        left = len(context.plan) - context.index
        if context.replans == 0:
            self._pending, self._resume_left = frozenset(), -1
            if left == len(context.plan):
                self._attempts.clear()
        elif left <= self._resume_left:
            self._pending = frozenset()
        clock = _Clock()
        references = tuple(
            self._retriever.retrieve(context.subtask, context.task.name, context.done)
        )
        clock.lap("retrieve")
        context = replace(context, references=references)
        verdict = self._detector.judge(context.scoped, context.observation, references)
        clock.lap("compare")
        if verdict.decision is Decision.LOOK_AGAIN and context.looks == 1:
            return StrategyAnswer(Decision.LOOK_AGAIN, verdict, seconds=clock.items())
        if verdict.decision is Decision.PROCEED:
            return StrategyAnswer(Decision.PROCEED, verdict, seconds=clock.items())
        verdict = replace(verdict, decision=Decision.REPLAN)
        return self._alarm(context, verdict, clock)

    def _alarm(self, context: BoundaryContext, verdict: Verdict, clock: _Clock) -> StrategyAnswer:
        diagnosis = self._without_pending(self._reasoner.diagnose(context, verdict))
        clock.lap("diagnose")
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
            self._pending = frozenset(diagnosis.must_change)
            self._resume_left = _common_suffix(replan.plan, context)
            return StrategyAnswer(
                Decision.REPLAN, verdict, diagnosis, replan, diagnosis.cause, clock.items()
            )
        if context.looks == 1:
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
        rest = Plan(context.remaining(), context.plan.goal)
        check = self._validator.check(rest, context.graph, context.task.goal)
        clock.lap("validate")
        decision = Decision.PROCEED if check.ok else Decision.STOP
        why = "no repair found; " + (
            "the plan at hand still checks out" if check.ok else f"stopped: {check.reason}"
        )
        return StrategyAnswer(decision, verdict, diagnosis, replan, why, clock.items())

    def _without_pending(self, diagnosis: Diagnosis) -> Diagnosis:
        left = tuple(fact for fact in diagnosis.must_change if fact not in self._pending)
        if left == diagnosis.must_change:
            return diagnosis
        cause = diagnosis.cause if left else f"being repaired: {diagnosis.cause}"
        return replace(diagnosis, must_change=left, cause=cause)

    def after_subtask(self, context: BoundaryContext, outcome: SkillOutcome) -> StrategyAnswer:
        """Go on: what went wrong shows at the next boundary."""
        return _GO_ON

    def after_episode(self, context: BoundaryContext) -> StrategyAnswer:
        """Go on: proactive monitoring ends with the last subtask's start."""
        return _GO_ON


def _common_suffix(plan: Plan, context: BoundaryContext) -> int:
    """How many subtasks at the end of a corrected plan are the old plan's own."""
    same = 0
    for new, old in zip(reversed(plan.subtasks), reversed(context.remaining()), strict=False):
        if new != old:
            break
        same += 1
    return same
