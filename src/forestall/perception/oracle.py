"""States from ground truth: the one file of this package that is handed the simulator's truth.

Its name in every record says so. It answers only for what is in view, and only with what a camera
could tell, so that it can be replaced by a learned estimator without changing what is observed.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence

from forestall.types.observation import Detection, Frame

NOT_VISIBLE = ("temperature",)
"""Attributes of the shipped vocabulary that no camera sees."""

FINE = ("broken", "cooked", "dirty", "filled")
"""Attributes whose look is too small to be told on a distant object."""


class OracleStateEstimator:
    """True states of visible instances.

    Args:
        states: instance name → its true attribute values.
        fine_pixels: mask size under which the fine attributes are not told.
        not_visible: attributes that are never told.
    """

    name = "oracle states"

    def __init__(
        self,
        states: Callable[[str], Mapping[str, str]],
        *,
        fine_pixels: int = 120,
        not_visible: Collection[str] = NOT_VISIBLE,
    ) -> None:
        self._states = states
        self._not_visible = frozenset(not_visible)
        self._fine_pixels = fine_pixels

    def estimate(
        self, frame: Frame, detections: Sequence[Detection]
    ) -> Sequence[Mapping[str, str | None]]:
        """See the Protocol; detections without an instance name get no states."""
        return [self._one(d) for d in detections]

    def _one(self, detection: Detection) -> Mapping[str, str | None]:
        if detection.instance is None:
            return {}
        true = self._states(detection.instance)
        small = int(detection.mask.sum()) < self._fine_pixels
        return {
            a: None if small and a in FINE else value
            for a, value in true.items()
            if a not in self._not_visible
        }
