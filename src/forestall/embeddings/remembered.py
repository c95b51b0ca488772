"""Rows that were computed before: of texts, and of the crops of the frame at hand.

Called by `twotower.py`, `clip.py` and `sentence.py`; calls nothing.
"""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Callable, Sequence

import numpy as np
import numpy.typing as npt

from forestall.types.observation import Mask, Rgb

Vectors = npt.NDArray[np.float32]


class TextRows:
    """Texts → rows; the latest are kept.

    Args:
        compute: gives the rows of texts that are not known yet.
        width: length of a row.
        size: how many texts are kept.
    """

    def __init__(
        self, compute: Callable[[Sequence[str]], Vectors], width: int, size: int = 16384
    ) -> None:
        self._compute = compute
        self._width = width
        self._size = size
        self._rows: OrderedDict[str, Vectors] = OrderedDict()

    def __call__(self, texts: Sequence[str]) -> Vectors:
        """(n, width), in the order of the texts."""
        new = [t for t in dict.fromkeys(texts) if t not in self._rows]
        if new:
            self._rows.update(zip(new, self._compute(new), strict=True))
        out = np.empty((len(texts), self._width), dtype=np.float32)
        for i, text in enumerate(texts):
            out[i] = self._rows[text]
            self._rows.move_to_end(text)
        while len(self._rows) > self._size:
            self._rows.popitem(last=False)
        return out


class CropRows:
    """Masks of one frame → rows, so that what asks for the same ones again waits no second time.

    Args:
        compute: gives the rows of masks that are not known yet.
        width: length of a row.
    """

    def __init__(self, compute: Callable[[Rgb, Sequence[Mask]], Vectors], width: int) -> None:
        self._compute = compute
        self._width = width
        self._frame: Rgb | None = None
        self._known: list[tuple[Mask, Vectors]] = []

    def __call__(self, rgb: Rgb, masks: Sequence[Mask]) -> Vectors:
        """(n, width), in the order of the masks; another frame makes it forget."""
        if self._frame is not rgb:
            self._frame, self._known = rgb, []
        rows = {id(mask): row for mask, row in self._known}
        new = [m for m in masks if id(m) not in rows]
        if new:
            for mask, row in zip(new, self._compute(rgb, new), strict=True):
                self._known.append((mask, row))
                rows[id(mask)] = row
        out = np.empty((len(masks), self._width), dtype=np.float32)
        for i, mask in enumerate(masks):
            out[i] = rows[id(mask)]
        return out
