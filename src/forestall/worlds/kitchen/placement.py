"""Finds free spots on and in receptacles: pure geometry in the frame of a region's carrier.

Called by `world` (to put things down) and by `stocking` (to furnish a new scene).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from forestall.worlds.kitchen.forms import Float, Form, Pose, Rect, Region, pose_at, pose_on_edge

STEP_M = 0.02
BLOCKING_HEIGHT_M = 0.04
"""What is lower than this is in nobody's way."""

_HIDING_M = 0.06
"""How much higher a thing may lie in a hollow so as not to cover another one."""

REST_M = 0.0004
"""How far above its support a thing is put, so that they do not touch."""


@dataclass(frozen=True, slots=True)
class Occupant:
    """What already lies in a region, in the carrier's frame."""

    name: str
    rect: Rect
    height_m: float
    z_m: float = 0.0
    core_m: float = 0.0


@dataclass(frozen=True, slots=True)
class Rules:
    """What a free spot must respect.

    Args:
        gap_m: distance from others.
        spare: nothing may come to stand before these (None: before anything).
        clear: whether nothing may stand before the new thing.
        corridor_m: free width to both sides of the way from a thing to the open edge.
    """

    gap_m: float = 0.03
    spare: frozenset[str] | None = None
    clear: bool = True
    corridor_m: float = 0.04


_NOTHING: frozenset[str] = frozenset()
LEVELS = (
    Rules(),
    Rules(gap_m=0.012, corridor_m=0.005),
    Rules(gap_m=0.012, corridor_m=0.005, clear=False),
    Rules(gap_m=0.012, corridor_m=0.005, spare=_NOTHING),
    Rules(gap_m=0.008, corridor_m=0.0, spare=_NOTHING, clear=False),
)
"""From the spots that a careful robot prefers to any spot at all."""

Score = Callable[[Float], Float]
"""Places (n, 2) of the footprint's centre → cost (n,); infinite where forbidden."""


def footprint_at(form: Form, pose: Pose) -> Rect:
    """Bounding rectangle of a thing at a pose, in the frame of the pose."""
    corners = np.array(
        [
            [x, y, z]
            for x in (form.footprint.x0, form.footprint.x1)
            for y in (form.footprint.y0, form.footprint.y1)
            for z in (0.0, form.height_m)
        ]
    )
    at = corners @ pose[:3, :3].T + pose[:3, 3]
    return Rect(
        float(at[:, 0].min()), float(at[:, 1].min()), float(at[:, 0].max()), float(at[:, 1].max())
    )


def spot(
    region: Region,
    form: Form,
    occupants: Sequence[Occupant],
    rules: Rules,
    score: Score,
    yaws: Sequence[float] = (0.0,),
) -> Pose | None:
    """A pose in the carrier's frame, None when there is no room."""
    if region.kind == "pile":
        return _in_pile(region, form, occupants)
    if region.kind in ("spot", "slot"):
        return _in_spot(region, form, occupants)
    for yaw in yaws:
        found = _on_surface(region, form, occupants, rules, score, yaw)
        if found is not None:
            return found
    return None


