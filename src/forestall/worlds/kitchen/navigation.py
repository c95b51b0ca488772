"""Where the robot can stand and what it sees from there; called by `world`."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np

from forestall.types.observation import Vec3
from forestall.worlds.kitchen.forms import Float, Pose, Rect, Stance

EYE_HEIGHT_M = 1.575
ROBOT_RADIUS_M = 0.24
DRIVE_M_PER_S = 0.25
TURN_RAD_PER_S = np.pi / 2
PAN_LIMIT_RAD = float(np.deg2rad(100))
TILT_LIMITS_RAD = (float(np.deg2rad(-45)), float(np.deg2rad(75)))
REACH_M = 1.45
REACH_ANGLE_RAD = float(np.deg2rad(75))
_CELL_M = 0.06
_RINGS_M = (0.7, 1.0, 1.4)
_TURNS = 16
ONE_VIEW_RAD = float(np.deg2rad(17.0))
"""Directions this near to a group's middle are looked at in one frame."""


@dataclass(frozen=True, slots=True)
class Standing:
    """A pose of the robot's base on the floor."""

    x: float
    y: float
    yaw_rad: float

    def seconds_to(self, other: Standing) -> float:
        """Simulated time to drive straight there, with the turns before and after."""
        dx, dy = other.x - self.x, other.y - self.y
        way = float(np.hypot(dx, dy))
        if way < 0.01:
            return abs(wrapped(other.yaw_rad - self.yaw_rad)) / TURN_RAD_PER_S
        heading = float(np.arctan2(dy, dx))
        turns = abs(wrapped(heading - self.yaw_rad)) + abs(wrapped(other.yaw_rad - heading))
        return way / DRIVE_M_PER_S + turns / TURN_RAD_PER_S

    def local_to_world(self, forward: float, left: float, up: float) -> Float:
        """A place given in the robot's frame."""
        c, s = np.cos(self.yaw_rad), np.sin(self.yaw_rad)
        return np.array(
            [self.x + c * forward - s * left, self.y + s * forward + c * left, up], dtype=np.float64
        )


@dataclass(frozen=True, slots=True)
class Floor:
    """The free floor of a room."""

    area: Rect
    obstacles: tuple[Rect, ...]

    def free(self, x: float, y: float, radius: float = ROBOT_RADIUS_M) -> bool:
        """Whether a disc on the floor meets neither wall nor obstacle."""
        a = self.area
        if not (a.x0 + radius <= x <= a.x1 - radius and a.y0 + radius <= y <= a.y1 - radius):
            return False
        return all(o.distance(x, y) >= radius for o in self.obstacles)

    def connected(self, a: tuple[float, float], b: tuple[float, float]) -> bool:
        """Whether the robot can get from one place to another."""
        labels = _joined(self)
        cells = [
            (round((p[0] - self.area.x0) / _CELL_M), round((p[1] - self.area.y0) / _CELL_M))
            for p in (a, b)
        ]
        shape = labels.shape
        clipped = [(min(max(i, 0), shape[0] - 1), min(max(j, 0), shape[1] - 1)) for i, j in cells]
        one, two = (int(labels[c]) for c in clipped)
        return one == two and one > 0


@lru_cache(maxsize=8)
def _joined(floor: Floor) -> Any:
    """Label of the connected part of the floor for every cell, 0 where the robot cannot be."""
    from scipy import ndimage

    area = floor.area
    xs = np.arange(area.x0, area.x1, _CELL_M)
    ys = np.arange(area.y0, area.y1, _CELL_M)
    x, y = np.meshgrid(xs, ys, indexing="ij")
    r = ROBOT_RADIUS_M - 0.03
    ok = (x >= area.x0 + r) & (x <= area.x1 - r) & (y >= area.y0 + r) & (y <= area.y1 - r)
    for o in floor.obstacles:
        dx = np.maximum(np.maximum(o.x0 - x, x - o.x1), 0)
        dy = np.maximum(np.maximum(o.y0 - y, y - o.y1), 0)
        ok &= np.hypot(dx, dy) >= r
    return ndimage.label(ok)[0]


def wrapped(angle_rad: float) -> float:
    """The same angle in (-π, π]."""
    return float(np.pi - (np.pi - angle_rad) % (2 * np.pi))


