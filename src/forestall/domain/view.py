"""What is asked when a formula is evaluated: anything that knows facts, in three values.

Implemented by the facts of a scene graph (`truth`) and by the planner's state; asked by `evaluate`.
0 is false, 1 unobserved, 2 true: "and" is the smaller, "or" the larger (Kleene).
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Protocol

from forestall.domain.model import Domain

FALSE, UNOBSERVED, TRUE = 0, 1, 2

UNKNOWN = "?"
"""Something that nobody has seen, where a place may hold more than is known."""

Binding = Mapping[str, str]


class View(Protocol):
    """What knows facts."""

    domain: Domain

    def things(self) -> Iterable[str]:
        """Every known thing."""

    def category(self, name: str) -> str:
        """The category of a thing, of a made name too."""

    def of_kind(self, kind: str) -> Iterable[str]:
        """Known things that count as a tag, a category or an attribute holder."""

    def fact(self, predicate: str, args: tuple[str, ...]) -> int:
        """Truth of a relation, a history or a built-in fact."""

    def value(self, name: str, attribute: str) -> str | None:
        """The value of an attribute; None where it is unobserved or not an attribute of it."""

    def unsure(self, name: str, attribute: str) -> bool:
        """Whether a missing value may be any (unobserved), and not just not an attribute."""

    def related(self, predicate: str, position: int, args: tuple[str, ...]) -> Iterable[str]:
        """What may stand at a position so that a relation is not false, the rest being given."""

    def with_value(self, attribute: str, value: str) -> Iterable[str]:
        """Things whose attribute may have a value."""
