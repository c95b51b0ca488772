"""What is true when a run is judged, for scoring: could the next step be done, and the rest?

A listener: it is told what happens and cannot change it. It executes the plan at hand on the true
state in the planning domain; the upper bound that no detector can beat, and the earliest moment at
which a failure exists. Built by `assembly` with the oracle, read by the experiments.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

from forestall.domain.model import Domain
from forestall.planning.validate import GraphValidator
from forestall.seams import OracleView
from forestall.strategies.intervention import rest_of
from forestall.types.episode import BoundaryRecord, EpisodeRecord, ExecutedRecord, SkillStatus
from forestall.types.plan import Plan
from forestall.types.runtime import BoundaryContext, When
from forestall.types.task import Goal


@dataclass(frozen=True, slots=True)
class TrueMoment:
    """The truth when a subtask came next.

    `possible`: it could be carried out. `reachable`: it and what is left of the plan would lead to
    the goal, with nothing happening on the way that must never happen.
    """

    possible: bool
    reachable: bool


class TruthTrace:
    """Implements `Listener`; `moments` has one entry for each call of a strategy."""

    def __init__(self) -> None:
        self.moments: list[TrueMoment] = []
        self._look: Callable[[BoundaryContext], TrueMoment] | None = None
        self._succeeded = True

    def attach(self, oracle: OracleView, domain: Domain) -> None:
        """Say whose truth is meant; `assembly` does."""
        validator = GraphValidator(domain)

        def look(context: BoundaryContext) -> TrueMoment:
            truth = oracle.truth()
            context = replace(context, index=context.index + self._done(context))
            rest = rest_of(context, domain)
            whole = validator.check(rest, truth, context.task.goal)
            if whole.ok:
                return TrueMoment(True, True)
            first = len(rest) - len(context.remaining()) + 1
            step = validator.check(Plan(rest.subtasks[:first]), truth, Goal(""))
            return TrueMoment(step.ok, False)

        self._look = look

    def on_start(self, record: EpisodeRecord) -> None:
        """Forget an earlier run."""
        self.moments.clear()

    def on_boundary(self, boundary: BoundaryRecord, context: BoundaryContext) -> None:
        """Look at the truth."""
        assert self._look is not None, "attach() comes first"
        self.moments.append(self._look(context))

    def on_executed(self, executed: ExecutedRecord, time_s: float) -> None:
        """A refused subtask is still to be done."""
        self._succeeded = executed.outcome.status is SkillStatus.SUCCEEDED

    def on_end(self, record: EpisodeRecord) -> None:
        """Nothing to look at."""

    def _done(self, context: BoundaryContext) -> int:
        """How many subtasks of the rest are over: after a subtask it is still the next one's."""
        return int(context.when is When.AFTER and self._succeeded)
