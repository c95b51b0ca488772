"""Furnishes a compiled room: needed things at allowed, reachable, unblocked places, and clutter.

Called by `model` and `changes`; works through `KitchenWorld`'s own spot finder. Every thing has a
random stream of its own.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import replace

import numpy as np

from forestall.errors import SceneError
from forestall.types.facts import category_of
from forestall.types.scene import ObjectNeed
from forestall.worlds.kitchen.catalogue import Catalogue
from forestall.worlds.kitchen.forms import Float, Pose, Region, inverse, pose_at
from forestall.worlds.kitchen.placement import REST_M, Rules, Score, footprint_at
from forestall.worlds.kitchen.world import KitchenWorld

OPEN_PLACES = {
    "kitchen": ("CounterTop", "DiningTable"),
    "living-room": ("DiningTable", "Shelf", "TVStand"),
}
"""Where things stand when a task does not say."""

_LONG = 2.0

TIGHT = "TVStand"
"""Clutter stays off it: beside the television there is room for one more thing."""


class Stocker:
    """Puts things into one world.

    Args:
        world: an empty room.
        catalogue: categories.
        room: kind of the room.
        fixtures: instance names of the room's fixtures.
        stream: the random choices for a thing, by its name.
    """

    def __init__(
        self,
        world: KitchenWorld,
        catalogue: Catalogue,
        room: str,
        fixtures: Sequence[str],
        stream: Callable[[str], np.random.Generator],
    ) -> None:
        self.world = world
        self.catalogue = catalogue
        self.open_places = OPEN_PLACES[room]
        self.fixtures = sorted(fixtures)
        self.stream = stream
        self.needed: list[str] = []

    def put_needed(self, needs: Sequence[ObjectNeed]) -> None:
        """Place every needed object.

        Raises:
            SceneError: an object finds no place.
        """
        blocked = {n.in_front_of: n for n in needs if n.in_front_of is not None}
        for need in in_order(needs, self.catalogue):
            if need.in_front_of is not None:
                self.put_in_front(need)
            else:
                self.put(need, blocked.get(need.id))
            self.needed.append(need.id)

    def put(self, need: ObjectNeed, blocker: ObjectNeed | None = None, tight: bool = False) -> None:
        """Place one object.

        Args:
            need: the object.
            blocker: what is to block it and needs room before it.
            tight: whether it may stand nearer to others, and turned, where there is no other place.

        Raises:
            SceneError: it finds no place.
        """
        rng = self.stream(need.id)
        options = self._receptacles(need, rng)
        form = self.world.bodies.forms[need.id]
        rules = Rules(gap_m=0.045, spare=frozenset(self.needed), clear=True)
        levels = (rules, replace(rules, gap_m=0.02, corridor_m=0.01)) if tight else (rules,)
        turns = (0.0,) if blocker is not None else _turns(form.footprint.size, rng)
        turns += (np.pi / 2, -np.pi / 2) if tight else ()
        for receptacle in options:
            room = 0.0 if blocker is None else self._room_for(blocker)
            found = self.world.find_spot(
                need.id,
                receptacle,
                levels=levels,
                yaws=turns,
                score=self._random(receptacle, form.footprint.size[1], rng, room),
            )
            if found is not None and (blocker is None or found[0].front_m is not None):
                self.world.settle(need.id, *found)
                return
        raise SceneError(f"no free place for {need.id} on or in {', '.join(options) or 'anything'}")

    def _receptacles(self, need: ObjectNeed, rng: np.random.Generator) -> list[str]:
        """Allowed receptacles in random order.

        Raises:
            SceneError: none exists, or none takes the object.
        """
        wanted = tuple(self.catalogue.canonical(p) for p in need.places) or self.open_places
        there = [*self.fixtures, *self.needed]
        options = [n for n in there if n in wanted or category_of(n) in wanted]
        if not options:
            raise SceneError(
                f"{need.id} needs {' or '.join(wanted)}, which the scene does not have"
            )
        taking = [n for n in options if self.catalogue.accepts(n, need.category)]
        if not taking:
            raise SceneError(f"{need.id}: {' or '.join(wanted)} does not take a {need.category}")
        return [taking[int(i)] for i in rng.permutation(len(taking))]

    def _room_for(self, blocker: ObjectNeed) -> float:
        """How much room a thing needs before it to be blocked by another one."""
        return max(self.world.bodies.forms[blocker.id].footprint.size) + 0.07

    def _random(
        self, receptacle: str, deep_m: float, rng: np.random.Generator, room_m: float = 0.0
    ) -> Score:
        """Random choice among free places, rather to the front, with `room_m` left before it."""
        regions = self.world.bodies.forms[receptacle].regions
        front = regions[0].front_m if regions else None

        def cost(places: Float) -> Float:
            noise = rng.random(len(places))
            if front is None:
                return noise
            space = front - (places[:, 1] + deep_m / 2)
            return np.asarray(np.where(space < room_m, np.inf, noise + 1.5 * np.abs(space - 0.12)))

        return cost

    def make_room(self, need: ObjectNeed, blocker: ObjectNeed, elsewhere: bool) -> None:
        """Move a thing as little as it takes to leave room before it for what is to block it.

        Args:
            need: what is to be blocked.
            blocker: what is to block it.
            elsewhere: whether it may go to another of its places where its own has no room.

        Raises:
            SceneError: it finds no such place.
        """
        bodies = self.world.bodies
        found = bodies.region_of(need.id)
        if found is None or found[0].front_m is None:
            raise SceneError(f"nothing can stand in front of {need.id} where it is")
        region, form = found[0], bodies.forms[need.id]
        local = inverse(bodies.pose(region.carrier)) @ bodies.pose(need.id)
        here = footprint_at(form, local).centre
        others = frozenset(self.needed) - {need.id}
        rules = Rules(gap_m=0.045, spare=others, clear=True)
        for turn in (0.0, np.pi / 2):
            front = bodies.forms[blocker.id].footprint.turned(turn).size
            better = self.world.find_spot(
                need.id,
                region.receptacle,
                levels=(rules, replace(rules, gap_m=0.02, corridor_m=0.01)),
                yaws=(0.0,),
                score=self._with_front(need.id, found, here, front),
            )
            if better is not None and better[1] == found[1]:
                self.world.settle(need.id, *better)
                return
        if not elsewhere:
            raise SceneError(f"no room for {blocker.id} in front of {need.id}")
        self.put(need, blocker)

    def _with_front(
        self,
        name: str,
        where: tuple[Region, int],
        here: tuple[float, float],
        front: tuple[float, float],
    ) -> Score:
        """Distance from `here`, infinite where something of size `front` does not fit before it."""
        region, index = where
        wide, deep = self.world.bodies.forms[name].footprint.size
        half = max(wide, front[0]) / 2 + 0.01
        taken = [o.rect for o in self.world.bodies.occupants(region, index, without=name)]
        taken += region.keep_out

        def cost(places: Float) -> Float:
            x, y = places[:, 0], places[:, 1] + deep / 2
            end = y + 0.05 + front[1]
            fits = (x - half >= region.area.x0) & (x + half <= region.area.x1)
            fits &= end <= (region.front_m or 0.0)
            for o in taken:
                meets = (x - half < o.x1) & (x + half > o.x0) & (y < o.y1) & (end + 0.01 > o.y0)
                fits &= ~meets
            way = np.hypot(places[:, 0] - here[0], places[:, 1] - here[1])
            return np.asarray(np.where(fits, way, np.inf))

        return cost

    def put_in_front(self, need: ObjectNeed) -> None:
        """Put a thing directly before another one, so that it blocks it.

        Raises:
            SceneError: the other thing is not there or has no open edge before it.
        """
        behind = need.in_front_of
        bodies = self.world.bodies
        if behind is None or behind not in bodies.parents:
            raise SceneError(f"{need.id} is to stand in front of {behind}, which is not placed")
        found = bodies.region_of(behind)
        if found is None or found[0].front_m is None:
            raise SceneError(f"nothing can stand in front of {behind} where it is")
        region, index = found
        if not self.catalogue.accepts(region.receptacle, need.category):
            raise SceneError(f"{region.receptacle} does not take a {need.category}")
        local = self._before(need.id, behind, region, index)
        self.world.settle(need.id, region, index, local)

    def _before(self, name: str, behind: str, region: Region, index: int) -> Pose:
        bodies = self.world.bodies
        at = inverse(bodies.pose(region.carrier)) @ bodies.pose(behind)
        target = footprint_at(bodies.forms[behind], at)
        form = bodies.forms[name]
        rng = self.stream(name)
        turns = sorted((0.0, np.pi / 2), key=lambda a: form.footprint.turned(a).size[0])
        for yaw in turns:
            rect = form.footprint.turned(yaw)
            gap = float(rng.uniform(0.022, 0.05))
            spare = max(target.size[0] - rect.size[0], 0.0)
            aside = 0.3 * spare * float(rng.choice([-1, 1]))
            x = target.centre[0] + aside - rect.centre[0]
            y = target.y1 + gap - rect.y0
            here = rect.moved(x, y)
            others = bodies.occupants(region, index)
            free = all(not here.overlaps(o.rect.grown(0.01)) for o in others if o.name != behind)
            clear = all(not here.overlaps(k) for k in region.keep_out)
            inside = here.x0 >= region.area.x0 and here.x1 <= region.area.x1
            if free and clear and inside and here.y1 <= (region.front_m or 0) + 0.005:
                return pose_at(x, y, region.z_m + REST_M, yaw)
        raise SceneError(f"no room for {name} in front of {behind}")

    def put_clutter(self, names: Iterable[str], most: int) -> list[str]:
        """Place up to `most` further things out of everybody's way; which ones found a place."""
        placed: list[str] = []
        cluttered = {*self.open_places, "Shelf"} - {TIGHT}
        surfaces = [n for n in self.fixtures if category_of(n) in cluttered]
        for name in names:
            if len(placed) == most:
                break
            rng = self.stream(name)
            form = self.world.bodies.forms[name]
            rules = Rules(gap_m=0.05, spare=frozenset(self.needed), clear=False)
            for index in rng.permutation(len(surfaces)):
                receptacle = surfaces[int(index)]
                if not self.catalogue.accepts(receptacle, name):
                    continue
                found = self.world.find_spot(
                    name,
                    receptacle,
                    levels=(rules,),
                    yaws=_turns(form.footprint.size, rng),
                    score=self._random(receptacle, form.footprint.size[1], rng),
                )
                if found is not None:
                    self.world.settle(name, *found)
                    placed.append(name)
                    break
        return placed

    def check(self, needs: Sequence[ObjectNeed]) -> None:
        """See that the robot can get to everything that is needed.

        Raises:
            SceneError: something is blocked, hidden, or out of reach.
        """
        blocked = {n.in_front_of for n in needs}
        names = [n.id for n in needs] + self.fixtures
        start = self.world.standing
        for name in names:
            if name == "Floor-1":
                continue
            goal = self.world.standing_for(name)
            if goal is None or not self.world.connected(start, goal):
                raise SceneError(f"the robot finds no place from which to reach {name}")
            if not self.world.reachable_from(goal, name):
                raise SceneError(f"{name} is out of the robot's reach")
            in_the_way = self.world.blocker(name)
            if in_the_way is not None and name not in blocked:
                raise SceneError(f"{in_the_way} stands in front of {name}")


