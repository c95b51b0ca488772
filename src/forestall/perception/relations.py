"""Where things are with respect to each other: left, right, front, behind, above, below, near.

Directions are those of a named frame: the camera of the newest view, levelled (x to its right, y
away from it, z up). "A in_front_of B" says that A is nearer to that camera. After REFLECT, they
are stated for close pairs only, along the one axis that dominates. Called by `fuse.py`.
"""

from __future__ import annotations

from collections.abc import Collection

import numpy as np

from forestall.perception.config import PerceptionConfig
from forestall.perception.geometry import Stack, sampled
from forestall.perception.unproject import Points
from forestall.types.graph import Relation
from forestall.types.observation import Pose

FRAME_NAME = "camera of the newest view, levelled"

_FEW = 96
_ALONG = (("right_of", "left_of"), ("behind", "in_front_of"), ("above", "below"))

DIRECTIONS = frozenset(("near", *(name for pair in _ALONG for name in pair)))
"""What is told of every pair by geometry alone, also where a domain has no word for it."""


def levelled_axes(camera_to_world: Pose) -> Points:
    """(3, 3) rows: right, away and up of the camera, turned so that up is the world's up."""
    right = camera_to_world[:3, 0] * np.array([1.0, 1.0, 0.0])
    length = float(np.linalg.norm(right))
    right = right / length if length > 1e-9 else np.array([1.0, 0.0, 0.0])
    up = np.array([0.0, 0.0, 1.0])
    return np.stack([right, np.cross(up, right), up])


def directions(
    stack: Stack,
    camera_to_world: Pose,
    skip: Collection[str],
    tied: Collection[tuple[str, str]],
    config: PerceptionConfig,
) -> list[Relation]:
    """Direction and nearness relations between all close pairs.

    Args:
        stack: located things.
        camera_to_world: the view whose directions are meant.
        skip: ids that are left out (large supports, what is held).
        tied: (child, parent) pairs, for which support or containment says it all.
        config: thresholds.
    """
    n = len(stack.things)
    if n < 2:
        return []
    ids = [t.id for t in stack.things]
    gap = stack.gaps_m()
    allowed = np.array([i not in skip for i in ids])
    pair = allowed[:, None] & allowed[None, :] & ~np.eye(n, dtype=bool)
    position = {name: k for k, name in enumerate(ids)}
    for child, parent in tied:
        if child in position and parent in position:
            i, j = position[child], position[parent]
            pair[i, j] = pair[j, i] = False
    centre = (stack.low_m + stack.high_m) / 2
    offset = (centre[:, None, :] - centre[None, :, :]) @ levelled_axes(camera_to_world).T
    length = np.linalg.norm(offset, axis=2)
    cosine = np.round(offset / np.where(length > 0, length, 1.0)[:, :, None], 6)
    vertical = np.abs(cosine[:, :, 2]) > config.vertical_cosine
    lateral = (np.abs(cosine[:, :, 0]) > config.lateral_cosine) & ~vertical
    frontal = (np.abs(cosine[:, :, 1]) > config.frontal_cosine) & ~vertical & ~lateral
    close = pair & (gap < config.close_m)
    found: list[Relation] = []
    for axis, applies in ((0, lateral), (1, frontal), (2, vertical)):
        for sign, predicate in zip((1, -1), _ALONG[axis], strict=True):
            hits = np.argwhere(close & applies & (sign * cosine[:, :, axis] > 0))
            found += [Relation(ids[i], predicate, ids[j]) for i, j in hits]
    near = pair & (gap <= config.near_m)
    for i, j in np.argwhere(np.triu(near & (gap <= 0.0))):
        near[i, j] = near[j, i] = _beside(stack, int(i), int(j), config)
    found += [Relation(ids[i], "near", ids[j]) for i, j in np.argwhere(near)]
    return found


def _beside(stack: Stack, i: int, j: int, config: PerceptionConfig) -> bool:
    """Whether things whose boxes overlap are near by their surfaces and the smaller one's length.

    In a heap every box overlaps every other.
    """
    one, other = (sampled(stack.samples[k], _FEW) for k in (i, j))
    size = min(float((stack.high_m[k] - stack.low_m[k]).max()) for k in (i, j))
    apart = np.linalg.norm(one[:, None, :] - other[None, :, :], axis=2)
    return float(apart.min()) <= min(config.near_m, max(0.75 * size, config.ring_m))
