"""Where a thing may be that nobody has seen: in what is shut and may hold it.

Called by the replanner; calls nothing. Opening and looking is a plan like any other; what is found
changes the graph, and the plan goes on or another place is opened.
"""

from __future__ import annotations

from collections.abc import Sequence

from forestall.domain.model import LOCATED, Domain
from forestall.domain.truth import is_shut
from forestall.types.facts import Literal, Truth, category_of
from forestall.types.graph import SceneGraph, Seen
from forestall.types.verdict import Reference


def sought(wanted: Sequence[Literal], graph: SceneGraph) -> tuple[str, ...]:
    """Things whose place must become known and that no node of the graph can be."""
    names = (x.args[0] for x in wanted if x.predicate == LOCATED and x.value == "true")
    return tuple(dict.fromkeys(n for n in names if not _is_there(graph, n)))


def hiding_places(
    thing: str, graph: SceneGraph, domain: Domain, references: Sequence[Reference]
) -> list[str]:
    """Shut places that take a thing, the likeliest first.

    First those of a kind in which demonstrations had it, then those that take the fewest kinds of
    things: what is particular is likelier than what takes everything. Ties by name.
    """
    kind = category_of(domain.canonical(thing))
    shown = {
        node.category
        for r in references
        for name in (n.id for n in r.graph.nodes if n.category == kind)
        for parent in r.graph.parents(name, domain.containing)
        if (node := r.graph.get(parent)) is not None
    }
    places = [
        n
        for n in graph.nodes
        if n.seen is not Seen.UNOBSERVED
        and domain.encloses(n.category)
        and domain.accepts(n.category, kind)
        and is_shut(domain, n.category, dict(n.states)) is Truth.TRUE
    ]
    taken = {
        c: sum(domain.accepts(c, other) for other in domain.categories)
        for c in {n.category for n in places}
    }
    places.sort(key=lambda n: (n.category not in shown, taken[n.category], n.id))
    return [n.id for n in places]


def _is_there(graph: SceneGraph, name: str) -> bool:
    return any(n.box_m is not None or n.seen is Seen.VISIBLE for n in graph.nodes
               if name in (n.id, n.category))  # fmt: skip
