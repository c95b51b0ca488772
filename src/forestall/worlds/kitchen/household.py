"""The truth of the household: what is where, in which state, and what has happened.

Skills and effects change it, the environment's oracle reads it. It tells the `World` to move things
and to make states visible; it never asks it for a meaning. Everything about categories comes from
the catalogue.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from typing import Protocol, runtime_checkable

from forestall.errors import UnknownNameError
from forestall.seams.acting import World
from forestall.types.episode import Event
from forestall.types.facts import GRIPPER, Literal, category_of, is_instance
from forestall.types.graph import Box, ObjectNode, Relation, SceneGraph
from forestall.types.observation import Vec3
from forestall.worlds.kitchen.catalogue import Catalogue, Category
from forestall.worlds.kitchen.law import LAW_EVENT, Law

FLOOR = "Floor"
"""Category that takes what falls."""

STATE_EVENT = "state"
"""Kind of an event whose text is a state literal that became true."""

RELATION_EVENT = "relation"
"""Kind of an event whose text is a relation literal that became true."""


class Placed(Protocol):
    """One instance as a scene builder names it."""

    @property
    def name(self) -> str:
        """Instance name, e.g. "Mug-1"."""

    @property
    def category(self) -> str:
        """Category of the catalogue."""

    @property
    def parent(self) -> str | None:
        """The receptacle that it starts in or on."""

    @property
    def states(self) -> Mapping[str, str] | tuple[tuple[str, str], ...]:
        """(attribute, value) pairs."""

    @property
    def prepared(self) -> bool:
        """Whether it is not there yet and waits to replace something (slices, cracked eggs)."""


@runtime_checkable
class Boxes(Protocol):
    """A world that can also say where its things are (the oracle's graph then has boxes)."""

    def box_world_m(self, name: str) -> tuple[Vec3, Vec3] | None:
        """Low and high corner of a thing in the world."""


@runtime_checkable
class Untidy(Protocol):
    """A world that can show what has half succeeded."""

    def leave_ajar(self, name: str, towards: str) -> None:
        """Leave a door a little way open, on its way to a state that it does not reach."""

    def lay(self, name: str) -> None:
        """Lay a thing that stands on its side."""


def number_of(name: str) -> int:
    """The instance number of a name, 0 without one."""
    tail = name.rpartition("-")[2]
    return int(tail) if tail.isdecimal() else 0


def natural_key(name: str) -> tuple[str, int, str]:
    """Sort key that puts Cabinet-2 before Cabinet-10."""
    return (category_of(name), number_of(name), name)


class Household:
    """Mutable truth over a catalogue; one instance is one run of one scene.

    Args:
        catalogue: categories and their properties.
        world: moves things and shows states.
        instances: everything in the scene, prepared things included.
        law: how it differs from its catalogue; not at all by default.
    """

    def __init__(
        self,
        catalogue: Catalogue,
        world: World,
        instances: Iterable[Placed],
        law: Law | None = None,
    ) -> None:
        self.catalogue = catalogue
        self.world = world
        self.law = law or Law()
        self.held: str | None = None
        self.time_s = 0.0
        self._parents: dict[str, str | None] = {}
        self._states: dict[str, dict[str, str]] = {}
        self._waiting: list[str] = []
        self._gone: dict[str, str] = {}
        self._spoiled: set[str] = set()
        self._events: list[Event] = []
        self._tempered_s: dict[str, float] = {}
        self._ajar: set[str] = set()
        self._lying: set[str] = set()
        for instance in sorted(instances, key=lambda i: natural_key(i.name)):
            states = catalogue.default_states(instance.category) | dict(instance.states)
            self._states[instance.name] = states
            if instance.prepared:
                self._waiting.append(instance.name)
            else:
                self._parents[instance.name] = instance.parent
        for deviation in self.law.deviations:
            self.record(LAW_EVENT, (deviation.thing,), str(deviation))

    # what is there

    def names(self) -> Iterator[str]:
        """Every instance that is there now, in natural order."""
        yield from sorted(self._parents, key=natural_key)

    def exists(self, name: str) -> bool:
        """Whether an instance is there now."""
        return name in self._parents

    def gone(self, name: str) -> str | None:
        """What became of an instance that was replaced, in words; None if it never was."""
        return self._gone.get(name)

    def is_any_support(self, name: str) -> bool:
        """Whether a name is a category of supports of which any will do ("CounterTop")."""
        kind = self.catalogue.find(name)
        if kind is None or is_instance(name) or not kind.fixture or kind.receptacle is None:
            return False
        return kind.receptacle.relation == "on_top_of" and kind.receptacle.capacity is None

    def category(self, name: str) -> Category:
        """The category of an instance."""
        return self.catalogue[name]

    def of_category(self, category: str) -> list[str]:
        """Every instance of a category that is there now."""
        return [n for n in self.names() if category_of(n) == category]

    def first(self, category: str) -> str | None:
        """The instance of a category with the lowest number."""
        return next(iter(self.of_category(category)), None)

    # where things are

    def parent(self, name: str) -> str | None:
        """The receptacle that a thing is directly in or on."""
        return self._parents.get(name)

    def ancestors(self, name: str) -> list[str]:
        """Receptacles from the direct one outwards."""
        found: list[str] = []
        parent = self._parents.get(name)
        while parent is not None and parent not in found:
            found.append(parent)
            parent = self._parents.get(parent)
        return found

    def contents(self, name: str) -> list[str]:
        """What is directly in or on a thing."""
        return [n for n in self.names() if self._parents[n] == name]

    def within(self, name: str) -> list[str]:
        """Everything in or on a thing, at any depth."""
        return [n for n in self.names() if name in self.ancestors(n)]

    def closed_around(self, name: str) -> str | None:
        """The closed container that hides a thing, the outermost one; None if accessible."""
        closed = [a for a in self.ancestors(name) if self.is_shut(a)]
        return closed[-1] if closed else None

    def is_shut(self, name: str) -> bool:
        """Whether a thing encloses its contents and is closed."""
        return self.catalogue.encloses(name) and self.state(name, "open") == "closed"

    # states

    def state(self, name: str, attribute: str) -> str | None:
        """A true value, None where the thing has no such attribute."""
        return self._states.get(name, {}).get(attribute)

    def set_state(self, name: str, attribute: str, value: str) -> bool:
        """Change one state and make it visible; returns whether anything changed.

        A thing without the attribute stays as it is.

        Raises:
            UnknownNameError: there is no such attribute, or it has no such value.
        """
        if value not in self.catalogue.values(attribute):
            known = self.catalogue.values(attribute)
            raise UnknownNameError(f"value of {attribute}", value, known)
        states = self._states.get(name, {})
        if attribute not in states:
            return False
        if attribute == "temperature":
            self._tempered_s[name] = self.time_s
        if states[attribute] == value:
            return False
        states[attribute] = value
        self.world.show(name, attribute, value)
        self.record(STATE_EVENT, (name,), str(Literal(attribute, (name,), value)))
        return True

    def swing(self, name: str, value: str) -> None:
        """Open or close a thing all the way."""
        was_ajar = name in self._ajar
        self._ajar.discard(name)
        if not self.set_state(name, "open", value) and was_ajar:
            self.world.show(name, "open", value)

    def leave_ajar(self, name: str, towards: str) -> None:
        """Leave a thing between its state, which it keeps, and another.

        What was to be opened counts as closed: nothing goes in; what was to be closed as open.
        """
        self._ajar.add(name)
        if isinstance(self.world, Untidy):
            self.world.leave_ajar(name, towards)

    def is_ajar(self, name: str) -> bool:
        """Whether a thing is neither open nor closed all the way."""
        return name in self._ajar

    def lay(self, name: str) -> None:
        """Lay a vessel on its side; it takes no liquid until it is picked up."""
        self._lying.add(name)
        if isinstance(self.world, Untidy):
            self.world.lay(name)

    def is_lying(self, name: str) -> bool:
        """Whether a vessel lies on its side."""
        return name in self._lying

    def tempered_s(self, name: str) -> float:
        """When a thing was last heated or cooled."""
        return self._tempered_s.get(name, 0.0)

    # changes

    def hold(self, name: str) -> None:
        """Take a thing, with what is in it, into the gripper."""
        self.world.hold(name)
        self._lying.discard(name)
        self._parents[name] = None
        self.held = name
        self.record(RELATION_EVENT, (name,), str(Literal("held_by", (name, GRIPPER))))

    def put(self, name: str, receptacle: str) -> None:
        """Put a thing in or on a receptacle."""
        self.world.place(name, receptacle)
        self._attach(name, receptacle)

    def fall(self, name: str) -> None:
        """Let the held thing fall to the floor."""
        self.world.drop(name)
        floor = self.first(FLOOR)
        self.held = None
        self._parents[name] = None
        if floor is not None:
            self._attach(name, floor)
        self.record("dropped", (name,), f"{name} fell out of the gripper")

    def replace(self, old: str, category: str, count: int, what: str) -> list[str]:
        """Take a thing away and put prepared ones at its place; returns their names.

        They take over its place, spoilage, and the states that last (temperature, cooked).

        Args:
            old: what vanishes.
            category: of the prepared things.
            count: how many of them at most.
            what: what happened in words, e.g. "sliced".
        """
        new = [n for n in self._waiting if category_of(n) == category][:count]
        self.world.replace(old, new)
        parent, states = self._parents.pop(old), self._states[old]
        self._gone[old] = what
        if self.held == old:
            self.held = None
        self.record(what, (old, *new), f"{old} was {what}")
        for name in new:
            self._waiting.remove(name)
            self._parents[name] = None
            if parent is not None:
                self._attach(name, parent)
            for attribute in self.catalogue.lasting:
                if attribute in states and attribute in self._states[name]:
                    self.set_state(name, attribute, states[attribute])
            if old in self._spoiled:
                self.spoil(name, f"{name} is made of {old}, which was spoiled")
        return new

    def spoil(self, name: str, why: str) -> None:
        """Note that something irreversible has happened to a thing; once for each."""
        if name not in self._spoiled:
            self._spoiled.add(name)
            self.record("spoiled", (name,), why)

    def record(self, kind: str, objects: tuple[str, ...], text: str) -> None:
        """Append an event."""
        self._events.append(Event(self.time_s, kind, objects, text))

    def _attach(self, name: str, receptacle: str) -> None:
        self._parents[name] = receptacle
        if self.held == name:
            self.held = None
        self.record(
            RELATION_EVENT,
            (name, receptacle),
            str(Literal(self._relation(receptacle), (name, receptacle))),
        )

    def _relation(self, receptacle: str) -> str:
        kind = self.catalogue[receptacle].receptacle
        return "on_top_of" if kind is None else kind.relation

    # the oracle's view

    def states(self, instance: str) -> Mapping[str, str]:
        """True attribute values of one instance, empty if there is no such instance now."""
        return dict(self._states[instance]) if instance in self._parents else {}

    def spoiled(self) -> frozenset[str]:
        """Instances to which something irreversible has happened."""
        return frozenset(self._spoiled)

    def events(self) -> tuple[Event, ...]:
        """Everything that has happened since reset, in order."""
        return tuple(self._events)

    def truth(self) -> SceneGraph:
        """The complete state: every instance, every state, containment, the hand, blocking."""
        nodes = [self._node(name) for name in self.names()]
        nodes.append(ObjectNode(GRIPPER, GRIPPER, last_seen_s=self.time_s))
        relations = [
            Relation(name, self._relation(parent), parent)
            for name in self.names()
            if (parent := self._parents[name]) is not None and parent in self._parents
        ]
        if self.held is not None:
            relations.append(Relation(self.held, "held_by", GRIPPER))
        for name in self.names():
            blocker = self.blocker(name)
            if blocker is not None:
                relations.append(Relation(blocker, "blocking", name))
        return SceneGraph(tuple(nodes), tuple(relations))

    def blocker(self, name: str) -> str | None:
        """What stands in front of a thing that could be picked up."""
        if not self.catalogue[name].pickupable or name == self.held or name not in self._parents:
            return None
        blocker = self.world.blocker(name)
        return blocker if blocker in self._parents else None

    def _node(self, name: str) -> ObjectNode:
        corners = self.world.box_world_m(name) if isinstance(self.world, Boxes) else None
        box = None if corners is None else Box(*corners)
        return ObjectNode(
            id=name,
            category=self.catalogue[name].name,
            states=tuple(sorted(self._states[name].items())),
            centroid_m=None if box is None else box.centre,
            box_m=box,
            last_seen_s=self.time_s,
        )