def _on_surface(
    region: Region,
    form: Form,
    occupants: Sequence[Occupant],
    rules: Rules,
    score: Score,
    yaw: float,
) -> Pose | None:
    rect = form.footprint.turned(yaw)
    if form.height_m > region.clearance_m:
        return None
    low = (region.area.x0 - rect.x0, region.area.y0 - rect.y0)
    high = (region.area.x1 - rect.x1, region.area.y1 - rect.y1)
    if low[0] > high[0] + 1e-9 or low[1] > high[1] + 1e-9:
        return None
    xs = np.linspace(low[0], high[0], 1 + int((high[0] - low[0]) / STEP_M + 1e-6))
    ys = np.linspace(low[1], high[1], 1 + int((high[1] - low[1]) / STEP_M + 1e-6))
    at = np.stack(np.meshgrid(xs, ys, indexing="ij"), axis=-1).reshape(-1, 2)
    free = np.ones(len(at), dtype=bool)
    for taken in region.keep_out:
        free &= ~_meets(at, rect, taken)
    tall = form.height_m >= BLOCKING_HEIGHT_M
    for other in occupants:
        free &= ~_meets(at, rect, other.rect.grown(rules.gap_m))
        if region.front_m is None:
            continue
        if tall and (rules.spare is None or other.name in rules.spare):
            way = Rect(other.rect.x0, other.rect.y1, other.rect.x1, region.front_m)
            free &= ~_meets(at, rect, way.grown(rules.corridor_m, 0))
        if rules.clear and other.height_m >= BLOCKING_HEIGHT_M:
            beside = other.rect.grown(rules.corridor_m, 0)
            behind = Rect(beside.x0, region.area.y0 - 1, beside.x1, beside.y0)
            free &= ~_meets(at, rect, behind)
    if not free.any():
        return None
    at = at[free]
    cost = score(at + np.array(rect.centre))
    best = int(np.argmin(cost))
    if not np.isfinite(cost[best]):
        return None
    return pose_at(float(at[best, 0]), float(at[best, 1]), region.z_m + REST_M, yaw)


def _meets(at: Float, rect: Rect, other: Rect) -> np.ndarray[tuple[int], np.dtype[np.bool_]]:
    x, y = at[:, 0], at[:, 1]
    return np.asarray(
        (x + rect.x0 < other.x1)
        & (x + rect.x1 > other.x0)
        & (y + rect.y0 < other.y1)
        & (y + rect.y1 > other.y0)
    )


def _in_spot(region: Region, form: Form, occupants: Sequence[Occupant]) -> Pose | None:
    if occupants:
        return None
    (x, y), (sx, sy) = region.area.centre, region.area.size
    if region.kind == "slot":
        wide, tall = form.footprint.size
        if wide > sx or form.height_m > sy:
            return None
        return pose_on_edge(x, y + form.height_m / 2, region.z_m + tall / 2 + REST_M)
    if form.height_m > region.clearance_m or 2 * form.core_m > min(sx, sy) + 0.011:
        return None
    return pose_at(x, y, region.z_m + REST_M, region.yaw_rad)


def _in_pile(region: Region, form: Form, occupants: Sequence[Occupant]) -> Pose | None:
    """The lowest place in a round hollow where an upright cylinder rests on what is there.

    Contents stand for their bounding cylinders; a sloping wall holds what is too wide for the
    floor.
    """
    heights = np.array([z for z, _ in region.profile])
    radii = np.array([r for _, r in region.profile])
    widening = np.maximum.accumulate(np.minimum(radii, radii[-1]))
    widest = float(widening[-1])
    r = form.core_m
    if r > widest + 1e-6:
        return None
    angles = 2 * np.pi * np.arange(12) / 12
    reach = max(widest - r - 0.002, 0.0)
    offsets = [(0.0, 0.0)] + [
        (float(s * np.cos(a)), float(s * np.sin(a)))
        for s in np.unique([min(r * 1.16 + 0.002, reach), reach])
        for a in angles
        if s > 0.004
    ]
    best: tuple[float, float, float, float] | None = None
    for x, y in offsets:
        need = float(np.hypot(x, y)) + r
        z = float(np.interp(need, widening, heights, left=0.0, right=np.inf))
        hidden = 0.0
        for other in sorted(occupants, key=lambda o: o.z_m):
            cx, cy = other.rect.centre
            over = r + other.core_m - float(np.hypot(cx - x, cy - y))
            if over <= 0:
                continue
            hidden += min(over / (2 * min(r, other.core_m)), 1.0)
            top = other.z_m + other.height_m + 2 * REST_M
            if z < top and z + form.height_m > other.z_m:
                z = top
        cost = z + _HIDING_M * hidden
        if z <= region.clearance_m - 0.25 * form.height_m and (
            best is None or cost < best[0] - 1e-4
        ):
            best = (cost, z, x, y)
    if best is None:
        return None
    _, z, x, y = best
    return pose_at(x, y, region.z_m + REST_M + z)
