"""Segmenters that need no model: masks that come with the frame. Called by the perceiver only."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from forestall.errors import PerceptionError
from forestall.perception.config import PerceptionConfig
from forestall.types.facts import category_of, is_instance
from forestall.types.observation import Detection, Frame


class InstanceSegmenter:
    """Reads the frame's instance segmentation, as simulators and trackers deliver it."""

    name = "simulator instance ids"

    def __init__(self, config: PerceptionConfig | None = None) -> None:
        self._config = config or PerceptionConfig()

    def segment(self, frame: Frame) -> Sequence[Detection]:
        """One detection for each instance with enough pixels, in name order.

        Where the frame tells kinds alone, none bears a name.

        Raises:
            PerceptionError: the frame has no instance ids, or an id without a name.
        """
        ids = frame.instance_ids
        if ids is None:
            raise PerceptionError(
                f"the segmenter {self.name!r} needs instance ids, and this frame has none"
            )
        counts = np.bincount(ids.ravel() + 1)[1:]
        if len(counts) > len(frame.instance_names):
            raise PerceptionError(
                f"instance id {len(counts) - 1} has no name: "
                f"{len(frame.instance_names)} names are given"
            )
        found = np.flatnonzero(counts >= self._config.min_pixels)
        if len(counts) <= np.iinfo(np.int16).max:
            ids = ids.astype(np.int16)  # half as much to compare, once for each instance
        order = sorted((frame.instance_names[int(i)], int(i)) for i in found)
        return [
            Detection(category_of(n), ids == i, n if is_instance(n) else None) for n, i in order
        ]


class GivenMasks:
    """Hands on the detections that came with the frame from outside."""

    name = "given masks"

    def __init__(self, config: PerceptionConfig | None = None) -> None:
        self._config = config or PerceptionConfig()

    def segment(self, frame: Frame) -> Sequence[Detection]:
        """The frame's detections with enough pixels.

        Raises:
            PerceptionError: the frame has no detections, or one instance twice.
        """
        if frame.detections is None:
            raise PerceptionError(
                f"the segmenter {self.name!r} needs masks, and this frame has none"
            )
        names = [d.instance for d in frame.detections if d.instance is not None]
        twice = sorted({n for n in names if names.count(n) > 1})
        if twice:
            raise PerceptionError(f"one frame has two masks of {', '.join(twice)}")
        return [d for d in frame.detections if int(d.mask.sum()) >= self._config.min_pixels]
