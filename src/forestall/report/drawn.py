"""Which relations a drawing treats how: what holds what, what stands in the way, what mirrors what.

Called by `page_view` with the domain of a record; the graph drawings ask it. A record whose domain
is not to be had is drawn all the same, every relation alike.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cache

from forestall.domain.load import load_domain
from forestall.errors import ForestallError


@dataclass(frozen=True)
class Drawn:
    """The parts that relations play in a drawing.

    Args:
        holding: of a thing to the hand.
        containing: of a thing to where it is.
        strong: of a thing to what it stands in the way of.
        mirror: relation → the one that says the same from the other end.
        symmetric: relations that are the same from both ends.
    """

    holding: str = ""
    containing: tuple[str, ...] = ()
    strong: str = ""
    mirror: Mapping[str, str] = field(default_factory=dict)
    symmetric: tuple[str, ...] = ()

    @property
    def tree(self) -> tuple[str, ...]:
        """Relations that make a tree of the nodes."""
        return (self.holding, *self.containing)


@cache
def drawn(domain: str) -> Drawn:
    """How the relations of a domain, by name or file, are drawn."""
    try:
        found = load_domain(domain)
    except ForestallError:
        return Drawn()
    relations = found.relations.values()
    return Drawn(
        found.roles.holding or "",
        found.containing,
        found.roles.blocking or "",
        {p.name: p.mirrors for p in relations if p.mirrors},
        tuple(p.name for p in relations if p.symmetric),
    )
