"""Small bench scenes: "Nut-1@Bolt-1 torque=tight", one of every fixture besides."""

from forestall.domain.load import shipped
from forestall.domain.model import Domain
from forestall.testing.symbolic_scene import relation_at, start_scene
from forestall.testing.symbolic_world import SymbolicWorld
from forestall.types.graph import ObjectNode, Relation, SceneGraph
from forestall.types.scene import SceneNeeds

BENCH = shipped("bench")


def bench(*specs: str, without: str = "", domain: Domain = BENCH) -> SymbolicWorld:
    """A world with these things; "Nut-1" alone is lost, "@gripper" is held, "A#B" is in B's way."""
    start = start_scene(domain, SceneNeeds(clutter=(0, 0)), 0)
    nodes = {n.id: n for n in start.nodes if n.category != without}
    relations = []
    holding, blocking = domain.roles.holding, domain.roles.blocking
    assert holding is not None and blocking is not None
    for spec in specs:
        head, *states = spec.split()
        head, _, behind = head.partition("#")
        name, _, place = head.partition("@")
        category = domain[name].name
        values = domain.default_states(category) | dict(s.split("=") for s in states)
        nodes[name] = ObjectNode(name, category, tuple(values.items()))
        if place in domain.robot.hands:
            relations.append(Relation(name, holding, place))
        elif place:
            at = relation_at(domain, name, place)
            relations.append(Relation(name, at, place))
        if behind:
            relations.append(Relation(name, blocking, behind))
    nodes |= {h: ObjectNode(h, h) for h in domain.robot.hands}
    return SymbolicWorld(domain, SceneGraph(tuple(nodes.values()), tuple(relations)))
