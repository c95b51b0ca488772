"""What may be where in a planning problem, and the atoms that say so.

Called by `translate` and `automatic`; calls `state` and `relevance`.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import NamedTuple

from forestall.planning.problem import Atom
from forestall.planning.relevance import Conjunction, Universe
from forestall.planning.state import State, by_number
from forestall.types.facts import Literal, category_of
from forestall.vocabulary import Category

MAX_DEPTH = 3

Switch = tuple[tuple[Atom, ...], tuple[Atom, ...]]
Room = tuple[list[Atom], list[Atom], list[Atom]]


class Change(NamedTuple):
    """A conditional effect before atoms are numbered."""

    condition: tuple[Atom, ...]
    add: tuple[Atom, ...]
    delete: tuple[Atom, ...]


class Layout:
    """Possible places, capacities and attributes of the things of a problem.

    Args:
        state: the first state.
        universe: the kept things.
        goals: ground alternatives; what they speak of is tracked.
    """

    def __init__(self, state: State, universe: Universe, goals: Sequence[Conjunction]) -> None:
        self.state = state
        self.universe = universe
        literals = [x for goal in goals for x in goal]
        self.warm = any("temperature" in x.predicate for x in literals)
        self.watched = {x.args[0] for x in literals if x.predicate == "spoiled"}
        self.watched |= {s for s, made in universe.made.items() if self.watched & set(made)}
        made = [y for names in universe.made.values() for y in names]
        self._made = set(made)
        self._quiet: dict[str, list[str]] = {}
        for x in universe.things:
            if state.value(x, "toggled") == "off":
                for target in state.targets(x):
                    self._quiet.setdefault(target, []).append(x)
        self.movable = sorted(
            [x for x in universe.things if self._movable(x)] + made, key=by_number
        )
        self.capacity = self._capacities()
        self.targets = {x: self._targets(x) for x in self.movable}
        self.places = {x: self._places(x) for x in self.movable}
        self._holders: dict[str, list[tuple[str, Atom]]] = {}
        for x in self.movable:
            for place in self.places[x]:
                parent = self.parent(place)
                if parent is not None:
                    self._holders.setdefault(parent, []).append((x, place))

    def safe(self, literal: Literal) -> bool:
        """Whether a literal forbids harm to a thing that nothing in the problem can harm."""
        if literal.predicate != "spoiled" or literal.value != "false":
            return False
        name = literal.args[0]
        outside = name not in self.universe.things and name not in self._made
        return outside and name not in self.state.spoiled

    def kind(self, name: str) -> str:
        """The category name of an existing or makeable thing."""
        return self.state.kinds.get(name, category_of(name))

    def category(self, name: str) -> Category:
        """The category of an existing or makeable thing."""
        return self.state.vocabulary.categories[self.kind(name)]

    def pickable(self, name: str) -> bool:
        """Whether a thing can be picked up."""
        return self.category(name).pickupable

    def has(self, name: str, attribute: str) -> bool:
        """Whether a thing has an attribute that the problem tracks."""
        if attribute == "temperature" and not self.warm:
            return False
        return attribute in self.category(name).attributes

    def initially(self, name: str, attribute: str) -> str:
        """The first value of an attribute."""
        value = self.state.value(name, attribute)
        return value or self.state.vocabulary.default_states(self.kind(name))[attribute]

    def becomes(self, name: str, attribute: str, value: str) -> Switch:
        """Atoms to add and to delete when an attribute takes a value."""
        values = self.state.vocabulary.attributes[attribute].values
        others = tuple(("is", name, attribute, v) for v in values if v != value)
        return (("is", name, attribute, value),), others

    def spoils(self, *names: str) -> tuple[Atom, ...]:
        """Atoms to delete when things are spoiled."""
        return tuple(("intact", n) for n in names if n in self.watched)

    def place(self, name: str, receptacle: str) -> Atom:
        """The atom of a thing in or on a receptacle as a skill puts it."""
        shape = self.state.category(receptacle).receptacle
        assert shape is not None
        return ("at", name, shape.relation, receptacle)

    def parent(self, place: Atom) -> str | None:
        """What a place belongs to, None for a thing that lies on nothing known."""
        return place[3] if place[0] == "at" else None

    def counted(self, place: Atom) -> bool:
        """Whether a thing at this place takes room of a limited receptacle."""
        parent = self.parent(place)
        if parent is None or parent not in self.capacity:
            return False
        return self.place(place[1], parent) == place

    def reachable(self, name: str) -> list[Atom]:
        """The condition that a thing is not inside something closed."""
        return [] if self.category(name).fixture else [("reach", name)]

    def room(self, receptacle: str) -> Iterator[Room]:
        """For each amount of room: condition, atoms to delete, atoms to add."""
        if receptacle not in self.capacity:
            yield [], [], []
            return
        for k in range(1, self.capacity[receptacle] + 1):
            here: Atom = ("free", receptacle, str(k))
            yield [here], [here], [("free", receptacle, str(k - 1))]

    def quiet(self, receptacle: str | None) -> list[Atom]:
        """The condition that nothing runs where a hand goes, for devices that were off at first.

        Plans then put a thing in, turn on, turn off and take it out, as people do, and leave no
        water running. Nothing is lost by it: whatever is on can be turned off.
        """
        return [("is", d, "toggled", "off") for d in self._quiet.get(receptacle or "", ())]

    def plain(self, name: str) -> bool:
        """A support or basin without limit, lid and device: what lies there is left alone."""
        category = self.category(name)
        busy = any(
            name in self.state.targets(d) for d in self.state.kinds if self.state.category(d).device
        )
        return (
            category.fixture
            and name not in self.capacity
            and not busy
            and not (self.state.vocabulary.encloses(name))
        )

    def behind(self, name: str) -> list[str]:
        """Kept things that a thing stands in front of."""
        return sorted(x for y, x in self.state.blocking if y == name and x in self.universe.things)

    def holders(self, name: str) -> list[tuple[str, Atom]]:
        """What can be directly in or on a thing, with the atom that says so."""
        return self._holders.get(name, [])

    def nested(self, name: str, depth: int = MAX_DEPTH) -> Iterator[tuple[str, tuple[Atom, ...]]]:
        """What can be inside at any depth, with the atoms that put it there."""
        for x, place in self.holders(name):
            yield x, (place,)
            if depth > 1:
                for y, path in self.nested(x, depth - 1):
                    yield y, (place, *path)

    def inherits(self, source: str, made: str) -> list[Change]:
        """What a made thing takes over from its source."""
        lasting = self.state.vocabulary.lasting
        changes = [c for a in lasting for c in self.copies(source, made, a)]
        if source in self.watched and made in self.watched:
            changes.append(Change((("not", "intact", source),), (), (("intact", made),)))
        return changes

    def tempers(self, source: str, target: str) -> list[Change]:
        """A thing takes over the temperature of another."""
        return self.copies(source, target, "temperature")

    def copies(self, source: str, target: str, attribute: str) -> list[Change]:
        """A thing takes over an attribute of another, where both have it."""
        if not (self.has(source, attribute) and self.has(target, attribute)):
            return []
        return [
            Change((("is", source, attribute, v),), *self.becomes(target, attribute, v))
            for v in self.state.vocabulary.attributes[attribute].values
        ]

    def initial(self) -> set[Atom]:
        """Every atom that holds at first."""
        state = self.state
        atoms: set[Atom] = set()
        if state.held is None:
            atoms.add(("hand_empty",))
        for name in (*self.universe.things, *sorted(self._made)):
            atoms.add(("located", name))
            exists = name in state.kinds
            if exists:
                place = self._first_place(name)
                atoms.add(("held", name) if name == state.held else place)
            if not exists or state.closed_around(name) is None:
                atoms.add(("reach", name))
            if name not in state.spoiled:
                atoms.add(("intact", name))
            for attribute in self.category(name).attributes:
                atoms.add(("is", name, attribute, self.initially(name, attribute)))
        for name, capacity in self.capacity.items():
            shape = self.category(name).receptacle
            assert shape is not None
            used = len(state.contents(name, shape.relation)) if name in state.kinds else 0
            atoms.add(("free", name, str(max(0, capacity - used))))
        return atoms

    def _movable(self, name: str) -> bool:
        return not self.state.category(name).fixture

    def _first_place(self, name: str) -> Atom:
        place = self.state.places.get(name)
        return ("loose", name) if place is None else ("at", name, place.relation, place.parent)

    def _capacities(self) -> dict[str, int]:
        limits = {}
        for name in (*self.universe.things, *sorted(self._made)):
            shape = self.category(name).receptacle
            if shape is not None and shape.capacity is not None:
                limits[name] = shape.capacity
        return limits

    def _targets(self, name: str) -> list[str]:
        vocabulary, universe = self.state.vocabulary, self.universe
        found = []
        for receptacle in universe.things:
            category = self.state.category(receptacle)
            if category.receptacle is None or receptacle == name:
                continue
            wanted = name in universe.purposeful and receptacle not in self._refused(name)
            if not (receptacle in universe.supports or wanted):
                continue
            if not vocabulary.accepts(receptacle, self.kind(name)):
                continue
            if self.category(name).receptacle and vocabulary.accepts(name, receptacle):
                continue
            found.append(receptacle)
        return sorted(found, key=lambda r: (r not in universe.supports, by_number(r)))

    def _refused(self, name: str) -> tuple[str, ...]:
        """Places that nothing is put to unless a goal names them."""
        return tuple(
            r
            for r in self.universe.things
            if self.state.kinds[r] in ("Floor", "GarbageCan") and r not in self.universe.purposeful
        )

    def _places(self, name: str) -> list[Atom]:
        places = [self.place(name, r) for r in self.targets[name]]
        source = next((s for s, made in self.universe.made.items() if name in made), None)
        if source is not None:
            if self.category(source).slices_into is not None:
                here = [self._first_place(source)] + [
                    self.place(source, r) for r in self._targets(source)
                ]
                for place in here:
                    parent = self.parent(place)
                    if parent is None or self.plain(parent):
                        places.append((place[0], name, *place[2:]))
        elif name != self.state.held:
            places.append(self._first_place(name))
        return list(dict.fromkeys(places))
