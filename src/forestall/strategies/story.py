"""What happened in a run, kept for questions about it, and REFLECT's way through it.

Called by post-hoc and online; calls a `Locator`. After REFLECT (Liu et al. 2023, arXiv 2306.15724,
Sec. 3): the subgoals, which are the steps that do more than drive, are verified one after the
other, and the first that is not satisfied is where the run failed.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

from forestall.domain.model import Domain
from forestall.strategies.asked import AskedLocator
from forestall.types.episode import SkillStatus
from forestall.types.exchange import Exchange
from forestall.types.graph import SceneGraph
from forestall.types.plan import Subtask
from forestall.types.runtime import BoundaryContext
from forestall.types.story import Located, Tried

Scope = Callable[[SceneGraph, Subtask], SceneGraph]
"""The part of a graph that concerns a subtask, as the perceiver cuts it."""


class Story:
    """The steps of a run, each with what was seen next.

    Args:
        scope: cuts what was seen to what concerns a step.
        domain: whose skills drive.
    """

    def __init__(self, scope: Scope, domain: Domain) -> None:
        self._scope, self._domain = scope, domain
        self.told: list[Tried] = []
        self._moment: tuple[int, ...] | None = None

    def begin(self) -> None:
        """Another run: what is known of the last one is forgotten."""
        self.told.clear()
        self._moment = None

    def tried(self, context: BoundaryContext, status: SkillStatus) -> None:
        """A step is over; told again of the same one, what is seen from now on counts."""
        moment = (context.index, context.replans, len(context.executed))
        if moment == self._moment and self.told:
            self.told.pop()
        self._moment = moment
        self.told.append(Tried(len(self.told) + 1, context.subtask, status))

    def saw(self, graph: SceneGraph) -> None:
        """Something was seen: of the step before it, where nothing was yet."""
        if self.told and self.told[-1].seen is None:
            last = self.told[-1]
            self.told[-1] = replace(last, seen=self._scope(graph, last.subtask))

    def is_subgoal(self, tried: Tried) -> bool:
        """Whether a step does more than drive."""
        return not self._domain.drives(tried.subtask)

    def located(self, locator: AskedLocator, context: BoundaryContext) -> Located:
        """Where and why the run failed; without a diagnosis where the locator could not say."""
        asked: tuple[Exchange, ...] = ()
        failed = None
        for tried in filter(self.is_subgoal, self.told):
            found = locator.verify(context, tried)
            asked = (*asked, *found.exchanges)
            if found.satisfied is None:
                return Located(None, None, asked)
            if not found.satisfied:
                failed = tried
                break
        located = locator.explain(context, tuple(self.told), failed)
        return replace(located, exchanges=(*asked, *located.exchanges))
