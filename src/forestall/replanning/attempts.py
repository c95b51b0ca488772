"""What one replanning has tried and may still try. Called by the replanner."""

from __future__ import annotations

from dataclasses import dataclass

from forestall.deadline import Deadline
from forestall.planning.planner import Planned
from forestall.types.plan import Plan, Subtask
from forestall.types.verdict import PlanCheck, ReplanOutcome


@dataclass(slots=True)
class Attempts:
    """What the attempts of one replanning may take and try, what they cost and how they failed."""

    start_s: float
    deadline: Deadline
    refused: frozenset[Subtask] = frozenset()
    vain: tuple[Subtask, ...] = ()
    expanded: int = 0
    timed_out: bool = False
    unproven: bool = False
    notes: tuple[str, ...] = ()
    rejected: tuple[Plan, PlanCheck] | None = None

    def share(self) -> Deadline:
        """Half of the time that is left, so that one attempt leaves some to the next."""
        return self.deadline.within(self.deadline.left() / 2)

    def count(self, planned: Planned) -> Planned:
        """Note what an attempt took and how it ended."""
        self.expanded += planned.expanded
        self.timed_out |= planned.outcome is ReplanOutcome.TIMEOUT
        self.unproven = planned.outcome is not ReplanOutcome.UNSOLVABLE
        if planned.note:
            self.notes = (*self.notes, planned.note)
        return planned
