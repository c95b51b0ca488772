"""Draws floor plans after seven rooms of AI2-THOR: six kitchens and a living room.

Called by `model` in the place of `plans`, whose parts it uses. Where furniture stands comes from
`ithor_layouts.toml`; the pieces are this kitchen's own. A seed chooses the layout, mirrors it, and
shifts what stands free; what a layout lacks is put along a wall.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from functools import partial

import numpy as np

from forestall.errors import SceneError, UnknownNameError
from forestall.worlds.kitchen.forms import Rect
from forestall.worlds.kitchen.ithor_layouts import Layout, Piece, Spot, layouts
from forestall.worlds.kitchen.layout import (
    COUNTER_DEPTH_M,
    COUNTER_HEIGHT_M,
    ROOM_HEIGHT_M,
    Draft,
    Draw,
    Item,
    Plan,
    columns_of,
)
from forestall.worlds.kitchen.plans import (
    APPLIANCES,
    HANDLE_M,
    decorate,
    drawer_places,
    hang_cabinet,
    set_drawers,
    stretches,
)

_BUILT_IN = ("counter", "bar", "corner", "stove", "fridge", "block", "tv_stand", "sofa")
_NAMES = {
    "table": "DiningTable", "shelf": "Shelf", "garbage_can": "GarbageCan",
    "floor_lamp": "FloorLamp",
}  # fmt: skip
_ZONES_M = {"counter": 0.70, "bar": 0.70, "stove": 0.70, "fridge": 0.85, "tv_stand": 1.15}
"""Floor before built-in furniture that stays free."""

_HIDING = ("cabinet", "stove", "fridge", "block", "tv_stand", "shelf")
"""Before what there is no window."""

_SEATS_BACK_M = 0.5
"""How far a chair is drawn back from a table under which it stands."""

_ABOUT_M = 0.45
"""How near to a wall cabinet of the layout one must hang to stand for it."""

_CABINET_M = (0.46, 0.62)

_HANGINGS = 20
"""How many times wall cabinets are hung anew until there are two."""

_SHIFTS = 40


def draws(*names: str) -> Mapping[str, Draw]:
    """What draws each kind of room after the named layouts, or after all.

    Raises:
        UnknownNameError: no such layout.
    """
    known = layouts()
    for name in names:
        if name not in known:
            raise UnknownNameError("layout", name, tuple(known))
    chosen = [known[n] for n in names or known]
    rooms = dict.fromkeys(c.room for c in chosen)
    return {room: partial(draw, [c for c in chosen if c.room == room]) for room in rooms}


def draw(choices: Sequence[Layout], rng: np.random.Generator, places: np.random.Generator) -> Plan:
    """Draw a room after one of the layouts.

    Args:
        choices: layouts.
        rng: which of them, whether it is mirrored, and what is built in.
        places: where the furniture stands that is not built in.

    Raises:
        SceneError: this draw does not work out.
    """
    chosen = choices[int(rng.integers(len(choices)))]
    chosen = chosen.mirrored() if rng.integers(2) else chosen
    draft = Draft(rng, chosen.width, chosen.depth)
    for piece in chosen.pieces:
        if piece.kind in _BUILT_IN:
            _build_in(draft, piece)
    kitchen = chosen.room == "kitchen"
    if kitchen:
        _fit_out(draft, chosen)
    _hang_windows(draft, chosen)
    draft.rng = places
    _stand(draft, chosen, "table", 0.85)
    _stand(draft, chosen, "shelf", 0.85)
    _stand(draft, chosen, *(("garbage_can", 0.6) if kitchen else ("floor_lamp", 0.75)))
    _scenery(draft, chosen)
    taken = {i.yaw for i in draft.items if i.kind in _BUILT_IN}
    free = [w for w in range(4) if w * math.pi / 2 not in taken]
    decorate(draft, [w for w in free if all(w != shown[0] for shown in chosen.windows)])
    items, decor = tuple(draft.items), tuple(draft.decor)
    return Plan(chosen.room, chosen.width, chosen.depth, ROOM_HEIGHT_M, items, decor)


def _build_in(draft: Draft, piece: Piece) -> None:
    zone_m = _ZONES_M.get(piece.kind, 0.0)
    if piece.kind in ("counter", "bar"):
        made = replace(piece, kind="counter", depth=COUNTER_DEPTH_M)
        item = made.item(draft.name("CounterTop"), splash=piece.kind == "counter")
    elif piece.kind == "stove":
        names = [draft.name(c) for c in ("StoveBurner", "StoveKnob") for _ in range(4)]
        item = piece.item("stove", extra=tuple(names))
    elif piece.kind == "fridge":
        item = replace(piece, depth=0.71).item(draft.name("Fridge"))
    elif piece.kind == "tv_stand":
        made = replace(piece, width=max(piece.width, 1.5), depth=0.48)
        item = made.item(draft.name("TVStand"), extra=(draft.name("Television"),))
    else:
        item = piece.item(f"{piece.kind}-{len(draft.items)}", scenery=True)
    draft.add(item, zone_m)


def _hang_windows(draft: Draft, chosen: Layout) -> None:
    """Hang the windows, as wide as furniture and wall cabinets leave them."""
    for wall, middle, width, low, high in chosen.windows:
        u = middle if wall in (0, 1) else -middle
        room = draft.length(wall) / 2
        a, b = max(u - width / 2, -room), min(u + width / 2, room)
        strip = Item("", "", *draft.at_wall(wall, 0.0), 2 * room, 0.3)
        above = 0.5
        for item in draft.items:
            rect = item.rect()
            if not rect.overlaps(strip.rect()):
                continue
            u0, u1 = sorted(_along(strip, p) for p in ((rect.x0, rect.y0), (rect.x1, rect.y1)))
            if item.kind in _HIDING:
                left, right = (a, min(b, u0 - 0.06)), (max(a, u1 + 0.06), b)
                a, b = max(left, right, key=lambda s: s[1] - s[0])
            elif u0 < b and a < u1:
                above = 1.38
        if b - a > 0.35:
            z = max(low, above)
            draft.decor.append(("window", wall, (a + b) / 2, z, b - a, min(high, 2.35) - z))


def _fit_out(draft: Draft, chosen: Layout) -> None:
    """Sink, appliances, drawers and wall cabinets, each as near as can be to where it is."""
    stoves = [i.rect() for i in draft.items if i.kind == "stove"]
    for k, item in enumerate(draft.items):
        if item.kind == "counter":
            draft.items[k] = replace(item, keep_out=tuple(_beside(item, stoves)))
        elif item.kind == "fridge":
            draft.items[k] = _hinged(draft, item)
    _set_sink(draft, chosen.spots["sink"][0])
    names = {"microwave": "Microwave", "coffee_machine": "CoffeeMachine", "toaster": "Toaster"}
    for kind, category in names.items():
        _set_appliance(draft, kind, category, chosen.spots[kind][0])
    _set_drawers(draft, chosen.spots["drawers"])
    _hang_cabinets(draft, chosen.spots.get("cabinets", ()))


def _beside(item: Item, stoves: Sequence[Rect]) -> Iterator[Spot]:
    """The ends of a counter that stay free for the handles of pans on the stove."""
    half = item.width / 2
    for low, high, end in ((-half, HANDLE_M - half, -half), (half - HANDLE_M, half, half)):
        x, y, _, _ = item.local_pose(end, item.depth / 2)
        if any(s.distance(x, y) < 0.1 for s in stoves):
            yield (low, high)


def _set_drawers(draft: Draft, wanted: Sequence[Spot]) -> None:
    """Two real drawers, near those of the layout."""
    places = drawer_places(draft)
    noise = draft.rng.uniform(0, 0.4, len(places))

    def off(index: int) -> float:
        k, column = places[index]
        item = draft.items[k]
        x, y, _, _ = item.local_pose(sum(columns_of(item.width)[column]) / 2, item.depth / 2)
        return min(math.dist((x, y), w) for w in wanted) + float(noise[index])

    set_drawers(draft, [places[i] for i in sorted(range(len(places)), key=off)])


def _set_sink(draft: Draft, at: Spot) -> None:
    tops = [(k, i) for k, i in enumerate(draft.items) if i.kind == "counter" and i.splash]
    k, item = min(tops, key=lambda t: t[1].rect().distance(*at))
    half = item.width / 2 - 0.33
    x = min(max(_along(item, at), -half), half)
    draft.items[k] = replace(item, sink_x=x, extra=(draft.name("Sink"), draft.name("Faucet")))


def _along(item: Item, at: Spot) -> float:
    """The x of a place in the frame of furniture."""
    dx, dy = at[0] - item.x, at[1] - item.y
    return dx * math.cos(item.yaw) + dy * math.sin(item.yaw)


def _set_appliance(draft: Draft, kind: str, category: str, at: Spot) -> None:
    """Stand an appliance on the counter that is nearest to its place.

    Raises:
        SceneError: no counter has room for it.
    """
    left, right, inset = APPLIANCES[kind]
    options = []
    for k, item in enumerate(draft.items):
        if item.kind != "counter" or not item.splash:
            continue
        for x0, x1 in stretches(item):
            if x1 - x0 >= left + right:
                x = min(max(_along(item, at), x0 + left), x1 - right)
                px, py, _, _ = item.local_pose(x, COUNTER_DEPTH_M / 2)
                options.append((math.dist(at, (px, py)), k, x))
    if not options:
        raise SceneError(f"no counter has room for the {category}")
    _, k, x = min(options)
    counter = draft.items[k]
    draft.items[k] = replace(counter, keep_out=(*counter.keep_out, (x - left, x + right)))
    px, py, _, yaw = counter.local_pose(x, inset)
    name = draft.name(category)
    draft.items.append(
        Item(kind, name, px, py, yaw, left + right, 0.4, z=COUNTER_HEIGHT_M, inset=inset)
    )


def _hang_cabinets(draft: Draft, wanted: Sequence[Spot]) -> None:
    """Two wall cabinets where the layout has some, else anywhere above a counter.

    Raises:
        SceneError: no wall has room for two.
    """
    rng = draft.rng
    spans = [s for i in draft.items if i.kind == "counter" and i.splash for s in _spans(draft, i)]
    places = []
    for index in rng.permutation(len(wanted)):
        at = wanted[int(index)]
        for item, a, b in spans:
            x = min(max(_along(item, at), a), b)
            if math.dist(item.local_pose(x, 0.17)[:2], at) < _ABOUT_M:
                places.append((item, a, b, x))
    for index in rng.permutation(len(spans)):
        item, a, b = spans[int(index)]
        places += [(item, a, b, x) for x in (float(rng.uniform(a, b)), a, b)]
    items = list(draft.items)
    for k in range(_HANGINGS):
        hung: list[Rect] = []
        draft.items, draft.counts["Cabinet"] = list(items), 0
        for item, a, b, x in places[k * len(wanted) // _HANGINGS :]:
            width = min(float(rng.uniform(*_CABINET_M)), b - a)
            middle = min(max(x, a + width / 2), b - width / 2)
            hang_cabinet(draft, item, middle, width, hung)
            if len(hung) == 4:
                return
    raise SceneError("no wall has room for two cabinets")


def _spans(draft: Draft, item: Item) -> list[tuple[Item, float, float]]:
    """Where wall cabinets can hang above a counter, their doors clear of what is beside it."""
    corners = [i.rect() for i in draft.items if i.kind == "corner"]
    ends = []
    for side in (-1, 1):
        x, y, _, _ = item.local_pose(side * item.width / 2, item.depth / 2)
        open_end = any(c.distance(x, y) < 0.05 for c in corners)
        ends.append(side * (item.width / 2 - (0.0 if open_end else 0.22)))
    cuts = [(ends[0], ends[1])]
    if item.sink_x is not None:
        cuts = [(ends[0], item.sink_x - 0.33), (item.sink_x + 0.33, ends[1])]
    return [(item, a, b) for a, b in cuts if b - a >= _CABINET_M[0]]


def _hinged(draft: Draft, fridge: Item) -> Item:
    """The fridge with its door hinged where it can swing open.

    Raises:
        SceneError: nowhere.
    """
    others = [i.rect() for i in draft.items if i.z == 0 and i is not fridge]
    room = Rect(-draft.width / 2, -draft.depth / 2, draft.width / 2, draft.depth / 2)
    first = int(draft.rng.choice([-1, 1]))
    for side in (first, -first):
        low, high = sorted((side * (fridge.width / 2 - 0.05), side * (fridge.width / 2 + 0.22)))
        swing = fridge.patch(Rect(low, 0.64, high, 0.66 + fridge.width))
        inside = room.x0 <= swing.x0 and swing.x1 <= room.x1
        inside = inside and room.y0 <= swing.y0 and swing.y1 <= room.y1
        if inside and not any(swing.overlaps(o) for o in others):
            draft.zones.append(swing)
            return replace(fridge, hinge=side)
    raise SceneError("the fridge's door meets something on either side")


def _stand(draft: Draft, chosen: Layout, kind: str, zone_m: float) -> None:
    """Stand furniture where the layout has it, shifted a little, or along a wall where it is not.

    Raises:
        SceneError: there is no room for it.
    """
    rng, name = draft.rng, draft.name(_NAMES[kind])
    size, made = _sized(rng, kind, None), None
    gap = 0.0 if kind == "shelf" else 0.03
    for piece in chosen.pieces:
        if piece.kind == kind and made is None:
            width, depth = _sized(rng, kind, piece)
            item = replace(piece, width=width, depth=depth).item(name)
            made = _shifted(draft, item, zone_m, gap)
    made = made or draft.settle(kind, name, size, range(4), zone_m, gap=gap)
    if made is None:
        raise SceneError(f"no room for {name}")


def _sized(rng: np.random.Generator, kind: str, piece: Piece | None) -> tuple[float, float]:
    """Width and depth: the layout's where this kitchen's furniture comes in that size."""
    ranges = {
        "table": ((1.15, 1.5), (0.75, 0.9)), "shelf": ((0.7, 0.9), (0.30, 0.30)),
        "garbage_can": ((0.28, 0.33), (0.28, 0.33)), "floor_lamp": ((0.36, 0.36), (0.36, 0.36)),
    }[kind]  # fmt: skip
    width, depth = (float(rng.uniform(*r)) for r in ranges)
    if piece is None or kind in ("garbage_can", "floor_lamp"):
        return width, depth
    return piece.width, piece.depth if kind == "table" else depth


def _shifted(draft: Draft, item: Item, zone_m: float, gap: float) -> Item | None:
    """Add furniture within some decimetres of its place, along the wall if it stands at one."""
    c, s = math.cos(item.yaw), math.sin(item.yaw)
    half = (draft.width if abs(s) > 0.5 else draft.depth) / 2
    back = half - (item.x * s - item.y * c)
    at_wall = back < 0.15
    for k in range(_SHIFTS):
        spread = 0.05 + 0.35 * k / _SHIFTS
        u, v = draft.rng.uniform(-spread, spread, 2)
        v = gap - back if at_wall else v
        x, y, _, _ = item.local_pose(float(u), float(v))
        moved = replace(item, x=x, y=y)
        if draft.fits(moved, zone_m):
            return draft.add(moved, zone_m)
    return None


def _scenery(draft: Draft, chosen: Layout) -> None:
    """Chairs and low tables, as far as they are in nobody's way."""
    for piece in chosen.pieces:
        if piece.kind not in ("chair", "coffee_table"):
            continue
        item = piece.item(f"{piece.kind}-{len(draft.items)}", scenery=True)
        for back in np.arange(0, _SEATS_BACK_M, 0.05).tolist():
            x, y, _, _ = item.local_pose(float(draft.rng.uniform(-0.03, 0.03)), -back)
            moved = replace(item, x=x, y=y)
            if draft.fits(moved, 0.0, gap=0.01):
                draft.add(moved, 0.0)
                break
