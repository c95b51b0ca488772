"""What is true in a scene of AI2-THOR, read off the metadata of one event.

The truth of the oracle, of the skills' needs and of what has happened. Called by `world`, `skills`,
`staging`; calls `frames`, `naming`.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from functools import cached_property
from typing import Any

from forestall.domain.model import Domain
from forestall.types.facts import GRIPPER, category_of
from forestall.types.graph import ObjectNode, Relation, SceneGraph
from forestall.worlds.ai2thor.frames import box_from_thor
from forestall.worlds.ai2thor.naming import Names, Thing, type_of, whole_of

_TEMPERATURES = {"RoomTemp": "room", "Hot": "hot", "Cold": "cold"}
_FLAGS: Mapping[str, tuple[str, str, str, str]] = {
    "open": ("openable", "isOpen", "closed", "open"),
    "toggled": ("toggleable", "isToggled", "off", "on"),
    "dirty": ("dirtyable", "isDirty", "clean", "dirty"),
    "broken": ("breakable", "isBroken", "intact", "broken"),
    "cooked": ("cookable", "isCooked", "raw", "cooked"),
    "sliced": ("sliceable", "isSliced", "whole", "sliced"),
}
"""Attribute → which flag gives it to a type, which one says its value, the value of each."""


class Scene:
    """One moment.

    Args:
        metadata: of an event.
        names: of its objects; new ones are given names.
        domain: whose categories and attributes to speak in.
    """

    def __init__(self, metadata: Mapping[str, Any], names: Names, domain: Domain) -> None:
        self._domain, self._names = domain, names
        things: Sequence[Thing] = metadata["objects"]
        made = {str(t["objectId"]).rpartition("|")[0] for t in things if _is_made(t)}
        there = [t for t in things if str(t["objectId"]) not in made]
        names.learn(there)
        self.things: dict[str, Thing] = {}
        self.basins: dict[str, Thing] = {}
        for thing in there:
            object_id = str(thing["objectId"])
            name = names.name(object_id)
            if name is not None:
                whole = whole_of(object_id) == object_id
                (self.things if whole else self.basins)[name] = thing
        held = [names.name(str(t["objectId"])) for t in metadata.get("inventoryObjects") or ()]
        self.held = next((n for n in held if n in self.things), None)

    def __contains__(self, name: str) -> bool:
        return name in self.things

    def of(self, category: str) -> list[str]:
        """Every instance of a category, lowest number first."""
        kind = self._domain.canonical(category)
        found = [n for n in self.things if category_of(n) in (kind, category)]
        return sorted(found, key=lambda n: int(n.rpartition("-")[2]))

    def receptacle(self, name: str) -> Thing | None:
        """The object that takes what is put in or on a thing: for a sink its basin."""
        thing = self.basins.get(name, self.things[name])
        return thing if thing.get("receptacle") else None

    def visible(self, name: str) -> bool:
        """Whether the agent sees a thing, near enough to handle it."""
        parts = (self.things.get(name), self.basins.get(name))
        return any(t is not None and bool(t["visible"]) for t in parts)

    # --- where things are ------------------------------------------------------------------------

    @cached_property
    def _all_parents(self) -> dict[str, tuple[str, ...]]:
        found = {}
        for name, thing in self.things.items():
            ids = thing.get("parentReceptacles") or ()
            named = dict.fromkeys(p for i in ids if (p := self._names.name(i)) in self.things)
            found[name] = tuple(p for p in named if p is not None and p != name)
        return found

    def parent(self, name: str) -> str | None:
        """What a thing is directly in or on: of all that have it the innermost."""
        return self._parents.get(name)

    @cached_property
    def _parents(self) -> dict[str, str]:
        fixture, listed, found = self._domain.roles.fixture, self._all_parents, {}
        for name, around in listed.items():
            if around and name != self.held and not self._domain.is_a(category_of(name), fixture):
                found[name] = max(
                    around,
                    key=lambda p: (sum(q in listed[p] for q in around), -self._volume(p)),
                )
        return found

    def contents(self, name: str) -> list[str]:
        """What is directly in or on a thing."""
        return [n for n in self.things if self.parent(n) == name]

    def within(self, name: str) -> list[str]:
        """Everything in or on a thing, at any depth."""
        return [n for n in self.things if name in self.ancestors(n)]

    def ancestors(self, name: str) -> list[str]:
        """What a thing is in or on, from the direct one outwards."""
        found: list[str] = []
        parent = self.parent(name)
        while parent is not None and parent not in found:
            found.append(parent)
            parent = self.parent(parent)
        return found

    def shut(self, name: str) -> bool:
        """Whether a thing is a closed container."""
        thing = self.things[name]
        return bool(thing.get("receptacle") and thing.get("openable") and not thing.get("isOpen"))

    def closed_around(self, name: str) -> str | None:
        """The outermost closed container of a thing."""
        closed = [a for a in self.ancestors(name) if self.shut(a)]
        return closed[-1] if closed else None

    # --- states ----------------------------------------------------------------------------------

    def states(self, name: str) -> dict[str, str]:
        """Attribute → value, those that the domain gives its category."""
        thing = self.things.get(name)
        category = None if thing is None else self._domain.find(type_of(thing))
        if thing is None or category is None:
            return {}
        found = self._domain.default_states(category.name)
        for attribute, value in self._read(name, thing):
            if attribute in found and value in self._domain.values(attribute):
                found[attribute] = value
        return found

    def _read(self, name: str, thing: Thing) -> Iterator[tuple[str, str]]:
        for attribute, (has, says, no, yes) in _FLAGS.items():
            if thing.get(has):
                yield attribute, yes if thing.get(says) else no
        if thing["objectType"] == "StoveBurner":
            knobs = [t for t in self.things.values() if self._controls(t, str(thing["objectId"]))]
            on = bool(thing.get("isToggled")) or any(k.get("isToggled") for k in knobs)
            yield "toggled", "on" if on else "off"
        if thing.get("canFillWithLiquid"):
            filled = bool(thing.get("isFilledWithLiquid"))
            yield "filled", str(thing.get("fillLiquid") or "water") if filled else "empty"
        yield "temperature", _TEMPERATURES.get(str(thing.get("temperature")), "room")

    def knob(self, name: str) -> str | None:
        """The knob that turns a burner on."""
        burner = str(self.things[name]["objectId"])
        return next((n for n, t in self.things.items() if self._controls(t, burner)), None)

    @staticmethod
    def _controls(thing: Thing, object_id: str) -> bool:
        return object_id in (thing.get("controlledObjects") or ())

    def _volume(self, name: str) -> float:
        box = box_from_thor(self.things[name])
        if box is None:
            return 0.0
        x, y, z = box.size
        return x * y * z

    # --- all of it -------------------------------------------------------------------------------

    def graph(self, time_s: float) -> SceneGraph:
        """The complete state."""
        nodes = [ObjectNode(GRIPPER, GRIPPER, last_seen_s=time_s)]
        relations = []
        for name, thing in self.things.items():
            box = box_from_thor(thing)
            nodes.append(
                ObjectNode(
                    name,
                    type_of(thing),
                    tuple(self.states(name).items()),
                    None if box is None else box.centre,
                    box,
                    last_seen_s=time_s,
                )
            )
            parent = self.parent(name)
            if parent is not None:
                relations.append(Relation(name, self.relation(parent), parent))
        if self.held is not None and self._domain.roles.holding is not None:
            relations.append(Relation(self.held, self._domain.roles.holding, GRIPPER))
        return SceneGraph(tuple(nodes), tuple(relations))

    def relation(self, place: str) -> str:
        """In which relation a place has what it has; on top, where the domain knows no better."""
        return self._domain.offers(place) or self._domain.containing[-1]


def _is_made(thing: Thing) -> bool:
    """Whether an object was made of another, which stays in the metadata."""
    head, _, tail = str(thing["objectId"]).rpartition("|")
    return "|" in head and (thing["objectType"] in tail) and thing["objectType"] not in (
        "SinkBasin", "BathtubBasin",
    )  # fmt: skip
