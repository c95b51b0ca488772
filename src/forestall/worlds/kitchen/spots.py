"""Finds where a thing can be put down in the present scene; called by `world`.

Goes through the regions of a receptacle with `placement`, or around the robot on the floor.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from forestall.worlds.kitchen.bodies import Bodies
from forestall.worlds.kitchen.forms import FLOOR, Float, Form, Pose, Region, inverse, pose_at
from forestall.worlds.kitchen.navigation import Floor, Standing
from forestall.worlds.kitchen.placement import LEVELS, REST_M, Rules, Score, spot

YAWS = (0.0, np.pi / 2, -np.pi / 2, np.pi)
"""Turns in which things are put down, the best first."""

Found = tuple[Region, int, Pose]
"""A region, its index in the receptacle, and a pose in its carrier's frame."""


def find(
    bodies: Bodies,
    thing: str,
    receptacle: str,
    *,
    here: Float,
    levels: Sequence[Rules] = LEVELS,
    near: Float | None = None,
    yaws: Sequence[float] = YAWS,
    score: Score | None = None,
) -> Found | None:
    """The best free spot on or in a receptacle.

    Args:
        bodies: the scene.
        thing: what is to be put.
        receptacle: where.
        here: (3,) where the robot is.
        levels: what the spot must respect, the strictest first.
        near: (3,) world point to which it should be near (default: before the robot).
        yaws: turns of the thing that may be used, the best first.
        score: overrides the choice among free spots.
    """
    form = bodies.forms[thing]
    regions = bodies.forms[receptacle].regions if receptacle in bodies.forms else ()
    for rules in levels:
        for index, region in enumerate(regions):
            taken = bodies.occupants(region, index, without=thing)
            judge = score or _nearness(bodies, region, here, near, form)
            found = spot(region, form, taken, rules, judge, yaws)
            if found is not None:
                return region, index, found
    return None


def _nearness(bodies: Bodies, region: Region, here: Float, near: Float | None, form: Form) -> Score:
    """Cost of places: near a point, or near the open edge before the robot."""
    to_local = inverse(bodies.pose(region.carrier))
    at = to_local @ np.array([*(here if near is None else near), 1.0])
    half = form.footprint.size[1] / 2
    first = region.area.y1 - 0.05 - half if region.first_m is None else region.first_m
    x = float(np.clip(at[0], region.area.x0, region.area.x1))
    if region.first_m is not None:
        x = region.area.centre[0]

    def cost(places: Float) -> Float:
        if near is not None:
            return np.asarray(np.hypot(places[:, 0] - at[0], places[:, 1] - at[1]))
        return np.asarray(np.abs(places[:, 0] - x) + 2.0 * np.abs(places[:, 1] - first))

    return cost


def on_floor(
    bodies: Bodies, floor: Floor, robot: Standing, thing: str, near: Float | None
) -> Found | None:
    """A free place on the floor: 0.3 to 0.6 m from the robot (further if need be), or near a point.

    Args:
        bodies: the scene.
        floor: the floor with everything that is on it.
        robot: where the robot stands.
        thing: what is to be put.
        near: (3,) world point; None: beside and in front of the robot.
    """
    form = bodies.forms[thing]
    region = bodies.forms[FLOOR].regions[0]
    yaw = robot.yaw_rad + np.pi / 2
    rect = form.footprint.turned(yaw)
    area = floor.area
    for x, y in _around_robot(robot) if near is None else _around_point(near):
        box = rect.moved(x, y).grown(0.02)
        inside = area.x0 < box.x0 and area.y0 < box.y0 and box.x1 < area.x1 and box.y1 < area.y1
        if not inside or box.distance(robot.x, robot.y) < 0.17:
            continue
        if not any(box.overlaps(o) for o in floor.obstacles):
            return region, 0, pose_at(x, y, region.z_m + REST_M, yaw)
    return None


def _around_robot(robot: Standing) -> list[tuple[float, float]]:
    sides = np.deg2rad([-50, 50, -30, 30, -75, 75, 0, -100, 100, -125, 125])
    places = []
    for radius in (0.45, 0.52, 0.60, 0.38, 0.70, 0.85, 1.0):
        for angle in sides:
            at = robot.local_to_world(radius * np.cos(angle), radius * np.sin(angle), 0)
            places.append((float(at[0]), float(at[1])))
    return places


def _around_point(point: Float) -> list[tuple[float, float]]:
    x, y = float(point[0]), float(point[1])
    angles = 2 * np.pi * np.arange(12) / 12
    ring = [
        (x + r * float(np.cos(a)), y + r * float(np.sin(a)))
        for r in (0.06, 0.10, 0.15, 0.2, 0.3)
        for a in angles
    ]
    return [(x, y), *ring]
