"""Pictures, observations and references for the detectors that compare with views."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from forestall.types.demonstration import View
from forestall.types.facts import GRIPPER, category_of
from forestall.types.graph import Box, ObjectNode, Relation, SceneGraph, Seen
from forestall.types.observation import (
    Frame,
    GripperState,
    Intrinsics,
    Mask,
    Observation,
    Rgb,
)
from forestall.types.plan import Subtask
from forestall.types.verdict import Reference

BOX = Box((0.0, 0.0, 0.0), (0.1, 0.1, 0.1))
SUBTASK = Subtask("pick_up", ("Mug-1",))


class MeanColour:
    """A picture's mean colour as its feature."""

    name = "mean-colour"

    def encode_crops(self, rgb: Rgb, masks: Sequence[Mask]) -> npt.NDArray[np.float32]:
        return np.stack([self.encode_image(rgb[m][None]) for m in masks])

    def encode_image(self, rgb: Rgb) -> npt.NDArray[np.float32]:
        row = rgb.reshape(-1, 3).mean(axis=0)
        unit: npt.NDArray[np.float32] = (row / np.linalg.norm(row)).astype(np.float32)
        return unit


class Said:
    """Says what it was told to say, one text after the other."""

    name = "said"

    def __init__(self, *texts: str) -> None:
        self._texts = list(texts)

    def caption(self, observation: Observation, scoped: SceneGraph) -> str:
        return self._texts.pop(0)


def frame(colour: tuple[int, int, int]) -> Frame:
    rgb = np.empty((4, 6, 3), np.uint8)
    rgb[:] = colour
    depth = np.zeros((4, 6), np.float32)
    return Frame(rgb, depth, Intrinsics(6, 4, 5.0, 5.0, 2.5, 1.5), np.eye(4))


def observation(*colours: tuple[int, int, int]) -> Observation:
    frames = tuple(frame(c) for c in colours or ((10, 10, 10),))
    return Observation(frames, GripperState(None, (0.0, 0.0, 1.0)), 0.0)


def node(name: str, seen: Seen = Seen.VISIBLE, **states: str | None) -> ObjectNode:
    return ObjectNode(name, category_of(name), tuple(states.items()), BOX.centre, BOX, seen)


def graph(*nodes: ObjectNode | str, links: Sequence[Relation] = ()) -> SceneGraph:
    things = [node(n) if isinstance(n, str) else n for n in nodes]
    hand = ObjectNode(GRIPPER, GRIPPER, (), BOX.centre, BOX)
    return SceneGraph((hand, *things), tuple(links), SUBTASK)


def reference(
    name: str = "d", view: View | None = None, expected: SceneGraph | None = None
) -> Reference:
    shown = graph("Mug-1") if expected is None else expected
    return Reference(name, "make-coffee", 1, SUBTASK, 1.0, shown, view=view)
