"""Image features small enough to lie in every node: one signed byte for each number.

Called by perception (writes) and comparison (reads); calls nothing. Only the direction of a feature
counts, so its length is dropped: component x of a vector v becomes round(127 * x / max |v|), and
reading scales the row of whole numbers back to unit length.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from forestall.errors import InputError

LARGEST = 127


def quantised(vector: npt.ArrayLike) -> bytes:
    """One byte for each component of a vector (d,), int8, the largest component at ±127.

    Raises:
        InputError: not one row of numbers, not finite, or without a direction (all zero).
    """
    row = np.asarray(vector, dtype=np.float64)
    if row.ndim != 1 or not np.isfinite(row).all() or not row.any():
        raise InputError(
            f"a feature is one row of finite numbers that are not all zero, got {row.shape}"
        )
    whole: npt.NDArray[np.int8] = np.rint(row * (LARGEST / np.abs(row).max())).astype(np.int8)
    return whole.tobytes()


def whole_numbers(feature: bytes) -> npt.NDArray[np.int8]:
    """(d,) int8 behind the bytes, not scaled.

    Raises:
        InputError: no bytes, or all of them zero.
    """
    row = np.frombuffer(feature, dtype=np.int8)
    if not row.any():
        raise InputError("an image feature has no direction: its bytes are empty or all zero")
    return row


def unquantised(feature: bytes) -> npt.NDArray[np.float32]:
    """(d,) float32 of unit length.

    Raises:
        InputError: no bytes, or all of them zero.
    """
    row = whole_numbers(feature).astype(np.float64)
    unit: npt.NDArray[np.float32] = (row / np.linalg.norm(row)).astype(np.float32)
    return unit
