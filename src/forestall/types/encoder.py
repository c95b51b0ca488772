"""How the cosines of an image-text encoder are turned into answers about states."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from forestall.errors import InputError


@dataclass(frozen=True, slots=True)
class StateReading:
    """Numbers that belong to one encoder; fitted on a development split, never on a test.

    Args:
        scale: by what a cosine is multiplied to give a logit.
        temperature: attribute → by what its logits are divided; "" for every other attribute.
        threshold: attribute → confidence under which nothing is said; "" for every other one.
        least_area: mask pixels under which nothing is said.
        most_rough: how rough pictures of its kind are at most, apart from noise
            (`perception/kind.py`); None: of every picture something is said.
    """

    scale: float = 100.0
    temperature: Mapping[str, float] = field(default_factory=dict)
    threshold: Mapping[str, float] = field(default_factory=dict)
    least_area: int = 400
    most_rough: float | None = None

    def __post_init__(self) -> None:
        if self.scale <= 0 or any(t <= 0 for t in self.temperature.values()):
            raise InputError("the scale and the temperatures of an encoder are above 0")

    @property
    def calibrated(self) -> bool:
        """Whether temperatures were fitted, so that confidences are probabilities."""
        return bool(self.temperature)

    def divisor(self, attribute: str) -> float:
        """The temperature of an attribute."""
        return self.temperature.get(attribute, self.temperature.get("", 1.0))

    def least_confidence(self, attribute: str) -> float:
        """The threshold of an attribute."""
        return self.threshold.get(attribute, self.threshold.get("", 0.8))
