"""Units and axes of those who bring an observation, converted into ours at the edge.

Ours: metres, z-depth, camera x right, y down, z forward, world z up (`types/observation.py`).
Called by `folder.py` and `scenes.py`. Faults are an InputError that says what is allowed.
"""

from __future__ import annotations

from typing import Any, Literal

import numpy as np
import numpy.typing as npt

from forestall.errors import InputError, UnknownNameError
from forestall.types.observation import Depth, Intrinsics, Mask, Pose, Vec3

DEPTH_UNITS = {"m": 1.0, "cm": 0.01, "mm": 0.001}
"""Metres of one unit; a number gives them too: 0.0002 for depth in 1/5000 m."""

DepthKind = Literal["z", "ray"]
MaskKind = Literal["bool", "scores", "logits", "alpha"]
Up = Literal["x", "y", "z", "-x", "-y", "-z"]
CameraAxes = Literal["opencv", "opengl", "ros"]

_AXES: dict[str, npt.NDArray[np.float64]] = {
    "opencv": np.eye(3),
    "opengl": np.diag([1.0, -1.0, -1.0]),
    "ros": np.array([[0.0, 0.0, 1.0], [-1.0, 0.0, 0.0], [0.0, -1.0, 0.0]]),
}
"""Columns: our camera's right, down and forward in the axes of theirs (opengl: y up, z backwards;
ros: x forward, y left, z up)."""

_UPS: dict[str, npt.NDArray[np.float64]] = {
    "z": np.eye(3),
    "-z": np.diag([1.0, -1.0, -1.0]),
    "y": np.array([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]]),
    "-y": np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]]),
    "x": np.array([[0.0, 0.0, -1.0], [0.0, 1.0, 0.0], [1.0, 0.0, 0.0]]),
    "-x": np.array([[0.0, 0.0, 1.0], [0.0, 1.0, 0.0], [-1.0, 0.0, 0.0]]),
}
"""Turns of their world into ours."""

ROTATION_TOLERANCE = 0.005
"""How far an entry of a rotation may be from the nearest true one: two decimals are kept."""

MASK_THRESHOLDS = {"scores": 0.5, "logits": 0.0, "alpha": 0.5}
"""Above which a pixel belongs to a mask, where nothing else is declared."""


def unit_m(unit: str | float) -> float:
    """Metres of one unit of depth.

    Raises:
        UnknownNameError: a name that is none.
        InputError: a number that is not above 0.
    """
    if isinstance(unit, str):
        if unit not in DEPTH_UNITS:
            raise UnknownNameError("depth_unit", unit, DEPTH_UNITS)
        return DEPTH_UNITS[unit]
    if not (np.isfinite(unit) and unit > 0):
        raise InputError(f"depth_unit must be m, cm, mm or the metres of one unit, got {unit}")
    return float(unit)


def z_depth(
    raw: npt.NDArray[Any], camera: Intrinsics, unit: str | float, kind: DepthKind = "z"
) -> Depth:
    """(H, W) float32 z-depth in metres.

    Args:
        raw: (H, W) as measured; 0 where nothing returned.
        camera: for `kind` "ray".
        unit: "m", "cm", "mm", or the metres of one unit.
        kind: "z", along the camera's axis, or "ray", along the ray through the pixel.

    Raises:
        InputError: another shape, a value that is no distance, an unknown unit.
    """
    if raw.shape != (camera.height, camera.width):
        raise InputError(
            f"depth has the shape {raw.shape}, the picture has {(camera.height, camera.width)}"
        )
    if raw.dtype.kind not in "fiu":
        raise InputError(f"depth must be numbers, this is {raw.dtype}")
    bad = int(np.count_nonzero(~np.isfinite(raw)))
    if bad:
        raise InputError(f"depth has {bad} NaN or infinite values; write 0 where nothing returned")
    if bool((raw < 0).any()):
        raise InputError("depth is negative somewhere; it is a distance in front of the camera")
    with np.errstate(over="ignore"):
        depth = raw.astype(np.float64) * unit_m(unit)
        if kind == "ray":
            u = (np.arange(camera.width) - camera.cx) / camera.fx
            v = (np.arange(camera.height) - camera.cy) / camera.fy
            depth = depth / np.sqrt(1.0 + u[None, :] ** 2 + v[:, None] ** 2)
        metres: Depth = depth.astype(np.float32)
    if not bool(np.isfinite(metres).all()):
        raise InputError("distances that cannot be: depth is too large for a number")
    return metres


_EXACT = 1e-12
"""How far a rotation that was not rounded is from being one."""


def camera_pose(matrix: npt.ArrayLike, axes: CameraAxes = "opencv", up: Up = "z") -> Pose:
    """(4, 4) camera to world in our axes, with the nearest rotation.

    Args:
        matrix: (4, 4), or (3, 4) without its last row.
        axes: of the camera: "opencv", "opengl" or "ros".
        up: which axis of the world points up.

    Raises:
        InputError: no rotation, one that mirrors, numbers that are not finite.
    """
    given = np.asarray(matrix, dtype=np.float64)
    if given.shape == (3, 4):
        given = np.vstack([given, [0.0, 0.0, 0.0, 1.0]])
    if given.shape != (4, 4) or not bool(np.isfinite(given).all()):
        raise InputError("camera_to_world must be 4 rows of 4 finite numbers")
    if not np.allclose(given[3], [0.0, 0.0, 0.0, 1.0]):
        raise InputError(f"the last row of camera_to_world must be 0 0 0 1, got {given[3]}")
    pose = np.eye(4)
    pose[:3, :3] = _turn(up) @ nearest_rotation(given[:3, :3]) @ _known(_AXES, "camera_axes", axes)
    pose[:3, 3] = _turn(up) @ given[:3, 3]
    return pose


