"""The symbolic state: what planning believes about the things of one scene graph.

Built from a `SceneGraph` and read by domain, validator, translation and replanner; calls only the
vocabulary and the types.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from itertools import product

from forestall.types.facts import GRIPPER, Literal, category_of, is_instance
from forestall.types.graph import SceneGraph
from forestall.vocabulary import Category, Device, Vocabulary

SUPPORTED = (
    "accessible",
    "blocking",
    "hand_empty",
    "held_by",
    "inside",
    "located",
    "on_top_of",
    "spoiled",
    "unblocked",
    "vacant",
)
"""Predicates that a symbolic state decides besides attributes; the others are geometry."""

CROWDED = 0.6
"""Share of a support's footprint from which on another one is preferred."""


def number_of(name: str) -> int:
    """The instance number of a name, 1 where it carries none."""
    return int(name.rpartition("-")[2]) if is_instance(name) else 1


def by_number(name: str) -> tuple[str, int]:
    """Sort key: category first, then number ("Mug-2" before "Mug-10")."""
    return category_of(name), number_of(name)


@dataclass(frozen=True, slots=True)
class Place:
    """Where a thing is: `relation` ("inside" or "on_top_of") and the thing that has it."""

    relation: str
    parent: str


@dataclass(slots=True)
class State:
    """What holds at one moment; `domain.apply` copies it and never changes the one it was given.

    Args:
        kinds: thing → category; whatever is not here does not exist.
        values: (thing, attribute) → value.
        places: thing → where it is; no entry for what is held, fixed, lost or on nothing known.
        held: what the gripper holds.
        at: the last thing that was driven to or handled.
        lost: things whose place is not known.
        blocking: (front, behind) pairs.
        spoiled: things to which something irreversible has happened.
        hidden: containers whose inside was not observed and is assumed empty.
        crowded: supports with little free area, as far as the boxes of the graph tell.
        assumed: facts that were not observed and are taken from the vocabulary.
    """

    vocabulary: Vocabulary
    kinds: dict[str, str]
    values: dict[tuple[str, str], str] = field(default_factory=dict)
    places: dict[str, Place] = field(default_factory=dict)
    held: str | None = None
    at: str | None = None
    lost: frozenset[str] = frozenset()
    blocking: frozenset[tuple[str, str]] = frozenset()
    spoiled: frozenset[str] = frozenset()
    hidden: frozenset[str] = frozenset()
    crowded: frozenset[str] = frozenset()
    assumed: frozenset[Literal] = frozenset()

    @classmethod
    def from_graph(cls, graph: SceneGraph, vocabulary: Vocabulary) -> State:
        """Read a scene graph; nodes of categories that the vocabulary lacks are left out.

        An unobserved attribute takes its default and is listed in `assumed`, as is the emptiness
        of every hidden container. A thing with neither box nor support is lost.
        """
        state = cls(vocabulary, {}, held=graph.holding)
        lost, assumed = set(), set()
        for node in graph.nodes:
            category = vocabulary.categories.get(node.category)
            if node.id == GRIPPER or category is None:
                continue
            state.kinds[node.id] = node.category
            for attribute, default in vocabulary.default_states(node.category).items():
                value = node.state(attribute)
                if value is None:
                    assumed.add(Literal(attribute, (node.id,), default))
                state.values[node.id, attribute] = default if value is None else value
            placed = node.box_m is not None or graph.parents(node.id) or node.id == graph.holding
            if not category.fixture and not placed:
                lost.add(node.id)
        if state.held not in state.kinds:
            state.held = None
        state.places.update(_places(graph, state))
        assumed |= {Literal("vacant", (h,)) for h in graph.hidden if h in state.kinds}
        state.lost = frozenset(lost)
        state.blocking = frozenset(
            (r.subject, r.object)
            for r in graph.relations
            if r.predicate == "blocking" and r.subject in state.kinds and r.object in state.kinds
        )
        state.hidden = frozenset(h for h in graph.hidden if h in state.kinds)
        state.assumed = frozenset(assumed)
        state.crowded = _crowded(graph)
        return state

    def copy(self) -> State:
        """An independent copy."""
        return State(
            self.vocabulary,
            dict(self.kinds),
            dict(self.values),
            dict(self.places),
            self.held,
            self.at,
            self.lost,
            self.blocking,
            self.spoiled,
            self.hidden,
            self.crowded,
            self.assumed,
        )

    def category(self, name: str) -> Category:
        """The category of an existing thing."""
        return self.vocabulary.categories[self.kinds[name]]

    def value(self, name: str, attribute: str) -> str | None:
        """The value of an attribute, None where the thing does not have it."""
        return self.values.get((name, attribute))

    def instances(self, category: str) -> tuple[str, ...]:
        """Existing things of a category, lowest number first."""
        return tuple(sorted((n for n, k in self.kinds.items() if k == category), key=by_number))

    def contents(self, name: str, relation: str | None = None) -> tuple[str, ...]:
        """What is directly in or on a thing."""
        return tuple(
            sorted(
                (
                    x
                    for x, p in self.places.items()
                    if p.parent == name and relation in (None, p.relation)
                ),
                key=by_number,
            )
        )

    def chain(self, name: str) -> Iterator[Place]:
        """Where a thing is, where that is, and so on upwards."""
        place = self.places.get(name)
        while place is not None:
            yield place
            place = self.places.get(place.parent)

    def root(self, name: str) -> str:
        """The outermost thing that has `name`, itself included."""
        return next((p.parent for p in reversed(list(self.chain(name)))), name)

    def closed_around(self, name: str) -> str | None:
        """The closed container that keeps the hand from a thing, if any."""
        for place in self.chain(name):
            closed = self.value(place.parent, "open") == "closed"
            if closed and place.relation == "inside" and self.vocabulary.encloses(place.parent):
                return place.parent
        return None

    def blockers(self, name: str) -> tuple[str, ...]:
        """What stands in front of a thing."""
        return tuple(sorted((y for y, x in self.blocking if x == name), key=by_number))

    def has_room(self, receptacle: str) -> bool:
        """Whether the capacity of a receptacle leaves room for one more thing."""
        shape = self.category(receptacle).receptacle
        if shape is None:
            return False
        used = len(self.contents(receptacle, shape.relation))
        return shape.capacity is None or used < shape.capacity

    def targets(self, name: str) -> tuple[str, ...]:
        """The receptacles whose contents a device works on."""
        device = self.category(name).device
        if device is None:
            return ()
        if device.acts_on is None:
            return (name,)
        partners = self.instances(device.acts_on)
        own = tuple(x for x in partners if number_of(x) == number_of(name))
        return own or partners[:1]

    def working(self, name: str) -> Device | None:
        """The device of a thing, if it works now."""
        device = self.category(name).device
        if device is None:
            return None
        if device.always:
            return device if self.value(name, "open") != "open" else None
        return device if self.value(name, "toggled") == "on" else None

    def matches(self, name: str) -> tuple[str, ...]:
        """Existing things that an instance or category name can mean."""
        canonical = self.vocabulary.canonical(name)
        return (canonical,) if canonical in self.kinds else self.instances(canonical)

    def holds(self, literal: Literal) -> bool:
        """Whether a literal holds; a category name means "some instance of it".

        With the value "false" no instance may make it true. Predicates of geometry never hold.
        """
        choices = [
            (a,) if a == GRIPPER else (self.matches(a) or ((a,) if is_instance(a) else ()))
            for a in literal.args
        ]
        found = any(self._holds(literal.predicate, c, literal.value) for c in product(*choices))
        return not found if literal.value == "false" else found

    def _holds(self, predicate: str, args: tuple[str, ...], value: str) -> bool:
        if predicate == "hand_empty":
            return self.held is None
        if not args:
            return False
        name = args[0]
        if predicate in ("inside", "on_top_of"):
            return self.places.get(name) == Place(predicate, args[-1])
        if predicate in self.vocabulary.attributes:
            return self.value(name, predicate) == value
        if name not in self.kinds:
            return False
        simple = {
            "held_by": self.held == name,
            "blocking": args in self.blocking,
            "located": name not in self.lost,
            "vacant": not self.contents(name),
            "unblocked": not self.blockers(name),
            "accessible": self.closed_around(name) is None,
            "spoiled": name in self.spoiled,
        }
        return simple.get(predicate, False)


