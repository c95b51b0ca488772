"""What is looked for during a run, and where somebody has looked.

Called by `intervention.py`. What nobody sees may be in a place that nobody has looked into; a place
that somebody has looked into has it no more, and plans are told so.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace

from forestall.domain.looked import (
    is_there,
    looked_into,
    looked_over,
    made_of,
    made_of_what_is_there,
    not_there,
)
from forestall.domain.model import LOCATED, Domain
from forestall.types.episode import SkillStatus
from forestall.types.facts import Literal
from forestall.types.runtime import BoundaryContext
from forestall.types.verdict import Diagnosis, PlanCheck


class Looking:
    """Of one run.

    Args:
        domain: what can be made of what, and which places are seen into.
    """

    def __init__(self, domain: Domain) -> None:
        self._domain = domain
        self.reset()

    def reset(self) -> None:
        """Nothing is looked for, and nobody has looked anywhere."""
        self.sought: frozenset[str] = frozenset()
        self._looked: frozenset[str] = frozenset()
        self._over: frozenset[str] = frozenset()

    def begin(self, context: BoundaryContext) -> None:
        """Take in what is seen before a subtask: what has been found is looked for no more."""
        graph, domain = context.graph, self._domain
        found = {n for n in self.sought if is_there(graph, n)}
        self.sought -= found | made_of_what_is_there(self.sought, graph, domain)
        self._looked |= looked_into(graph, domain)
        here: frozenset[str] = frozenset()
        if context.executed and context.executed[-1][1] is SkillStatus.SUCCEEDED:
            here = looked_over(graph, context.executed[-1][0], domain)
        self._over = self._over | here if self.sought else here

    def seek(self, names: Iterable[str]) -> None:
        """Look for some things, too."""
        self.sought |= frozenset(names)

    def excuses(self, check: PlanCheck, now: int, on_the_way: bool) -> bool:
        """Whether a plan is at fault only in that what is looked for has not been found yet.

        Args:
            check: of the plan.
            now: position of the step that comes next in what was checked.
            on_the_way: whether that step is one of those that go and look. What the plan does after
                them is judged when they are done; a later step may lack the thing's place.
        """
        looking = {Literal(LOCATED, (name,)) for name in self.sought}
        if check.step is None:
            return on_the_way and not looking.isdisjoint(check.unmet)
        return check.step > now and bool(check.lacking) and looking.issuperset(check.lacking)

    def with_places(self, diagnosis: Diagnosis, context: BoundaryContext) -> Diagnosis:
        """A diagnosis with where the things that nobody sees are not: where one has looked."""
        lost = [x.args[0] for x in diagnosis.must_change if x.predicate == LOCATED]
        lost += made_of(lost, context.graph, self._domain)
        looked = self._looked | self._over
        empty = [f for name in lost for f in not_there(name, looked, self._domain)]
        must_stay = tuple(dict.fromkeys((*diagnosis.must_stay, *empty)))
        return replace(diagnosis, must_stay=must_stay) if empty else diagnosis
