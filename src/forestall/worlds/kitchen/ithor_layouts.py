"""The layouts of `ithor_layouts.toml`: where furniture stands in rooms of AI2-THOR; for `ithor`."""

from __future__ import annotations

import math
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cache
from importlib.resources import files
from typing import Any

from forestall.worlds.kitchen.layout import Item
from forestall.worlds.kitchen.plans import APPLIANCES

Spot = tuple[float, float]


@dataclass(frozen=True, slots=True)
class Piece:
    """A piece of furniture of a layout: middle of its back edge, quarter turns left from north."""

    kind: str
    x: float
    y: float
    facing: int
    width: float
    depth: float

    def item(self, name: str = "", **more: Any) -> Item:
        """The same as furniture of this kitchen."""
        yaw = self.facing * math.pi / 2
        return Item(self.kind, name, self.x, self.y, yaw, self.width, self.depth, **more)


@dataclass(frozen=True, slots=True)
class Layout:
    """A room of AI2-THOR, its origin in the middle of the floor.

    Args:
        name: of the scene.
        room: kind of the room.
        width: along x; `depth` along y.
        pieces: furniture.
        windows: (wall, middle along x or y, width, low and high edge).
        spots: where sink, appliances, drawers and wall cabinets are.
    """

    name: str
    room: str
    width: float
    depth: float
    pieces: tuple[Piece, ...]
    windows: tuple[tuple[int, float, float, float, float], ...]
    spots: Mapping[str, tuple[Spot, ...]]

    def mirrored(self) -> Layout:
        """The same with left and right exchanged."""
        return replace(
            self,
            pieces=tuple(replace(p, x=-p.x, facing=-p.facing % 4) for p in self.pieces),
            windows=tuple(
                (-wall % 4, u if wall % 2 else -u, width, low, high)
                for wall, u, width, low, high in self.windows
            ),
            spots={k: tuple((-x, y) for x, y in v) for k, v in self.spots.items()},
        )


@cache
def layouts() -> Mapping[str, Layout]:
    """All of them by name."""
    text = files("forestall.worlds.kitchen").joinpath("ithor_layouts.toml").read_text("utf-8")
    return {name: _layout(name, table) for name, table in tomllib.loads(text).items()}


def _layout(name: str, table: Mapping[str, Any]) -> Layout:
    x0, y0, x1, y1 = table["bounds"]
    x, y = (x0 + x1) / 2, (y0 + y1) / 2
    one = {k: [table[k]] for k in ("sink", *APPLIANCES) if k in table}
    many = {k: table[k] for k in ("drawers", "cabinets") if k in table}
    return Layout(
        name,
        table["room"],
        x1 - x0,
        y1 - y0,
        tuple(Piece(k, px - x, py - y, *rest) for k, px, py, *rest in table["pieces"]),
        tuple((w, u - (y if w % 2 else x), *size) for w, u, *size in table["windows"]),
        {k: tuple((px - x, py - y) for px, py in v) for k, v in (one | many).items()},
    )
