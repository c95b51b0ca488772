"""One camera with its detector and its mount: perfect frames in, what a robot would get out.

Errors are composed and each is 0 by default. Every draw depends on the seed, on how many
observations came before, and on the frame's place in its own: the same run has the same errors.
Called by `world.py` and by whoever replays observations; calls `depth.py` and `masks.py`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
import numpy.typing as npt

from forestall.errors import InputError, UnknownNameError
from forestall.sensors.depth import DEPTH_CAMERAS
from forestall.sensors.masks import miscalled, moved_outlines, without
from forestall.types.observation import Depth, Frame, Observation, Pose, Rgb

_MOST_OUTLINE_PX = 20


@dataclass(frozen=True, slots=True)
class Errors:
    """What a sensor gets wrong; 0 is nothing.

    Args:
        depth: camera: perfect, realsense (stereo), kinect (structured light) or tof.
        depth_noise: further deviation of depth at 1 m, in metres; it grows with its square.
        pose_cm: root mean square error of the camera's place, for each frame.
        pose_deg: of its direction.
        outline_px: up to how many pixels a mask is too wide or too narrow.
        missed: share of masks that are missing.
        least_px: masks of fewer pixels are missing, too.
        mislabelled: share of movable things that are called by another category.
        gain: brightness is off by up to this share.
        blur_px: length of motion blur, sideways.
        colour_noise: deviation of every colour value, of 255.
        identities: whether masks tell which thing they show, and not only its category.
    """

    depth: str = "perfect"
    depth_noise: float = 0.0
    pose_cm: float = 0.0
    pose_deg: float = 0.0
    outline_px: int = 0
    missed: float = 0.0
    least_px: int = 0
    mislabelled: float = 0.0
    gain: float = 0.0
    blur_px: int = 0
    colour_noise: float = 0.0
    identities: bool = True

    def __post_init__(self) -> None:
        if self.depth not in DEPTH_CAMERAS:
            raise UnknownNameError("depth camera", self.depth, DEPTH_CAMERAS)
        for name in ("missed", "mislabelled", "gain"):
            if not 0 <= getattr(self, name) <= 1:
                raise InputError(f"{name} of a sensor is a share from 0 to 1")
        for name in ("depth_noise", "pose_cm", "pose_deg", "least_px", "blur_px", "colour_noise"):
            if not 0 <= getattr(self, name) < float("inf"):
                raise InputError(f"{name} of a sensor is 0 or more")
        if not 0 <= self.outline_px <= _MOST_OUTLINE_PX:
            raise InputError(f"outline_px of a sensor is 0 to {_MOST_OUTLINE_PX}")


REALISTIC = Errors(
    depth="realsense",
    pose_cm=1.0,
    pose_deg=1.0,
    outline_px=2,
    missed=0.05,
    mislabelled=0.02,
    identities=False,
)
"""A stereo camera on an arm, and a good detector."""


@dataclass(slots=True)
class Sensor:
    """Makes of perfect observations what this sensor gives.

    Args:
        errors: what it gets wrong.
        labels: categories that its detector may confuse with each other.
    """

    errors: Errors
    labels: Sequence[str] = ()
    _seed: int = 0
    _count: int = field(default=0)

    def reset(self, seed: int) -> None:
        """A run begins."""
        self._seed, self._count = seed, 0

    def sense(self, observation: Observation) -> Observation:
        """The observation as this sensor gives it; hands, time and place are the robot's own."""
        self._count += 1
        frames = tuple(
            self._frame(f, np.random.default_rng((self._seed, self._count, i)))
            for i, f in enumerate(observation.frames)
        )
        return replace(observation, frames=frames)

    def _frame(self, frame: Frame, rng: np.random.Generator) -> Frame:
        errors = self.errors
        depth = DEPTH_CAMERAS[errors.depth](frame.depth_m, frame.intrinsics, rng)
        depth = _noisy(depth, errors.depth_noise, rng)
        ids, names = frame.instance_ids, frame.instance_names
        if ids is not None:
            ids = without(ids, errors.missed, errors.least_px, rng)
            ids = moved_outlines(ids, errors.outline_px, rng)
            names = miscalled(names, self.labels, errors.mislabelled, rng)
        return replace(
            frame,
            rgb=_exposed(frame.rgb, errors, rng),
            depth_m=frame.depth_m if frame.colour_only else depth,
            camera_to_world=_mounted(frame.camera_to_world, errors, rng),
            instance_ids=ids,
            instance_names=names,
        )


def _noisy(depth_m: Depth, at_1_m: float, rng: np.random.Generator) -> Depth:
    """Depth with noise that grows with its square, as disparity has it."""
    if at_1_m == 0:
        return depth_m
    noise = rng.standard_normal(depth_m.shape, dtype=np.float32)
    noisy: Depth = np.maximum(depth_m + np.float32(at_1_m) * depth_m**2 * noise, 0.0)
    return noisy


def _mounted(pose: Pose, errors: Errors, rng: np.random.Generator) -> Pose:
    """Where the robot believes its camera to be."""
    from scipy.spatial.transform import Rotation

    turn, shift = rng.normal(size=3), rng.normal(size=3)
    if errors.pose_cm == 0 and errors.pose_deg == 0:
        return pose
    each = 1.0 / np.sqrt(3.0)
    believed = pose.copy()
    wrong = Rotation.from_rotvec(np.deg2rad(errors.pose_deg) * each * turn).as_matrix()
    believed[:3, :3] = wrong @ pose[:3, :3]
    believed[:3, 3] += errors.pose_cm / 100.0 * each * shift
    return believed


def _exposed(rgb: Rgb, errors: Errors, rng: np.random.Generator) -> Rgb:
    """Colours with exposure, motion blur and noise."""
    from scipy import ndimage

    if errors.gain == 0 and errors.blur_px == 0 and errors.colour_noise == 0:
        return rgb
    values: npt.NDArray[np.floating[Any]] = rgb * (1 + errors.gain * rng.uniform(-1, 1))
    if errors.blur_px > 1:
        values = ndimage.uniform_filter1d(values, errors.blur_px, axis=1)
    values = values + errors.colour_noise * rng.normal(size=rgb.shape)
    exposed: Rgb = np.clip(np.rint(values), 0, 255).astype(np.uint8)
    return exposed
