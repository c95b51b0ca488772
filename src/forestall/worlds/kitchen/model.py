"""Builds a whole scene from what a task needs and a seed; the entry is `build_scene`.

Chooses the contents (`contents`), draws the plan (`plans`), builds and compiles it (`rooms`,
`objects`, `assembly`), furnishes it (`stocking`), changes what a scenario changes (`changes`), and
starts over with other random choices when something finds no place. The undisturbed scene is made
first and in the same way whatever the scenario, so that both scenes of a seed match.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import mujoco
import numpy as np

from forestall.errors import SceneError
from forestall.types.facts import category_of, is_instance
from forestall.types.scene import SceneNeeds
from forestall.worlds.kitchen import layout, plans
from forestall.worlds.kitchen.assembly import Kit, compile_kit
from forestall.worlds.kitchen.bodies import Bodies
from forestall.worlds.kitchen.catalogue import Catalogue
from forestall.worlds.kitchen.changes import Change, change_of, disturb
from forestall.worlds.kitchen.contents import Contents, Thing, contents_of
from forestall.worlds.kitchen.forms import Instance, Rect
from forestall.worlds.kitchen.navigation import Floor, Standing
from forestall.worlds.kitchen.needs import AXES, roomed
from forestall.worlds.kitchen.objects import build_thing
from forestall.worlds.kitchen.robot import build_robot
from forestall.worlds.kitchen.rooms import build_room
from forestall.worlds.kitchen.settled import check_settled
from forestall.worlds.kitchen.stocking import Stocker
from forestall.worlds.kitchen.streams import Streams
from forestall.worlds.kitchen.style import draw_light, draw_style
from forestall.worlds.kitchen.world import HAND_M, KitchenWorld

OWN: Mapping[str, layout.Draw] = {"kitchen": plans.kitchen, "living-room": plans.living_room}
"""What draws the rooms that are this kitchen's own."""

LAYOUTS = 10
"""How many layouts are tried for one seed."""

STOCKINGS = 4
"""How many times one layout is furnished anew."""

DRAFTS = 60
"""How many floor plans are drawn for one layout."""

STARTS = 40
"""How many other start places are tried."""


def build_scene(
    needs: SceneNeeds,
    seed: int,
    catalogue: Catalogue,
    make: type[KitchenWorld] = KitchenWorld,
    draws: Mapping[str, layout.Draw] = OWN,
) -> KitchenWorld:
    """Build the scene of a seed, the same each time.

    Args:
        needs: what must be there; everything else varies with the seed.
        seed: 0 or more.
        catalogue: categories, those of the task file included.
        make: what the geometry is.
        draws: what draws a floor plan, by kind of room.

    Raises:
        SceneError: contradictory needs, or no room for something.
        UnknownNameError: a category that the catalogue lacks.
    """
    needs = roomed(needs)
    base = _canonical(needs.undisturbed or _undisturbed(needs), catalogue)
    needs = _canonical(needs, catalogue)
    if base.room != needs.room:
        raise SceneError(f"a {base.room} cannot be changed into a {needs.room}")
    change = change_of(needs, base, lambda n, a: catalogue.default_states(n)[a])
    if needs.room not in draws:
        raise SceneError(f"there is no floor plan for a {needs.room}, only for {', '.join(draws)}")
    failure = ""
    for attempt in range(LAYOUTS):
        streams = Streams(seed, attempt, dict(needs.vary))
        contents = contents_of(needs, base, catalogue, streams)
        drawn = _drawn(needs.room, draws[needs.room], streams)
        empty = _empty_room(needs, base, contents.things, catalogue, streams, make, drawn)
        start = empty.world.bodies.snapshot()
        for stocking in range(STOCKINGS):
            empty.world.bodies.restore(start)
            try:
                stocker = _stock(empty, base, catalogue, contents, streams, stocking)
                _disturb(stocker, change, contents, streams, stocking)
                world = _restarted(empty, streams)
            except SceneError as error:
                failure = str(error)
                continue
            world.freeze(_instances(world, empty.fixtures, contents.things))
            return world
    raise SceneError(f"no {needs.room} of seed {seed} has room for this scene: {failure}")


def _undisturbed(needs: SceneNeeds) -> SceneNeeds:
    return replace(needs, vary=(), more_clutter=0)


@dataclass(frozen=True, slots=True)
class _Empty:
    world: KitchenWorld
    fixtures: tuple[str, ...]
    plan: layout.Plan
    floor: Floor


def _canonical(needs: SceneNeeds, catalogue: Catalogue) -> SceneNeeds:
    """Resolve aliases and check what can be checked without a room."""
    ids = [n.id for n in needs.objects]
    twice = sorted({i for i in ids if ids.count(i) > 1})
    if twice:
        raise SceneError(f"{twice[0]} is needed twice; every object has its own id")
    for need in needs.objects:
        category = catalogue[need.category]
        if category.fixture:
            raise SceneError(f"{need.id}: a {category.name} is a fixture and cannot be placed")
        if category_of(need.id) != category.name or not is_instance(need.id):
            raise SceneError(f"{need.id} must be named {category.name}-1 or another number")
        _checked(need.id, category.name, need.states, catalogue)
        for place in need.places:
            if catalogue[place].receptacle is None:
                raise SceneError(f"{need.id}: nothing can be put on or in a {place}")
        if need.in_front_of is not None and need.in_front_of not in ids:
            raise SceneError(
                f"{need.id} is to stand in front of {need.in_front_of}, "
                "which is not among the needed objects"
            )
    fixtures = tuple((catalogue.canonical(f), a, v) for f, a, v in needs.fixtures)
    for name, attribute, value in fixtures:
        _checked(name, catalogue[name].name, ((attribute, value),), catalogue)
    low, high = needs.clutter
    if not 0 <= low <= high:
        raise SceneError(f"clutter must be a smallest and a largest number, got {low} and {high}")
    for axis, number in needs.vary:
        if axis not in AXES or number < 0:
            known = ", ".join(AXES)
            raise SceneError(f"cannot vary {axis!r} to {number}: known are {known}, numbers from 0")
    if needs.more_clutter < 0:
        raise SceneError(f"more_clutter cannot be {needs.more_clutter}")
    return replace(needs, fixtures=fixtures)


