"""What neighbours in the picture have to do with each other; called by its makers."""

from __future__ import annotations

import numpy as np

from forestall.worlds.kitchen.rendering.tracer import Bool, Float, Int
from forestall.worlds.kitchen.rendering.vectors import dot

LEAST_CONTRAST = 0.025
"""Steps of the square root of linear colour that are worth smoothing (full scale is 1)."""


def discontinuities(geom: Int, normal: Float, depth_m: Float) -> Bool:
    """(h, w) pixels with a neighbour that shows another geom, facing or distance."""
    inverse = 1 / np.where(depth_m > 0, depth_m, np.float32(1e3))
    edges = np.zeros(geom.shape, dtype=bool)
    for first, second in (
        (np.s_[:, :-1], np.s_[:, 1:]),
        (np.s_[:-1], np.s_[1:]),
    ):
        here, there = inverse[first], inverse[second]
        turn = dot(normal[first], normal[second])
        step = np.abs(here - there) > 0.04 * np.minimum(here, there)
        hit = geom[first] >= 0
        jump = (geom[first] != geom[second]) | (hit & ((turn < 0.85) | step))
        edges[first] |= jump
        edges[second] |= jump
    return edges


def contrasts(colour: Float) -> Bool:
    """(h, w) pixels that differ visibly from a neighbour."""
    tone = np.sqrt(colour)
    out = np.zeros(colour.shape[:2], dtype=bool)
    for first, second in ((np.s_[:, :-1], np.s_[:, 1:]), (np.s_[:-1], np.s_[1:])):
        step = np.abs(tone[first] - tone[second]) > LEAST_CONTRAST
        visible = step[..., 0] | step[..., 1] | step[..., 2]
        out[first] |= visible
        out[second] |= visible
    return out


def grown(mask: Bool, by: int) -> Bool:
    """A mask with everything within `by` pixels (square neighbourhood) added."""
    out = mask.copy()
    for _ in range(by):
        row = out.copy()
        row[:, 1:] |= out[:, :-1]
        row[:, :-1] |= out[:, 1:]
        out = row.copy()
        out[1:] |= row[:-1]
        out[:-1] |= row[1:]
    return out


def enlarged(grid: Float, height: int, width: int) -> Float:
    """Bilinear enlargement by 2: grid samples stay where they were taken."""
    tall = np.empty((height, grid.shape[1], grid.shape[2]), np.float32)
    tall[::2] = grid
    below = np.concatenate([grid[1:], grid[-1:]])
    tall[1::2] = 0.5 * (grid + below)[: height // 2]
    out = np.empty((height, width, grid.shape[2]), np.float32)
    out[:, ::2] = tall
    right = np.concatenate([tall[:, 1:], tall[:, -1:]], axis=1)
    out[:, 1::2] = 0.5 * (tall + right)[:, : width // 2]
    return out
