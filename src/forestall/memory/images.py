"""Pictures of demonstrations: PNG files named by the hash of their pixels.

Called by the store; calls nothing. A file appears complete or not at all.
"""

from __future__ import annotations

import hashlib
import re
from pathlib import Path

import numpy as np

from forestall.errors import FileFormatError, InputError, MemoryFileError
from forestall.files import whole_file
from forestall.reading.pictures import read_picture
from forestall.types.observation import Rgb

_HASH = re.compile(r"^[0-9a-f]{32}$")


class ImageFolder:
    """Pictures in a folder, each once.

    Args:
        folder: made when the first picture is put.
    """

    def __init__(self, folder: Path) -> None:
        self.folder = folder

    def put_image(self, rgb: Rgb) -> str:
        """Keep a (H, W, 3) uint8 picture; returns the hash of its size and pixels.

        Raises:
            InputError: not a picture.
            MemoryFileError: the folder cannot be written.
        """
        from PIL import Image

        if rgb.ndim != 3 or rgb.shape[2] != 3 or rgb.dtype != np.uint8:
            raise InputError(f"a picture is (H, W, 3) uint8, got {rgb.shape} {rgb.dtype}")
        name = _hash(rgb)
        path = self._path(name)
        if path.exists():
            return name
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
            with whole_file(path) as file:
                Image.fromarray(rgb).save(file, format="PNG", compress_level=3)
        except OSError as error:
            raise MemoryFileError(f"cannot keep a picture in {self.folder}: {error}") from error
        return name

    def get_image(self, name: str) -> Rgb:
        """The (H, W, 3) uint8 picture with this hash.

        Raises:
            MemoryFileError: there is none, or the file is damaged.
        """
        if not _HASH.match(name):
            raise MemoryFileError(f"{name!r} is not the name of a stored picture")
        path = self._path(name)
        if not path.exists():
            raise MemoryFileError(f"picture {name} is not in {self.folder}")
        try:
            rgb = np.asarray(read_picture(path, "RGB"), dtype=np.uint8)
        except FileFormatError as error:
            raise MemoryFileError(f"picture {path} is damaged: {error}") from error
        if _hash(rgb) != name:
            raise MemoryFileError(f"picture {path} is damaged: its content is not what it says")
        return rgb

    def _path(self, name: str) -> Path:
        return self.folder / name[:2] / f"{name}.png"


def _hash(rgb: Rgb) -> str:
    digest = hashlib.blake2b(repr(rgb.shape).encode(), digest_size=16)
    digest.update(np.ascontiguousarray(rgb).tobytes())
    return digest.hexdigest()
