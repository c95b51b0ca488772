"""Where a thing may be that nobody has seen: in what is shut and may hold it.

Called by the replanner; calls nothing that plans. Opening and looking is a plan like any other;
what is found changes the graph, and the plan goes on or another place is opened. Each place is
looked into once: that a thing is not there is a fact that stays (`domain.looked`).
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from forestall.domain.looked import searched
from forestall.domain.model import LOCATED, Domain
from forestall.domain.truth import is_shut
from forestall.planning.places import positions
from forestall.planning.robot_time import Spot, way_s
from forestall.types.facts import Literal, Truth, category_of
from forestall.types.graph import ObjectNode, SceneGraph, Seen
from forestall.types.verdict import Reference

SHOWN = 8.0
"""How many times as likely a kind of place is in which demonstrations had the thing."""
FOR_FEW = 0.25
"""How many times as likely a place is that does not hold many things by nature."""
IN_VAIN = " and is not there"

LOOK_S = 5.0
"""What it takes to open a place and look, the way there apart."""


def sought(wanted: Sequence[Literal], graph: SceneGraph) -> tuple[str, ...]:
    """Things whose place must become known and that no node of the graph can be."""
    names = (x.args[0] for x in wanted if x.predicate == LOCATED and x.value == "true")
    return tuple(dict.fromkeys(n for n in names if not _is_there(graph, n)))


def hiding_places(
    thing: str,
    graph: SceneGraph,
    domain: Domain,
    references: Sequence[Reference],
    start: Spot | None = None,
) -> list[str]:
    """Shut places that take a thing, by chance for each second that it takes to look.

    That order finds it in the least time on average. A kind of place in which demonstrations had it
    is likelier, then one that holds many things by nature, then one that takes few kinds of things:
    what is particular is likelier than what takes everything. Ties by name.

    Args:
        thing: category or instance.
        graph: what is known.
        domain: which places take it.
        references: demonstrations of this step.
        start: where the robot stands, x and y in metres; None: every way is as long.
    """
    kind = category_of(domain.canonical(thing))
    places = [
        n
        for n in graph.nodes
        if n.seen is not Seen.UNOBSERVED
        and domain.encloses(n.category)
        and domain.accepts(n.category, kind)
        and is_shut(domain, n.category, dict(n.states)) is Truth.TRUE
    ]
    chances = _chances(kind, {n.category for n in places}, domain, references)
    spots = positions(graph)

    def promise(node: ObjectNode) -> tuple[float, str]:
        way = 0.0 if start is None else way_s(domain, ("", start), (node.id, spots.get(node.id)))
        return -chances[node.category] / (way + LOOK_S), node.id

    return [n.id for n in sorted(places, key=promise)]


def _chances(
    kind: str, categories: Iterable[str], domain: Domain, references: Sequence[Reference]
) -> dict[str, float]:
    """How likely a thing is in one place of each category, up to a common factor."""
    shown = {
        node.category
        for r in references
        for name in (n.id for n in r.graph.nodes if n.category == kind)
        for parent in r.graph.parents(name, domain.containing)
        if (node := r.graph.get(parent)) is not None
    }
    return {
        c: (SHOWN if c in shown else 1.0)
        * (1.0 if domain.is_a(c, domain.roles.crowded) else FOR_FEW)
        / max(1, sum(domain.accepts(c, other) for other in domain.categories))
        for c in categories
    }


def in_vain(lost: Sequence[str], known: Sequence[Literal], domain: Domain) -> tuple[str, ...]:
    """What is said of things that were looked for wherever they may be."""
    found = {name: searched(name, known, domain) for name in lost}
    return tuple(f"{n} was looked for in {', '.join(p)}{IN_VAIN}" for n, p in found.items() if p)


def _is_there(graph: SceneGraph, name: str) -> bool:
    return any(n.box_m is not None or n.seen is Seen.VISIBLE for n in graph.nodes
               if name in (n.id, n.category))  # fmt: skip
