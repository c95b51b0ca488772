"""What real executives do: whatever the robot says has not gone through is tried once more.

Called by the monitor after each subtask. The baseline of every comparison with a robot that fails
by chance: it needs no camera, no demonstration and no model.
"""

from __future__ import annotations

from forestall.strategies.intervention import SKILL_STATUS, checked
from forestall.types.episode import SkillOutcome, SkillStatus
from forestall.types.plan import Plan
from forestall.types.runtime import BoundaryContext, LooksAfter, StrategyAnswer
from forestall.types.verdict import Decision, Diagnosis, Replan, ReplanOutcome

_GO_ON = StrategyAnswer(Decision.PROCEED)


class RetryOnce:
    """Goes on, and repeats a subtask that the robot reports as not done, each at most so often.

    Args:
        max_attempts: how often one subtask of the plan is repeated.
    """

    name = "retry-once"
    looks_after = LooksAfter.NOTHING

    def __init__(self, max_attempts: int = 1) -> None:
        self._max_attempts = max_attempts
        self._left = -1  # subtasks that were left of the plan when one was repeated last
        self._repeated = 0

    def before_subtask(self, context: BoundaryContext) -> StrategyAnswer:
        """Go on."""
        if context.index == 0 and context.replans == 0:
            self._left, self._repeated = -1, 0
        return _GO_ON

    def after_subtask(self, context: BoundaryContext, outcome: SkillOutcome) -> StrategyAnswer:
        """Was it done? If not, once more."""
        left = len(context.plan) - context.index
        if left != self._left:
            self._left, self._repeated = left, 0
        if outcome.status is SkillStatus.SUCCEEDED or self._repeated >= self._max_attempts:
            return _GO_ON
        self._repeated += 1
        again = Plan(context.plan.subtasks[context.index :], context.plan.goal)
        why = f"{again.subtasks[0]} was {outcome.status.value}: once more"
        return StrategyAnswer(
            Decision.REPLAN,
            checked(SKILL_STATUS, False, why),
            Diagnosis(why, (), producer=self.name),
            Replan(ReplanOutcome.SOLVED, again, producer=self.name),
            why,
        )

    def after_episode(self, context: BoundaryContext) -> StrategyAnswer:
        """Go on."""
        return _GO_ON
