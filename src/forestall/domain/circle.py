"""Facts that are defined by each other: the least fixpoint of what they come to.

Called by `evaluate` and by the planner's compiled formulas, each with its own way to work a
definition out.
"""

from __future__ import annotations

from collections.abc import Callable

from forestall.domain.schema import Predicate
from forestall.domain.view import FALSE

DEEP = 12
"""How many facts that are defined by each other are worked out one inside the other."""


class DeeperError(Exception):
    """Says which fact is to be worked out before one that led to it over too many others."""

    def __init__(self, known: Predicate, args: tuple[str, ...]) -> None:
        super().__init__(known.name, *args)
        self.known, self.those = known, args


class Circle:
    """What is known so far of predicates that are defined with each other.

    Args:
        work_out: the truth of a derived fact by its definition; it asks this circle for the others.
    """

    __slots__ = ("best", "closed", "depth", "now", "work_out")

    def __init__(self, work_out: Callable[[Predicate, tuple[str, ...]], int]) -> None:
        self.work_out = work_out
        self.best: dict[tuple[str, ...], int] = {}
        self.now: dict[tuple[str, ...], int | None] = {}
        self.closed = False
        self.depth = 0

    def ask(self, known: Predicate, args: tuple[str, ...]) -> int:
        """The truth as far as it is known; None marks what is being asked just now.

        Raises:
            DeeperError: it is to be worked out by itself first.
        """
        key = (known.name, *args)
        if key in self.now:
            found = self.now[key]
            if found is not None:
                return found
            self.closed = True
            return self.best.get(key, FALSE)
        if self.depth == DEEP:
            raise DeeperError(known, args)
        self.now[key] = None
        self.depth += 1
        try:
            truth = self.now[key] = self.work_out(known, args)
        except BaseException:  # an interrupt, too, leaves nothing half worked out
            del self.now[key]
            raise
        finally:
            self.depth -= 1
        return truth

    def settle(self, known: Predicate, args: tuple[str, ...]) -> int:
        """The least fixpoint, so that facts that go in a circle support nothing.

        Afterwards `now` has the truth of everything that was asked.
        """
        while True:
            truth = self._chained(known, args)
            best = {k: t for k, t in self.now.items() if t}
            if not self.closed or best == self.best:
                return truth
            self.best, self.now, self.closed = best, {}, False

    def _chained(self, known: Predicate, args: tuple[str, ...]) -> int:
        """Ask, what lies too deep first: a chain of any length takes no more of Python's stack."""
        waiting = [(known, args)]
        while True:
            one, those = waiting[-1]
            self.now[one.name, *those] = None
            try:
                truth = self.now[one.name, *those] = self.work_out(one, those)
            except DeeperError as deeper:
                waiting.append((deeper.known, deeper.those))
                continue
            waiting.pop()
            if not waiting:
                return truth
