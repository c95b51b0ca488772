"""A room for the input gate: floor, walls, a counter with things on it, seen by a robot."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from forestall.types.observation import Detection, Frame, Observation

from .synthetic import Solid, at, hollow, looking, observed

EYE = looking((0.1, -0.9, 1.5), (0.0, 0.3, 0.85))
HAND = (0.25, -0.3, 1.1)
ROOM = [
    Solid("Floor-1", (-4.0, -4.0, -0.02), (4.0, 0.6, 0.0)),
    Solid("Wall-1", (-4.0, 0.6, 0.0), (4.0, 0.65, 2.6)),
    Solid("CounterTop-1", (-1.2, 0.0, 0.0), (1.0, 0.6, 0.9)),
    Solid("Fridge-1", (1.0, -0.1, 0.0), (1.7, 0.6, 1.8)),
    *hollow("Microwave-1", (-0.45, 0.15, 0.9), (0.05, 0.55, 1.2), 0.02, "front"),
    at("Bowl-1", -0.2, 0.3, 0.92, (0.2, 0.2, 0.085), True),
    at("Mug-1", 0.3, 0.2, 0.9, (0.085, 0.085, 0.1), True),
    at("Pot-1", 0.65, 0.3, 0.9, (0.2, 0.2, 0.13), True),
    at("Plate-1", 0.25, -0.3, 1.1, (0.22, 0.22, 0.025), True),
]


def room() -> Observation:
    """What the robot sees of the room with a plate in its hand, noise on every colour."""
    seen = observed(ROOM, EYE, holding="Plate-1", hand=HAND, time_s=2.0)
    noise = np.random.default_rng(0).integers(0, 20, seen.frames[0].rgb.shape)
    rgb = np.clip(seen.frames[0].rgb.astype(np.int64) + noise, 0, 255).astype(np.uint8)
    return with_frame(seen, lambda frame: replace(frame, rgb=rgb))


def with_frame(seen: Observation, change: Callable[[Frame], Frame]) -> Observation:
    """The observation with its first frame changed."""
    return replace(seen, frames=(change(seen.frames[0]), *seen.frames[1:]))


def detected(seen: Observation, score: float = 1.0) -> Observation:
    """The same with masks in place of ids."""

    def change(frame: Frame) -> Frame:
        assert frame.instance_ids is not None
        found = tuple(
            Detection(name.rsplit("-", 1)[0], frame.instance_ids == i, name, score)
            for i, name in enumerate(frame.instance_names)
            if (frame.instance_ids == i).any()
        )
        return replace(frame, instance_ids=None, instance_names=(), detections=found)

    return with_frame(seen, change)
