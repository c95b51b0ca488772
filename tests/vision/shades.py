"""A detector that goes by the shades in which `perception.synthetic` draws things."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from forestall.types.grounding import GroundedBox
from forestall.types.observation import Rgb

STEP = 37


class Shades:
    """Boxes around what is drawn in a shade that stands for a word; see `Finder`.

    Args:
        words: in the order of the names that were drawn.
        closed: whether it knows these words alone.
        score: of every box.
    """

    def __init__(
        self, words: tuple[str, ...] = (), *, closed: bool = False, score: float = 0.8
    ) -> None:
        self._words, self._score = words, score
        self.name = "shades"
        self.vocabulary: Sequence[str] | None = words if closed else None
        self.asked: list[tuple[str, ...]] = []

    def find(self, pictures: Sequence[Rgb], phrases: Sequence[str]) -> list[list[GroundedBox]]:
        """See the Protocol."""
        self.asked.append(tuple(phrases))
        return [self._boxes(picture, phrases) for picture in pictures]

    def _boxes(self, picture: Rgb, phrases: Sequence[str]) -> list[GroundedBox]:
        found = []
        for number, word in enumerate(self._words, 1):
            rows, columns = np.nonzero(picture[..., 0] == number * STEP)
            if word in phrases and len(rows):
                low, high = (float(columns.min()), float(rows.min())), (columns.max(), rows.max())
                corners = (*low, float(high[0]) + 1, float(high[1]) + 1)
                found.append(GroundedBox(word, corners, self._score))
        return found
