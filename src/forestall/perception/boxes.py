"""Masks from boxes: what in a box belongs to the thing that the box is around.

With depth it is what lies as far away as the middle of the box, as deep as the box is wide; without
depth it is the whole box. Called by `scenes.py`. Such masks say where a thing is, and not where it
ends: their detections are not `outlined`.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from forestall.errors import InputError
from forestall.types.observation import Depth, Intrinsics, Mask

_LEAST_DEEP_M = 0.03


def box_mask(
    box: Sequence[float], shape: tuple[int, int], depth_m: Depth | None, camera: Intrinsics
) -> Mask:
    """(H, W) bool of the thing in a box.

    Args:
        box: (x low, y low, x high, y high) in pixels; cut off at the picture's border.
        shape: (H, W) of the picture.
        depth_m: z-depth, None without.
        camera: says how wide the box is at that distance.

    Raises:
        InputError: not four finite numbers in order.
    """
    numbers = np.asarray(box, dtype=np.float64)
    if numbers.shape != (4,) or not bool(np.isfinite(numbers).all()):
        raise InputError(f"a box must be four finite numbers, got {box!r}")
    if numbers[2] <= numbers[0] or numbers[3] <= numbers[1]:
        raise InputError(f"a box must be (x low, y low, x high, y high), got {numbers.tolist()}")
    height, width = shape
    limits = np.array([width, height, width, height])
    left, top, right, bottom = np.clip(np.rint(numbers), 0, limits).astype(int).tolist()
    mask = np.zeros(shape, dtype=np.bool_)
    mask[top:bottom, left:right] = True
    if depth_m is None or not mask.any():
        return mask
    inner_y, inner_x = (bottom - top) // 4, (right - left) // 4
    middle = depth_m[top + inner_y : bottom - inner_y, left + inner_x : right - inner_x]
    known = middle[middle > 0]
    if known.size == 0:
        return mask
    distance = float(np.median(known))
    wide = max((right - left) / camera.fx, (bottom - top) / camera.fy) * distance
    near: Mask = np.abs(depth_m - distance) <= max(_LEAST_DEEP_M, wide / 2)
    return mask & near
