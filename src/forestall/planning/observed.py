"""A scene graph as the first state of planning.

Called by the validator and by whoever plans from what was seen; calls `state` and `places`.
"""

from __future__ import annotations

from forestall.domain.model import Domain
from forestall.planning.places import crowded, places, positions
from forestall.planning.state import State
from forestall.types.facts import Literal
from forestall.types.graph import SceneGraph


def state_of(graph: SceneGraph, domain: Domain) -> State:
    """Read a scene graph; what is of a category that the domain lacks is a thing with what is seen.

    An unobserved attribute takes what is presumed of it, else its default, and is listed in
    `assumed`, as is the emptiness of every hidden container. A thing with neither box nor place
    is lost.
    """
    hands = domain.robot.hands
    domain = domain.knowing(n.category for n in graph.nodes if n.id not in hands)
    state, roles = State(domain, {}), domain.roles
    lost, assumed = set(), set()
    held = {r.subject for r in graph.relations if r.predicate == roles.holding}
    placed = held | {r.subject for r in graph.relations if r.predicate in domain.containing}
    for node in graph.nodes:
        if node.id in hands:
            continue
        category = domain[node.category]
        state.kinds[node.id] = category.name
        presumed = dict(node.presumed)
        for attribute, default in domain.default_states(category.name).items():
            value = node.state(attribute)
            if value is None:
                value = presumed.get(attribute, default)
                assumed.add(Literal(attribute, (node.id,), value))
            state.values[node.id, attribute] = value
        for attribute, seen in node.states:  # also of what nobody knew to have such a state
            if seen is not None and attribute in domain.attributes:
                state.values[node.id, attribute] = seen
        loose = node.box_m is None and node.id not in placed
        if loose and roles.fixture not in category.tags:
            lost.add(node.id)
    for r in graph.relations:
        if r.subject not in state.kinds or r.predicate in domain.containing:
            continue
        if r.predicate in domain.moved and (r.object in state.kinds or r.object in hands):
            state.add((r.predicate, r.subject, r.object))
    for name, place in places(graph, state).items():
        state.add((place.relation, name, place.parent))
    state.lost = frozenset(lost)
    state.hidden = frozenset(h for h in graph.hidden if h in state.kinds)
    if roles.vacant is not None:
        assumed |= {Literal(roles.vacant, (h,)) for h in state.hidden}
    state.assumed = frozenset(assumed)
    state.crowded = crowded(graph, domain)
    state.where = positions(graph)
    return state
