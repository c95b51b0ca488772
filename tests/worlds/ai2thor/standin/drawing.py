"""Casts rays at boxes: colour, z-depth and which thing, as the Unity side would draw them.

Coordinates are AI2-THOR's: left-handed, metres, y up; yaw clockwise from +z, horizon downwards.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

NEAR_M, FAR_M = 0.1, 20.0
_LIGHT = np.array([0.75, 1.0, 0.85])  # how bright a face is that looks along x, y, z


@dataclass(frozen=True)
class Part:
    """One box of a thing: whose, low and high corner, colour."""

    owner: int
    low: tuple[float, float, float]
    high: tuple[float, float, float]
    colour: tuple[int, int, int]


def axes(yaw_deg: float, horizon_deg: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """The camera's right, up and forward."""
    yaw, down = math.radians(yaw_deg), math.radians(horizon_deg)
    right = np.array([math.cos(yaw), 0.0, -math.sin(yaw)])
    flat = np.array([math.sin(yaw), 0.0, math.cos(yaw)])
    forward = math.cos(down) * flat + np.array([0.0, -math.sin(down), 0.0])
    up = math.sin(down) * flat + np.array([0.0, math.cos(down), 0.0])
    return right, up, forward


def draw(
    parts: Sequence[Part],
    eye: Sequence[float],
    looks: tuple[float, float],
    size: tuple[int, int],
    fov_deg: float,
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """(H, W, 3) uint8 colours, (H, W) float32 z-depth, (H, W) int32 owners, -1 for nothing.

    `looks` are yaw and horizon, `size` is width and height.
    """
    width, height = size
    focal = 0.5 * height / math.tan(math.radians(fov_deg) / 2)
    right, up, forward = axes(*looks)
    origin = np.asarray(eye, dtype=float)
    u = (np.arange(width) - (width - 1) / 2) / focal
    v = (np.arange(height) - (height - 1) / 2) / focal
    with np.errstate(divide="ignore"):
        inverse = [
            1.0 / (forward[i] + u[None, :] * right[i] - v[:, None] * up[i]) for i in range(3)
        ]
    depth = np.full((height, width), FAR_M, dtype=np.float64)
    owner = np.full((height, width), -1, dtype=np.int32)
    rgb = np.full((height, width, 3), 235, dtype=np.uint8)
    for part in parts:
        low, high = np.asarray(part.low) - origin, np.asarray(part.high) - origin
        window = _window(low, high, (right, up, forward), focal, size)
        if window is None:
            continue
        rows, columns = window
        first, leaves = [], None
        with np.errstate(invalid="ignore"):
            for i in range(3):
                rate = inverse[i][rows, columns]
                a, b = low[i] * rate, high[i] * rate
                first.append(np.fmin(a, b))
                last = np.fmax(a, b)
                leaves = last if leaves is None else np.minimum(leaves, last)
        enters = np.maximum(np.maximum(first[0], first[1]), first[2])
        hit = (enters <= leaves) & (enters > NEAR_M) & (enters < depth[rows, columns])
        if not hit.any():
            continue
        face = np.where(enters == first[0], 0, np.where(enters == first[1], 1, 2))[hit]
        shade = _LIGHT[face][:, None] * np.asarray(part.colour)
        depth[rows, columns][hit] = enters[hit]
        owner[rows, columns][hit] = part.owner
        rgb[rows, columns][hit] = shade.astype(np.uint8)
    return rgb, depth.astype(np.float32), owner


def _window(
    low: np.ndarray,
    high: np.ndarray,
    camera: tuple[np.ndarray, np.ndarray, np.ndarray],
    focal: float,
    size: tuple[int, int],
) -> tuple[slice, slice] | None:
    """Rows and columns that a box can show in; None for none."""
    right, up, forward = camera
    corners = np.array(
        [[(low, high)[i][0], (low, high)[j][1], (low, high)[k][2]]
         for i in (0, 1) for j in (0, 1) for k in (0, 1)]
    )  # fmt: skip
    ahead = corners @ forward
    if (ahead <= NEAR_M).all():
        return None
    width, height = size
    if (ahead <= NEAR_M).any():
        return slice(0, height), slice(0, width)
    columns = corners @ right / ahead * focal + (width - 1) / 2
    rows = -(corners @ up) / ahead * focal + (height - 1) / 2
    left, top = max(0, math.floor(columns.min())), max(0, math.floor(rows.min()))
    end, bottom = min(width, math.ceil(columns.max()) + 1), min(height, math.ceil(rows.max()) + 1)
    return (slice(top, bottom), slice(left, end)) if left < end and top < bottom else None