def before(furniture: Pose, stance: Stance, target_x: float) -> list[tuple[float, float]]:
    """Places (x, y) in front of furniture, best first.

    Args:
        furniture: world pose of the furniture's frame.
        stance: how it is approached.
        target_x: x of what is wanted, in the furniture's frame.
    """
    options = []
    for distance in np.arange(0.50, 1.21, 0.05):
        for aside in np.arange(-0.60, 0.61, 0.05):
            off = float(aside) - stance.aside_m
            cost = 1.3 * abs(float(distance) - stance.distance_m) + abs(off) + 0.01 * (off > 0)
            options.append((cost, target_x + float(aside), stance.front_m + float(distance)))
    options.sort()
    _, x, y = np.array(options).T
    at = furniture[:2, :2] @ np.stack((x, y)) + furniture[:2, 3:]
    return [(px, py) for px, py in at.T.tolist()]


def around(x: float, y: float, near: tuple[float, float]) -> list[tuple[float, float]]:
    """Places around something on the floor, best first; the nearest to `near` are better."""
    options = []
    for radius in (0.70, 0.80, 0.60, 0.90):
        for k in range(24):
            a = 2 * np.pi * k / 24
            px, py = x + radius * float(np.cos(a)), y + radius * float(np.sin(a))
            cost = abs(radius - 0.7) + 0.3 * float(np.hypot(px - near[0], py - near[1]))
            options.append((round(cost, 9), px, py))
    return [(px, py) for _, px, py in sorted(options)]


def camera(eye: Float, yaw_rad: float, tilt_rad: float) -> Pose:
    """Camera to world: x right, y down, z forward; a positive tilt looks down."""
    cy, sy = np.cos(yaw_rad), np.sin(yaw_rad)
    ct, st = np.cos(tilt_rad), np.sin(tilt_rad)
    out = np.eye(4)
    out[:3, 0] = (sy, -cy, 0)
    out[:3, 1] = (-cy * st, -sy * st, -ct)
    out[:3, 2] = (cy * ct, sy * ct, -st)
    out[:3, 3] = eye
    return out


def in_reach(here: Standing, low: Float, high: Float) -> bool:
    """Whether the arm reaches a box from where the robot stands."""
    base = np.array([here.x, here.y])
    way = np.clip(base, low[:2], high[:2]) - base
    distance = float(np.hypot(*way))
    if distance > REACH_M or low[2] > 2.0:
        return False
    if distance < 0.3:
        return True
    off = wrapped(float(np.arctan2(way[1], way[0])) - here.yaw_rad)
    return abs(off) <= REACH_ANGLE_RAD


def lookouts(floor: Floor, here: Standing, point: Sequence[float]) -> list[Vec3]:
    """Where the eyes could be to look at a point: places on rings around it, the nearest first.

    Args:
        floor: the free floor; what is not free, or cannot be reached on it, is left out.
        here: where the robot stands.
        point: in the world.
    """
    angles = 2 * np.pi * np.arange(_TURNS) / _TURNS
    around = [
        (float(point[0] + r * np.cos(a)), float(point[1] + r * np.sin(a)))
        for r in _RINGS_M
        for a in angles
    ]
    free = [p for p in around if floor.free(*p) and floor.connected((here.x, here.y), p)]
    free.sort(key=lambda p: (round(float(np.hypot(p[0] - here.x, p[1] - here.y)), 9), p))
    return [(x, y, EYE_HEIGHT_M) for x, y in free]


def sight_points(low: Float, high: Float) -> Float:
    """Points of a box that stand for it when one asks whether it can be seen, (n, 3)."""
    c, h = (low + high) / 2, (high - low) / 2
    offsets = np.array(
        [[0, 0, 0.9], [0, 0, 0.0], [0.7, 0, 0.5], [-0.7, 0, 0.5], [0, 0.7, 0.5], [0, -0.7, 0.5]]
    )
    return np.asarray(c + offsets * h)


def share(hits: Sequence[str | None], wanted: frozenset[str]) -> float:
    """Which part of the glances met what was wanted."""
    return sum(hit in wanted for hit in hits) / max(len(hits), 1)


def aims(ways: Float) -> list[Float]:
    """Directions to look in, one for each group of (n, 3) directions that fit into one view.

    The group of the last direction comes last.
    """
    units = ways / np.linalg.norm(ways, axis=1, keepdims=True)
    groups: list[list[Float]] = []
    for unit in units:
        for group in groups:
            middle = np.mean([*group, unit], axis=0)
            middle /= np.linalg.norm(middle)
            if all(float(middle @ u) >= np.cos(ONE_VIEW_RAD) for u in (*group, unit)):
                group.append(unit)
                break
        else:
            groups.append([unit])
    last = next(g for g in groups if any((u == units[-1]).all() for u in g))
    groups = [*(g for g in groups if g is not last), last]
    return [np.mean(group, axis=0) for group in groups]
