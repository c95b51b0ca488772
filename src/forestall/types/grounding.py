"""What a detector of things says of a picture, before anything is outlined or located."""

from __future__ import annotations

from dataclasses import dataclass

from forestall.errors import PerceptionError
from forestall.types.checks import check_name, check_number

Corners = tuple[float, float, float, float]
"""(x low, y low, x high, y high) in pixels; (0, 0) is the upper left corner of a picture."""


@dataclass(frozen=True, slots=True)
class GroundedBox:
    """A box around what a phrase names.

    Args:
        phrase: one of those that were asked for.
        corners: of the box, within the picture.
        score: in [0, 1], as the detector has it.
    """

    phrase: str
    corners: Corners
    score: float

    def __post_init__(self) -> None:
        check_name("the phrase of a box", self.phrase)
        for number in (*self.corners, self.score):
            check_number("a number of a box", number)
        left, top, right, bottom = self.corners
        if not (left < right and top < bottom):
            raise PerceptionError(f"a box has two sides, got {self.corners}")
        if not 0 <= self.score <= 1:
            raise PerceptionError(f"the score of a box is 0 to 1, got {self.score}")

    @property
    def area(self) -> float:
        """In pixels."""
        left, top, right, bottom = self.corners
        return (right - left) * (bottom - top)

    def overlap(self, other: GroundedBox) -> float:
        """What two boxes share, as a share of what they cover together (IoU)."""
        wide = min(self.corners[2], other.corners[2]) - max(self.corners[0], other.corners[0])
        high = min(self.corners[3], other.corners[3]) - max(self.corners[1], other.corners[1])
        shared = max(0.0, wide) * max(0.0, high)
        return shared / (self.area + other.area - shared)
