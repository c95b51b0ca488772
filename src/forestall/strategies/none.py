"""The plan as given (the paper's baseline without replanning)."""

from __future__ import annotations

from forestall.types.episode import SkillOutcome
from forestall.types.runtime import BoundaryContext, LooksAfter, StrategyAnswer
from forestall.types.verdict import Decision

_GO_ON = StrategyAnswer(Decision.PROCEED)


class NoReplanning:
    """Always goes on."""

    name = "none"
    looks_after = LooksAfter.NOTHING

    def before_subtask(self, context: BoundaryContext) -> StrategyAnswer:
        """Go on."""
        return _GO_ON

    def after_subtask(self, context: BoundaryContext, outcome: SkillOutcome) -> StrategyAnswer:
        """Go on."""
        return _GO_ON

    def after_episode(self, context: BoundaryContext) -> StrategyAnswer:
        """Go on."""
        return _GO_ON
