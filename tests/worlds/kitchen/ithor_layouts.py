"""Converts dumps of AI2-THOR scenes into the kitchen's `ithor_layouts.toml`.

    python tests/worlds/kitchen/ithor_layouts.py FOLDER FILE

FOLDER holds `FloorPlan*_physics.json`: object id → AI2-THOR's metadata of the object. Its frame has
y up; x and z are the floor's x and y here. Positions, sizes and headings are those of the dump.
What a dump does not say is written down below: counters stand in it as one bounding box around both
legs of an L, walls inside of the room's rectangle do not stand in it at all.
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

NORTH, WEST, SOUTH, EAST = range(4)
"""Where the front of a piece looks, as quarter turns to the left from north."""

BESIDE_WALL_M = 0.45
"""What stands nearer than this to an edge of the floor stands at a wall there."""

CORNER_M, STOVE_M, FRIDGE_M = 0.64, 0.76, 0.70

SOURCE = """\
# Where furniture stands in seven rooms of AI2-THOR (iTHOR), for `ithor.py`.
# Made by tests/worlds/kitchen/ithor_layouts.py from the object metadata of the scenes
# FloorPlan1, 2, 4, 6, 7, 16 and 202: AI2-THOR (Allen Institute for AI, Apache License 2.0), as
# dumped by the project rl_ai2thor (Copyright (c) 2024 Julian Paquerot, MIT License; see
# ithor_layouts.LICENSE).
# Metres, rounded; x to the east, y to the north. A piece: kind, x and y of the middle of its back
# edge, quarter turns to the left from facing north, width, depth.
"""

# A leg of counters: what it is, where its front looks, from where to where along its wall, and
# where its back is (None: at the wall). Read off from the doors and drawers under the worktop.
Leg = tuple[str, int, float, float, float | None]
LEGS: Mapping[str, tuple[Leg, ...]] = {
    "FloorPlan1": (
        ("corner", NORTH, -2.38, -1.74, None),
        ("counter", NORTH, -1.74, -0.64, None),
        ("counter", NORTH, 0.13, 1.22, None),
        ("counter", EAST, -2.16, 0.42, None),
    ),
    "FloorPlan2": (
        ("counter", NORTH, -2.05, 1.51, None),
        ("corner", NORTH, 1.51, 2.15, None),
        ("counter", WEST, -1.16, 0.22, None),
        ("counter", WEST, 0.98, 1.55, None),
    ),
    "FloorPlan4": (
        ("counter", NORTH, -3.98, -3.62, None),
        ("counter", NORTH, -2.86, 0.00, None),
        ("counter", WEST, 2.68, 3.49, None),
    ),
    "FloorPlan6": (
        ("counter", EAST, -0.28, 2.97, None),
        ("counter", NORTH, 0.10, 1.31, None),
        ("corner", NORTH, 1.31, 1.95, None),
        ("counter", WEST, -1.33, -0.52, None),
        ("counter", WEST, 0.24, 0.58, None),
    ),
    "FloorPlan7": (
        ("corner", NORTH, -2.12, -1.48, None),
        ("counter", NORTH, -1.48, 0.77, None),
        ("counter", NORTH, 1.53, 1.89, None),
        ("bar", EAST, -1.35, 0.69, -2.12),
    ),
    "FloorPlan16": (
        ("counter", EAST, 0.23, 2.67, None),
        ("counter", NORTH, 1.12, 1.80, None),
        ("corner", NORTH, 2.565, 3.205, None),
        ("counter", WEST, -1.505, 0.60, None),
    ),
    "FloorPlan202": (),
}
"""The sink of FloorPlan6 stands across its corner, and a leg of FloorPlan16 across the room: the
first stands beside the corner here, the second is left out. The end of FloorPlan4's high table that
carries appliances is a counter."""

STOVE_FACES = {
    "FloorPlan1": (NORTH, -0.255),
    "FloorPlan2": (WEST, 0.60),
    "FloorPlan4": (NORTH, -3.24),
    "FloorPlan6": (WEST, -0.14),
    "FloorPlan7": (NORTH, 1.15),
    "FloorPlan16": (NORTH, 2.18),
}
"""Where the stove's front looks, and its middle along the wall (in FloorPlan16 moved by 0.2 m, to
the counter beside it)."""

TABLE_FACES = {
    "FloorPlan1": WEST,
    "FloorPlan2": EAST,
    "FloorPlan4": WEST,
    "FloorPlan6": WEST,
    "FloorPlan7": SOUTH,
    "FloorPlan16": SOUTH,
}
"""From where the robot works at the dining table, or at the island that stands for one."""

TABLE_ENDS = {"FloorPlan4": 2.64}
"""Where a table ends that is partly a counter."""

BLOCKS = {
    "FloorPlan2": ((-3.30, -1.80, -2.10, 1.75),),
    "FloorPlan7": ((-1.10, 2.52, 0.75, 2.62),),
}
"""Walls inside of the room, behind the fridge."""

Box = tuple[float, float, float, float, float, float]


def convert(name: str, dump: Mapping[str, Any]) -> dict[str, Any]:
    """The facts of one layout."""
    objects = list(dump.values())
    bounds = _bounds(name, objects)
    kitchen = bool(LEGS[name])
    facts: dict[str, Any] = {
        "room": "kitchen" if kitchen else "living-room",
        "bounds": bounds,
        "pieces": [*_built_in(name, objects, bounds), *_standing(name, objects, bounds)],
        "windows": [w for o in _all(objects, "Window") if (w := _window(_box(o), bounds))],
    }
    if kitchen:
        places = {
            "sink": "Sink", "microwave": "Microwave", "coffee_machine": "CoffeeMachine",
            "toaster": "Toaster",
        }  # fmt: skip
        facts |= {kind: list(_middle(_all(objects, c)[0])) for kind, c in places.items()}
        facts["drawers"] = _places(_all(objects, "Drawer"))
        hung = [o for o in _all(objects, "Cabinet") if _box(o)[2] > 1.2]
        facts["cabinets"] = _places(hung)
    return facts


def _all(objects: Iterable[Mapping[str, Any]], *categories: str) -> list[Mapping[str, Any]]:
    found = [o for o in objects if o["objectType"] in categories]
    return sorted(found, key=lambda o: str(o["objectId"]))


def _box(found: Mapping[str, Any]) -> Box:
    """Low and high corner, z up."""
    box = found["axisAlignedBoundingBox"]
    low = [box["center"][k] - box["size"][k] / 2 for k in "xzy"]
    high = [box["center"][k] + box["size"][k] / 2 for k in "xzy"]
    return (low[0], low[1], low[2], high[0], high[1], high[2])


def _middle(found: Mapping[str, Any]) -> list[float]:
    x0, y0, _, x1, y1, _ = _box(found)
    return [(x0 + x1) / 2, (y0 + y1) / 2]


def _places(found: list[Mapping[str, Any]]) -> list[list[float]]:
    """Where there is one or several above each other."""
    return sorted({tuple(round(v, 2) for v in _middle(o)): _middle(o) for o in found}.values())


def _heading(found: Mapping[str, Any]) -> int:
    """Headings are clockwise in AI2-THOR."""
    return round(-float(found["rotation"]["y"]) / 90) % 4


def _bounds(name: str, objects: list[Mapping[str, Any]]) -> list[float]:
    """The floor, drawn in to the backs of the fridge and of the counters at its edges."""
    x0, y0, _, x1, y1, _ = _box(_all(objects, "Floor")[0])
    edges = [x0, y0, x1, y1]
    for side, (facing, inward) in enumerate(((EAST, 1), (NORTH, 1), (WEST, -1), (SOUTH, -1))):
        backs = [o for o in _all(objects, "Fridge") if _heading(o) == facing]
        backs += [o for o in _all(objects, "CounterTop") if _piece(o, facing)[2] >= 1.0]
        way = [inward * (_box(o)[side if side < 2 else side + 1] - edges[side]) for o in backs]
        edges[side] += inward * min((w for w in way if 0 < w < BESIDE_WALL_M), default=0.0)
    return edges


def _at_wall(bounds: list[float], facing: int, along: float, back: float | None) -> list[float]:
    x0, y0, x1, y1 = bounds
    wall = {NORTH: y0, WEST: x1, SOUTH: y1, EAST: x0}[facing] if back is None else back
    return [along, wall] if facing in (NORTH, SOUTH) else [wall, along]


def _built_in(
    name: str, objects: list[Mapping[str, Any]], bounds: list[float]
) -> Iterable[list[Any]]:
    for kind, facing, low, high, back in LEGS[name]:
        yield [kind, *_at_wall(bounds, facing, (low + high) / 2, back), facing, high - low, 0.62]
    for x0, y0, x1, y1 in BLOCKS.get(name, ()):
        yield ["block", (x0 + x1) / 2, y0, NORTH, x1 - x0, y1 - y0]
    if name in STOVE_FACES:
        facing, along = STOVE_FACES[name]
        yield ["stove", *_at_wall(bounds, facing, along, None), facing, STOVE_M, 0.65]
    for found in _all(objects, "Fridge"):
        facing = _heading(found)
        x, y, width, depth = _piece(found, facing)
        yield ["fridge", *_backed(bounds, facing, x, y), facing, min(width, FRIDGE_M), depth]


def _piece(found: Mapping[str, Any], facing: int) -> tuple[float, float, float, float]:
    """Middle of the back edge, width and depth of a bounding box that looks somewhere."""
    x0, y0, _, x1, y1, _ = _box(found)
    x, y = (x0 + x1) / 2, (y0 + y1) / 2
    at = {NORTH: (x, y0), WEST: (x1, y), SOUTH: (x, y1), EAST: (x0, y)}[facing]
    across = facing in (NORTH, SOUTH)
    return (*at, x1 - x0 if across else y1 - y0, y1 - y0 if across else x1 - x0)


def _backed(bounds: list[float], facing: int, x: float, y: float) -> list[float]:
    """A place against the wall behind it, where there is one."""
    wx, wy = _at_wall(bounds, facing, x if facing in (NORTH, SOUTH) else y, None)
    near = abs(wx - x) + abs(wy - y) < BESIDE_WALL_M
    return [wx, wy] if near else [x, y]


def _from_wall(found: Mapping[str, Any], bounds: list[float]) -> int:
    """Away from the nearest wall along its long side."""
    x0, y0, _, x1, y1, _ = _box(found)
    long = (x1 - x0) / (y1 - y0)
    ways = {
        NORTH: y0 - bounds[1], WEST: bounds[2] - x1, SOUTH: bounds[3] - y1, EAST: x0 - bounds[0]
    }  # fmt: skip
    if max(long, 1 / long) > 1.5:
        ways = {f: w for f, w in ways.items() if (f in (NORTH, SOUTH)) == (long > 1)}
    return min(ways, key=lambda f: ways[f])


def _standing(
    name: str, objects: list[Mapping[str, Any]], bounds: list[float]
) -> Iterable[list[Any]]:
    at_wall = {
        "GarbageCan": "garbage_can", "ShelvingUnit": "shelf", "SideTable": "shelf",
        "TVStand": "tv_stand", "Sofa": "sofa", "ArmChair": "sofa", "FloorLamp": "floor_lamp",
    }  # fmt: skip
    for category, kind in at_wall.items():
        for found in _all(objects, category):
            facing = _from_wall(found, bounds)
            x, y, width, depth = _piece(found, facing)
            yield [kind, *_backed(bounds, facing, x, y), facing, width, depth]
    tables = _all(objects, "DiningTable")
    islands = [o for o in _all(objects, "CounterTop") if _island(o, objects)]
    for found in (tables or islands)[:1]:
        x, y, width, depth = _piece(found, TABLE_FACES[name])
        if name in TABLE_ENDS:
            low = y - width / 2
            y, width = (low + TABLE_ENDS[name]) / 2, TABLE_ENDS[name] - low
        yield ["table", x, y, TABLE_FACES[name], width, depth]
        for seat in _all(objects, "Chair", "Stool"):
            yield ["chair", *_seat(seat, found, objects), 0.42, 0.42]
    for found in _all(objects, "CoffeeTable"):
        x, y, width, depth = _piece(found, NORTH)
        yield ["coffee_table", x, y, NORTH, width, depth]


def _island(top: Mapping[str, Any], objects: list[Mapping[str, Any]]) -> bool:
    """Whether a worktop stands alone in the middle, without sink and stove."""
    x0, y0, _, x1, y1, _ = _box(top)
    fixed = [_middle(o) for o in _all(objects, "Sink", "StoveBurner")]
    alone = not any(x0 <= x <= x1 and y0 <= y <= y1 for x, y in fixed)
    return alone and min(x1 - x0, y1 - y0) > 0.8


def _seat(
    seat: Mapping[str, Any], table: Mapping[str, Any], objects: list[Mapping[str, Any]]
) -> list[Any]:
    """Where a chair's back is, and that it looks as in the dump; a stool looks to what it is at."""
    x, y = _middle(seat)
    facing = _heading(seat)
    if seat["objectType"] == "Stool":
        tops = [table, *_all(objects, "CounterTop")]
        away = [(_distance(_box(t), x, y), k) for k, t in enumerate(tops)]
        x0, y0, _, x1, y1, _ = _box(tops[min(away)[1]])
        ways = {NORTH: y0 - y, WEST: x - x1, SOUTH: y - y1, EAST: x0 - x}
        facing = max(ways, key=lambda f: ways[f])
    dx, dy = {NORTH: (0, -1), WEST: (1, 0), SOUTH: (0, 1), EAST: (-1, 0)}[facing]
    return [x + 0.21 * dx, y + 0.21 * dy, facing]


