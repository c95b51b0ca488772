"""The bench with a camera: pictures of a room beside the facts, and perception that looks at both.

What is judged are the facts; the pictures go through the gate and the watch that a run has.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from forestall.domain.load import shipped
from forestall.perception.gate_config import WatchConfig
from forestall.perception.given import GivenStateEstimator
from forestall.perception.given_graph import GraphPassthrough
from forestall.perception.perceiver import GraphPerceiver
from forestall.perception.segmenters import InstanceSegmenter
from forestall.testing.misbehaving import Instead, changes
from forestall.types.graph import SceneGraph
from forestall.types.observation import Frame, Observation, Vec3
from perception.rooms import room

ROOM = room()


class Pictured:
    """A world of facts whose observations have a picture, noisy as a camera's."""

    def __init__(self, inner: Any) -> None:
        self._inner = inner
        self._looks = 0

    def __getattr__(self, name: str) -> Any:
        return getattr(self._inner, name)

    def scan(self, thorough: bool = False) -> Observation:
        return self._pictured(self._inner.scan(thorough))

    def observe(self, focus: Sequence[Vec3] = ()) -> Observation:
        return self._pictured(self._inner.observe(focus))

    def _pictured(self, seen: Observation) -> Observation:
        self._looks += 1
        frame = ROOM.frames[0]
        noise = np.random.default_rng(self._looks).integers(0, 2, frame.rgb.shape)
        return replace(seen, frames=(replace(frame, rgb=frame.rgb ^ noise.astype(np.uint8)),))


class Looking(GraphPassthrough):
    """Believes the facts of what its pictures do not forbid."""

    def __init__(self) -> None:
        super().__init__(shipped("bench"))
        household = shipped("household")
        self._eye = GraphPerceiver(
            InstanceSegmenter(), GivenStateEstimator({}), household, watch=WatchConfig()
        )

    def reset(self) -> None:
        """See the Protocol."""
        super().reset()
        self._eye.reset()

    def perceive(self, observation: Observation) -> SceneGraph:
        """See the Protocol."""
        self._eye.perceive(replace(ROOM, frames=observation.frames, time_s=observation.time_s))
        return super().perceive(observation)


def black(frame: Frame) -> Frame:
    """No light."""
    return replace(frame, rgb=np.zeros_like(frame.rgb))


def grey(frame: Frame) -> Frame:
    """No signal."""
    return replace(frame, rgb=np.full_like(frame.rgb, 128))


def flat(frame: Frame) -> Frame:
    """The same distance everywhere."""
    return replace(frame, depth_m=np.full_like(frame.depth_m, 1.5))


def without_depth(frame: Frame) -> Frame:
    """No distance anywhere."""
    return replace(frame, depth_m=np.zeros_like(frame.depth_m))


def in_millimetres(frame: Frame) -> Frame:
    """A driver that has changed its unit."""
    return replace(frame, depth_m=frame.depth_m * 1000)


def leapt(frame: Frame) -> Frame:
    """A pose far away, and the same picture."""
    pose = frame.camera_to_world.copy()
    pose[:3, 3] += (40.0, 0.0, 0.0)
    return replace(frame, camera_to_world=pose)


def pictures(change: Any) -> Instead:
    """Every picture changed."""

    def of(seen: Observation) -> Observation:
        return replace(seen, frames=tuple(change(f) for f in seen.frames))

    return changes(of)


def stuck() -> Instead:
    """The first picture for ever, beside facts and a clock that go on."""
    kept: list[tuple[Frame, ...]] = []

    def of(seen: Observation) -> Observation:
        kept.append(seen.frames)
        return replace(seen, frames=kept[0])

    return changes(of)
