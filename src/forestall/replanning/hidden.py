"""Where a thing may be that nobody has seen: in what is shut, and behind what stands in the view.

Called by the replanner; calls nothing that plans. Going there, opening and looking is a plan like
any other; what is found changes the graph, and the plan goes on or another place is looked at. Each
place is looked at once: that a thing is not there is a fact that stays (`domain.looked`).
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from forestall.domain.looked import in_sight, is_there, searched
from forestall.domain.model import LOCATED, Domain
from forestall.domain.truth import is_shut
from forestall.planning.places import positions
from forestall.planning.robot_time import Spot, way_s
from forestall.types.facts import Literal, Truth, category_of
from forestall.types.graph import ObjectNode, SceneGraph, Seen
from forestall.types.plan import Plan
from forestall.types.verdict import Reference

SHOWN = 8.0
"""How many times as likely a kind of place is in which demonstrations had the thing."""
PLANNED = 19.0
"""The same where the task's plan takes it from: what it opens first, else what is open. Who made
the plan knew the place, and is believed to be wrong about that in one of twenty."""
FOR_FEW = 0.25
"""How many times as likely a place is that does not hold many things by nature, or is avoided."""
IN_VAIN = " and is not there"

LOOK_S = 2.0
"""What it takes to look at a place, the way there apart."""
OPEN_S = 6.0
"""What it takes more to open it before, and to shut it where nothing was found."""


def sought(wanted: Sequence[Literal], graph: SceneGraph) -> tuple[str, ...]:
    """Things whose place must become known and that no node of the graph can be."""
    names = (x.args[0] for x in wanted if x.predicate == LOCATED and x.value == "true")
    return tuple(dict.fromkeys(n for n in names if not is_there(graph, n)))


def hiding_places(
    thing: str,
    graph: SceneGraph,
    domain: Domain,
    references: Sequence[Reference],
    start: Spot | None = None,
    plan: Plan | None = None,
) -> list[str]:
    """Places that take a thing and may hide it, by chance for each second that it takes to look.

    That order finds it in the least time on average. A kind of place in which demonstrations had it
    is likelier, and one that the plan takes it from; then one that holds many things by nature,
    then one that takes few kinds of things: what is particular is likelier than what takes
    everything. Ties by name. What is shut hides everything; of what is open it is as likely as the
    share of it is large that no view has shown.

    Args:
        thing: category or instance.
        graph: what is known.
        domain: which places take it.
        references: demonstrations of this step.
        start: where the robot stands, x and y in metres; None: every way is as long.
        plan: of the task; None: nobody has one.
    """
    kind = category_of(domain.canonical(thing))
    takes = [
        n for n in graph.nodes if n.seen is not Seen.UNOBSERVED and domain.accepts(n.category, kind)
    ]
    shut = {n.id for n in takes if is_shut_place(n, domain)}
    places = [n for n in takes if n.id in shut or _unseen(n, domain) > 0.0]
    chances = _chances(kind, {n.category for n in places}, domain, references)
    taken_from = () if plan is None else _opened_first(kind, plan, domain)
    spots = positions(graph)

    def promise(node: ObjectNode) -> tuple[float, str]:
        way = 0.0 if start is None else way_s(domain, ("", start), (node.id, spots.get(node.id)))
        looking_s = LOOK_S + (OPEN_S if node.id in shut else 0.0)
        share = 1.0 if node.id in shut else _unseen(node, domain)
        if plan is not None and (
            node.category in taken_from or not (taken_from or node.id in shut)
        ):
            share *= PLANNED
        return -chances[node.category] * share / (way + looking_s), node.id

    return [n.id for n in sorted(places, key=promise)]


def is_shut_place(node: ObjectNode, domain: Domain) -> bool:
    """Whether it must be opened before anybody sees what is in it."""
    shut = is_shut(domain, node.category, dict(node.states))
    return domain.encloses(node.category) and shut is Truth.TRUE


def _unseen(node: ObjectNode, domain: Domain) -> float:
    """Share of an open place that no view has shown, from 0 to 1."""
    if node.box_m is None or not in_sight(node.category, domain):
        return 0.0
    wide_m, deep_m, _ = node.box_m.size
    return min(1.0, node.unseen_m2 / max(wide_m * deep_m, 1e-6))


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

    many = (domain.roles.crowded, domain.roles.support)

    def usual(category: str) -> bool:
        avoided = any(domain.is_a(category, tag) for tag in domain.roles.avoid)
        return not avoided and any(domain.is_a(category, tag) for tag in many)

    return {
        c: (SHOWN if c in shown else 1.0)
        * (1.0 if usual(c) else FOR_FEW)
        / max(1, sum(domain.accepts(c, other) for other in domain.categories))
        for c in categories
    }


def _opened_first(kind: str, plan: Plan, domain: Domain) -> set[str]:
    """Kinds of places that can be shut and take a thing, and that a plan names before it has it."""
    named: set[str] = set()
    for step in plan:
        kinds = [category_of(domain.canonical(a)) for a in step.args]
        if kind in kinds and not domain.drives(step):
            break
        named.update(kinds)
    return {c for c in named if domain.encloses(c) and domain.accepts(c, kind)}


def in_vain(lost: Sequence[str], known: Sequence[Literal], domain: Domain) -> tuple[str, ...]:
    """What is said of things that were looked for wherever they may be."""
    found = {name: searched(name, known, domain) for name in lost}
    return tuple(f"{n} was looked for in {', '.join(p)}{IN_VAIN}" for n, p in found.items() if p)
