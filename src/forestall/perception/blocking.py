"""What stands in the way of what: the approach corridor, and masks that cut each other.

A hand of some width, thickness and length (`config.py`) comes level for the middle of a thing, over
the open edge of a support or through the open side of a container; what stands in its corridor
blocks. Where one mask cuts off a good part of another's outline with a step in depth (REFLECT's
"blocking": image overlap and smaller depth), the corridor is tested with slack, because part of the
target is hidden. Called by `fuse.py`.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
import numpy.typing as npt

from forestall.domain.model import Domain
from forestall.perception.config import PerceptionConfig
from forestall.perception.geometry import Stack
from forestall.perception.support import CONTAINMENT, Parent
from forestall.perception.surfaces import SURFACE
from forestall.perception.unproject import Labels, Points
from forestall.types.graph import Relation
from forestall.types.observation import Depth, Vec3

_STEEP = 0.25  # how far beside a surface, by its height over it, a robot stands at least


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
    eye_world_m: Vec3,
    cut_share: Mapping[tuple[str, str], float],
    domain: Domain,
    config: PerceptionConfig,
) -> list[Relation]:
    """Every "B blocking A" between things with the same parent.

    Args:
        stack: located things.
        parents: what each thing rests in or on.
        eye_world_m: where the robot looks from.
        cut_share: (nearer, farther) → share of the farther one's outline that is cut off.
        domain: how tall things are of which only a part shows.
        config: thresholds.
    """
    if domain.roles.blocking is None:
        return []
    index = {t.id: i for i, t in enumerate(stack.things)}
    beside: dict[Parent, list[str]] = {}
    for name in sorted(parents):
        if name in index and parents[name][1] in index:
            beside.setdefault(parents[name], []).append(name)
    found = []
    eye = np.asarray(eye_world_m)
    for (predicate, support), names in beside.items():
        if len(names) < 2 or _from_straight_above(stack, index[support], eye):
            continue
        if domain.predicates[predicate].geometry == CONTAINMENT:
            axes = _opening(stack, index[support], [index[n] for n in names], eye, config)
        else:
            axes = _open_edge(stack, index[support], eye, config)
        extents = {n: _extent(stack, index[n], axes, domain) for n in names}
        for target in names:
            if _from_above(stack, index[support], index[target], config):
                continue
            for other in names:
                cut = cut_share.get((other, target), 0.0) >= config.occlusion_share
                if other != target and _in_the_way(extents[target], extents[other], cut, config):
                    found.append(Relation(other, domain.roles.blocking, target))
    return found


Axes = npt.NDArray[np.float64]
"""(2, 2) rows: the horizontal direction from a thing to the hand that comes for it, and across."""


def _axes(direction: npt.NDArray[np.float64]) -> Axes:
    return np.array([direction, [-direction[1], direction[0]]])


def _open_edge(stack: Stack, support: int, eye_world_m: Points, config: PerceptionConfig) -> Axes:
    """Over which edge of a support a hand comes.

    Over the side before which the robot stands, if it stands before one of them, whatever part of
    the support shows. Else, at a corner or over it, over a longer side, the one towards the robot;
    over the side that faces the robot most where the sides are alike.
    """
    low, high = stack.low_m[support, :2], stack.high_m[support, :2]
    size, towards = high - low, eye_world_m[:2] - (high + low) / 2
    before = (low > eye_world_m[:2]) | (eye_world_m[:2] > high)
    along = int(np.argmin(size))
    if before.sum() == 1:
        along = int(np.argmax(before))
    elif size.max() < config.oblong * size.min():
        along = int(np.argmax(np.abs(towards)))
    direction = np.zeros(2)
    direction[along] = 1.0 if towards[along] >= 0 else -1.0
    return _axes(direction)


def _opening(
    stack: Stack,
    container: int,
    contents: Sequence[int],
    eye_world_m: Points,
    config: PerceptionConfig,
) -> Axes:
    """Through which side of a container a hand comes: the one with the least wall in the way."""
    low = stack.low_m[list(contents)].min(axis=0)
    high = stack.high_m[list(contents)].max(axis=0)
    centre = (low + high)[:2] / 2
    p = stack.things[container].points_world_m
    level = p[(p[:, 2] > low[2] + config.rim_slack_m) & (p[:, 2] < high[2])][:, :2] - centre
    options = []
    for direction in (
        np.array([1.0, 0]),
        np.array([-1.0, 0]),
        np.array([0, 1.0]),
        np.array([0, -1.0]),
    ):
        along, across = _axes(direction) @ level.T
        wall = int(np.count_nonzero((along > config.ring_m) & (np.abs(across) < config.near_m)))
        options.append((wall, -float(direction @ (eye_world_m[:2] - centre)), tuple(direction)))
    return _axes(np.array(min(options)[2]))


def _extent(stack: Stack, i: int, axes: Axes, domain: Domain) -> tuple[float, ...]:
    """Extent of a thing towards the hand, across, and upwards."""
    local = stack.samples[i][:, :2] @ axes.T
    low, high = local.min(axis=0), local.max(axis=0)
    foot, top = float(stack.low_m[i, 2]), float(stack.high_m[i, 2])
    category = domain.find(stack.things[i].category)
    size = None if category is None else category.size_m
    tall = top if not size else max(top, foot + float(size[2]))
    return (float(low[0]), float(high[0]), float(low[1]), float(high[1]), foot, tall)


def _from_straight_above(stack: Stack, support: int, eye_world_m: Points) -> bool:
    """Whether nothing tells from where a hand comes: a bare surface, seen from above it."""
    if stack.things[support].category != SURFACE:
        return False
    away = np.maximum(stack.low_m[support] - eye_world_m, eye_world_m - stack.high_m[support])
    return bool(np.linalg.norm(np.maximum(away[:2], 0.0)) < _STEEP * away[2])


def _from_above(stack: Stack, support: int, target: int, config: PerceptionConfig) -> bool:
    """Whether the target is reached from above: on the floor, or in something open on top."""
    foot, top = stack.low_m[target, 2], stack.high_m[target, 2]
    if foot < config.floor_m:
        return True
    low, high = stack.low_m[support, 2], stack.high_m[support, 2]
    return bool(low + config.rim_slack_m < foot < high - config.rim_slack_m) and bool(
        high < top + config.headroom_m
    )


def _in_the_way(
    target: tuple[float, ...], other: tuple[float, ...], cut: bool, config: PerceptionConfig
) -> bool:
    """Whether `other` stands in the hand's way to the middle of the target.

    Of a target that the other one cuts off in the image, some is hidden behind it, and its middle
    is not known so well.
    """
    _, front, left, right, foot, top = target
    back_b, front_b, left_b, right_b, foot_b, top_b = other
    under = foot + max((top - foot - config.hand_thick_m) / 2, config.hand_over_m)
    if top_b < under or foot_b >= top:
        return False
    if front_b <= front or back_b >= front + config.hand_long_m:
        return False
    middle, half = (left + right) / 2, config.hand_wide_m / 2
    if cut:
        half = max(half, (right - left) / 2 + config.cut_slack_m)
    return right_b > middle - half and left_b < middle + half
