"""What compiled formulas ask about things: the seam between `schemas` and who answers them.

Implemented by `grounder` (what can be true of some things) and `asked` (what holds in a state).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Protocol

from forestall.planning.nodes import Node

Names = Mapping[str, str]


class World(Protocol):
    """What grounding asks about the things at hand ."""

    def things(self) -> Sequence[str]:
        """Every thing."""

    def of_kind(self, kind: str) -> Sequence[str]:
        """Things that count as a kind."""

    def is_a(self, name: str, kind: str) -> bool:
        """Whether a thing counts as a kind."""

    def same_category(self, one: str, other: str) -> bool:
        """Whether two things are of one category."""

    def located(self, name: str) -> bool:
        """Whether the place of a thing is known."""

    def faced(self, name: str) -> Node:
        """Whether the robot faces a thing."""

    def static(self, predicate: str, args: tuple[str, ...]) -> bool:
        """Whether a static predicate holds."""

    def static_related(self, predicate: str, position: int, args: tuple[str, ...]) -> Sequence[str]:
        """What fits at a position of a static predicate."""

    def value(self, name: str, attribute: str, value: str) -> Node:
        """The fact that an attribute has a value."""

    def fact(self, predicate: str, args: tuple[str, ...]) -> Node:
        """A relation or history."""

    def related(self, predicate: str, position: int, args: tuple[str, ...]) -> Sequence[str]:
        """What may stand at a position of a relation."""

    def derived(self, predicate: str, args: tuple[str, ...]) -> Node:
        """A derived fact."""

    def existing(self, name: str, node: Node) -> Node:
        """A node about a thing, which holds only while that exists."""

    def number(self, name: str, what: str) -> int | None:
        """A number of a thing."""
