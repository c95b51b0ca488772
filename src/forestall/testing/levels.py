"""How much of a run a world can repeat, and what differs between two observations.

Called by `conformance`; calls nothing. A world declares its level: a simulation that computes the
same each time repeats to the last bit; one with physics on a graphics card repeats as nearly as
`Tolerance` says; a robot repeats nothing, and is not asked for what makes no sense.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from enum import Enum
from typing import Any

import numpy as np

from forestall.types.observation import Frame, GripperState, Observation


class Level(Enum):
    """What a world is held to."""

    EXACT = "exact"
    TOLERANCE = "tolerance"
    HARDWARE = "hardware"


@dataclass(frozen=True, slots=True)
class Tolerance:
    """How far two runs of one seed may be apart.

    Args:
        length_m: depths, cameras, the robot and its hand.
        turn_rad: where a camera looks.
        colour: mean over a picture, of 255.
        share: of a picture's pixels that may differ further in depth or in what they show.
        time_s: clocks and durations.
    """

    length_m: float = 0.02
    turn_rad: float = 0.02
    colour: float = 8.0
    share: float = 0.02
    time_s: float = 0.5


NONE = Tolerance(0.0, 0.0, 0.0, 0.0, 0.0)


def differences(a: Observation, b: Observation, within: Tolerance) -> Iterator[str]:
    """What two observations do not share, in words."""
    if len(a.frames) != len(b.frames):
        yield "the number of frames"
        return
    for one, other in zip(a.frames, b.frames, strict=True):
        yield from _pictures(one, other, within)
    if a.graph != b.graph:
        yield "the scene graph"
    if a.told != b.told:
        yield "what somebody pointed at"
    if not _same_hand(a.gripper, b.gripper, within):
        yield "the gripper"
    if math.dist(a.robot_position_world_m, b.robot_position_world_m) > within.length_m:
        yield "the robot's position"
    if abs(a.time_s - b.time_s) > within.time_s:
        yield "time"


def _same_hand(a: GripperState, b: GripperState, within: Tolerance) -> bool:
    if within is NONE:
        return a == b
    same = (a.holding, a.released, a.name) == (b.holding, b.released, b.name)
    return same and math.dist(a.position_world_m, b.position_world_m) <= within.length_m


def _pictures(a: Frame, b: Frame, within: Tolerance) -> Iterator[str]:
    if a.rgb.shape != b.rgb.shape:
        yield "the size of a picture"
        return
    if _mean(a.rgb, b.rgb) > within.colour:
        yield "rgb"
    apart = np.abs(a.depth_m.astype(float) - b.depth_m) > within.length_m
    if float(apart.mean()) > within.share:
        yield "depth_m"
    turn = float(np.abs(a.camera_to_world[:3, :3] - b.camera_to_world[:3, :3]).max())
    moved = float(np.abs(a.camera_to_world[:3, 3] - b.camera_to_world[:3, 3]).max())
    if turn > within.turn_rad or moved > within.length_m:
        yield "camera_to_world"
    if not _same_things(a, b, within):
        yield "instance_ids"
    if within is NONE and a.instance_names != b.instance_names:
        yield "instance_names"


def _same_things(a: Frame, b: Frame, within: Tolerance) -> bool:
    """Whether the same pixels show the same things, whatever numbers these have."""
    if a.instance_ids is None or b.instance_ids is None:
        return a.instance_ids is b.instance_ids
    if within is NONE:
        return np.array_equal(a.instance_ids, b.instance_ids)
    different = _named(a) != _named(b)
    return float(different.mean()) <= within.share


def _named(frame: Frame) -> Any:
    """(H, W) texts: what each pixel shows."""
    names = np.array([*frame.instance_names, ""])
    return names[frame.instance_ids]


def _mean(a: Any, b: Any) -> float:
    return float(np.abs(a.astype(np.int16) - b.astype(np.int16)).mean())
