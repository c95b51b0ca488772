"""What the compiled formulas of `schemas` ask, answered by what holds now.

Called by `state`; calls `schemas`. Every node is true or false here, nothing is left open.
"""

from __future__ import annotations

from collections.abc import Sequence
from threading import get_ident
from typing import TYPE_CHECKING

from forestall.domain.circle import Circle
from forestall.domain.evaluate import static_holds
from forestall.domain.schema import Predicate
from forestall.domain.view import FALSE, TRUE
from forestall.planning.nodes import Node
from forestall.planning.schemas import schemas_of

if TYPE_CHECKING:
    from forestall.planning.state import State


class Asked:
    """Implements `schemas.World` over one state."""

    __slots__ = ("_circles", "_kinds", "domain", "schemas", "state")

    def __init__(self, state: State) -> None:
        self.state, self.domain = state, state.domain
        self.schemas = schemas_of(state.domain)
        self._kinds = state.kinds
        self._circles: dict[tuple[int, frozenset[str]], Circle] = {}  # of each thread its own

    def things(self) -> Sequence[str]:
        """Every thing."""
        return tuple(self.state.kinds)

    def of_kind(self, kind: str) -> Sequence[str]:
        """Things that count as a kind."""
        return self.state.of_kind(kind)

    def is_a(self, name: str, kind: str) -> bool:
        """Whether a thing counts as a kind."""
        return kind in self.domain.kinds(self._kinds.get(name) or self.state.category(name))

    def same_category(self, one: str, other: str) -> bool:
        """Whether two things are of one category."""
        return self.state.category(one) == self.state.category(other)

    def located(self, name: str) -> bool:
        """Whether the place of a thing is known."""
        return name in self.state.kinds and name not in self.state.lost

    def faced(self, name: str) -> Node:
        """Whether the robot faces a thing."""
        return self.state.at == name

    def static(self, predicate: str, args: tuple[str, ...]) -> bool:
        """Whether a static predicate holds."""
        return static_holds(self.state, predicate, args)

    def static_related(self, predicate: str, position: int, args: tuple[str, ...]) -> Sequence[str]:
        """What fits at a position of a static predicate."""
        state = self.state
        given = {i: state.category(a) for i, a in enumerate(args) if i != position}
        fitting = {
            row[position]
            for row in self.domain.statics.get(predicate, ())
            if all(row[i] == c for i, c in given.items())
        }
        return [
            n
            for c in sorted(fitting)
            for n in state.of_kind(c)
            if state.kinds[n] == c
            and static_holds(state, predicate, (*args[:position], n, *args[position + 1 :]))
        ]

    def value(self, name: str, attribute: str, value: str) -> Node:
        """Whether an attribute has a value."""
        return self.state.values.get((name, attribute)) == value

    def fact(self, predicate: str, args: tuple[str, ...]) -> Node:
        """Whether a relation or history holds."""
        return (predicate, *args) in self.state.facts

    def related(self, predicate: str, position: int, args: tuple[str, ...]) -> Sequence[str]:
        """What stands at a position of a relation."""
        return self.state.related(predicate, position, args)

    def derived(self, predicate: str, args: tuple[str, ...]) -> Node:
        """Whether a derived fact holds."""
        members = self.domain.recursive.get(predicate)
        circle = None if members is None else self._circles.get((get_ident(), members))
        if circle is not None:
            return circle.ask(self.domain.predicates[predicate], args) == TRUE
        return self.state.follow((predicate, *args), lambda: self._derived(predicate, args))

    def _derived(self, predicate: str, args: tuple[str, ...]) -> bool | Node:
        known = self.domain.predicates[predicate]
        members = self.domain.recursive.get(predicate)
        if members is None:
            return self._defined(known, args)
        circle = Circle(lambda k, those: TRUE if self._defined(k, those) is True else FALSE)
        own = get_ident(), members
        self._circles[own] = circle
        try:
            truth = circle.settle(known, args)
        finally:
            del self._circles[own]
        for fact, found in circle.now.items():
            self.state.know(fact, found == TRUE)
        return truth == TRUE

    def _defined(self, known: Predicate, args: tuple[str, ...]) -> Node:
        assert known.definition is not None
        names = {p.name: a for p, a in zip(known.parameters, args, strict=True)}
        return self.schemas.formula(known.definition)(self, names)

    def existing(self, name: str, node: Node) -> Node:
        """Only what exists is asked about."""
        return node

    def number(self, name: str, what: str) -> int | None:
        """A number of a thing."""
        return self.domain.number(self.state.category(name), what)
