"""Depth as cameras give it: noise that grows with distance, steps, holes, mixed pixels, a range.

Each function takes true z-depth and gives measured z-depth, 0 where nothing returned. Called by
`sensor.py`. Sources:

- structured light (Kinect): Nguyen, Izadi, Lovell, "Modeling Kinect Sensor Noise for Improved 3D
  Reconstruction and Tracking", 3DIMPVT 2012 (axial noise, and 0.8 pixels sideways); Khoshelham,
  Elberink, "Accuracy and Resolution of Kinect Depth Data", Sensors 12 (2012) (steps of disparity;
  the shadow of the projector at edges).
- stereo (RealSense D400): the theory of stereo, deviation = subpixel · z² / (f · baseline), with
  Intel's 0.08 pixels ("Best-Known-Methods for Tuning Intel RealSense D400 Depth Cameras", 2018).
- time of flight (Kinect v2): Fankhauser et al., "Kinect v2 for Mobile Robot Navigation: Evaluation
  and Modeling", ICAR 2015 (axial noise); mixed pixels at edges.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np
import numpy.typing as npt

from forestall.types.observation import Depth, Intrinsics

Floats = npt.NDArray[np.float64]
DepthCamera = Callable[[Depth, Intrinsics, np.random.Generator], Depth]

_EDGE = 0.03  # step to a neighbour, as a share of the distance, that is an edge
_SUBPIXEL, _STEREO_BASELINE_M = 0.08, 0.05
_LIGHT_BASELINE_M, _LIGHT_STEPS = 0.075, 8
_SIDEWAYS_PX = 0.8
_BLOBS, _BLOB_PX = 12, 6


def perfect(depth_m: Depth, camera: Intrinsics, rng: np.random.Generator) -> Depth:
    """As drawn."""
    return depth_m


def stereo(depth_m: Depth, camera: Intrinsics, rng: np.random.Generator) -> Depth:
    """An active stereo camera: noise by the square of distance, holes at edges and in blobs."""
    from scipy import ndimage

    z = depth_m.astype(np.float64)
    rough = ndimage.gaussian_filter(rng.normal(size=z.shape), 0.7)
    rough /= rough.std()
    z += rough * z * z * _SUBPIXEL / (camera.fx * _STEREO_BASELINE_M)
    z[_edges(depth_m) & (rng.random(z.shape) < 0.6)] = 0.0
    for _ in range(_BLOBS):
        row, column = rng.integers(z.shape[0]), rng.integers(z.shape[1])
        z[row : row + _BLOB_PX, column : column + _BLOB_PX] = 0.0
    return _within(z, depth_m, 0.2, 10.0)


def structured_light(depth_m: Depth, camera: Intrinsics, rng: np.random.Generator) -> Depth:
    """A Kinect: pixels sideways, axial noise, steps of disparity, a shadow at edges."""
    height, width = depth_m.shape
    up, sideways = rng.normal(0, _SIDEWAYS_PX, (2, height, width))
    rows = np.rint(np.arange(height)[:, None] + up).astype(np.int64).clip(0, height - 1)
    columns = np.rint(np.arange(width)[None, :] + sideways).astype(np.int64).clip(0, width - 1)
    z = depth_m[rows, columns].astype(np.float64)
    z += rng.normal(size=z.shape) * (0.0012 + 0.0019 * (z - 0.4) ** 2)
    reach = camera.fx * _LIGHT_BASELINE_M
    disparity = np.rint(_LIGHT_STEPS * reach / np.maximum(z, 0.1)) / _LIGHT_STEPS
    z = reach / np.maximum(disparity, 1.0 / _LIGHT_STEPS)
    z[_shadow(depth_m, reach)] = 0.0
    return _within(z, depth_m, 0.4, 5.0)


def time_of_flight(depth_m: Depth, camera: Intrinsics, rng: np.random.Generator) -> Depth:
    """A Kinect v2: noise that grows with distance and slant, mixed pixels at edges."""
    from scipy import ndimage

    z = depth_m.astype(np.float64)
    slope = np.hypot(*np.gradient(z)) * camera.fx / np.maximum(z, 0.1)
    slant = np.minimum(np.arctan(slope), np.deg2rad(80.0))
    millimetres = 1.5 - 0.5 * z + 0.3 * z**2 + 0.1 * z**1.5 * (slant / (np.pi / 2 - slant)) ** 2
    mixed = ndimage.uniform_filter(z, 3)
    edge = _edges(depth_m)
    z[edge] = mixed[edge]
    z += rng.normal(size=z.shape) * np.maximum(millimetres, 0.5) / 1000.0
    return _within(z, depth_m, 0.5, 4.5)


DEPTH_CAMERAS: Mapping[str, DepthCamera] = {
    "perfect": perfect,
    "realsense": stereo,
    "kinect": structured_light,
    "tof": time_of_flight,
}
"""Every depth camera by name."""


def _edges(depth_m: Depth) -> npt.NDArray[np.bool_]:
    """(H, W) pixels at a step of depth."""
    from scipy import ndimage

    far = ndimage.maximum_filter(depth_m, 3)
    near = ndimage.minimum_filter(depth_m, 3)
    edges: npt.NDArray[np.bool_] = far - near > _EDGE * np.maximum(near, 0.1)
    return edges


def _shadow(depth_m: Depth, reach: float) -> npt.NDArray[np.bool_]:
    """(H, W) pixels that the projector, to the right of the camera, does not reach."""
    disparity = reach / np.maximum(depth_m.astype(np.float64), 0.1)
    column = np.arange(depth_m.shape[1])
    place = column[None, :] + disparity  # where the projector's ray to each pixel passes
    nearest = np.maximum.accumulate(place, axis=1)
    shadow: npt.NDArray[np.bool_] = place < nearest - 1.0
    return shadow


def _within(z: Floats, true_m: Depth, least_m: float, most_m: float) -> Depth:
    """Measured depth, 0 out of range and where there was none."""
    z[(z < least_m) | (z > most_m) | (true_m <= 0)] = 0.0
    measured: Depth = z.astype(np.float32)
    return measured
