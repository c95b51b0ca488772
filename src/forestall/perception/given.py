"""States that somebody wrote down: for stored observations and for tests."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from forestall.types.observation import Detection, Frame


class GivenStateEstimator:
    """Hands on states by instance name, and those that a detection brings with it.

    Args:
        states: instance name → attribute → value; read anew at every frame.
    """

    name = "given states"

    def __init__(self, states: Mapping[str, Mapping[str, str]]) -> None:
        self._states = states

    def estimate(
        self, frame: Frame, detections: Sequence[Detection]
    ) -> Sequence[Mapping[str, str | None]]:
        """See the Protocol."""
        return [dict(self._states.get(d.instance or "", {})) | dict(d.states) for d in detections]
