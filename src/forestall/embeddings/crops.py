"""Cuts objects out of a frame: a square of colour and mask around each one, all of one size.

Called by `twotower.py`, and by the making of the training pictures, so that both see the same;
calls nothing. What lies around an object is kept (a door stands open before something), and the
mask, as fourth channel, says which of it is meant.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt
from PIL import Image

from forestall.types.observation import Mask, Rgb

Crops = npt.NDArray[np.uint8]

INPUT_PIXELS = 64
"""Edge of what the image tower is given."""

MARGIN = 1.25
"""Edge of the square as a multiple of the longer side of the object's bounding box."""

LEAST_SIDE = 10.0
"""Smaller boxes are widened: a few pixels say nothing without what is around them."""

_GREY = 127


def bounding_box(mask: Mask) -> tuple[int, int, int, int] | None:
    """First and last column and row (x0, y0, x1, y1), the ends excluded; None for an empty mask."""
    columns, rows = np.flatnonzero(mask.any(axis=0)), np.flatnonzero(mask.any(axis=1))
    if not columns.size:
        return None
    return int(columns[0]), int(rows[0]), int(columns[-1]) + 1, int(rows[-1]) + 1


def crop(rgb: Rgb, mask: Mask, pixels: int = INPUT_PIXELS, margin: float = MARGIN) -> Crops:
    """(pixels, pixels, 4) uint8: colour, and the mask as 0 or 255; grey beyond the frame.

    An empty mask gives a grey crop with an empty mask.
    """
    box = bounding_box(mask)
    if box is None:
        blank = np.full((pixels, pixels, 4), _GREY, dtype=np.uint8)
        blank[..., 3] = 0
        return blank
    x0, y0, x1, y1 = box
    side = margin * max(x1 - x0, y1 - y0, LEAST_SIDE)
    return square(rgb, mask, ((x0 + x1) / 2, (y0 + y1) / 2), side, pixels)


def square(rgb: Rgb, mask: Mask, middle: tuple[float, float], side: float, pixels: int) -> Crops:
    """The same for a square given by its middle (x, y) and its edge in pixels of the frame."""
    height, width = mask.shape
    left, top = middle[0] - side / 2, middle[1] - side / 2
    first_x, first_y = int(np.floor(left)), int(np.floor(top))
    size = int(np.ceil(side)) + 1
    window = np.full((size, size, 4), _GREY, dtype=np.uint8)
    window[..., 3] = 0
    x0, x1 = max(first_x, 0), min(first_x + size, width)
    y0, y1 = max(first_y, 0), min(first_y + size, height)
    if x0 < x1 and y0 < y1:
        inner = window[y0 - first_y : y1 - first_y, x0 - first_x : x1 - first_x]
        inner[..., :3] = rgb[y0:y1, x0:x1]
        inner[..., 3] = np.where(mask[y0:y1, x0:x1], 255, 0)
    dx, dy = left - first_x, top - first_y
    # RGBX: the four channels are scaled alike (RGBA would scale colours weighted by the mask)
    picture = Image.frombuffer("RGBX", (size, size), window.tobytes(), "raw", "RGBX", 0, 1)
    scaled = picture.resize(
        (pixels, pixels), Image.Resampling.BILINEAR, box=(dx, dy, dx + side, dy + side)
    )
    return np.asarray(scaled)


def crops(rgb: Rgb, masks: Sequence[Mask], pixels: int = INPUT_PIXELS) -> Crops:
    """(n, pixels, pixels, 4) uint8, one for each mask."""
    out = np.empty((len(masks), pixels, pixels, 4), dtype=np.uint8)
    for i, mask in enumerate(masks):
        out[i] = crop(rgb, mask, pixels)
    return out


def whole(rgb: Rgb, pixels: int = INPUT_PIXELS) -> Crops:
    """A whole frame as one crop, grey above and below, its mask the frame."""
    height, width = rgb.shape[:2]
    everything = np.ones((height, width), dtype=bool)
    return square(rgb, everything, (width / 2, height / 2), float(max(height, width)), pixels)
