"""Turns an undisturbed scene into a scenario's: only what the scenario names differs.

Called by `model` once the undisturbed scene stands; works through `stocking`. What a scenario adds
or moves is put beside what is there. Where that leaves no room, clutter gives way first (it goes
back to its place if that is still free, else to another, else it is left out), then a thing that is
to be blocked moves, as little as it takes to leave room before it, to another of its places only
where its own has none. Clutter of a category that the scenario adds is left out: the added one
stands for it. Where nothing helps, `model` furnishes the room anew, and the places differ.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

from forestall.errors import SceneError
from forestall.types.facts import category_of
from forestall.types.scene import ObjectNeed, SceneNeeds
from forestall.worlds.kitchen.contents import Clutter, Contents
from forestall.worlds.kitchen.forms import Pose, Rect, Region, inverse
from forestall.worlds.kitchen.placement import BLOCKING_HEIGHT_M, Rules, footprint_at
from forestall.worlds.kitchen.settled import check_settled
from forestall.worlds.kitchen.stocking import Stocker, in_order

_FREEDOMS = ((False, False), (True, False), (False, True), (True, True))
"""Whether clutter gives way and whether what is to be blocked moves, in the order of trying."""

_TRIES = 3
"""How many places are tried for what changes, with each freedom; the last of them tight ones."""

_NEAR_M = 0.008
"""Clutter this near to something new does not go back."""

Draw = Callable[[str, int], Callable[[str], np.random.Generator]]
"""Axis and number of the try → the random choices for a thing, by its name."""


@dataclass(frozen=True, slots=True)
class Change:
    """How a scene differs from the undisturbed one.

    Args:
        needs: what the scene must contain.
        gone: needed things that are not there.
        put: needed things that are added or start somewhere else.
        states: (instance, attribute, value) that differ.
    """

    needs: SceneNeeds
    gone: tuple[str, ...]
    put: tuple[ObjectNeed, ...]
    states: tuple[tuple[str, str, str], ...]

    @property
    def blocked(self) -> dict[str, ObjectNeed]:
        """Thing → what is put before it."""
        return {n.in_front_of: n for n in self.put if n.in_front_of is not None}


def change_of(needs: SceneNeeds, base: SceneNeeds, default: Callable[[str, str], str]) -> Change:
    """What differs between two needs; `default` tells an (instance, attribute)'s usual value."""
    before = {n.id: n for n in base.objects}
    after = {n.id: n for n in needs.objects}
    put = tuple(
        n
        for n in needs.objects
        if n.id not in before
        or (n.places, n.in_front_of) != (before[n.id].places, before[n.id].in_front_of)
    )
    old = _states(base)
    new = _states(needs)
    states = tuple(
        (*key, new.get(key) or default(*key))
        for key in sorted({**old, **new})
        if old.get(key) != new.get(key) and not (key[0] in before and key[0] not in after)
    )
    return Change(needs, tuple(sorted(set(before) - set(after))), put, states)


def _states(needs: SceneNeeds) -> dict[tuple[str, str], str]:
    found = {(n.id, a): v for n in needs.objects for a, v in n.states}
    return found | {(name, a): v for name, a, v in needs.fixtures}


def disturb(stocker: Stocker, change: Change, contents: Contents, draw: Draw) -> None:
    """Change a finished undisturbed scene.

    Args:
        stocker: of that scene.
        change: what differs.
        contents: what the scene was built with.
        draw: random choices.

    Raises:
        SceneError: there is no room for the change.
    """
    bodies = stocker.world.bodies
    start, needed = bodies.snapshot(), list(stocker.needed)
    failure: SceneError | None = None
    for loose, shifted in _FREEDOMS:
        if shifted and not change.blocked:
            continue
        for again in range(_TRIES):
            bodies.restore(start)
            stocker.needed = list(needed)
            try:
                _apply(stocker, change, contents, draw, again, (loose, shifted))
            except SceneError as error:
                failure = failure or error
            else:
                return
    raise failure or SceneError("the scene cannot be changed")


