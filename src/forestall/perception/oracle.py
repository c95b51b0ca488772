"""States from ground truth: the one file of this package that is handed the simulator's truth.

Its name in every record says so. It answers only for what is in view, and only with what a camera
could tell, so that it can be replaced by a learned estimator without changing what is observed.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

import numpy as np

from forestall.domain.model import Domain
from forestall.types.graph import SceneGraph
from forestall.types.observation import Detection, Frame

_NEAR_M = 0.1


class OracleStateEstimator:
    """True states of visible instances.

    Args:
        states: instance name → its true attribute values.
        domain: which attributes a camera sees, and which of them look too small from afar.
        truth: the true graph, in which a mask without a name is looked up by its place; without
            it such a mask gets no states.
        fine_pixels: mask size under which the fine attributes are not told.
    """

    name = "oracle states"

    def __init__(
        self,
        states: Callable[[str], Mapping[str, str]],
        domain: Domain,
        truth: Callable[[], SceneGraph] | None = None,
        *,
        fine_pixels: int = 120,
    ) -> None:
        self._states = states
        self._truth = truth
        self._told = {a.name for a in domain.attributes.values() if a.camera}
        self._fine = {a.name for a in domain.attributes.values() if a.fine}
        self._fine_pixels = fine_pixels

    def estimate(
        self, frame: Frame, detections: Sequence[Detection]
    ) -> Sequence[Mapping[str, str | None]]:
        """See the Protocol."""
        nameless = any(d.instance is None for d in detections)
        truth = self._truth() if self._truth is not None and nameless else None
        return [self._one(d, d.instance or _behind(d, frame, truth)) for d in detections]

    def _one(self, detection: Detection, instance: str | None) -> Mapping[str, str | None]:
        if instance is None:
            return {}
        true = self._states(instance)
        small = int(detection.mask.sum()) < self._fine_pixels
        return {
            a: None if small and a in self._fine else value
            for a, value in true.items()
            if a in self._told
        }


def _behind(detection: Detection, frame: Frame, truth: SceneGraph | None) -> str | None:
    """The true thing of a mask's category that is where the mask is."""
    rows, columns = np.nonzero(detection.mask & (frame.depth_m > 0))
    if truth is None or not len(rows):
        return None
    z, k = frame.depth_m[rows, columns].astype(np.float64), frame.intrinsics
    local = np.stack([(columns - k.cx) / k.fx * z, (rows - k.cy) / k.fy * z, z])
    points = frame.camera_to_world[:3, :3] @ local + frame.camera_to_world[:3, 3:]
    x, y, height = np.median(points, axis=1).tolist()
    return truth.nearest(detection.category, (x, y, height), _NEAR_M)
