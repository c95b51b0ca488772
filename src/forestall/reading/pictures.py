"""Pictures of others, within a budget of bytes and pixels. Called by folders, records, memories."""

from __future__ import annotations

import io
import warnings
from pathlib import Path
from typing import TYPE_CHECKING

from forestall.errors import FileFormatError
from forestall.reading.files import decoding, read_bytes

if TYPE_CHECKING:
    from PIL import Image

MOST_PICTURE_BYTES = 256 * 2**20

MOST_PIXELS = 50_000_000
"""More than any camera of a robot has; a file of a few KiB can claim far more."""

FORMATS = ("PNG", "JPEG", "WEBP", "BMP")


def read_picture(path: Path, mode: str | None = None) -> Image.Image:
    """A picture, decoded whole.

    Args:
        path: of the file.
        mode: what it is converted to, e.g. "RGB"; as it is by default.

    Raises:
        FileFormatError: no picture, cut off, of another format than `FORMATS`, or larger than
            `MOST_PIXELS`.
    """
    from PIL import Image, UnidentifiedImageError

    data = read_bytes(path, "picture", MOST_PICTURE_BYTES)
    with decoding(path, "a picture"):
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", Image.DecompressionBombWarning)  # our budget is less
            try:
                image: Image.Image = Image.open(io.BytesIO(data), formats=FORMATS)
            except UnidentifiedImageError as error:
                raise FileFormatError(f"{path} is not a picture ({', '.join(FORMATS)})") from error
        width, height = image.size
        if width * height > MOST_PIXELS:
            raise FileFormatError(
                f"{path}: a picture of {width} x {height} pixels; at most {MOST_PIXELS} are read"
            )
        image.load()
        return image if mode is None else image.convert(mode)