def _apply(
    stocker: Stocker,
    change: Change,
    contents: Contents,
    draw: Draw,
    again: int,
    freedom: tuple[bool, bool],
) -> None:
    bodies = stocker.world.bodies
    loose, shifted = freedom
    stocker.stream = draw("place", again)
    added = {n.category for n in change.put if n.id not in stocker.needed}
    clutter = _pieces(bodies.parents, contents.clutter)
    for name in clutter:
        if contents.other is not None or category_of(name) in added:
            bodies.remove(name)
    places = _places(stocker, [n for n in clutter if n in bodies.parents])
    if loose:
        for name in places:
            bodies.remove(name)
    for name in change.gone:
        stocker.needed.remove(name)
        bodies.remove(name)
    for name, attribute, value in change.states:
        bodies.show(name, attribute, value)
    _put(stocker, change, (loose, shifted), again == _TRIES - 1)
    if loose:
        _put_back(stocker, change, places)
    if contents.other is not None:
        stocker.stream = draw("clutter", again)
        placed = stocker.put_clutter(contents.other.names, contents.other.most)
        if len(placed) < change.needs.clutter[0]:
            raise SceneError("the other clutter finds no place")
    if contents.more.most:
        stocker.stream = draw("more clutter", again)
        if not stocker.put_clutter(contents.more.names, contents.more.most):
            raise SceneError("there is no room for more clutter")
    stocker.check(change.needs.objects)
    problems = check_settled(stocker.world)
    if problems:
        raise SceneError(problems[0])


def _pieces(parents: Mapping[str, str | None], clutter: Clutter) -> list[str]:
    return [n for n in clutter.names if n in parents]


def _places(stocker: Stocker, names: list[str]) -> dict[str, tuple[Region, int, Pose]]:
    """Where things lie: region, its index, and pose in its carrier's frame."""
    bodies = stocker.world.bodies
    found = {}
    for name in names:
        where = bodies.region_of(name)
        if where is not None:
            local = inverse(bodies.pose(where[0].carrier)) @ bodies.pose(name)
            found[name] = (*where, local)
    return found


def _put(stocker: Stocker, change: Change, freedom: tuple[bool, bool], tight: bool) -> None:
    """Place what is added or starts somewhere else."""
    bodies = stocker.world.bodies
    loose, shifted = freedom
    for need in change.put:
        if need.id in stocker.needed:
            stocker.needed.remove(need.id)
            bodies.detach(need.id)
    by_id = {n.id: n for n in change.needs.objects}
    for need in in_order(change.put, stocker.catalogue):
        behind = need.in_front_of
        if behind is None:
            stocker.put(need, change.blocked.get(need.id), tight)
        else:
            if shifted and by_id[behind] not in change.put:
                stocker.make_room(by_id[behind], need, elsewhere=loose)
            stocker.put_in_front(need)
        stocker.needed.append(need.id)


def _put_back(
    stocker: Stocker, change: Change, places: Mapping[str, tuple[Region, int, Pose]]
) -> None:
    """Put clutter back where it was, or where there is room, or leave it out."""
    world = stocker.world
    for name, (region, index, local) in places.items():
        world.settle(name, region, index, local)
        if _in_the_way(stocker, name, region, index):
            world.bodies.remove(name)
            stocker.put_clutter([name], 1)


def _in_the_way(stocker: Stocker, name: str, region: Region, index: int) -> bool:
    """Whether clutter meets something, or stands before something needed."""
    bodies = stocker.world.bodies
    form = bodies.forms[name]
    rect = footprint_at(form, inverse(bodies.pose(region.carrier)) @ bodies.pose(name))
    tall = form.height_m >= BLOCKING_HEIGHT_M
    for other in bodies.occupants(region, index, without=name):
        if rect.overlaps(other.rect.grown(_NEAR_M)):
            return True
        if tall and region.front_m is not None and other.name in stocker.needed:
            way = Rect(other.rect.x0, other.rect.y1, other.rect.x1, region.front_m)
            if rect.overlaps(way.grown(Rules().corridor_m, 0)):
                return True
    return False
