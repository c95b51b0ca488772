"""Where things are, as a scene graph has it: one place for each, and which supports are crowded.

Called by `state` when it reads a graph.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from forestall.domain.model import Domain
from forestall.types.facts import by_number
from forestall.types.graph import SceneGraph

if TYPE_CHECKING:
    from forestall.planning.state import State

CROWDED = 0.6
"""Share of a support's footprint from which on another one is preferred."""


@dataclass(frozen=True, slots=True)
class Place:
    """Where a thing is: a containing relation and the thing that has it."""

    relation: str
    parent: str


def crowded(graph: SceneGraph, domain: Domain) -> frozenset[str]:
    """Supports whose contents cover more than `CROWDED` of their own footprint."""
    covered: dict[str, float] = {}
    area_m2 = {n.id: n.box_m.size[0] * n.box_m.size[1] for n in graph.nodes if n.box_m is not None}
    for r in graph.relations:
        if r.predicate in domain.containing and domain.is_a(r.object, domain.roles.support):
            covered[r.object] = covered.get(r.object, 0.0) + area_m2.get(r.subject, 0.0)
    return frozenset(x for x, a in covered.items() if x in area_m2 and a > CROWDED * area_m2[x])


def positions(graph: SceneGraph) -> dict[str, tuple[float, float]]:
    """Where things are on the floor plan, those of which that is known."""
    found = {}
    for node in graph.nodes:
        centre = node.box_m.centre if node.box_m is not None else node.centroid_m
        if centre is not None:
            found[node.id] = centre[:2]
    return found


def places(graph: SceneGraph, state: State) -> dict[str, Place]:
    """One place for each thing: the innermost of several, the ground last, no cycles."""
    domain = state.domain
    held = {h for _, h in state.in_hands()}
    order = {relation: i for i, relation in enumerate(domain.containing)}
    edges: dict[str, list[Place]] = {}
    for r in graph.relations:
        known = r.subject in state.kinds and r.object in state.kinds and r.subject not in held
        if known and r.predicate in order:
            edges.setdefault(r.subject, []).append(Place(r.predicate, r.object))
    found: dict[str, Place] = {}
    for name in sorted(edges, key=by_number):
        if domain.roles.fixture in state.kind(name).tags:
            continue
        parents = {p.parent for p in edges[name]}
        outer = {q.parent for p in parents for q in edges.get(p, ())}
        ranked = sorted(
            edges[name],
            key=lambda p: (
                p.parent in outer,
                domain.is_a(state.kinds[p.parent], domain.roles.ground),
                order[p.relation],
                by_number(p.parent),
            ),
        )
        for place in ranked:
            above, seen = place.parent, {name}
            while above not in seen and above in found:
                seen.add(above)
                above = found[above].parent
            if above not in seen:
                found[name] = place
                break
    return found
