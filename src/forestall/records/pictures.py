"""Pictures of a run: encoded for the record's folder, and small enough for a page.

Only Pillow; the same picture gives the same bytes.
"""

from __future__ import annotations

import base64
import hashlib
import io
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from forestall.reading.files import inside
from forestall.reading.pictures import read_picture
from forestall.types.episode import StoredFrame
from forestall.types.observation import Frame, Rgb

_QUALITIES = (84, 72, 60, 45, 30, 18)


@dataclass(frozen=True, slots=True)
class Picture:
    """A picture inside a page."""

    uri: str  # data URI
    width: int
    height: int


def encode_jpeg(rgb: Rgb, *, width: int | None = None, quality: int = 92) -> bytes:
    """An (H, W, 3) uint8 picture as JPEG, scaled down to `width` pixels where it is wider."""
    from PIL import Image

    image = Image.fromarray(rgb)
    if width is not None and image.width > width:
        height = max(1, round(image.height * width / image.width))
        image = image.resize((width, height), Image.Resampling.LANCZOS)
    buffer = io.BytesIO()
    image.save(buffer, "JPEG", quality=quality, optimize=True)
    return buffer.getvalue()


def file_name(data: bytes) -> str:
    """A name made from the content, so that a picture is never mistaken for another."""
    return f"{hashlib.sha256(data).hexdigest()[:16]}.jpg"


def rgb_of(frame: Frame | StoredFrame, folder: Path | None) -> Rgb | None:
    """The picture of a frame, None where it was not kept or is not there any more.

    Args:
        frame: as seen, or as a record has it.
        folder: of the record.

    Raises:
        FileFormatError: the file is not a picture, or not in the folder.
    """
    if isinstance(frame, Frame):
        return frame.rgb
    if frame.picture is None or folder is None or not (folder / frame.picture).is_file():
        return None
    return np.asarray(read_picture(inside(folder, frame.picture), "RGB"))


def page_picture(rgb: Rgb, *, width: int, budget_bytes: int) -> Picture:
    """A picture as data URI in the best quality that fits into `budget_bytes` characters.

    Where even the lowest quality does not fit, the picture gets smaller.
    """
    while True:
        for quality in _QUALITIES:
            data = encode_jpeg(rgb, width=width, quality=quality)
            if len(data) * 4 / 3 <= budget_bytes:
                return _picture(rgb, data, width)
        if width <= 64:
            return _picture(rgb, data, width)
        width = width * 3 // 4


def _picture(rgb: Rgb, data: bytes, width: int) -> Picture:
    full_height, full_width = rgb.shape[:2]
    shown = min(width, full_width)
    height = max(1, round(full_height * shown / full_width))
    uri = "data:image/jpeg;base64," + base64.b64encode(data).decode("ascii")
    return Picture(uri, shown, height)
