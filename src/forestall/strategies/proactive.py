"""Replanning before a failure materialises (paper, Sec. 3): compare, explain, correct, go on.

Called by the runtime at each boundary. Retriever, detector, reasoner, replanner and validator come
through the constructor; what follows an alarm is in `intervention.py`.
"""

from __future__ import annotations

from dataclasses import replace

from forestall.seams import Detector, PlanValidator, Reasoner, Replanner, Retriever
from forestall.strategies.asked import AskedDetector, AskedReasoner, AskedRetriever
from forestall.strategies.intervention import Clock, Intervention
from forestall.types.episode import SkillOutcome
from forestall.types.runtime import BoundaryContext, LooksAfter, StrategyAnswer
from forestall.types.verdict import Decision

_GO_ON = StrategyAnswer(Decision.PROCEED)


class Proactive:
    """Judges each subtask before it starts.

    Subtasks of the nominal plan are compared with demonstrations of the same point. The steps of a
    repair have no such point: there the rest of the plan is checked on what is seen, by the same
    validator that accepted the repair, and an alarm is raised when it would no longer run.
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
        self._retriever = AskedRetriever(retriever)
        self._detector = AskedDetector(detector)
        self._reasoner = AskedReasoner(reasoner)
        self._intervention = Intervention(replanner, validator, max_attempts)

    def before_subtask(self, context: BoundaryContext) -> StrategyAnswer:
        """Retrieve, compare; on an alarm diagnose and replan."""
        self._intervention.begin(context)
        clock = Clock()
        if context.subtask in context.refused:
            return self._intervention.refused(context, clock)
        if self._intervention.repairs(context):
            return self._intervention.check_rest(context, clock)
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
        unseen = verdict.decision is Decision.LOOK_AGAIN
        verdict = replace(verdict, decision=Decision.REPLAN)
        diagnosis = self._reasoner.diagnose(context, verdict)
        clock.lap("diagnose")
        if unseen and not diagnosis.must_change:
            return StrategyAnswer(
                Decision.LOOK_AGAIN, verdict, diagnosis, None, verdict.note, clock.items()
            )
        return self._intervention.alarm(context, verdict, diagnosis, clock)

    def after_subtask(self, context: BoundaryContext, outcome: SkillOutcome) -> StrategyAnswer:
        """Go on: what went wrong shows at the next boundary."""
        return _GO_ON

    def after_episode(self, context: BoundaryContext) -> StrategyAnswer:
        """Go on: proactive monitoring ends with the last subtask's start."""
        return _GO_ON
