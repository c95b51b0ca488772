"""Whether a picture is of the kind that an encoder of drawn pictures was made for.

Drawings are parted into smooth areas and edges; in photographs nothing is smooth: texture, blur and
uneven light are everywhere. So the steps between neighbours in a picture thinned to some 60 rows
(which averages the noise of a sensor away) are looked at: those at edges over the usual ones.
Called by `learned.py`.
"""

from __future__ import annotations

import numpy as np

from forestall.types.observation import Rgb

_ROWS = 60
_LUMA = np.array([0.299, 0.587, 0.114], dtype=np.float32)
_LEAST_STEP = 0.3  # of 255: less cannot be told from rounding
_EDGE, _USUAL = 97, 50  # percentiles of steps


def edge_contrast(rgb: Rgb) -> float:
    """Logarithm of the steps at edges over the usual steps between neighbours.

    Args:
        rgb: (H, W, 3) uint8, of 60 rows and columns at least.
    """
    every = max(1, len(rgb) // _ROWS)
    rows, columns = rgb.shape[0] // every, rgb.shape[1] // every
    cut = rgb[: rows * every, : columns * every].astype(np.float32) @ _LUMA
    thin = cut.reshape(rows, every, columns, every).mean(axis=(1, 3))
    steps = np.abs(np.concatenate([np.diff(thin, axis=0).ravel(), np.diff(thin, axis=1).ravel()]))
    edge, usual = np.percentile(steps, (_EDGE, _USUAL))
    return float(np.log((edge + _LEAST_STEP) / (usual + _LEAST_STEP)))


def of_its_kind(rgb: Rgb, least: float | None) -> bool:
    """Whether a picture is parted as sharply as an encoder's own; too small ones are let pass."""
    return least is None or min(rgb.shape[:2]) < _ROWS or edge_contrast(rgb) >= least