def _distance(box: Box, x: float, y: float) -> float:
    dx, dy = max(box[0] - x, x - box[3], 0.0), max(box[1] - y, y - box[4], 0.0)
    return float((dx * dx + dy * dy) ** 0.5)


def _window(box: Box, bounds: list[float]) -> list[Any] | None:
    """Wall (0 south, 1 east, 2 north, 3 west), middle along x or y, width, low and high edge."""
    x0, y0, z0, x1, y1, z1 = box
    if min(x1 - x0, y1 - y0) > 0.4:
        return None
    x, y = (x0 + x1) / 2, (y0 + y1) / 2
    away = [abs(y - bounds[1]), abs(x - bounds[2]), abs(y - bounds[3]), abs(x - bounds[0])]
    wall = away.index(min(away))
    if min(away) > BESIDE_WALL_M:
        return None
    return [wall, y if wall % 2 else x, y1 - y0 if wall % 2 else x1 - x0, z0, z1]


def _written(value: Any) -> str:
    if isinstance(value, list):
        return f"[{', '.join(map(_written, value))}]"
    if isinstance(value, float):
        return str(round(value, 2) + 0.0)
    return json.dumps(value)


def text_of(layouts: Mapping[str, Mapping[str, Any]]) -> str:
    """The file."""
    lines = [SOURCE]
    for name, facts in layouts.items():
        lines.append(f"[{name}]")
        for key, value in facts.items():
            if value and isinstance(value, list) and isinstance(value[0], list):
                lines += [f"{key} = [", *(f"    {_written(v)}," for v in value), "]"]
            else:
                lines.append(f"{key} = {_written(value)}")
        lines.append("")
    return "\n".join(lines)


def main() -> None:
    """Write the file."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", type=Path)
    parser.add_argument("out", type=Path)
    given = parser.parse_args()
    layouts = {
        name: convert(name, json.loads((given.folder / f"{name}_physics.json").read_text("utf-8")))
        for name in LEGS
    }
    given.out.write_text(text_of(layouts), encoding="utf-8")


if __name__ == "__main__":
    main()
