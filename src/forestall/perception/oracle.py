"""States from ground truth: the one file of this package that is handed the simulator's truth.

Its name in every record says so. It answers only for what is in view, and only with what a camera
could tell, so that it can be replaced by a learned estimator without changing what is observed.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

from forestall.domain.model import Domain
from forestall.types.observation import Detection, Frame


class OracleStateEstimator:
    """True states of visible instances.

    Args:
        states: instance name → its true attribute values.
        domain: which attributes a camera sees, and which of them look too small from afar.
        fine_pixels: mask size under which the fine attributes are not told.
    """

    name = "oracle states"

    def __init__(
        self,
        states: Callable[[str], Mapping[str, str]],
        domain: Domain,
        *,
        fine_pixels: int = 120,
    ) -> None:
        self._states = states
        self._told = {a.name for a in domain.attributes.values() if a.camera}
        self._fine = {a.name for a in domain.attributes.values() if a.fine}
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
            a: None if small and a in self._fine else value
            for a, value in true.items()
            if a in self._told
        }
