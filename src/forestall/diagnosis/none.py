"""The ablation without the reasoning module (paper, Table 2): something does not fit, no more.

Called where a reasoner can stand; calls `planning`. The replanner learns nothing of the cause and
so plans for the goal from what is seen ("uninformed replanning strategies that often fail to
address the root causes", Sec. 4). It belongs together with `replanning/anew.py`: a replanner that
restores facts and then resumes the old plan would take the goal for the cause and do things twice.
"""

from __future__ import annotations

from dataclasses import replace

from forestall.domain.model import Domain
from forestall.planning.validate import observed, unmet
from forestall.types.runtime import BoundaryContext
from forestall.types.verdict import Diagnosis, Verdict


class NoReasoning:
    """Names what the goal still lacks in place of a cause (implements `Reasoner`).

    Args:
        domain: what is planned in.
    """

    name = "none"

    def __init__(self, domain: Domain) -> None:
        self._domain = domain

    def diagnose(self, context: BoundaryContext, verdict: Verdict) -> Diagnosis:
        """The goal's literals that do not hold under the binding that comes nearest to it."""
        state = observed(context.graph, self._domain)
        lacking = unmet((state,), replace(context.task.goal, never=()))
        return Diagnosis(
            cause="no reasoning: the scene does not fit",
            must_change=tuple(dict.fromkeys(lacking)),
            producer=self.name,
        )