def _crowded(graph: SceneGraph) -> frozenset[str]:
    """Things whose contents cover more than `CROWDED` of their own footprint."""
    covered: dict[str, float] = {}
    area_m2 = {n.id: n.box_m.size[0] * n.box_m.size[1] for n in graph.nodes if n.box_m is not None}
    for r in graph.relations:
        if r.predicate == "on_top_of":
            covered[r.object] = covered.get(r.object, 0.0) + area_m2.get(r.subject, 0.0)
    return frozenset(x for x, a in covered.items() if x in area_m2 and a > CROWDED * area_m2[x])


def _places(graph: SceneGraph, state: State) -> dict[str, Place]:
    """One place for each thing: inside before on top, the innermost of several, no cycles."""
    edges: dict[str, list[Place]] = {}
    for r in graph.relations:
        known = r.subject in state.kinds and r.object in state.kinds and r.subject != state.held
        if known and r.predicate in ("inside", "on_top_of"):
            edges.setdefault(r.subject, []).append(Place(r.predicate, r.object))
    places: dict[str, Place] = {}
    for name in sorted(edges, key=by_number):
        if state.category(name).fixture:
            continue
        parents = {p.parent for p in edges[name]}
        outer = {q.parent for p in parents for q in edges.get(p, ())}
        ranked = sorted(
            edges[name],
            key=lambda p: (
                p.parent in outer,
                state.kinds[p.parent] == "Floor",
                p.relation != "inside",
                by_number(p.parent),
            ),
        )
        for place in ranked:
            above, seen = place.parent, {name}
            while above not in seen and above in places:
                seen.add(above)
                above = places[above].parent
            if above not in seen:
                places[name] = place
                break
    return places
