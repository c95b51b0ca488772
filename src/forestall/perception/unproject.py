"""From masks and depth to one clean cloud per instance, in the world frame.

All instances of a frame are reduced together: one integer key holds instance and voxel, one sort
does the thinning, and outliers fall to a count of neighbours on a coarser grid (REFLECT voxelises
and removes outliers one cloud at a time). Called by the perceiver.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
import numpy.typing as npt

from forestall.perception.config import PerceptionConfig
from forestall.types.observation import Depth, Detection, Frame, Intrinsics, Pose

Points = npt.NDArray[np.float64]
Labels = npt.NDArray[np.int16]

_GRID_BITS = 14
_GRID_HALF = 1 << (_GRID_BITS - 1)
_COARSE = 2  # bits: a coarse cell is four voxels wide


@dataclass(frozen=True, slots=True, eq=False)
class Cloud:
    """What one mask shows of an object.

    `points_world_m` is (n, 3), sorted by voxel; `low_m`, `high_m` and `centroid_m` are (3,).
    `pixels` counts the mask.
    """

    points_world_m: Points
    low_m: Points
    high_m: Points
    centroid_m: Points
    pixels: int


def label_image(detections: Sequence[Detection], shape: tuple[int, int]) -> Labels:
    """(H, W) int16: index of the detection at each pixel, -1 for none.

    Where masks overlap, the smaller one lies on top.
    """
    sizes = [int(np.count_nonzero(d.mask)) for d in detections]
    keys = [d.instance or d.category for d in detections]
    labels: Labels = np.full(shape, -1, dtype=np.int16)
    for i in sorted(range(len(detections)), key=lambda i: (-sizes[i], keys[i])):
        np.copyto(labels, np.int16(i), where=detections[i].mask)
    return labels


@lru_cache(maxsize=4)
def _lattice(width: int, height: int) -> npt.NDArray[np.uint16]:
    """Column | row: its low k bits are zero on a lattice of stride 2^k."""
    u = np.arange(width, dtype=np.uint16)
    v = np.arange(height, dtype=np.uint16)
    return (u[None, :] | v[:, None]).ravel()


@lru_cache(maxsize=4)
def rays(k: Intrinsics) -> tuple[npt.NDArray[np.float32], npt.NDArray[np.float32]]:
    """(W,) x of each column's and (H,) y of each row's rays at z = 1."""
    x = (np.arange(k.width, dtype=np.float32) - np.float32(k.cx)) / np.float32(k.fx)
    y = (np.arange(k.height, dtype=np.float32) - np.float32(k.cy)) / np.float32(k.fy)
    return x, y


def heights(
    depth_m: Depth,
    x: npt.NDArray[np.float32],
    y: npt.NDArray[np.float32],
    camera_to_world: Pose,
) -> npt.NDArray[np.float32]:
    """(h, w) height in the world of each pixel; x and y are those of its ray at z = 1."""
    row = camera_to_world[2].astype(np.float32)
    along = (x * row[0])[None, :] + (y * row[1] + row[2])[:, None]
    found: npt.NDArray[np.float32] = depth_m * along + row[3]
    return found


@lru_cache(maxsize=4)
def _each_ray(k: Intrinsics) -> npt.NDArray[np.float32]:
    """(H·W, 2) x and y of the ray through each pixel at z = 1."""
    x, y = rays(k)
    return np.stack(np.broadcast_arrays(x[None, :], y[:, None]), axis=-1).reshape(-1, 2)


def project(
    points_world_m: Points, intrinsics: Intrinsics, camera_to_world: Pose
) -> tuple[npt.NDArray[np.int64], npt.NDArray[np.int64], Points, npt.NDArray[np.bool_]]:
    """Pixel columns, rows, z-depth and whether each point falls into the image."""
    local = (points_world_m - camera_to_world[:3, 3]) @ camera_to_world[:3, :3]
    z = local[:, 2]
    ahead = z > 0.05
    safe = np.where(ahead, z, 1.0)
    u = np.rint(local[:, 0] / safe * intrinsics.fx + intrinsics.cx)
    v = np.rint(local[:, 1] / safe * intrinsics.fy + intrinsics.cy)
    inside = ahead & (u >= 0) & (u < intrinsics.width) & (v >= 0) & (v < intrinsics.height)
    column = np.where(inside, u, 0).astype(np.int64)
    row = np.where(inside, v, 0).astype(np.int64)
    return column, row, z, inside


def clouds(
    frame: Frame,
    labels: Labels,
    voxel_m: Sequence[float],
    config: PerceptionConfig,
    in_one_piece: Sequence[bool] = (),
) -> list[Cloud | None]:
    """One cloud for each detection (None where no depth returned under its mask).

    Args:
        frame: depth and camera.
        labels: (H, W) index of the detection at each pixel, -1 for none.
        voxel_m: edge of the thinning grid for each detection.
        config: thresholds.
        in_one_piece: for each detection, whether points far apart along the line of sight cannot
            all be its own; no one if left out.
    """
    count = len(voxel_m)
    flat = labels.ravel()
    pixels = np.bincount(flat + 1, minlength=count + 1)[1:]
    if count == 0:
        return []
    low_bits = strides(pixels, config) - 1
    index, owner = _sampled_pixels(frame, flat, low_bits)
    points = _to_world(frame, index)
    worth = np.square(low_bits + 1, dtype=np.float64)
    facing = _facing_px(frame, points, np.asarray(voxel_m)[owner], config)
    owner, points, weights = _thin(points, owner, np.asarray(voxel_m), worth, facing, config)
    starts = np.searchsorted(owner, np.arange(count + 1))
    result: list[Cloud | None] = []
    for i in range(count):
        own = points[starts[i] : starts[i + 1]]
        if len(own) == 0:
            result.append(None)
            continue
        worth_px = weights[starts[i] : starts[i + 1]]
        if in_one_piece and in_one_piece[i]:
            kept = _own(own, worth_px, frame.camera_to_world[:3, 3], config)
            own, worth_px = own[kept], worth_px[kept]
        low, high = robust_box(own, config.box_percentile)
        centroid = np.average(own, axis=0, weights=worth_px)
        result.append(Cloud(own, low, high, centroid, int(pixels[i])))
    return result


def _own(
    points: Points, weights: Points, eye_world_m: Points, config: PerceptionConfig
) -> npt.NDArray[np.bool_]:
    """Which points of a thing of one piece are its own, and not far before or behind it.

    Where a mask is a pixel too wide, it shows a little of what is behind.
    """
    away = np.linalg.norm(points - eye_world_m, axis=1)
    order = np.argsort(away, kind="stable")
    part = np.empty(len(away), dtype=np.int64)
    part[order] = np.cumsum(np.diff(away[order], prepend=away[order[0]]) > config.stray_gap_m)
    share = np.bincount(part, weights=weights) / weights.sum()
    own: npt.NDArray[np.bool_] = (share >= min(config.stray_share, float(share.max())))[part]
    return own


def robust_box(points_m: Points, share: float) -> tuple[Points, Points]:
    """Lower and upper corner without the outermost share of points at each end of each axis."""
    cut = int(len(points_m) * share)
    if cut == 0:
        return points_m.min(axis=0), points_m.max(axis=0)
    ordered = np.partition(points_m, (cut, len(points_m) - 1 - cut), axis=0)
    return ordered[cut], ordered[len(points_m) - 1 - cut]


def strides(pixels: npt.NDArray[np.int64], config: PerceptionConfig) -> npt.NDArray[np.int64]:
    """For each mask, the stride of the lattice on which it is unprojected, a power of two."""
    stride = np.sqrt(np.maximum(pixels / config.max_points, 1.0))
    wanted = np.left_shift(1, np.ceil(np.log2(stride)).astype(np.int64))
    every: npt.NDArray[np.int64] = np.minimum(wanted, config.max_stride)
    return every


def _sampled_pixels(
    frame: Frame, flat: Labels, low_bits: npt.NDArray[np.int64]
) -> tuple[npt.NDArray[np.int64], npt.NDArray[np.int64]]:
    """Flat indices and labels of the pixels that are unprojected."""
    table = np.append(low_bits, 0).astype(np.uint16)
    lattice = _lattice(frame.intrinsics.width, frame.intrinsics.height)
    keep = (lattice & table.take(flat)) == 0
    keep &= flat >= 0
    keep &= frame.depth_m.ravel() > 0
    index = np.flatnonzero(keep)
    return index, flat[index].astype(np.int64)


def _to_world(frame: Frame, index: npt.NDArray[np.int64]) -> Points:
    rays = _each_ray(frame.intrinsics).take(index, axis=0)
    depth = frame.depth_m.ravel()[index]
    local = np.empty((len(index), 3))
    local[:, :2] = rays * depth[:, None]
    local[:, 2] = depth
    world: Points = local @ frame.camera_to_world[:3, :3].T + frame.camera_to_world[:3, 3]
    return world


def _thin(
    points: Points,
    owner: npt.NDArray[np.int64],
    voxel_m: Points,
    worth: Points,
    facing_px: Points,
    config: PerceptionConfig,
) -> tuple[npt.NDArray[np.int64], Points, Points]:
    """Voxel means, outliers removed: owner, point and pixels of each voxel, by owner.

    `worth` is how many pixels a sampled one of each owner stands for, `facing_px` how many a
    surface that faces the camera would show in a coarse cell at each point.
    """
    cell = np.floor(points / voxel_m[owner][:, None]).astype(np.int64) + _GRID_HALF
    np.clip(cell, 0, 2 * _GRID_HALF - 1, out=cell)
    key = _key(owner, cell)
    order = np.argsort(key, kind="stable")
    key = key[order]
    starts = np.flatnonzero(np.diff(key, prepend=-1))
    weights = np.diff(starts, append=len(key)).astype(np.float64)
    if len(starts) == 0:
        return owner, points, weights
    means = np.add.reduceat(points[order], starts, axis=0) / weights[:, None]
    first = order[starts]
    weights *= worth[owner[first]]
    own = owner[first]
    held = _held(own, cell[first] >> _COARSE, weights)
    keep = held >= config.min_cell_support
    dense = keep & (held >= config.sparse_share * facing_px[first])
    all_px, left_px = (np.bincount(own, weights * f, len(voxel_m)) for f in (keep, dense))
    keep = np.where((left_px >= config.dense_share * all_px)[own], dense, keep)
    return own[keep], means[keep], weights[keep]


def _facing_px(frame: Frame, points: Points, voxel_m: Points, config: PerceptionConfig) -> Points:
    """(n,) pixels that a surface facing the camera shows in a coarse cell at each point.

    None for furniture, which is seen at grazing angles.
    """
    pose, k = frame.camera_to_world, frame.intrinsics
    away_m = np.maximum((points - pose[:3, 3]) @ pose[:3, 2], 0.05)
    facing: Points = np.square(voxel_m * (1 << _COARSE) / away_m) * (k.fx * k.fy)
    facing[voxel_m >= config.fixture_voxel_m] = 0.0
    return facing


def _key(owner: npt.NDArray[np.int64], cell: npt.NDArray[np.int64]) -> npt.NDArray[np.int64]:
    key = owner
    for axis in range(3):
        key = (key << _GRID_BITS) | cell[:, axis]
    return key


def _held(owner: npt.NDArray[np.int64], coarse: npt.NDArray[np.int64], weights: Points) -> Points:
    """How many pixels a voxel's coarse cell with its six neighbours holds."""
    key = _key(owner, coarse)
    cells, inverse = np.unique(key, return_inverse=True)
    held = np.bincount(inverse, weights=weights)
    total: Points = held.astype(np.float64)
    for step in (1, 1 << _GRID_BITS, 1 << (2 * _GRID_BITS)):
        at = np.searchsorted(cells, cells + step)
        hit = np.flatnonzero(
            (at < len(cells)) & (cells[np.minimum(at, len(cells) - 1)] - step == cells)
        )
        np.add.at(total, hit, held[at[hit]])
        np.add.at(total, at[hit], held[hit])
    return total[inverse]
