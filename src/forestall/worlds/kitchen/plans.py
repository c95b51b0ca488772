"""Draws floor plans from a seed: kitchens with counters along one to three walls, living rooms.

Called by `model`; uses `layout`. The built-in part and the free-standing furniture have a random
stream each, so that the furniture can be drawn anew in the same room.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from forestall.errors import SceneError
from forestall.worlds.kitchen.forms import Rect
from forestall.worlds.kitchen.layout import (
    COUNTER_DEPTH_M,
    COUNTER_HEIGHT_M,
    ROOM_HEIGHT_M,
    Draft,
    Item,
    Plan,
    columns_of,
    drawer_columns,
)

_CORNER, _FRIDGE, _FRIDGE_GAP, _STOVE = 0.64, 0.70, 0.25, 0.76
HANDLE_M = 0.11
APPLIANCES = {  # kind → free width to its left (towards -x) and right on the counter, own depth
    "microwave": (0.28, 0.39, 0.06),
    "coffee_machine": (0.14, 0.14, 0.05),
    "toaster": (0.16, 0.16, 0.12),
}
_CABINET_M = (0.52, 0.62)


@dataclass(frozen=True, slots=True)
class _Run:
    """Modules along a wall, from u0 on, as (kind, width) in the order of +u."""

    wall: int
    u0: float
    modules: tuple[tuple[str, float], ...]


def kitchen(rng: np.random.Generator, places: np.random.Generator) -> Plan:
    """Draw a kitchen.

    Args:
        rng: the room, its counters and appliances, and every size.
        places: where the furniture stands that is not built in.

    Raises:
        SceneError: this draw does not work out.
    """
    shape = ("one", "ell", "galley", "u")[int(rng.integers(4))]
    width, depth, runs = _runs(shape, rng)
    draft = Draft(rng, width, depth)
    for run in runs:
        _lay_run(draft, run)
    _set_appliances(draft)
    _set_drawers(draft)
    _hang_cabinets(draft)
    used = {r.wall for r in runs}
    free = [w for w in range(4) if w not in used]
    size = (float(rng.uniform(1.15, 1.5)), float(rng.uniform(0.75, 0.9)))
    shelf_size = (float(rng.uniform(0.7, 0.9)), 0.30)
    bin_size = (float(rng.uniform(0.28, 0.33)), float(rng.uniform(0.28, 0.33)))
    draft.rng = places
    table = draft.settle("table", draft.name("DiningTable"), size, free, gap=0.02)
    if table is None:
        raise SceneError("no room for the dining table")
    _chairs(draft, table)
    every = [0, 1, 2, 3]
    shelf = draft.settle("shelf", draft.name("Shelf"), shelf_size, every)
    can = draft.settle("garbage_can", draft.name("GarbageCan"), bin_size, every, 0.75, gap=0.03)
    if shelf is None or can is None:
        raise SceneError("no room for the shelf and the garbage can")
    decorate(draft, free)
    return Plan("kitchen", width, depth, ROOM_HEIGHT_M, tuple(draft.items), tuple(draft.decor))


def _runs(shape: str, rng: np.random.Generator) -> tuple[float, float, list[_Run]]:
    def span(low: float, high: float) -> float:
        return float(rng.uniform(low, high))

    fridge = ("fridge", _FRIDGE)
    gap = ("gap", _FRIDGE_GAP)
    stove = ("stove", _STOVE)
    main = [gap, fridge, ("counter", span(1.0, 1.3)), stove, ("counter", span(0.95, 1.2))]
    sink = ("sink", span(1.75, 2.2))
    mirrored = bool(rng.integers(2))
    wall = int(rng.integers(4))
    if shape == "one":
        main = [gap, fridge, ("counter", span(1.55, 1.8)), stove, ("sink", span(2.0, 2.3))]
        length = sum(w for _, w in main) + span(0.05, 0.3)
        across = span(3.4, 3.9)
        runs = [_run(wall, length, main, mirrored, 0.0)]
    elif shape == "ell":
        length = sum(w for _, w in main) + _CORNER
        across = _CORNER + sink[1] + span(0.75, 1.1)
        corner = [*main, ("corner", _CORNER)]
        side = (wall + 1) % 4 if not mirrored else (wall - 1) % 4
        runs = [_run(wall, length, corner, mirrored, 0.0)]
        runs.append(_run(side, across, [("void", _CORNER), sink], mirrored, 0.0))
    elif shape == "galley":
        length = sum(w for _, w in main) + span(0.05, 0.4)
        across = span(3.3, 3.7)
        runs = [_run(wall, length, main, mirrored, 0.0)]
        runs.append(_run((wall + 2) % 4, length, [sink], not mirrored, span(0.1, 0.5)))
    else:
        middle = [
            ("corner", _CORNER),
            ("counter", span(0.95, 1.2)),
            stove,
            ("counter", span(0.95, 1.2)),
            ("corner", _CORNER),
        ]
        length = sum(w for _, w in middle)
        across = _CORNER + max(sink[1], 1.9) + span(0.9, 1.2)
        cold = [gap, fridge]
        runs = [_run(wall, length, middle, mirrored, 0.0)]
        one, two = (
            ((wall + 1) % 4, (wall - 1) % 4) if not mirrored else ((wall - 1) % 4, (wall + 1) % 4)
        )
        runs.append(_run(one, across, [("void", _CORNER), sink], mirrored, 0.0))
        runs.append(_run(two, across, cold, mirrored, span(0.15, 0.4)))
    size = (length, across) if wall % 2 == 0 else (across, length)
    return (*size, runs)


def _run(
    wall: int, length: float, modules: list[tuple[str, float]], mirrored: bool, offset: float
) -> _Run:
    """Modules from one end of a wall, or from the other when mirrored."""
    total = sum(w for _, w in modules)
    if mirrored:
        return _Run(wall, length / 2 - offset - total, tuple(reversed(modules)))
    return _Run(wall, -length / 2 + offset, tuple(modules))


def _lay_run(draft: Draft, run: _Run) -> None:
    rng = draft.rng
    u = run.u0
    for k, (kind, width) in enumerate(run.modules):
        x, y, yaw = draft.at_wall(run.wall, u + width / 2)
        u += width
        if kind in ("gap", "void"):
            continue
        if kind == "fridge":
            before = run.modules[k - 1][0] if k else ""
            hinge = -1 if before == "gap" else 1
            item = Item("fridge", draft.name("Fridge"), x, y, yaw, width, 0.71, hinge=hinge)
            draft.add(item, 1.15)
            draft.zones.append(replace(item, width=width + 0.44).zone(0.85))
        elif kind == "stove":
            burners = tuple(draft.name("StoveBurner") for _ in range(4))
            knobs = tuple(draft.name("StoveKnob") for _ in range(4))
            draft.add(Item("stove", "stove", x, y, yaw, width, 0.65, extra=burners + knobs))
        elif kind == "corner":
            draft.add(
                Item(
                    "corner",
                    f"corner-{len(draft.items)}",
                    x,
                    y,
                    yaw,
                    width,
                    COUNTER_DEPTH_M,
                    scenery=True,
                ),
                0.0,
            )
        else:
            sink_x = None
            extra: tuple[str, ...] = ()
            if kind == "sink":
                reach = width / 2 - 0.55
                sink_x = float(rng.choice([-1, 1])) * float(rng.uniform(0.3, 1.0)) * reach
                extra = (draft.name("Sink"), draft.name("Faucet"))
                draft.decor.append(("window", run.wall, u - width / 2 + sink_x, 1.40, 0.95, 0.72))
            kinds = [m[0] for m in (("", 0.0), *run.modules, ("", 0.0))]
            beside = []  # room for the handles of pans on the stove
            if kinds[k] == "stove":
                beside.append((-width / 2, -width / 2 + HANDLE_M))
            if kinds[k + 2] == "stove":
                beside.append((width / 2 - HANDLE_M, width / 2))
            draft.add(
                Item(
                    "counter",
                    draft.name("CounterTop"),
                    x,
                    y,
                    yaw,
                    width,
                    COUNTER_DEPTH_M,
                    sink_x=sink_x,
                    extra=extra,
                    keep_out=tuple(beside),
                )
            )


def _set_appliances(draft: Draft) -> None:
    """Stand the appliances on counters, each at an end of a free stretch."""
    rng = draft.rng
    kinds = {"microwave": "Microwave", "coffee_machine": "CoffeeMachine", "toaster": "Toaster"}
    for kind, category in kinds.items():
        left, right, inset = APPLIANCES[kind]
        need = left + right
        options = []
        for k, item in enumerate(draft.items):
            if item.kind != "counter":
                continue
            for x0, x1 in stretches(item):
                if x1 - x0 >= need:
                    options.append((x1 - x0 - need, k, x0, x1))
        if not options:
            raise SceneError(f"no counter has room for the {category}")
        options.sort(reverse=True)
        _, k, x0, x1 = options[int(rng.integers(min(2, len(options))))]
        at_left = bool(rng.integers(2))
        x = x0 + left if at_left else x1 - right
        counter = draft.items[k]
        draft.items[k] = replace(counter, keep_out=(*counter.keep_out, (x - left, x + right)))
        px, py, _, yaw = counter.local_pose(x, inset)
        draft.items.append(
            Item(
                kind, draft.name(category), px, py, yaw, need, 0.4, z=COUNTER_HEIGHT_M, inset=inset
            )
        )


def _set_drawers(draft: Draft) -> None:
    """Choose two columns of counters for real drawers."""
    places = drawer_places(draft)
    set_drawers(draft, [places[int(i)] for i in draft.rng.permutation(len(places))])


def drawer_places(draft: Draft) -> list[tuple[int, int]]:
    """Where a real drawer can be: (index of the counter, its column)."""
    return [
        (k, c)
        for k, item in enumerate(draft.items)
        if item.kind == "counter"
        for c in drawer_columns(item.width, item.sink_x)
    ]


def set_drawers(draft: Draft, places: Sequence[tuple[int, int]]) -> None:
    """Make the first two places drawers that open without meeting each other.

    Raises:
        SceneError: there are no two.
    """
    opened: list[Rect] = []
    for k, column in places:
        item = draft.items[k]
        x0, x1 = columns_of(item.width)[column]
        room = item.patch(Rect(x0, item.depth, x1, item.depth + 0.40))
        if any(room.overlaps(o) for o in opened):
            continue
        opened.append(room)
        drawer = (draft.name("Drawer"), column)
        draft.items[k] = replace(item, drawers=(*item.drawers, drawer))
        if len(opened) == 2:
            return
    raise SceneError("no counters have room for two drawers")


def stretches(item: Item) -> list[tuple[float, float]]:
    """Free spans of a counter, ends kept clear."""
    taken = sorted(
        item.keep_out
        + (((item.sink_x - 0.29, item.sink_x + 0.29),) if item.sink_x is not None else ())
    )
    x, spans = -item.width / 2 + 0.04, []
    for a, b in (*taken, (item.width / 2 - 0.04, 0.0)):
        if a - x > 0.05:
            spans.append((x, a))
        x = b
    return spans


def _hang_cabinets(draft: Draft) -> None:
    """Two wall cabinets, clear of window, hood, fridge and side walls."""
    rng = draft.rng
    options = []
    for item in draft.items:
        if item.kind != "counter":
            continue
        low, high = -item.width / 2 + 0.17, item.width / 2 - 0.17
        spans = [(low, high)]
        if item.sink_x is not None:
            spans = [(low, item.sink_x - 0.60), (item.sink_x + 0.60, high)]
        options += [(item, a, b) for a, b in spans if b - a >= _CABINET_M[0]]
    hung: list[Rect] = []
    for index in rng.permutation(len(options)):
        item, a, b = options[int(index)]
        width = min(float(rng.uniform(*_CABINET_M)), b - a)
        x = float(rng.uniform(a + width / 2, b - width / 2)) if b - a > width else (a + b) / 2
        hang_cabinet(draft, item, x, width, hung)
        if len(hung) == 4:
            return
    raise SceneError("no wall has room for two cabinets")


def hang_cabinet(draft: Draft, item: Item, x: float, width: float, hung: list[Rect]) -> None:
    """A wall cabinet above a counter, where it and its door meet none of those in `hung`."""
    px, py, _, yaw = item.local_pose(x, 0.011)
    hinge = int(draft.rng.choice([-1, 1]))
    for side in (hinge, -hinge):
        low, high = sorted((side * (width / 2 - 0.04), side * (width / 2 + 0.20)))
        made = Item("cabinet", "", px, py, yaw, width, 0.33, z=1.38, hinge=side)
        door = made.patch(Rect(low, 0.33, high, 0.36 + width))
        if not any(r.overlaps(door) or r.overlaps(made.rect()) for r in hung):
            draft.items.append(replace(made, name=draft.name("Cabinet")))
            hung += [door, made.rect()]
            return


def _chairs(draft: Draft, table: Item) -> None:
    size = (0.42, 0.42)
    for side in (-1, 1):
        if draft.rng.uniform() < 0.25:
            continue
        x, y, _, yaw = table.local_pose(side * (table.width / 2 + 0.44), table.depth / 2 - 0.05)
        chair = Item(
            "chair", f"chair-{len(draft.items)}", x, y, yaw + side * np.pi / 2, *size, scenery=True
        )
        if draft.fits(chair, 0.0, gap=0.005):
            draft.add(chair, 0.0)


def decorate(draft: Draft, walls: list[int]) -> None:
    """Pictures, a door, a clock on the walls that have no counters."""
    rng = draft.rng
    for k, wall in enumerate(walls):
        half = draft.length(wall) / 2
        if k == 0:
            u = float(rng.uniform(-half + 0.6, half - 0.6))
            item = Item("door", "door", *draft.at_wall(wall, u), 0.9, 0.05)
            if draft.fits(item, 0.0):
                draft.decor.append(("door", wall, u, 0.0, 0.86, 2.05))
                continue
        u = float(rng.uniform(-half + 0.5, half - 0.5))
        size = (float(rng.uniform(0.4, 0.7)), float(rng.uniform(0.35, 0.55)))
        draft.decor.append(("picture", wall, u, float(rng.uniform(1.45, 1.65)), *size))


def living_room(rng: np.random.Generator, places: np.random.Generator) -> Plan:
    """Draw a living room.

    Args:
        rng: the room, television and sofa, and every size.
        places: where the other furniture stands.

    Raises:
        SceneError: this draw does not work out.
    """
    width, depth = float(rng.uniform(4.3, 5.4)), float(rng.uniform(4.0, 4.9))
    draft = Draft(rng, width, depth)
    wall = int(rng.integers(4))
    reach = draft.length(wall) / 2 - 1.2
    u = float(rng.uniform(-reach, reach)) * 0.6
    x, y, yaw = draft.at_wall(wall, u)
    stand = Item(
        "tv_stand",
        draft.name("TVStand"),
        x,
        y,
        yaw,
        float(rng.uniform(1.5, 1.8)),
        0.48,
        extra=(draft.name("Television"),),
    )
    draft.add(stand, 1.15)
    x, y, yaw = draft.at_wall((wall + 2) % 4, -u, 0.03)
    sofa = Item("sofa", "sofa", x, y, yaw, float(rng.uniform(1.7, 2.1)), 0.85, scenery=True)
    draft.add(sofa, 0.0)
    sides = [(wall + 1) % 4, (wall + 3) % 4]
    size = (float(rng.uniform(1.15, 1.5)), float(rng.uniform(0.75, 0.9)))
    shelf_size = (float(rng.uniform(0.75, 1.0)), 0.30)
    rug = (float(rng.uniform(1.7, 2.2)), float(rng.uniform(1.2, 1.5)))
    draft.rng = places
    table = draft.settle("table", draft.name("DiningTable"), size, sides, gap=0.02)
    if table is None:
        raise SceneError("no room for the dining table")
    _chairs(draft, table)
    every = [0, 1, 2, 3]
    shelf = draft.settle("shelf", draft.name("Shelf"), shelf_size, every)
    lamp = draft.settle("floor_lamp", draft.name("FloorLamp"), (0.36, 0.36), every, 0.75, gap=0.03)
    if shelf is None or lamp is None:
        raise SceneError("no room for the shelf and the floor lamp")
    draft.decor.append(("rug", wall, u, float(draft.length(wall + 1) / 2), *rug))
    decorate(draft, sides)
    draft.decor.append(("window", (wall + 2) % 4, -u, 1.15, 1.5, 0.95))
    return Plan("living-room", width, depth, 2.6, tuple(draft.items), tuple(draft.decor))
