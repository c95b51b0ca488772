"""Single files of a stored observation: colour, depth, masks. Called by `folder.py`.

Units and kinds are as declared; `conventions.py` converts them.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from forestall.errors import FileFormatError, InputError
from forestall.perception.conventions import MaskKind, mask_of
from forestall.reading.arrays import read_npy, read_npz
from forestall.reading.files import inside
from forestall.reading.pictures import read_picture
from forestall.types.observation import Mask, Rgb

_GREY = ("I;16", "I;16B", "I;16L", "I")
_OPAQUE = 255
_MOST_TOLD = 20


def read_rgb(file: Path) -> Rgb:
    """(H, W, 3) uint8."""
    return np.asarray(read_picture(file, "RGB"), dtype=np.uint8)


def read_depth(folder: Path, name: str | None) -> tuple[npt.NDArray[Any], str | None, Path]:
    """Raw depth, the unit that its file implies (None: it must be declared), and the file.

    Args:
        folder: where the file is.
        name: its name; None: depth.npy, or depth.png where there is none.
    """
    if name is None:
        options = [f for f in ("depth.npy", "depth.png") if (folder / f).is_file()]
        if not options:
            raise FileFormatError(f"{folder} has neither depth.npy nor depth.png")
        name = options[0]
    file = inside(folder, name)
    if file.suffix != ".npy":
        image = read_picture(file)
        if image.mode not in _GREY:
            raise FileFormatError(
                f"{file}: depth as PNG must be 16-bit grey, this is {image.mode!r}"
            )
        return np.asarray(image), "mm", file
    array = read_npy(file)
    if array.dtype.kind not in "fiu":
        raise FileFormatError(f"{file}: depth must be numbers, this is {array.dtype}")
    return array, "m" if array.dtype.kind == "f" else None, file


def single_mask(
    file: Path, shape: tuple[int, ...], kind: MaskKind | None, threshold: float | None
) -> Mask:
    """(H, W) bool from a picture of one thing.

    The alpha channel where there is one that says something; else grey; else what is not black.
    """
    image = read_picture(file)
    if image.mode in ("RGBA", "LA", "PA"):
        alpha = np.asarray(image.convert("RGBA"))[:, :, 3]
        if kind == "alpha" or int(alpha.min()) < _OPAQUE:
            return _mask(alpha, shape, f"{file} (alpha)", kind, threshold)
        image = image.convert("RGB")
    elif kind == "alpha":
        raise FileFormatError(f"{file}: mask_kind is alpha, and the picture has no alpha channel")
    grey = image.mode in ("L", *_GREY)
    raw = np.asarray(image if grey else image.convert("RGB").convert("L"))
    return _mask(raw, shape, f"{file}", kind if grey else "bool", threshold)


def _mask(
    raw: npt.NDArray[Any],
    shape: tuple[int, ...],
    where: str,
    kind: MaskKind | None,
    threshold: float | None,
) -> Mask:
    try:
        return mask_of(raw, shape, kind, threshold)
    except InputError as error:
        raise FileFormatError(f"{where}: {error}") from error


@dataclass(frozen=True, slots=True, eq=False)
class MaskFile:
    """One id a pixel (a picture, or .npy of whole numbers), or an .npz with one array a name."""

    file: Path
    shape: tuple[int, ...]
    ids: npt.NDArray[np.int64] | None
    arrays: Mapping[str, npt.NDArray[Any]] = field(default_factory=dict)

    @classmethod
    def open(cls, folder: Path, name: str | None, shape: tuple[int, ...]) -> MaskFile | None:
        """Read the file; None when it is not named and neither default is there."""
        if name is None:
            options = [f for f in ("masks.png", "masks.npz") if (folder / f).is_file()]
            if not options:
                return None
            name = options[0]
        file = inside(folder, name)
        if file.suffix == ".npz":
            return cls(file, tuple(shape), None, read_npz(file))
        if file.suffix == ".npy":
            raw = read_npy(file)
            if raw.dtype.kind not in "iu":
                raise FileFormatError(f"{file}: ids must be whole numbers, this is {raw.dtype}")
        else:
            image = read_picture(file)
            if image.mode not in ("L", "P", *_GREY):
                raise FileFormatError(
                    f"{file}: ids must be one number a pixel, this is a picture of mode "
                    f"{image.mode!r}. For ids coded in colour write r + 256 * g + 65536 * b as a "
                    "32-bit .tif or an .npy of whole numbers"
                )
            raw = np.asarray(image)
        ids = raw.astype(np.int64)
        if ids.shape != tuple(shape):
            raise FileFormatError(
                f"{file}: mask shape {ids.shape} does not fit the picture's {tuple(shape)}"
            )
        return cls(file, tuple(shape), ids)

    def of(
        self,
        key: int | str | None,
        where: str,
        kind: MaskKind | None = None,
        threshold: float | None = None,
    ) -> Mask:
        """The mask with an id (a picture) or a name (npz)."""
        if isinstance(key, int):
            if self.ids is None:
                raise FileFormatError(f"{where}: 'id' needs masks.png, there is {self.file.name}")
            mask: Mask = self.ids == key
            if not mask.any():
                there = [str(i) for i in np.unique(self.ids) if i]
                more = ", ..." if len(there) > _MOST_TOLD else ""
                raise FileFormatError(
                    f"{where}: {self.file} has no pixel with the id {key}; it has "
                    f"{', '.join(there[:_MOST_TOLD]) or 'none'}{more}"
                )
            return mask
        if self.ids is not None:
            raise FileFormatError(f"{where}: 'mask' needs masks.npz, there is {self.file.name}")
        if key is None or key not in self.arrays:
            known = ", ".join(sorted(self.arrays)[:8]) or "none"
            raise FileFormatError(f"{where}: {self.file} has no array {key!r}; it has {known}")
        return _mask(self.arrays[key], self.shape, f"{where}: {self.file}", kind, threshold)
