"""From what a detector's heads give to boxes in pixels. Called by the finders of this package."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
import numpy.typing as npt

from forestall.errors import InputError
from forestall.types.grounding import GroundedBox
from forestall.types.observation import Rgb

Floats = npt.NDArray[np.float32]


def check_finding(least_score: float, batch: int) -> None:
    """Options that every finder has.

    Raises:
        InputError: a score that is none, or an empty batch.
    """
    if not 0 <= least_score <= 1:
        raise InputError(f"least_score is 0 to 1, got {least_score}")
    if batch < 1:
        raise InputError(f"a batch holds at least one picture, got {batch}")


def grounded(
    phrases: Sequence[str], scores: Floats, boxes: Floats, size: tuple[int, int]
) -> list[GroundedBox]:
    """Boxes in pixels, cut off at the picture's border; what lies outside of it is left out.

    Args:
        phrases: (n,) of each box.
        scores: (n,) in [0, 1].
        boxes: (n, 4) middle x, middle y, width, height, as shares of what `size` says.
        size: (W, H) in pixels of what the shares are of; the picture has its upper left corner.
    """
    wide, high = size
    half = boxes[:, 2:] / 2
    corners = np.concatenate([boxes[:, :2] - half, boxes[:, :2] + half], axis=1)
    corners = np.clip(corners, 0.0, 1.0) * np.array([wide, high, wide, high])
    return [
        GroundedBox(phrase, (left, top, right, bottom), min(1.0, float(score)))
        for phrase, score, (left, top, right, bottom) in zip(
            phrases, scores, corners.tolist(), strict=True
        )
        if left < right and top < bottom
    ]


def within(found: Sequence[GroundedBox], picture: Rgb) -> list[GroundedBox]:
    """Boxes of a padded picture, cut off where the picture itself ends."""
    high, wide = picture.shape[:2]
    cut = []
    for box in found:
        left, top, right, bottom = box.corners
        right, bottom = min(right, float(wide)), min(bottom, float(high))
        if left < right and top < bottom:
            cut.append(GroundedBox(box.phrase, (left, top, right, bottom), box.score))
    return cut


def batches(pictures: Sequence[Rgb], most: int) -> Iterator[list[int]]:
    """Indices of pictures that go through together: of one size, so that none is padded."""
    sizes: dict[tuple[int, ...], list[int]] = {}
    for index, picture in enumerate(pictures):
        sizes.setdefault(picture.shape, []).append(index)
    for same in sizes.values():
        for start in range(0, len(same), most):
            yield same[start : start + most]


def sigmoid(logits: Floats) -> Floats:
    """Elementwise, and 0 for what is minus infinity."""
    with np.errstate(over="ignore"):
        return np.asarray(1 / (1 + np.exp(-logits)), dtype=np.float32)
