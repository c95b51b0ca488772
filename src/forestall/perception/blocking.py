"""What stands in the way of what: the approach corridor, and masks that cut each other.

Two signs, after REFLECT's "blocking" (image overlap and smaller depth): a thing on the same
support stands between another and the robot, or its mask cuts off a good part of the other's
outline with a step in depth. Called by `fuse.py`.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import numpy.typing as npt

from forestall.perception.config import PerceptionConfig
from forestall.perception.geometry import Stack
from forestall.perception.support import Parent
from forestall.perception.unproject import Labels
from forestall.types.graph import Relation
from forestall.types.observation import Depth, Vec3


def cuts(
    labels: Labels, depth_m: Depth, count: int, depth_edge_m: float
) -> npt.NDArray[np.float64]:
    """(count, count) share of the second mask's outline that the first one cuts off.

    Only every second pixel is looked at; outlines are long enough.
    """
    small, depth = labels[::2, ::2], depth_m[::2, ::2]
    cut = np.zeros((count + 1, count + 1))
    outline = np.zeros(count + 1)
    for axis in (0, 1):
        one = (slice(None, -1), slice(None)) if axis == 0 else (slice(None), slice(None, -1))
        two = (slice(1, None), slice(None)) if axis == 0 else (slice(None), slice(1, None))
        edge = np.nonzero(small[one] != small[two])
        a = small[one][edge].astype(np.int64) % (count + 1)
        b = small[two][edge].astype(np.int64) % (count + 1)
        near, far = depth[one][edge], depth[two][edge]
        outline += np.bincount(a, minlength=count + 1) + np.bincount(b, minlength=count + 1)
        first = (far - near > depth_edge_m) & (near > 0)
        second = (near - far > depth_edge_m) & (far > 0)
        np.add.at(cut, (a[first], b[first]), 1.0)
        np.add.at(cut, (b[second], a[second]), 1.0)
    share: npt.NDArray[np.float64] = cut[:count, :count] / np.maximum(outline[:count], 1.0)
    return share


def blocking(
    stack: Stack,
    parents: Mapping[str, Parent],
    robot_position_world_m: Vec3,
    cut_share: Mapping[tuple[str, str], float],
    config: PerceptionConfig,
) -> list[Relation]:
    """Every "B blocking A" between things with the same parent.

    Args:
        stack: located things.
        parents: what each thing rests in or on.
        robot_position_world_m: where the robot stands.
        cut_share: (nearer, farther) → share of the farther one's outline that is cut off.
        config: thresholds.
    """
    found = []
    robot = np.asarray(robot_position_world_m[:2])
    gap = stack.gaps_m()
    index = {t.id: i for i, t in enumerate(stack.things)}
    members = [i for i in sorted(parents) if i in index]
    for target in members:
        for other in members:
            a, b = index[target], index[other]
            if other == target or parents[other] != parents[target]:
                continue
            if gap[a, b] > config.corridor_m:
                continue
            if _between(stack, a, b, robot, config) or (
                cut_share.get((other, target), 0.0) >= config.occlusion_share
                and _in_front(stack, a, b, robot, config)
            ):
                found.append(Relation(other, "blocking", target))
    return found


def _approach(
    stack: Stack, a: int, robot: npt.NDArray[np.float64]
) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.float64]]:
    """Middle of a thing and the (2, 2) rows: direction to the robot, and across it."""
    centre = (stack.low_m[a, :2] + stack.high_m[a, :2]) / 2
    towards = robot - centre
    length = float(np.linalg.norm(towards))
    x, y = towards / length if length > 1e-9 else np.array([1.0, 0.0])
    return centre, np.array([[x, y], [-y, x]])


def _extent(
    stack: Stack, i: int, centre: npt.NDArray[np.float64], axes: npt.NDArray[np.float64]
) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.float64]]:
    local = (stack.samples[i][:, :2] - centre) @ axes.T
    return local.min(axis=0), local.max(axis=0)


def _between(
    stack: Stack, a: int, b: int, robot: npt.NDArray[np.float64], config: PerceptionConfig
) -> bool:
    """Whether `b` cuts the corridor through which the robot's hand comes to `a`."""
    if stack.high_m[b, 2] < stack.low_m[a, 2] + config.min_obstacle_m:
        return False
    centre, axes = _approach(stack, a, robot)
    low_a, high_a = _extent(stack, a, centre, axes)
    low_b, high_b = _extent(stack, b, centre, axes)
    if not high_a[0] - config.ring_m <= (low_b[0] + high_b[0]) / 2:
        return False
    if low_b[0] > high_a[0] + config.corridor_m:
        return False
    half = max(config.corridor_half_width_m, min(-low_a[1], high_a[1]))
    across = min(high_b[1], half) - max(low_b[1], -half)
    return bool(across >= config.corridor_share * 2 * half)


def _in_front(
    stack: Stack, a: int, b: int, robot: npt.NDArray[np.float64], config: PerceptionConfig
) -> bool:
    """Whether `b` is nearer to the robot than `a` and within the corridor's depth."""
    if stack.high_m[b, 2] < stack.low_m[a, 2] + config.min_obstacle_m:
        return False
    centre, axes = _approach(stack, a, robot)
    _, high_a = _extent(stack, a, centre, axes)
    low_b, high_b = _extent(stack, b, centre, axes)
    middle = (low_b[0] + high_b[0]) / 2
    return bool(middle > 0 and low_b[0] <= high_a[0] + config.corridor_m)
