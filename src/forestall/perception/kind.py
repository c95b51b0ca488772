"""Whether a picture is of the kind that an encoder of drawn pictures was made for.

Drawings are parted into smooth areas and edges; in photographs nothing is smooth: texture, blur and
uneven light are everywhere. Where a sensor's noise is all that differs from pixel to pixel, means
of four differ half as much, and nothing is left over in most of a picture. So what is left over is
looked at, in the middle one of all steps between neighbours. Called by `learned.py`.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from forestall.types.observation import Rgb

_ROWS = 480
"""Larger pictures are thinned to about so many rows."""

_LEAST_ROWS = 60
_LUMA = np.array([0.299, 0.587, 0.114], dtype=np.float32)


def roughness(rgb: Rgb) -> float:
    """How much of the usual step between neighbours is not noise, in steps of 255.

    The finer a picture, the smaller the steps along the same slope: what is found counts as in a
    picture of 480 rows.

    Args:
        rgb: (H, W, 3) uint8, of 60 rows and columns at least.
    """
    fine = _thinned(rgb.astype(np.float32) @ _LUMA, max(1, round(len(rgb) / _ROWS)))
    left_over = _usual_step(_thinned(fine, 2)) - _usual_step(fine) / 2
    return float(left_over * np.sqrt(len(fine) / _ROWS))


def of_its_kind(rgb: Rgb, most: float | None) -> bool:
    """Whether a picture is as smooth as an encoder's own; too small ones are let pass."""
    return most is None or min(rgb.shape[:2]) < _LEAST_ROWS or roughness(rgb) <= most


def _thinned(luma: npt.NDArray[np.float32], every: int) -> npt.NDArray[np.float32]:
    """Means of squares."""
    rows, columns = luma.shape[0] // every, luma.shape[1] // every
    cut = luma[: rows * every, : columns * every]
    mean: npt.NDArray[np.float32] = cut.reshape(rows, every, columns, every).mean(axis=(1, 3))
    return mean


def _usual_step(luma: npt.NDArray[np.float32]) -> float:
    """The median between neighbours, in every fourth row and in every fourth column."""
    along, across = np.diff(luma[::4], axis=1), np.diff(luma[:, ::4], axis=0)
    return float(np.median(np.abs(np.concatenate([along.ravel(), across.ravel()]))))
