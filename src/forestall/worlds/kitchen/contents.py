"""Which movable things a scene is built with: the task's, the clutter, and what waits for its turn.

Called by `model` before anything is built. The clutter is chosen for the undisturbed scene, from a
stream of its own, so that a scenario does not change it.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from forestall.types.facts import category_of
from forestall.types.scene import ObjectNeed, SceneNeeds
from forestall.worlds.kitchen.catalogue import Catalogue
from forestall.worlds.kitchen.streams import Streams

_SPARE = 3
"""How many more pieces are built than wanted, for those that find no place."""

_NOT_CLUTTER = {
    "kitchen": frozenset({"Laptop", "RemoteControl"}),
    "living-room": frozenset(
        {"Pot", "Pan", "Kettle", "Knife", "Lettuce", "Egg", "Potato", "Bread"}
    ),
}


@dataclass(frozen=True, slots=True)
class Thing:
    """One movable thing that is built into the scene.

    Args:
        name: instance name.
        category: its category.
        states: start states.
        looks: what its colours and shape are drawn for.
        made_from: what it waits in as a part.
    """

    name: str
    category: str
    states: dict[str, str]
    looks: str
    made_from: str | None = None


@dataclass(frozen=True, slots=True)
class Clutter:
    """Further objects: candidates in the order in which they are tried, and how many are wanted."""

    names: tuple[str, ...] = ()
    most: int = 0


@dataclass(frozen=True, slots=True)
class Contents:
    """Everything movable of a scene.

    Args:
        things: all that is built; those of the undisturbed scene come first.
        clutter: of the undisturbed scene.
        other: what takes the place of that clutter; None where it stays.
        more: what is strewn in beside it.
    """

    things: tuple[Thing, ...]
    clutter: Clutter
    other: Clutter | None
    more: Clutter


def contents_of(
    needs: SceneNeeds, base: SceneNeeds, catalogue: Catalogue, streams: Streams
) -> Contents:
    """Choose the contents of a scene.

    Args:
        needs: what the scene must contain.
        base: the same, before a scenario changed it.
        catalogue: categories.
        streams: random streams of the seed.
    """
    added = {n.category for n in needs.objects} - {n.category for n in base.objects}
    of_task = {n.category for n in base.objects}
    order, most = _ordered(base, of_task, catalogue, streams.without("clutter"))
    clutter = Clutter(_named(order, 0, most + _SPARE if most else 0), most)
    other = None
    if streams.varied("clutter"):
        order, most = _ordered(base, of_task, catalogue, streams)
        names = _named(order, 0, most + _SPARE if most else 0)
        other = Clutter(_without(names, added), most)
    count = needs.more_clutter
    start = len(clutter.names if other is None else other.names)
    names = _named(order, start, count + _SPARE if count else 0)
    more = Clutter(_without(names, added), count)

    ids = {n.id for n in needs.objects}
    things = {n.id: _needed(n, catalogue) for n in base.objects}
    things |= {n: _plain(n, catalogue) for n in clutter.names}
    prepared = _prepared(things.values(), ids | set(things), catalogue)
    new = {n.id: _needed(n, catalogue) for n in needs.objects if n.id not in things}
    for name in (*(other.names if other else ()), *more.names):
        if name not in things:
            new.setdefault(name, _plain(name, catalogue))
    used = ids | set(things) | set(new) | {t.name for t in prepared}
    waiting = _prepared(new.values(), used, catalogue)
    return Contents((*things.values(), *prepared, *new.values(), *waiting), clutter, other, more)


def _needed(need: ObjectNeed, catalogue: Catalogue) -> Thing:
    states = catalogue.default_states(need.category) | dict(need.states)
    return Thing(need.id, need.category, states, need.id)


def _plain(name: str, catalogue: Catalogue) -> Thing:
    category = category_of(name)
    return Thing(name, category, catalogue.default_states(category), name)


def _without(names: Sequence[str], categories: set[str]) -> tuple[str, ...]:
    return tuple(n for n in names if category_of(n) not in categories)


def _ordered(
    needs: SceneNeeds, of_task: set[str], catalogue: Catalogue, streams: Streams
) -> tuple[list[str], int]:
    """Categories of clutter in random order, and how many pieces are wanted."""
    parts = {c for n in of_task for c in (catalogue[n].slices_into, catalogue[n].cracks_into)}
    options = [
        name
        for name, c in sorted(catalogue.categories.items())
        if c.pickupable
        and not c.fixture
        and name not in of_task
        and name not in parts
        and name not in _NOT_CLUTTER[needs.room]
        and ("sliced", "sliced") not in c.defaults
    ]
    rng = streams("clutter")
    low, high = needs.clutter
    most = int(rng.integers(low, high + 1))
    order = [options[int(i)] for i in rng.permutation(len(options))]
    return order, most if order else 0


def _named(order: Sequence[str], first: int, count: int) -> tuple[str, ...]:
    """Instance names from the `first`-th on, going round the categories."""
    if not order:
        return ()
    return tuple(
        f"{order[k % len(order)]}-{1 + k // len(order)}" for k in range(first, first + count)
    )


def _prepared(things: Iterable[Thing], used: set[str], catalogue: Catalogue) -> list[Thing]:
    """Slices and cracked eggs that wait for their turn."""
    used = set(used)
    made: list[Thing] = []
    for thing in things:
        category = catalogue[thing.category]
        parts = [category.slices_into] * category.slices if category.slices_into else []
        parts += [category.cracks_into] if category.cracks_into else []
        for k, part in enumerate(parts):
            number = 1
            while f"{part}-{number}" in used:
                number += 1
            name = f"{part}-{number}"
            used.add(name)
            looks = f"{thing.looks}/{part}/{k}"
            made.append(Thing(name, part, catalogue.default_states(part), looks, thing.name))
    return made
