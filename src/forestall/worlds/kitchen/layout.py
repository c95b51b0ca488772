"""The catalogue of floor plans: furniture items, plans, and drafts that keep floor free.

`plans` draws with it, the furniture builders read it; no simulator, only rectangles.

Walls are numbered counter-clockwise from y = -depth/2 (0: south, 1: east, 2: north, 3: west). A
wall's own frame has its origin in its middle on the floor, +y into the room; furniture uses the
same frame.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from forestall.errors import SceneError
from forestall.worlds.kitchen.forms import Rect

COUNTER_DEPTH_M = 0.62
COUNTER_HEIGHT_M = 0.90
ROOM_HEIGHT_M = 2.55
"""Of kitchens."""

STANDING_M = 0.95
"""Free floor in front of everything that the robot works at."""


@dataclass(frozen=True, slots=True)
class Item:
    """One piece of furniture: its frame in the room and what it is made with.

    Args:
        kind: name of its builder.
        name: instance name (or a plain name for scenery).
        x: place of its origin; `y`, `z` likewise.
        yaw: its +y is the room's y turned by this.
        width: along its x.
        depth: along its y.
        sink_x: of a counter: where the sink is.
        drawers: of a counter: (drawer instance, column).
        keep_out: of a counter: (x0, x1) spans that are taken.
        extra: further instances that it carries.
        hinge: side of the hinge (+1: +x).
        inset: how far its back is from the back of what it stands on.
        splash: whether tiles cover the wall above it.
        scenery: no instance.
    """

    kind: str
    name: str
    x: float
    y: float
    yaw: float
    width: float
    depth: float
    z: float = 0.0
    sink_x: float | None = None
    drawers: tuple[tuple[str, int], ...] = ()
    keep_out: tuple[tuple[float, float], ...] = ()
    extra: tuple[str, ...] = ()
    hinge: int = 1
    inset: float = 0.0
    splash: bool = True
    scenery: bool = False

    def local_pose(self, x: float, y: float) -> tuple[float, float, float, float]:
        """World (x, y, 0, yaw) of a place in its frame."""
        c, s = float(np.cos(self.yaw)), float(np.sin(self.yaw))
        return (self.x + c * x - s * y, self.y + s * x + c * y, 0.0, self.yaw)

    def patch(self, local: Rect) -> Rect:
        """A rectangle of its frame in the room."""
        return local.turned(self.yaw).moved(self.x, self.y)

    def rect(self) -> Rect:
        """Footprint on the floor."""
        return (
            Rect(-self.width / 2, 0, self.width / 2, self.depth)
            .turned(self.yaw)
            .moved(self.x, self.y)
        )

    def zone(self, depth: float = STANDING_M) -> Rect:
        """Floor in front of it that must stay free."""
        half = max(self.width / 2, 0.32)
        front = Rect(-half, self.depth, half, self.depth + depth)
        return front.turned(self.yaw).moved(self.x, self.y)


@dataclass(frozen=True, slots=True)
class Plan:
    """A whole room.

    Args:
        room: "kitchen" or "living-room".
        width: along x; `depth` along y; `height`.
        items: furniture.
        decor: (kind, wall, u, z, width, height) on the walls.
    """

    room: str
    width: float
    depth: float
    height: float
    items: tuple[Item, ...]
    decor: tuple[tuple[str, int, float, float, float, float], ...]


Draw = Callable[[np.random.Generator, np.random.Generator], Plan]
"""Draws a floor plan: from a stream for what is built in, and one for what stands free."""


@dataclass(slots=True)
class Draft:
    """A plan while it is being drawn."""

    rng: np.random.Generator
    width: float
    depth: float
    items: list[Item] = field(default_factory=list)
    zones: list[Rect] = field(default_factory=list)
    decor: list[tuple[str, int, float, float, float, float]] = field(default_factory=list)
    counts: dict[str, int] = field(default_factory=dict)

    def name(self, category: str) -> str:
        """The next instance name of a category."""
        self.counts[category] = self.counts.get(category, 0) + 1
        return f"{category}-{self.counts[category]}"

    def length(self, wall: int) -> float:
        """Length of a wall."""
        return self.depth if wall % 2 else self.width

    def at_wall(self, wall: int, u: float, gap: float = 0.0) -> tuple[float, float, float]:
        """World (x, y, yaw) of a place along a wall."""
        yaw = wall * np.pi / 2
        out = (self.width if wall % 2 else self.depth) / 2 - gap
        c, s = float(np.cos(yaw)), float(np.sin(yaw))
        return (c * u + s * out, s * u - c * out, float(yaw))

    def add(self, item: Item, zone_m: float = STANDING_M) -> Item:
        """Add furniture and the free floor before it."""
        self.items.append(item)
        if zone_m > 0:
            self.zones.append(item.zone(zone_m))
        return item

    def fits(self, item: Item, zone_m: float, gap: float = 0.04) -> bool:
        """Whether furniture meets neither furniture nor the floor that others need."""
        rect = item.rect()
        half = Rect(-self.width / 2, -self.depth / 2, self.width / 2, self.depth / 2)
        inside = (
            rect.x0 >= half.x0 - 1e-6
            and rect.y0 >= half.y0 - 1e-6
            and rect.x1 <= half.x1 + 1e-6
            and rect.y1 <= half.y1 + 1e-6
        )
        if not inside or any(rect.overlaps(z) for z in self.zones):
            return False
        if any(rect.grown(gap).overlaps(o.rect()) for o in self.items if o.z == 0):
            return False
        if zone_m <= 0:
            return True
        zone = item.zone(zone_m)
        zone_inside = (
            zone.x0 >= half.x0 - 0.1
            and zone.y0 >= half.y0 - 0.1
            and zone.x1 <= half.x1 + 0.1
            and zone.y1 <= half.y1 + 0.1
        )
        return zone_inside and not any(zone.overlaps(o.rect()) for o in self.items if o.z == 0)

    def settle(
        self,
        kind: str,
        name: str,
        size: tuple[float, float],
        walls: Sequence[int],
        zone_m: float = STANDING_M,
        gap: float = 0.0,
        tries: int = 60,
        **more: object,
    ) -> Item | None:
        """Find a place along one of the walls; None when there is none."""
        for _ in range(tries):
            wall = int(walls[int(self.rng.integers(len(walls)))])
            reach = self.length(wall) / 2 - size[0] / 2 - 0.02
            if reach <= 0:
                continue
            x, y, yaw = self.at_wall(wall, float(self.rng.uniform(-reach, reach)), gap)
            item = Item(kind, name, x, y, yaw, *size)
            item = replace(item, **more)  # type: ignore[arg-type]
            if self.fits(item, zone_m):
                return self.add(item, zone_m)
        return None


def free_place(plan: Plan, rng: np.random.Generator) -> tuple[float, float, float]:
    """A place (x, y, yaw) on the free floor, for the robot to start from.

    Raises:
        SceneError: there is none.
    """
    for _ in range(200):
        x = float(rng.uniform(-plan.width / 2 + 0.4, plan.width / 2 - 0.4))
        y = float(rng.uniform(-plan.depth / 2 + 0.4, plan.depth / 2 - 0.4))
        if all(i.rect().distance(x, y) > 0.36 for i in plan.items if i.z == 0):
            return (x, y, float(rng.uniform(-np.pi, np.pi)))
    raise SceneError("the room has no free floor for the robot")


def columns_of(width: float) -> list[tuple[float, float]]:
    """The doors and drawers of a counter, side by side."""
    count = max(1, round(width / 0.47))
    edges = np.linspace(-width / 2, width / 2, count + 1).tolist()
    return list(itertools.pairwise(edges))


def drawer_columns(width: float, sink_x: float | None) -> list[int]:
    """Which columns of a counter can be real drawers."""
    return [
        k
        for k, (x0, x1) in enumerate(columns_of(width))
        if sink_x is None or x1 <= sink_x - 0.27 or x0 >= sink_x + 0.27
    ]
