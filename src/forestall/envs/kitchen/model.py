"""Builds a whole scene from what a task needs and a seed; the entry is `build_scene`.

Draws the plan (`plans`), builds and compiles it (`rooms`, `objects`, `assembly`), furnishes it
(`stocking`), and starts over with other random choices when something finds no place.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import mujoco
import numpy as np

from forestall.envs.kitchen import layout, plans
from forestall.envs.kitchen.assembly import Kit, compile_kit
from forestall.envs.kitchen.bodies import Bodies
from forestall.envs.kitchen.forms import Instance, Rect
from forestall.envs.kitchen.navigation import Floor, Standing
from forestall.envs.kitchen.objects import build_thing
from forestall.envs.kitchen.robot import build_robot
from forestall.envs.kitchen.rooms import build_room
from forestall.envs.kitchen.settled import check_settled
from forestall.envs.kitchen.stocking import OPEN_PLACES, Stocker
from forestall.envs.kitchen.style import draw_style
from forestall.envs.kitchen.world import HAND_M, KitchenWorld
from forestall.errors import SceneError
from forestall.types.facts import category_of, is_instance
from forestall.types.scene import SceneNeeds
from forestall.vocabulary import Vocabulary

LAYOUTS = 10
"""How many layouts are tried for one seed."""

STOCKINGS = 4
"""How many times one layout is furnished anew."""

DRAFTS = 60
"""How many floor plans are drawn for one layout."""

_SPARE_CLUTTER = 3
_NOT_CLUTTER = {
    "kitchen": frozenset({"Laptop", "RemoteControl"}),
    "living-room": frozenset(
        {"Pot", "Pan", "Kettle", "Knife", "Lettuce", "Egg", "Potato", "Bread"}
    ),
}


@dataclass(frozen=True, slots=True)
class _Thing:
    """One movable thing that is built into the scene."""

    name: str
    category: str
    states: dict[str, str]
    made_from: str | None = None


def build_scene(needs: SceneNeeds, seed: int, vocabulary: Vocabulary) -> KitchenWorld:
    """Build the scene of a seed, the same each time.

    Args:
        needs: what must be there; everything else varies with the seed.
        seed: 0 or more.
        vocabulary: categories, those of the task file included.

    Raises:
        SceneError: contradictory needs, or no room for something.
        UnknownNameError: a category that the vocabulary lacks.
    """
    if needs.room not in OPEN_PLACES:
        known = ", ".join(sorted(OPEN_PLACES))
        raise SceneError(f"unknown room {needs.room!r}: known: {known}")
    needs = _canonical(needs, vocabulary)
    failure = ""
    for attempt in range(LAYOUTS):
        rng = np.random.default_rng(seed if attempt == 0 else [seed, attempt])
        things, clutter, most = _things(needs, vocabulary, rng)
        empty = _empty_room(needs, things, vocabulary, rng)
        start = empty.world.bodies.snapshot()
        for _ in range(STOCKINGS):
            empty.world.bodies.restore(start)
            try:
                _stock(empty, needs, vocabulary, clutter, most, rng)
            except SceneError as error:
                failure = str(error)
                continue
            empty.world.freeze(_instances(empty, things))
            return empty.world
    raise SceneError(f"no {needs.room} of seed {seed} has room for this scene: {failure}")


@dataclass(frozen=True, slots=True)
class _Empty:
    world: KitchenWorld
    fixtures: tuple[str, ...]


def _canonical(needs: SceneNeeds, vocabulary: Vocabulary) -> SceneNeeds:
    """Resolve aliases and check what can be checked without a room."""
    ids = [n.id for n in needs.objects]
    twice = sorted({i for i in ids if ids.count(i) > 1})
    if twice:
        raise SceneError(f"{twice[0]} is needed twice; every object has its own id")
    for need in needs.objects:
        category = vocabulary[need.category]
        if category.fixture:
            raise SceneError(f"{need.id}: a {category.name} is a fixture and cannot be placed")
        if category_of(need.id) != category.name or not is_instance(need.id):
            raise SceneError(f"{need.id} must be named {category.name}-1 or another number")
        _checked(need.id, category.name, need.states, vocabulary)
        for place in need.places:
            if vocabulary[place].receptacle is None:
                raise SceneError(f"{need.id}: nothing can be put on or in a {place}")
        if need.in_front_of is not None and need.in_front_of not in ids:
            raise SceneError(
                f"{need.id} is to stand in front of {need.in_front_of}, "
                "which is not among the needed objects"
            )
    fixtures = tuple((vocabulary.canonical(f), a, v) for f, a, v in needs.fixtures)
    for name, attribute, value in fixtures:
        _checked(name, vocabulary[name].name, ((attribute, value),), vocabulary)
    low, high = needs.clutter
    if not 0 <= low <= high:
        raise SceneError(f"clutter must be a smallest and a largest number, got {low} and {high}")
    return SceneNeeds(needs.room, needs.objects, fixtures, needs.clutter)


def _checked(
    name: str, category: str, states: Sequence[tuple[str, str]], vocabulary: Vocabulary
) -> None:
    for attribute, value in states:
        if attribute not in vocabulary[category].attributes:
            known = ", ".join(vocabulary[category].attributes) or "none"
            raise SceneError(f"{name} has no attribute {attribute!r}: it has {known}")
        if value not in vocabulary.values(attribute):
            known = ", ".join(vocabulary.values(attribute))
            raise SceneError(f"{attribute} of {name} cannot be {value!r}: known: {known}")


def _things(
    needs: SceneNeeds, vocabulary: Vocabulary, rng: np.random.Generator
) -> tuple[list[_Thing], list[str], int]:
    """Everything movable that is built, the clutter among it, and how much of it is wanted."""
    things = [
        _Thing(n.id, n.category, vocabulary.default_states(n.category) | dict(n.states))
        for n in needs.objects
    ]
    names = [n.id for n in needs.objects]
    taken = {n.category for n in needs.objects}
    taken |= {c for n in taken for c in (vocabulary[n].slices_into, vocabulary[n].cracks_into) if c}
    options = [
        name
        for name, c in sorted(vocabulary.categories.items())
        if c.pickupable
        and not c.fixture
        and name not in taken
        and name not in _NOT_CLUTTER[needs.room]
        and ("sliced", "sliced") not in c.defaults
    ]
    low, high = needs.clutter
    most = int(rng.integers(low, high + 1))
    clutter: list[str] = []
    numbers: dict[str, int] = {}
    if options and most:
        order = [options[int(i)] for i in rng.permutation(len(options))]
        for k in range(most + min(_SPARE_CLUTTER, len(options))):
            category = order[k % len(order)]
            numbers[category] = numbers.get(category, 0) + 1
            name = f"{category}-{numbers[category]}"
            clutter.append(name)
            things.append(_Thing(name, category, vocabulary.default_states(category)))
    names += clutter
    return things + _prepared(things, names, vocabulary), clutter, most


def _prepared(
    things: Sequence[_Thing], names: Sequence[str], vocabulary: Vocabulary
) -> list[_Thing]:
    """Slices and cracked eggs that wait for their turn."""
    used = set(names)
    made: list[_Thing] = []
    for thing in things:
        category = vocabulary[thing.category]
        parts = [category.slices_into] * category.slices if category.slices_into else []
        parts += [category.cracks_into] if category.cracks_into else []
        for part in parts:
            number = 1
            while f"{part}-{number}" in used:
                number += 1
            name = f"{part}-{number}"
            used.add(name)
            made.append(_Thing(name, part, vocabulary.default_states(part), thing.name))
    return made


def _empty_room(
    needs: SceneNeeds, things: Sequence[_Thing], vocabulary: Vocabulary, rng: np.random.Generator
) -> _Empty:
    plan = _drawn(needs.room, rng)
    kit = Kit(mujoco.MjSpec(), rng)
    forms = build_room(kit, plan, draw_style(rng))
    fixtures = tuple(sorted(forms))
    states = {name: vocabulary.default_states(name) for name in fixtures}
    for name, attribute, value in needs.fixtures:
        if name not in states:
            raise SceneError(f"the {needs.room} has no {name}")
        states[name][attribute] = value
    for thing in things:
        forms[thing.name] = build_thing(kit, thing.name, vocabulary[thing.category])
        states[thing.name] = thing.states
    build_robot(kit, HAND_M)
    bodies = Bodies(compile_kit(kit), forms, states)
    area = Rect(-plan.width / 2, -plan.depth / 2, plan.width / 2, plan.depth / 2)
    floor = Floor(area, tuple(item.rect() for item in plan.items if item.z == 0))
    world = KitchenWorld(bodies, floor, Standing(*plan.start), _decks(plan))
    return _Empty(world, fixtures)


def _drawn(room: str, rng: np.random.Generator) -> layout.Plan:
    draw = plans.kitchen if room == "kitchen" else plans.living_room
    for _ in range(DRAFTS):
        try:
            return draw(rng)
        except SceneError:
            continue
    raise SceneError(f"no floor plan for a {room} was found")


def _decks(plan: layout.Plan) -> Mapping[str, str]:
    """Appliance → the counter that it stands on."""
    counters = [item for item in plan.items if item.kind == "counter"]
    decks = {}
    for item in plan.items:
        if item.z == layout.COUNTER_HEIGHT_M:
            under = [c.name for c in counters if c.rect().distance(item.x, item.y) < 1e-6]
            decks[item.name] = under[0]
    return decks


def _stock(
    empty: _Empty,
    needs: SceneNeeds,
    vocabulary: Vocabulary,
    clutter: Sequence[str],
    most: int,
    rng: np.random.Generator,
) -> None:
    world = empty.world
    stocker = Stocker(world, vocabulary, needs.room, empty.fixtures, rng)
    stocker.put_needed(needs.objects)
    placed = stocker.put_clutter(clutter, most)
    if len(placed) < needs.clutter[0]:
        raise SceneError(f"only {len(placed)} of {needs.clutter[0]} further objects found a place")
    stocker.check(needs.objects)
    problems = check_settled(world)
    if problems:
        raise SceneError(problems[0])


def _instances(empty: _Empty, things: Sequence[_Thing]) -> tuple[Instance, ...]:
    bodies = empty.world.bodies
    found = [
        Instance(name, category_of(name), None, tuple(sorted(bodies.states[name].items())))
        for name in empty.fixtures
    ]
    for thing in things:
        parent = bodies.parents.get(thing.name)
        waiting = thing.made_from is not None
        if parent is None and not (waiting and thing.made_from in bodies.parents):
            continue
        states = tuple(sorted(bodies.states[thing.name].items()))
        found.append(Instance(thing.name, thing.category, parent, states, waiting, thing.made_from))
    return tuple(found)
