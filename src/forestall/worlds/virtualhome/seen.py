"""Symbolic observations: what a program is about, out of the evolving graph, as a scene graph.

Called by the importer and the world; calls `evolving`. Hands, room, posture, plugs and who is close
to what are facts like any other. Who is close to a thing or faces it is what the executor itself
takes for that, since its edges alone do not say it.
"""

from __future__ import annotations

from collections.abc import Iterable

from forestall.types.graph import Box, ObjectNode, Relation, SceneGraph
from forestall.worlds.virtualhome.evolving import Evolving

HANDS = {"right_gripper": "HOLDS_RH", "left_gripper": "HOLDS_LH"}
"""Node id of a hand → the edge from the character to what it holds."""

HELD = "held_by"
YES, NO, NEITHER = "yes", "no", "neither"

ATTRIBUTES: dict[str, dict[str, str]] = {
    "opening": {"closed": "CLOSED", "open": "OPEN"},
    "power": {"off": "OFF", "on": "ON"},
    "mains": {"plugged_in": "PLUGGED_IN", "plugged_out": "PLUGGED_OUT"},
    "dirt": {"clean": "CLEAN", "dirty": "DIRTY"},
}
"""Attribute → value → the state that says it."""

HAVING = {"opening": "CAN_OPEN", "power": "HAS_SWITCH", "mains": "HAS_PLUG"}
"""Attribute → the property of things that have it, whether or not a state is known."""

_HALF_M = 0.1

POSTURES = {"sitting": "SITTING", "lying": "LYING"}


def name_of(word: str, node: int) -> str:
    """How a thing is called here."""
    return f"{word}-{node}"


def scene(flat: Evolving, about: Iterable[int]) -> SceneGraph:
    """What concerns some things: they, what they are in and on, what is in and on them, the hands.

    Args:
        flat: the household as it is.
        about: node ids.
    """
    ids = _concerned(flat, about)
    names = {i: name_of(flat.name(i), i) for i in ids}
    nodes = [_node(flat, i, names[i]) for i in sorted(ids)]
    nodes += [ObjectNode(h, h) for h in HANDS]
    return SceneGraph(tuple(nodes), tuple(_relations(flat, ids, names)))


def _node(flat: Evolving, node: int, name: str) -> ObjectNode:
    """A thing; its box is made up, and says only that its place is known."""
    x, h = float(node), _HALF_M
    box = Box((x - h, -h, 0.0), (x + h, h, 2 * h))
    return ObjectNode(name, flat.name(node), _states(flat, node), box.centre, box)


def _concerned(flat: Evolving, about: Iterable[int]) -> set[int]:
    wanted = {*about, *flat.to(flat.character, *HANDS.values())}
    ids = {flat.character, *wanted, *flat.to(flat.character, "ON", "INSIDE")}
    waiting = list(wanted)
    while waiting:
        found = flat.to(waiting.pop(), "ON", "INSIDE") - ids
        ids |= found
        waiting += found
    for i in flat.all_ids():
        if i not in ids and any(
            x in wanted and not flat.is_room(x) for x in flat.to(i, "ON", "INSIDE")
        ):
            ids.add(i)
    return ids


def _states(flat: Evolving, node: int) -> tuple[tuple[str, str], ...]:
    states, properties = flat.states(node), flat.properties(node)
    if node == flat.character:
        return tuple((p, YES if s in states else NO) for p, s in POSTURES.items())
    found = []
    for attribute, values in ATTRIBUTES.items():
        known = [v for v, s in values.items() if s in states]
        if known or HAVING.get(attribute) in properties:
            found.append((attribute, known[0] if len(known) == 1 else NEITHER))
    return tuple(found)


def _relations(flat: Evolving, ids: set[int], names: dict[int, str]) -> Iterable[Relation]:
    me = flat.character
    for hand, edge in HANDS.items():
        for held in flat.to(me, edge) & ids:
            yield Relation(names[held], HELD, hand)
    for i in sorted(ids):
        rooms = {x for x in flat.to(i, "INSIDE") & ids if flat.is_room(x)}
        if i == me:
            yield from (Relation(names[i], "inside", names[x]) for x in rooms)
            on = flat.to(i, "ON") & ids
            yield from (Relation(names[i], "ontop", names[x]) for x in on)
            continue
        if flat.near(i):
            yield Relation(names[me], "next_to", names[i])
        if flat.faced(i):
            yield Relation(names[me], "is_facing", names[i])
        if flat.is_room(i):
            continue
        yield from (Relation(names[i], "inside_room", names[x]) for x in rooms)
        for x in flat.to(i, "INSIDE") & ids - rooms:
            yield Relation(names[i], "obj_inside", names[x])
        for x in flat.to(i, "ON") & ids:
            yield Relation(names[i], "on_char" if x == me else "obj_ontop", names[x])
        yield from (
            Relation(names[x], "obj_next_to", names[i])
            for x in _beside(flat, i, ids)
            if x not in (i, me) and not flat.is_room(x)
        )


def _beside(flat: Evolving, node: int, ids: set[int]) -> set[int]:
    """What whoever walks to a thing is then close to, as the executor judges it."""
    there = {node, *flat.to(node, "ON"), *(x for x in flat.to(node, "INSIDE"))}
    there = {x for x in there if not flat.is_room(x)}
    if "CAN_OPEN" in flat.properties(node):
        there |= {i for i in ids if node in flat.to(i, "INSIDE")}
    close = {x for t in there for x in flat.to(t, "CLOSE")}
    return ids & (there | close | {i for i in ids if flat.to(i, "ON") & there})
