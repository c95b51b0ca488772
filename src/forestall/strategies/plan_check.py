"""The plan check as a judge: does what is left of the plan run on what is seen?

Called by the monitor before each subtask; validator and replanner come through the constructor. It
needs no demonstration, judges steps that none has, and sees a wrong plan before it starts. It knows
what the domain file knows, and nothing else.
"""

from __future__ import annotations

from dataclasses import replace

from forestall.domain.asked import not_understood
from forestall.seams.judging import PlanValidator, Replanner
from forestall.strategies.intervention import (
    PLAN_CHECK,
    Clock,
    Intervention,
    checked,
    look_again,
    would_not_work,
)
from forestall.strategies.relied import relied_on_now
from forestall.types.episode import SkillOutcome
from forestall.types.runtime import BoundaryContext, LooksAfter, StrategyAnswer
from forestall.types.verdict import Decision, PlanCheck

_GO_ON = StrategyAnswer(Decision.PROCEED)


class PlanChecking:
    """Executes the rest of the plan on the observed graph before each subtask.

    - it runs and reaches the goal: proceed, unless what the next subtask relies on was not seen, or
      something is said of its arguments that the domain has no word for;
    - it does not: another look, then an alarm and a plan from what is seen.

    Args:
        replanner: makes the corrected plan.
        validator: executes what is left of a plan on what is seen.
        max_attempts: repairs of one cause.
    """

    name = "plan-check"
    looks_after = LooksAfter.NOTHING

    def __init__(
        self, replanner: Replanner, validator: PlanValidator, max_attempts: int = 2
    ) -> None:
        self._validator = validator
        self._intervention = Intervention(replanner, validator, max_attempts)

    def before_subtask(self, context: BoundaryContext) -> StrategyAnswer:
        """Execute what is left in the mind; on a refusal replan."""
        self._intervention.begin(context)
        clock = Clock()
        if (done := self._intervention.done_already(context, clock)) is not None:
            return done
        if context.subtask in context.refused:
            return self._intervention.refused(context, clock)
        domain = self._validator.domain
        check = self._intervention.check_plan(context, clock)
        verdict = checked(PLAN_CHECK, check.ok, told(check))
        if not check.ok:
            diagnosis = would_not_work(check)
            if context.may_look:
                return look_again(verdict, clock, diagnosis.cause, diagnosis)
            return self._intervention.alarm(context, verdict, diagnosis, clock)
        lost = [n for n in context.subtask.args if not context.graph.matches(n)]
        unseen = lost or [str(x) for x in relied_on_now(check, context, domain)]
        if unseen:
            why = f"not observed: {', '.join(unseen)}"
            found = self._intervention.look_for(context, verdict, clock)
            return found or look_again(replace(verdict, note=why), clock, why)
        if strange := not_understood(context.scoped, context.subtask, domain):
            why = "; ".join(strange)
            return look_again(replace(verdict, note=why), clock, why)
        return StrategyAnswer(Decision.PROCEED, verdict, seconds=clock.items())

    def after_subtask(self, context: BoundaryContext, outcome: SkillOutcome) -> StrategyAnswer:
        """Go on: what went wrong shows at the next boundary."""
        return _GO_ON

    def after_episode(self, context: BoundaryContext) -> StrategyAnswer:
        """Go on: the last check was before the last subtask."""
        return _GO_ON


def told(check: PlanCheck) -> str:
    """What the plan check says, for a verdict."""
    if check.ok:
        return "what is left of the plan runs on what is seen"
    if check.step is None:
        return check.reason
    return f"step {check.step + 1} of what is left cannot run: {check.reason}"
