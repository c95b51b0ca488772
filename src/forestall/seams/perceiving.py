"""From pictures to a scene graph, and what pictures and texts are compared by."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Protocol, runtime_checkable

import numpy as np
import numpy.typing as npt

from forestall.types.encoder import StateReading
from forestall.types.facts import Change
from forestall.types.graph import SceneGraph
from forestall.types.grounding import Corners, GroundedBox
from forestall.types.observation import Detection, Frame, Mask, Observation, Rgb
from forestall.types.plan import Subtask

Alters = Callable[[SceneGraph, Subtask], Iterable[Change]]
"""What is believed, what was carried out → what that may have changed."""


class Segmenter(Protocol):
    """Finds instances in a frame.

    One with a method `segment_all(frames)`, an answer for each, is asked for all frames of an
    observation at once. One whose `tracks` is False has no names of its own for things: the world
    is then spoken to as one that keeps its names to itself.
    """

    name: str

    def segment(self, frame: Frame) -> Sequence[Detection]:
        """Instance masks with categories; the same instance name over frames when it tracks."""


class Finder(Protocol):
    """Finds in pictures what phrases name: boxes, without outlines.

    `vocabulary` is all that it can be asked for, None for one that takes any phrase.
    """

    name: str
    vocabulary: Sequence[str] | None

    def find(
        self, pictures: Sequence[Rgb], phrases: Sequence[str]
    ) -> Sequence[Sequence[GroundedBox]]:
        """For each picture what was found in it; several boxes may be of one thing."""


class Outliner(Protocol):
    """Turns boxes into masks; `exact`: a mask ends where its thing ends."""

    name: str
    exact: bool

    def outline(self, frame: Frame, boxes: Sequence[Corners]) -> Sequence[Mask]:
        """For each box the (H, W) mask of the thing in it; an empty one where there is none."""


class StateEstimator(Protocol):
    """Reads states of detected objects off a frame."""

    name: str

    def estimate(
        self, frame: Frame, detections: Sequence[Detection]
    ) -> Sequence[Mapping[str, str | None]]:
        """For each detection: attribute → value, None where it cannot be told."""


@runtime_checkable
class ConfidentStateEstimator(StateEstimator, Protocol):
    """One that also says how sure it is, so that a doubtful look does not undo a sure one."""

    def estimate_with_confidence(
        self, frame: Frame, detections: Sequence[Detection]
    ) -> Sequence[tuple[Mapping[str, str | None], Mapping[str, float]]]:
        """For each detection: as `estimate`, and attribute → probability of the value told.

        Probabilities are calibrated, in [0, 1]; an attribute without one is as sure as can be.
        """


class Perceiver(Protocol):
    """Turns observations into one scene graph that lives over the episode.

    One with a method `acted(subtask, succeeded)` is told each skill that was carried out and
    whether it is said to have succeeded, so that it can doubt what that may have changed. One with
    a method `best_vantage(eyes, points)` is asked before a second look from which of some places of
    the camera it would see more of what it has not seen around some points (both metres in the
    world): a position in `eyes`, None where none is worth the way.
    """

    def reset(self) -> None:
        """Forget everything."""

    def perceive(self, observation: Observation) -> SceneGraph:
        """Fuse an observation and return the whole graph as believed now."""

    def scope(self, graph: SceneGraph, subtask: Subtask) -> SceneGraph:
        """The part of a graph that concerns a (grounded) subtask, with its subtask node."""

    def describe(self) -> Mapping[str, str]:
        """Which segmenter, state estimator and image encoder are used (goes into every record)."""


class TextEncoder(Protocol):
    """Embeds short texts."""

    name: str

    def encode(self, texts: Sequence[str]) -> npt.NDArray[np.float32]:
        """(n, d) float32 rows of unit length."""


class ImageEncoder(Protocol):
    """Embeds pictures; what one encoder gives compares only with what the same one gives."""

    name: str

    def encode_crops(self, rgb: Rgb, masks: Sequence[Mask]) -> npt.NDArray[np.float32]:
        """(n, d) float32 rows of unit length, one for the object under each mask."""

    def encode_image(self, rgb: Rgb) -> npt.NDArray[np.float32]:
        """(d,) float32 of unit length: the whole picture."""


class Captioner(Protocol):
    """Says in a few sentences what a picture shows."""

    name: str

    def caption(self, observation: Observation, scoped: SceneGraph) -> str:
        """`scoped` is what perception made of the observation; a model that sees ignores it."""


class ImageTextEncoder(ImageEncoder, TextEncoder, Protocol):
    """Pictures and texts in one space, as CLIP has them."""

    reading: StateReading