def place(position: npt.ArrayLike, up: Up = "z") -> Vec3:
    """A place in the world in our axes.

    Raises:
        InputError: not three finite numbers.
    """
    given = np.asarray(position, dtype=np.float64)
    if given.shape != (3,) or not bool(np.isfinite(given).all()):
        raise InputError(f"a place must be three finite numbers, got {position!r}")
    x, y, z = (float(v) for v in _turn(up) @ given)
    return (x, y, z)


def nearest_rotation(matrix: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
    """The nearest rotation of a matrix that is one but for rounding.

    Raises:
        InputError: it mirrors, or an entry is farther off than `ROTATION_TOLERANCE`.
    """
    if float(np.abs(matrix).max()) > 2.0:
        raise InputError("camera_to_world has no rotation in its upper left: entries above 1")
    off = float(np.abs(matrix @ matrix.T - np.eye(3)).max())
    if off < _EXACT and float(np.linalg.det(matrix)) > 0:
        return matrix  # what was written by us comes back to the bit
    left, _, right = np.linalg.svd(matrix)
    nearest: npt.NDArray[np.float64] = left @ right
    off = float(np.abs(nearest - matrix).max())
    if off > ROTATION_TOLERANCE:
        raise InputError(
            f"camera_to_world has no rotation in its upper left: {off:.2g} from the nearest one "
            f"(rounding explains {ROTATION_TOLERANCE:g})"
        )
    if float(np.linalg.det(nearest)) < 0:
        raise InputError(
            "camera_to_world is left-handed: it mirrors the world; turn one axis round, or declare "
            f"camera_axes ({', '.join(_AXES)})"
        )
    return nearest


def mask_of(
    raw: npt.NDArray[Any],
    shape: tuple[int, ...],
    kind: MaskKind | None = None,
    threshold: float | None = None,
) -> Mask:
    """(H, W) bool of one mask.

    Args:
        raw: (H, W); bool, or numbers.
        shape: of the picture.
        kind: "bool": non-zero is inside; "scores", "logits", "alpha": what is above the threshold.
            None: bool, if the numbers are two.
        threshold: in the mask's own numbers; 0.5 for scores (and half of the range of whole
            numbers), 0 for logits, half opaque for alpha where nothing is said.

    Raises:
        InputError: another shape, no numbers, NaN, or numbers whose meaning is not declared.
    """
    if raw.dtype.kind not in "biuf":
        raise InputError(f"a mask must be bool or numbers, this is {raw.dtype}")
    if raw.shape != tuple(shape):
        raise InputError(
            f"a mask has the shape {raw.shape}, the picture has {tuple(shape)}: give one (H, W) "
            "array a thing"
        )
    if raw.dtype.kind == "b":
        return raw.astype(np.bool_)
    if not bool(np.isfinite(raw).all()):
        raise InputError("a mask has NaN or infinite values")
    if kind in MASK_THRESHOLDS:
        return _above(raw, str(kind), threshold)
    if kind is None:
        values = np.unique(raw)
        if len(values) > 2 or (len(values) == 2 and values[0] != 0) or values[0] < 0:
            raise InputError(
                f"a mask has {len(values)} different values ({values[0]:g} to {values[-1]:g}): "
                "declare mask_kind (scores, logits or alpha) and mask_threshold, or write a bool "
                "mask"
            )
        if raw.dtype.kind == "f" and values[-1] not in (0.0, 1.0, 255.0):
            raise InputError(
                f"a mask has the values {', '.join(f'{v:g}' for v in values)}: scores are "
                "thresholded only where mask_kind is declared"
            )
    mask: Mask = raw != 0
    return mask


def _above(raw: npt.NDArray[Any], kind: str, threshold: float | None) -> Mask:
    least = MASK_THRESHOLDS[kind] if threshold is None else threshold
    if kind != "logits" and threshold is None and raw.dtype.kind in "iu":
        least *= float(np.iinfo(raw.dtype).max)
    if kind == "scores" and raw.dtype.kind == "f":
        low, high = float(raw.min()), float(raw.max())
        if low < 0 or high > 1:
            raise InputError(
                f"scores of a mask go from {low:g} to {high:g}: they must lie in [0, 1]; "
                "declare mask_kind logits if they are"
            )
    mask: Mask = raw > least
    return mask


def _known(
    table: dict[str, npt.NDArray[np.float64]], kind: str, name: str
) -> npt.NDArray[np.float64]:
    if name not in table:
        raise UnknownNameError(kind, name, table)
    return table[name]


def _turn(up: str) -> npt.NDArray[np.float64]:
    return _known(_UPS, "up axis", up)
