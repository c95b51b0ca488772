"""Single files of a stored observation: colour, depth, masks. Called by `folder.py`."""

from __future__ import annotations

import zipfile
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
from PIL import Image

from forestall.errors import FileFormatError, PerceptionError
from forestall.types.observation import Depth, Mask, Rgb

MILLIMETRE_M = 0.001


def _image(file: Path) -> Image.Image:
    if not file.is_file():
        raise FileFormatError(f"{file} is missing")
    try:
        image = Image.open(file)
        image.load()
    except (OSError, SyntaxError, ValueError) as error:
        raise FileFormatError(f"{file} cannot be read as a picture: {error}") from error
    return image


def _array(file: Path) -> Any:
    if not file.is_file():
        raise FileFormatError(f"{file} is missing")
    try:
        return np.load(file, allow_pickle=False)
    except (OSError, ValueError, EOFError, zipfile.BadZipFile) as error:
        raise FileFormatError(f"{file} cannot be read as a numpy file: {error}") from error


def read_rgb(file: Path) -> Rgb:
    """(H, W, 3) uint8."""
    return np.asarray(_image(file).convert("RGB"), dtype=np.uint8)


def read_depth(folder: Path, name: str | None, shape: tuple[int, ...]) -> Depth:
    """(H, W) float32 metres, from float .npy (metres) or 16-bit .png (millimetres).

    Args:
        folder: where the file is.
        name: its name; None: depth.npy, or depth.png where there is none.
        shape: (H, W) of the colour picture.
    """
    if name is None:
        options = [f for f in ("depth.npy", "depth.png") if (folder / f).is_file()]
        if not options:
            raise FileFormatError(f"{folder} has neither depth.npy nor depth.png")
        name = options[0]
    file = folder / name
    depth = _depth_png(file) if file.suffix == ".png" else _depth_npy(file)
    if depth.shape != tuple(shape):
        raise PerceptionError(
            f"{file}: shape {depth.shape} does not fit the colour picture's {tuple(shape)}"
        )
    if not bool(np.isfinite(depth).all()):
        bad = int((~np.isfinite(depth)).sum())
        raise PerceptionError(
            f"{file}: {bad} NaN or infinite values; write 0 where nothing returned"
        )
    if bool((depth < 0).any()):
        raise PerceptionError(f"{file}: negative depth; z-depth is metres in front of the camera")
    if not bool((depth > 0).any()):
        raise PerceptionError(f"{file}: depth is 0 everywhere, so nothing can be located")
    return depth


def _depth_png(file: Path) -> Depth:
    image = _image(file)
    if image.mode not in ("I;16", "I;16B", "I"):
        raise PerceptionError(
            f"{file}: depth as PNG must be 16-bit grey in millimetres, this is {image.mode!r}"
        )
    return (np.asarray(image).astype(np.float32) * np.float32(MILLIMETRE_M)).astype(np.float32)


def _depth_npy(file: Path) -> Depth:
    array = _array(file)
    if not isinstance(array, np.ndarray) or array.dtype not in (np.float32, np.float64):
        kind = getattr(array, "dtype", type(array).__name__)
        raise PerceptionError(f"{file}: depth must be float32 or float64 metres, this is {kind}")
    return array.astype(np.float32)


def single_mask(file: Path, shape: tuple[int, ...]) -> Mask:
    """(H, W) bool: where a picture is not black."""
    mask = np.asarray(_image(file).convert("L")) > 0
    return _fitting(mask, shape, f"{file}")


def _fitting(mask: npt.NDArray[Any], shape: tuple[int, ...], where: str) -> Mask:
    if mask.shape != tuple(shape):
        raise PerceptionError(
            f"{where}: mask shape {mask.shape} does not fit the depth's {tuple(shape)}"
        )
    return mask.astype(np.bool_)


@dataclass(frozen=True, slots=True, eq=False)
class MaskFile:
    """masks.png (one id a pixel, 0 for none) or masks.npz (one array a name)."""

    file: Path
    shape: tuple[int, ...]
    ids: npt.NDArray[np.int64] | None
    arrays: dict[str, npt.NDArray[Any]]

    @classmethod
    def open(cls, folder: Path, name: str | None, shape: tuple[int, ...]) -> MaskFile | None:
        """Read the file; None when it is not named and neither default is there."""
        if name is None:
            options = [f for f in ("masks.png", "masks.npz") if (folder / f).is_file()]
            if not options:
                return None
            name = options[0]
        file = folder / name
        if file.suffix == ".npz":
            loaded = _array(file)
            return cls(file, tuple(shape), None, {k: loaded[k] for k in loaded.files})
        image = _image(file)
        if image.mode not in ("L", "P", "I;16", "I;16B", "I"):
            raise FileFormatError(
                f"{file}: ids must be an 8-bit or 16-bit grey or palette PNG, not {image.mode!r}"
            )
        ids = np.asarray(image).astype(np.int64)
        if ids.shape != tuple(shape):
            raise PerceptionError(
                f"{file}: mask shape {ids.shape} does not fit the depth's {tuple(shape)}"
            )
        return cls(file, tuple(shape), ids, {})

    def of(self, key: int | str | None, where: str) -> Mask:
        """The mask with an id (PNG) or a name (npz)."""
        if isinstance(key, int):
            if self.ids is None:
                raise FileFormatError(f"{where}: 'id' needs masks.png, there is {self.file.name}")
            mask: Mask = self.ids == key
            return mask
        if self.ids is not None:
            raise FileFormatError(f"{where}: 'mask' needs masks.npz, there is {self.file.name}")
        if key not in self.arrays:
            known = ", ".join(sorted(self.arrays)) or "none"
            raise FileFormatError(f"{where}: {self.file} has no array {key!r}; it has {known}")
        return _fitting(self.arrays[key], self.shape, f"{where}: {self.file}")
