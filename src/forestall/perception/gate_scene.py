"""What depth shows against gravity, the floor, the hand and the sizes of things.

Called by `gate.py`; sizes are judged in `gate_sizes.py`. Rooms are built level: most of their
surfaces lie or stand. If they do so by another direction than by the stated "up", the pose, the
axes or the focal length are wrong. Where it is near the stated one, the angle between the two is
measured.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from functools import cache

import numpy as np

from forestall.domain.model import Domain
from forestall.perception.coarse import Coarse
from forestall.perception.gate_config import GateConfig
from forestall.perception.gate_sizes import judge_sizes
from forestall.perception.unproject import Points
from forestall.types.finding import Finding
from forestall.types.observation import GripperState, Observation

_PATCHES = 1500
_DIRECTIONS = 300
_WIDTHS_DEG = (30.0, 15.0, 6.0)
_UPWARDS = np.array([[0.0, 0.0, 1.0]])
_AXES = (
    "check camera_to_world, its axes (camera_axes: opencv is x right, y down, z forward), which "
    "axis of the world is up, and the focal length"
)


def judge_scene(
    look: Coarse,
    index: int,
    observation: Observation,
    domain: Domain | None,
    limits: GateConfig,
) -> Iterator[Finding]:
    """Gravity, and where a domain says more: supports, the floor, sizes."""
    normals = look.normals(_PATCHES)
    leaning = _gravity(look, normals, limits)
    if leaning is not None:
        yield Finding("pose", leaning, index)
    else:
        yield from _lean(normals, index, limits)
    if domain is None:
        return
    if leaning is None:
        yield from _supports(look, index, domain, limits)
    yield from _floor(look, index, observation, domain, limits)
    yield from judge_sizes(look, index, observation.robot_position_world_m[2], domain, limits)


def judge_hand(look: Coarse, hand: GripperState, limits: GateConfig) -> Iterator[Finding]:
    """What the robot holds is seen where its hand is, or not at all."""
    held = hand.holding
    if held is None or held not in look.instances:
        return
    cells = look.cells(look.instances.index(held))
    if not cells.any():
        return
    place = np.asarray(hand.position_world_m)
    off = np.sqrt(((look.points_world_m[cells] - place) ** 2).sum(axis=1))
    if float(off.min()) > limits.hand_off_m:
        yield Finding(
            "hand",
            f"{held} is in the hand and is seen {float(off.min()):.2g} m away from it: the unit of "
            "depth, the pose of the camera or the position of the gripper is wrong",
        )


@cache
def _candidates() -> Points:
    """(n, 3) directions, evenly over the upper half of a sphere."""
    i = np.arange(_DIRECTIONS) + 0.5
    down = np.arccos(1 - i / _DIRECTIONS)
    around = np.pi * (1 + 5**0.5) * i
    return np.stack(
        [np.cos(around) * np.sin(down), np.sin(around) * np.sin(down), np.cos(down)], axis=1
    )


def _level(normals: Points, directions: Points, limits: GateConfig) -> tuple[Points, Points]:
    """Shares of patches that lie flat, and that lie or stand, by each direction."""
    along = np.abs(normals @ directions.T)
    flat = (along > limits.level).mean(axis=0)
    upright = (along < np.sqrt(1 - limits.level**2)).mean(axis=0)
    return flat, flat + upright


def _gravity(look: Coarse, normals: Points, limits: GateConfig) -> str | None:
    """A sentence where the room as a whole leans, or is seen from below."""
    if len(normals) < limits.min_normals:
        return None
    if _from_below(look, normals, limits):
        return f"every level surface is seen from below: {_AXES}"
    _, stated = _level(normals, _UPWARDS, limits)
    if float(stated[0]) >= limits.min_upright:
        return None
    flat, level = _level(normals, _candidates(), limits)
    walls = level - flat
    level = np.where((flat > limits.clear_flat) & (walls > limits.clear_flat), level, 0.0)
    best = int(level.argmax())
    if float(level[best]) >= limits.clear_upright:
        angle = float(np.degrees(np.arccos(_candidates()[best, 2])))
        return (
            f"the room leans by {angle:.0f} degrees: {100 * float(level[best]):.0f} % of its "
            f"surfaces lie or stand by that direction, {100 * float(stated[0]):.0f} % by the "
            f"stated one: {_AXES}"
        )
    return None


def _lean(normals: Points, index: int, limits: GateConfig) -> Iterator[Finding]:
    """The angle between the stated gravity and that of the planes, where both are near."""
    if len(normals) < limits.min_normals:
        return
    up = _planes_up(normals, limits)
    angle = float(np.degrees(np.arccos(min(1.0, float(up[2])))))
    if angle < limits.lean_said_deg:
        return
    sharp = replace(limits, level=float(np.cos(np.deg2rad(limits.lean_near_deg))))
    flat, level = _level(normals, np.stack([up, _UPWARDS[0]]), sharp)
    least = max(limits.clear_flat, limits.lean_ratio * float(flat[1]))
    if float(level[0]) < limits.lean_share or float(flat[0]) < least:
        return
    both = min(float(flat[0]), float(level[0] - flat[0])) > limits.clear_flat
    yield Finding(
        "pose",
        f"the planes of the picture lean by {angle:.0f} degrees against the stated gravity: "
        f"{100 * float(flat[0]):.0f} % of its surfaces lie by theirs, {100 * float(flat[1]):.0f} % "
        "by the stated one; check the rotation of camera_to_world",
        index,
        refuses=both and angle >= limits.lean_refused_deg,
    )


def _planes_up(normals: Points, limits: GateConfig) -> Points:
    """The direction near the stated one by which most patches lie or stand, in narrowing steps."""
    stated: Points = _UPWARDS[0]
    up = stated
    for width in _WIDTHS_DEG:
        along = np.abs(normals @ up)
        lying = normals[along > np.cos(np.deg2rad(width))]
        standing = normals[along < np.sin(np.deg2rad(width))]
        if len(lying) < limits.clear_flat * len(normals):
            return stated
        _, directions = np.linalg.eigh(lying.T @ lying - standing.T @ standing)
        up = directions[:, -1] * (1.0 if directions[2, -1] >= 0 else -1.0)
    return up


def _from_below(look: Coarse, normals: Points, limits: GateConfig) -> bool:
    """Whether a camera that is said to stand on its head, or to look up, sees undersides only."""
    pose = look.frame.camera_to_world
    over = float(pose[2, 1]) > 0.2 or float(pose[2, 2]) > 0.9
    under = float((normals[:, 2] < -limits.level).mean())
    top = float((normals[:, 2] > limits.level).mean())
    return over and under > limits.clear_flat and top < 0.02


def _supports(look: Coarse, index: int, domain: Domain, limits: GateConfig) -> Iterator[Finding]:
    """What things are put on lies flat and is seen from above."""
    labels = [i for i, c in enumerate(look.categories) if domain.is_open_support(c)]
    normals = look.normals(_PATCHES, labels) if labels else np.zeros((0, 3))
    if len(normals) < limits.min_normals:
        return
    flat, _ = _level(normals, _UPWARDS, limits)
    up = float((normals[:, 2] > limits.level).mean())
    if up >= limits.least_flat:
        return
    names = ", ".join(sorted({look.instances[i] or look.categories[i] for i in labels}))
    if float(flat[0]) - up > limits.clear_flat:
        yield Finding("pose", f"{names}: seen from below only: {_AXES}", index)
        return
    others, _ = _level(normals, _candidates(), limits)
    best = int(others.argmax())
    steep = abs(float(_candidates()[best, 2]))
    leaning = np.sqrt(1 - limits.level**2) < steep < limits.level
    if leaning and float(others[best]) > limits.clear_upright:
        yield Finding(
            "pose",
            f"{names}: leans by {float(np.degrees(np.arccos(steep))):.0f} degrees: {_AXES}",
            index,
        )


def _floor(
    look: Coarse, index: int, observation: Observation, domain: Domain, limits: GateConfig
) -> Iterator[Finding]:
    stands_m = observation.robot_position_world_m[2]
    for label, category in enumerate(look.categories):
        if not domain.is_a(category, domain.roles.ground):
            continue
        cells = look.cells(label)
        if int(cells.sum()) < limits.sized_cells:
            continue
        height = float(np.median(look.points_world_m[cells][:, 2])) - stands_m
        if abs(height) > limits.floor_off_m:
            yield Finding(
                "floor",
                f"{look.instances[label] or category} is seen {height:+.2f} m from where the "
                "robot stands: the unit of depth, the height of the camera or robot_position_m is "
                "wrong",
                index,
            )
