"""The input gate: one pass over an observation that names what cannot be.

`inspect` is pure. Called by the perceiver before anything is believed; calls `gate_masks.py` and
`gate_scene.py`, which look at each picture on a coarse lattice (`coarse.py`). What only several
observations show is `gate_time.py`'s.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence

import numpy as np

from forestall.domain.model import Domain
from forestall.perception.coarse import Coarse, Masks
from forestall.perception.gate_config import GateConfig
from forestall.perception.gate_masks import judge_masks
from forestall.perception.gate_scene import judge_hand, judge_scene
from forestall.types.finding import Finding
from forestall.types.observation import Frame, Intrinsics, Observation

__all__ = ["Masks", "inspect"]


def inspect(
    observation: Observation,
    domain: Domain | None = None,
    config: GateConfig | None = None,
    masks: Sequence[Masks] | None = None,
) -> tuple[Finding, ...]:
    """Everything about an observation that cannot be, and what ought to be known of it.

    Args:
        observation: pictures, or a scene graph, of which only times and places are looked at.
        domain: says how large things are, what lies flat, what moves; without it fewer checks.
        config: limits.
        masks: of each frame, where a segmenter found them; else those that the frames bring.

    Returns:
        Findings, the plainest first; `refuse` of `types/finding.py` raises those that refuse.
    """
    limits = config or GateConfig()
    findings = list(_numbers(observation))
    if findings:
        return tuple(findings)
    scores: list[float] = []
    looks: list[Coarse] = []
    for index, frame in enumerate(observation.frames):
        found = None if masks is None else masks[index]
        own = frame.detections if found is None else found.detections
        scores += [d.score for d in own or ()]
        if frame.colour_only:
            findings += _colour(frame, index, limits)
            continue
        plain = [*_camera(frame.intrinsics, index, limits)]
        plain += _pose(frame, observation, index, limits)
        plain += _colour(frame, index, limits)
        look = Coarse.of(frame, found, limits.rows)
        plain += _depth(look, index, limits)
        findings += plain
        if not plain:
            looks.append(look)
            findings += judge_masks(look, index, domain, limits)
            findings += judge_scene(look, index, observation, domain, limits)
    findings += _scores(scores, limits)
    if looks:
        for hand in observation.hands:
            findings += judge_hand(looks[-1], hand, limits)
    return tuple(findings)


def _numbers(observation: Observation) -> Iterator[Finding]:
    """Places and times that are no numbers, or beyond every scene."""
    places: list[tuple[str, tuple[float, ...]]] = [
        ("time_s", (observation.time_s,)),
        ("the robot's position", observation.robot_position_world_m),
    ]
    for hand in observation.hands:
        places.append((f"the position of {hand.name}", hand.position_world_m))
        places.append((f"where {hand.name} let go", hand.released_world_m or ()))
    for name, values in places:
        if not all(math.isfinite(v) for v in values):
            yield Finding("numbers", f"{name} is not finite: {', '.join(map(str, values))}")


def _camera(camera: Intrinsics, index: int, limits: GateConfig) -> Iterator[Finding]:
    """Focal length and principal point."""
    numbers = (camera.fx, camera.fy, camera.cx, camera.cy)
    if not all(math.isfinite(v) for v in numbers) or min(camera.fx, camera.fy) <= 0:
        yield Finding(
            "camera", f"intrinsics must be finite, fx and fy above 0, got {numbers}", index
        )
        return
    for name, size, focal in (("fx", camera.width, camera.fx), ("fy", camera.height, camera.fy)):
        view = 2 * math.degrees(math.atan2(size / 2, focal))
        if not limits.min_view_deg <= view <= limits.max_view_deg:
            yield Finding(
                "camera",
                f"{name} = {focal:g} on {size} pixels is a field of view of {view:.3g} degrees, "
                f"no camera's ({limits.min_view_deg:g} to {limits.max_view_deg:g}): give the focal "
                "length in pixels of this very picture",
                index,
            )
    ratio = max(camera.fx, camera.fy) / min(camera.fx, camera.fy)
    if ratio > limits.max_aspect:
        yield Finding("camera", f"fx and fy differ by a factor of {ratio:.3g}", index)
    for name, size, centre in (("cx", camera.width, camera.cx), ("cy", camera.height, camera.cy)):
        if not 0 <= centre <= size:
            yield Finding(
                "camera",
                f"{name} = {centre:g} lies outside the picture of {size} pixels: intrinsics must "
                "be those of this very picture, scaled and cropped with it",
                index,
            )


def _pose(
    frame: Frame, observation: Observation, index: int, limits: GateConfig
) -> Iterator[Finding]:
    """Where the camera is, against the origin and against the floor."""
    pose = frame.camera_to_world
    place = pose[:3, 3]
    if np.array_equal(pose, np.eye(4)):
        yield Finding(
            "pose",
            "camera_to_world is the identity: the camera would lie on the floor and look straight "
            "up; give where it is in a world whose z is up",
            index,
        )
        return
    if float(np.abs(place).max()) > limits.reach_m:
        yield Finding(
            "pose",
            f"the camera is at ({', '.join(f'{v:.3g}' for v in place)}) m; it must be within "
            f"{limits.reach_m:g} m of the origin",
            index,
        )
        return
    height = float(place[2]) - observation.robot_position_world_m[2]
    if not limits.min_height_m <= height <= limits.max_height_m:
        yield Finding(
            "pose",
            f"the camera is {height:.3g} m above the floor on which the robot stands; expected "
            f"{limits.min_height_m:g} to {limits.max_height_m:g} (world in metres, z up, "
            "robot_position_m on the floor)",
            index,
        )


def _colour(frame: Frame, index: int, limits: GateConfig) -> Iterator[Finding]:
    """A picture that shows nothing."""
    thin = frame.rgb[::8, ::8]
    if int(thin.max()) < limits.black and int(frame.rgb.max()) < limits.black:
        yield Finding(
            "blank", "the picture is black: no light, or a camera without a signal", index
        )
    elif int(np.ptp(thin)) == 0 and int(np.ptp(frame.rgb)) == 0:
        yield Finding("blank", "the picture has one colour only: a camera without a signal", index)


def _depth(look: Coarse, index: int, limits: GateConfig) -> Iterator[Finding]:
    """Distances that are none, in another unit, constant or noise."""
    known = look.depth_m[look.known]
    if known.size == 0:
        yield Finding("distances", "no depth returned anywhere, so nothing can be located", index)
        return
    middle = float(np.median(known))
    if not limits.min_distance_m <= middle <= limits.max_distance_m:
        yield Finding(
            "distances",
            f"distances that cannot be: their median is {middle:.4g} m, expected "
            f"{limits.min_distance_m:g} to {limits.max_distance_m:g}; declare the unit that depth "
            "is in (depth_unit)",
            index,
        )
        return
    if float(np.ptp(known)) < limits.min_spread_m and known.size > 1:
        yield Finding(
            "distances", f"depth is {middle:.3g} m everywhere: a sensor without a signal", index
        )
        return
    depth = look.frame.depth_m
    here, beside = depth[:: look.step, :-1:2], depth[:: look.step, 1::2]
    both = (here > 0) & (beside > 0)
    if both.any():
        rough = float(np.median(np.abs(beside - here)[both] / here[both]))
        if rough > limits.max_roughness:
            yield Finding(
                "distances",
                f"neighbouring pixels differ by {100 * rough:.0f} % of their distance: noise, or a "
                "picture read in the wrong byte order or size",
                index,
            )


def _scores(scores: Sequence[float], limits: GateConfig) -> Iterator[Finding]:
    unsure = [s for s in scores if s < limits.least_score]
    if scores and len(unsure) == len(scores):
        yield Finding(
            "confidence",
            f"none of the {len(scores)} detections is surer than {limits.least_score:g}: "
            "nothing was seen",
        )
    elif unsure:
        yield Finding(
            "confidence",
            f"{len(unsure)} of {len(scores)} detections are not surer than "
            f"{limits.least_score:g}: where they are is not believed",
            refuses=False,
        )
