"""Replanning before a failure materialises (paper, Sec. 3): compare, explain, correct, go on.

Called by the runtime at each boundary. Retriever, detector, reasoner, replanner and validator come
through the constructor; what follows an alarm is in `intervention.py`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from forestall.seams.judging import Detector, PlanValidator, Reasoner, Replanner, Retriever
from forestall.strategies.asked import AskedDetector, AskedReasoner, AskedRetriever
from forestall.strategies.intervention import (
    PLAN_CHECK,
    SKILL_STATUS,
    Clock,
    Intervention,
    checked,
    look_again,
    would_not_work,
)
from forestall.strategies.panel import Panel, together
from forestall.types.episode import SkillOutcome, SkillStatus
from forestall.types.plan import Plan, Subtask
from forestall.types.runtime import BoundaryContext, LooksAfter, StrategyAnswer
from forestall.types.verdict import (
    Decision,
    Diagnosis,
    PlanCheck,
    Replan,
    ReplanOutcome,
    Verdict,
)

_GO_ON = StrategyAnswer(Decision.PROCEED)


class Proactive:
    """Judges each subtask before it starts.

    Subtasks of the nominal plan are compared with demonstrations of the same point. The steps of a
    repair have no such point: there the rest of the plan is checked on what is seen, by the same
    validator that accepted the repair, and an alarm is raised when it would no longer run.

    Args:
        retriever: finds the references.
        detector: judges the scene before a subtask.
        reasoner: explains.
        replanner: makes the corrected plan.
        validator: says whether what is left of a plan runs on what is seen.
        max_attempts: repairs of one cause.
        repeats: whether what the robot says was not done is to be done again.
        panel: judges in the place of the detector, heard together.
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
        repeats: bool = False,
        panel: Panel | None = None,
    ) -> None:
        self._retriever = AskedRetriever(retriever)
        self._detector = AskedDetector(detector)
        self._reasoner = AskedReasoner(reasoner)
        self._intervention = Intervention(replanner, validator, max_attempts)
        self._repeats = repeats
        self._panel = panel
        self._validator = validator
        self._max_attempts = max_attempts
        self._undone: dict[Subtask, int] = {}

    def before_subtask(self, context: BoundaryContext) -> StrategyAnswer:
        """Retrieve, compare; on an alarm diagnose and replan."""
        self._intervention.begin(context)
        if context.index == 0 and context.replans == 0:
            self._undone.clear()
        clock = Clock()
        if (done := self._intervention.done_already(context, clock)) is not None:
            return done
        if context.subtask in context.refused:
            return self._refused(context, clock)
        if self._intervention.repairs(context):
            return self._intervention.check_rest(context, clock)
        context = self._with_references(context, clock)
        if self._panel is not None:
            return self._by_panel(self._panel, context, clock)
        verdict = self._detector.judge(
            context.scoped, context.observation, context.references, context
        )
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
            found = self._intervention.look_for(context, verdict, clock)
            return found or StrategyAnswer(
                Decision.LOOK_AGAIN, verdict, diagnosis, None, verdict.note, clock.items()
            )
        return self._intervention.alarm(context, verdict, diagnosis, clock)

    def _with_references(self, context: BoundaryContext, clock: Clock) -> BoundaryContext:
        references = tuple(
            self._retriever.retrieve(context.subtask, context.task.name, context.done)
        )
        clock.lap("retrieve")
        return replace(context, references=references)

    def _refused(self, context: BoundaryContext, clock: Clock) -> StrategyAnswer:
        """The robot is heard, and of the judges what they say is lacking."""
        if self._panel is None:
            return self._intervention.refused(context, clock)
        context = self._with_references(context, clock)
        _, said = self._heard(self._panel, context, clock)
        lacking = tuple(dict.fromkeys(x for v in said for x in v.lacking))
        answer = self._intervention.refused(context, clock, lacking)
        return replace(answer, watched=said)

    def _heard(
        self, panel: Panel, context: BoundaryContext, clock: Clock
    ) -> tuple[PlanCheck | None, tuple[Verdict, ...]]:
        check = self._intervention.check_plan(context, clock) if panel.checks_plan else None
        said = panel.hear(context, check, self._validator.domain)
        clock.lap("compare")
        return check, said

    def _by_panel(self, panel: Panel, context: BoundaryContext, clock: Clock) -> StrategyAnswer:
        """Hear every judge; an alarm of theirs is explained by all that raise one."""
        check, said = self._heard(panel, context, clock)
        verdict = panel.decide(said)
        look = verdict.decision is Decision.LOOK_AGAIN
        if look and not context.may_look:
            verdict = panel.once_more(said)
            look = verdict.decision is Decision.LOOK_AGAIN
        if look and context.may_look:
            suspected = None if check is None or check.ok else would_not_work(check)
            answer = look_again(verdict, clock, verdict.note, suspected)
        elif verdict.decision is Decision.PROCEED:
            answer = StrategyAnswer(Decision.PROCEED, verdict, seconds=clock.items())
        else:
            answer = self._alarmed(context, verdict, said, check, clock)
        return replace(answer, watched=said)

    def _alarmed(
        self,
        context: BoundaryContext,
        verdict: Verdict,
        said: Sequence[Verdict],
        check: PlanCheck | None,
        clock: Clock,
    ) -> StrategyAnswer:
        """An alarm, or what nobody could see: diagnose by whoever does not let the step pass."""
        unseen = verdict.decision is Decision.LOOK_AGAIN
        alarmed = replace(verdict, decision=Decision.REPLAN)
        against = [
            v for v in said if v.decision is not Decision.PROCEED and v.detector != PLAN_CHECK
        ]
        compared = None
        if against:
            first = replace(against[0], decision=Decision.REPLAN)
            compared = self._reasoner.diagnose(replace(context, said=tuple(said)), first)
        clock.lap("diagnose")
        if unseen and (compared is None or not compared.must_change):
            found = self._intervention.look_for(context, verdict, clock)
            return found or look_again(verdict, clock, verdict.note)
        diagnosis = together(check, compared)
        return self._intervention.alarm(context, alarmed, diagnosis, clock)

    def after_subtask(self, context: BoundaryContext, outcome: SkillOutcome) -> StrategyAnswer:
        """Go on, as the paper does: what went wrong shows at the next boundary.

        Where `repeats` is set, what was not done is to be done again: after a failure the same,
        after a refusal with other things than those that were refused. What is not done in
        `max_attempts` repetitions is an alarm.
        """
        if not self._repeats or outcome.status is SkillStatus.SUCCEEDED:
            return _GO_ON
        tried = self._undone[context.subtask] = self._undone.get(context.subtask, 0) + 1
        why = f"{context.subtask} was {outcome.status.value}"
        verdict = checked(SKILL_STATUS, False, why)
        diagnosis = Diagnosis(
            why, (), culprits=context.subtask.args, producer=self.name, step=context.subtask
        )
        if tried > self._max_attempts:
            why = f"{why} {tried} times"
            return StrategyAnswer(Decision.PROCEED, verdict, diagnosis, None, why)
        again = Plan(context.remaining(), context.plan.goal)
        replan = Replan(ReplanOutcome.SOLVED, again, producer=self.name)
        return StrategyAnswer(Decision.REPLAN, verdict, diagnosis, replan, why)

    def after_episode(self, context: BoundaryContext) -> StrategyAnswer:
        """Go on: proactive monitoring ends with the last subtask's start."""
        return _GO_ON