def _turns(size: tuple[float, float], rng: np.random.Generator) -> tuple[float, ...]:
    """A random turn, slight for long things, and straight as a last resort."""
    long = max(size) / min(size) > _LONG
    turn = float(rng.normal(0, np.deg2rad(4 if long else 11)))
    return (float(np.clip(turn, -0.4, 0.4)), 0.0)


def in_order(needs: Sequence[ObjectNeed], catalogue: Catalogue) -> list[ObjectNeed]:
    """Receptacles before their contents, blocked things before their blockers.

    Raises:
        SceneError: the needs go round in a circle.
    """
    by_id = {n.id: n for n in needs}
    waits: Mapping[str, set[str]] = {n.id: _depends(n, needs, catalogue) for n in needs}
    done: list[ObjectNeed] = []
    placed: set[str] = set()
    blocked = {n.in_front_of for n in needs}

    def urgency(need: ObjectNeed) -> tuple[bool, bool, str]:
        return (need.id not in blocked and need.in_front_of is None, not need.places, need.id)

    while len(done) < len(needs):
        ready = [n for n in by_id.values() if n.id not in placed and waits[n.id] <= placed]
        if not ready:
            left = ", ".join(sorted(set(by_id) - placed))
            raise SceneError(f"these objects need each other's places in a circle: {left}")
        first = min(ready, key=urgency)
        done.append(first)
        placed.add(first.id)
    return done


def _depends(need: ObjectNeed, needs: Sequence[ObjectNeed], catalogue: Catalogue) -> set[str]:
    wanted = {catalogue.canonical(p) for p in need.places}
    found = {n.id for n in needs if n.id != need.id and (n.id in wanted or n.category in wanted)}
    if need.in_front_of is not None and any(n.id == need.in_front_of for n in needs):
        found.add(need.in_front_of)
    return found