def _checked(
    name: str, category: str, states: Sequence[tuple[str, str]], catalogue: Catalogue
) -> None:
    for attribute, value in states:
        if attribute not in catalogue[category].attributes:
            known = ", ".join(catalogue[category].attributes) or "none"
            raise SceneError(f"{name} has no attribute {attribute!r}: it has {known}")
        if value not in catalogue.values(attribute):
            known = ", ".join(catalogue.values(attribute))
            raise SceneError(f"{attribute} of {name} cannot be {value!r}: known: {known}")


def _empty_room(
    needs: SceneNeeds,
    base: SceneNeeds,
    things: Sequence[Thing],
    catalogue: Catalogue,
    streams: Streams,
    make: type[KitchenWorld],
    drawn: tuple[layout.Plan, Standing],
) -> _Empty:
    plan, start = drawn
    colours = streams("colours")
    kit = Kit(mujoco.MjSpec(), colours)
    forms = build_room(kit, plan, draw_style(colours), draw_light(streams("light")))
    fixtures = tuple(sorted(forms))
    states = {name: catalogue.default_states(name) for name in fixtures}
    for name, attribute, value in (*needs.fixtures, *base.fixtures):
        if name not in states:
            raise SceneError(f"the {needs.room} has no {name}")
        if (name, attribute, value) in base.fixtures:
            states[name][attribute] = value
    for thing in things:
        kit.rng = streams("colours", thing.looks)
        forms[thing.name] = build_thing(kit, thing.name, catalogue[thing.category])
        states[thing.name] = thing.states
    build_robot(kit, HAND_M)
    bodies = Bodies(compile_kit(kit), forms, states)
    area = Rect(-plan.width / 2, -plan.depth / 2, plan.width / 2, plan.depth / 2)
    floor = Floor(area, tuple(item.rect() for item in plan.items if item.z == 0))
    world = make(bodies, floor, start, _decks(plan))
    return _Empty(world, fixtures, plan, floor)


def _drawn(room: str, draw: layout.Draw, streams: Streams) -> tuple[layout.Plan, Standing]:
    """A floor plan and the undisturbed start in it; other furniture stands in the same room."""
    usual = streams.without("furniture").without("start")
    for draft in range(DRAFTS):
        try:
            plan = draw(usual("layout", draft), usual("furniture", draft))
            start = Standing(*layout.free_place(plan, usual("start")))
        except SceneError:
            continue
        if not streams.varied("furniture"):
            return plan, start
        for again in range(DRAFTS):
            try:
                plan = draw(streams("layout", draft), streams("furniture", draft, again))
                return plan, Standing(*layout.free_place(plan, usual("start")))
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
    base: SceneNeeds,
    catalogue: Catalogue,
    contents: Contents,
    streams: Streams,
    stocking: int,
) -> Stocker:
    """Furnish the undisturbed scene."""
    world = empty.world
    stocker = Stocker(
        world, catalogue, base.room, empty.fixtures, lambda n: streams("place", stocking, n)
    )
    stocker.put_needed(base.objects)
    placed = stocker.put_clutter(contents.clutter.names, contents.clutter.most)
    if len(placed) < base.clutter[0]:
        raise SceneError(f"only {len(placed)} of {base.clutter[0]} further objects found a place")
    stocker.check(base.objects)
    problems = check_settled(world)
    if problems:
        raise SceneError(problems[0])
    return stocker


def _disturb(
    stocker: Stocker, change: Change, contents: Contents, streams: Streams, stocking: int
) -> None:
    """Turn the undisturbed scene into the scenario's."""
    same_clutter = contents.other is None and not contents.more.most
    if not (change.gone or change.put or change.states) and same_clutter:
        return

    def draw(axis: str, again: int) -> Callable[[str], np.random.Generator]:
        return lambda name: streams(axis, stocking, "changed", again, name)

    disturb(stocker, change, contents, draw)


def _restarted(empty: _Empty, streams: Streams) -> KitchenWorld:
    """The world with the robot at another start, from where it gets everywhere, if one is asked."""
    world = empty.world
    if not streams.varied("start"):
        return world
    for again in range(STARTS):
        start = Standing(*layout.free_place(empty.plan, streams("start", again)))
        if world.connected(start, world.standing):
            return type(world)(world.bodies, empty.floor, start, _decks(empty.plan))
    raise SceneError("the robot finds no other place to start from")


def _instances(
    world: KitchenWorld, fixtures: Sequence[str], things: Sequence[Thing]
) -> tuple[Instance, ...]:
    bodies = world.bodies
    found = [
        Instance(name, category_of(name), None, tuple(sorted(bodies.states[name].items())))
        for name in fixtures
    ]
    for thing in things:
        parent = bodies.parents.get(thing.name)
        waiting = thing.made_from is not None
        if parent is None and not (waiting and thing.made_from in bodies.parents):
            continue
        states = tuple(sorted(bodies.states[thing.name].items()))
        found.append(Instance(thing.name, thing.category, parent, states, waiting, thing.made_from))
    return tuple(found)
