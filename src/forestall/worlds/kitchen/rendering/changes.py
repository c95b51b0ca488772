"""Where a change of a scene can show in a picture; called by `redrawing`.

Everything here errs on the side of too much.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from forestall.types.observation import Intrinsics
from forestall.worlds.kitchen.rendering.drawn import Content
from forestall.worlds.kitchen.rendering.lighting import AMBIENT_REACH_M, LAMP_RADIUS_M
from forestall.worlds.kitchen.rendering.tracer import Bool, Float
from forestall.worlds.kitchen.rendering.vectors import dot

MARGIN_M = 0.003
MARGIN_PIXELS = 2
NEAREST_M = 0.02
TILE = 16
CALL_PIXELS = 4000.0
"""How many pixels are drawn in the time that it takes to begin with a window."""

Sphere = tuple[Float, float]
Box = tuple[int, int, int, int]
"""Top, left, bottom, right; the ends excluded."""


def on_screen(
    corners_m: npt.NDArray[Any], camera_to_world: npt.NDArray[np.float64], camera: Intrinsics
) -> Box | None:
    """The pixels in which a box of eight corners (8, 3) can be seen, None for none."""
    local = (corners_m - camera_to_world[:3, 3]) @ camera_to_world[:3, :3]
    depth = local[:, 2]
    if depth.max() < NEAREST_M:
        return None if depth.max() < -NEAREST_M else (0, 0, camera.height, camera.width)
    if depth.min() < NEAREST_M:
        return 0, 0, camera.height, camera.width
    x = camera.cx + camera.fx * local[:, 0] / depth
    y = camera.cy + camera.fy * local[:, 1] / depth
    slack = MARGIN_PIXELS + MARGIN_M * max(camera.fx, camera.fy) / float(depth.min())
    top, bottom = _span(y, slack, camera.height)
    left, right = _span(x, slack, camera.width)
    return (top, left, bottom, right) if top < bottom and left < right else None


def _span(values: npt.NDArray[np.float64], slack: float, size: int) -> tuple[int, int]:
    low, high = np.clip([values.min() - slack, values.max() + slack + 1], 0, size)
    return int(np.floor(low)), int(np.ceil(high))


def spheres(content: Content, geoms: Sequence[int]) -> Iterator[Sphere]:
    """Around the geoms of each instance."""
    groups: dict[int, list[int]] = {}
    for g in geoms:
        instance = int(content.instance[g])
        groups.setdefault(instance if instance >= 0 else -1 - g, []).append(g)
    for members in groups.values():
        corners = content.corners_m[members].reshape(-1, 3)
        centre = (corners.min(axis=0) + corners.max(axis=0)) / 2
        radius = float(np.sqrt(((corners - centre) ** 2).sum(axis=1).max()))
        yield centre.astype(np.float32), radius + MARGIN_M


def in_light(points_m: Float, reach_m: Float, lamp_m: Float, around: Iterable[Sphere]) -> Bool:
    """Points (n, 3) that one of the spheres may shade, or take ambient light from.

    Args:
        points_m: in the world.
        reach_m: (n,) how far ambient rays go.
        lamp_m: place of the key light.
        around: what has changed.
    """
    touched = np.zeros(len(points_m), dtype=bool)
    along = lamp_m - points_m
    length = np.maximum(dot(along, along), np.float32(1e-12))
    for centre, radius in around:
        to = centre - points_m
        touched |= dot(to, to) <= (reach_m + np.float32(radius)) ** 2
        to -= np.clip(dot(to, along) / length, 0, 1)[:, None] * along
        touched |= dot(to, to) <= np.float32((radius + LAMP_RADIUS_M) ** 2)
    return touched


FARTHEST_M = np.float32(max(AMBIENT_REACH_M))


def windows(dirty: Bool, pad: int) -> list[tuple[Box, Box]]:
    """Boxes that hold all that is dirty, each with the same box grown by `pad`; even corners."""
    height, width = dirty.shape
    rows, columns = -(-height // TILE), -(-width // TILE)
    padded = np.zeros((rows * TILE, columns * TILE), dtype=bool)
    padded[:height, :width] = dirty
    tiles = np.asarray(padded.reshape(rows, TILE, columns, TILE).any(axis=(1, 3)))
    found = []
    for one in _divided(tiles, 0, 0, pad):
        top, left, bottom, right = (TILE * n for n in one)
        box = top, left, min(bottom, height), min(right, width)
        low, far = min(box[2] + pad, height), min(box[3] + pad, width)
        found.append((box, (max(top - pad, 0), max(left - pad, 0), low, far)))
    return found


def _divided(tiles: Bool, top: int, left: int, pad: int) -> Iterator[Box]:
    """Boxes of tiles around what is set, cut in two as long as that makes them cheaper."""
    if not tiles.any():
        return
    down, across = np.flatnonzero(tiles.any(axis=1)), np.flatnonzero(tiles.any(axis=0))
    tiles = tiles[down[0] : down[-1] + 1, across[0] : across[-1] + 1]
    top, left = top + int(down[0]), left + int(across[0])
    rows, columns = tiles.shape
    least = float(_cost(np.array(rows), np.array(columns), pad))
    cut = None
    for axis, part in ((0, tiles), (1, tiles.T)):
        if len(part) > 1:
            before, after = _costs(part, pad)[:-1], _costs(part[::-1], pad)[::-1][1:]
            k = int((before + after).argmin())
            if before[k] + after[k] < least:
                least, cut = float(before[k] + after[k]), (axis, k + 1)
    if cut is None:
        yield top, left, top + rows, left + columns
    elif cut[0] == 0:
        yield from _divided(tiles[: cut[1]], top, left, pad)
        yield from _divided(tiles[cut[1] :], top + cut[1], left, pad)
    else:
        yield from _divided(tiles[:, : cut[1]], top, left, pad)
        yield from _divided(tiles[:, cut[1] :], top, left + cut[1], pad)


def _costs(tiles: Bool, pad: int) -> npt.NDArray[np.float64]:
    """For each k the cost of the box around what is set in the first k + 1 rows; the first is."""
    held = np.logical_or.accumulate(tiles, axis=0)
    width = tiles.shape[1] - held[:, ::-1].argmax(axis=1) - held.argmax(axis=1)
    last = np.maximum.accumulate(np.where(tiles.any(axis=1), np.arange(len(tiles)), 0))
    return _cost(last + 1, width, pad)


def _cost(
    rows: npt.NDArray[np.int64], columns: npt.NDArray[np.int64], pad: int
) -> npt.NDArray[np.float64]:
    return (TILE * rows + 2.0 * pad) * (TILE * columns + 2.0 * pad) + CALL_PIXELS


def area(boxes: Iterable[tuple[Box, Box]]) -> int:
    """Pixels of the outer boxes."""
    return sum(_area(outer) for _, outer in boxes)


def _area(box: Box) -> int:
    return (box[2] - box[0]) * (box[3] - box[1])
