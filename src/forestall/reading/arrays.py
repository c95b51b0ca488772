"""Arrays of others from .npy and .npz, within budgets; no pickle is ever loaded.

The head of an array is read and checked before anything is allocated. Called by the readers of
observation folders and of training pictures; calls `files`.
"""

from __future__ import annotations

import io
import zipfile
from math import prod
from pathlib import Path
from typing import IO, Any

import numpy as np
import numpy.typing as npt
from numpy.lib import format as npy

from forestall.errors import FileFormatError
from forestall.reading.files import decoding, read_bytes

MOST_ARRAY_BYTES = 512 * 2**20
MOST_ARRAYS = 4096
MOST_DIMENSIONS = 8
NUMBERS = "biufc"

_HEADERS = {(1, 0): npy.read_array_header_1_0, (2, 0): npy.read_array_header_2_0}
_HOW = (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED)


def read_npy(path: Path) -> npt.NDArray[Any]:
    """The array of an .npy file: booleans, integers, floats or complex numbers.

    Raises:
        FileFormatError: no .npy, objects in it, cut off, or too large.
    """
    data = read_bytes(path, "numpy array", MOST_ARRAY_BYTES)
    with decoding(path, "a numpy array (.npy)"):
        return _array(io.BytesIO(data), len(data))


def read_npz(path: Path, kinds: str = NUMBERS) -> dict[str, npt.NDArray[Any]]:
    """The arrays of an .npz file by name.

    Args:
        path: of the file.
        kinds: of values, as numpy's `dtype.kind` names them; plain numbers by default.

    Raises:
        FileFormatError: no .npz, one of its arrays as in `read_npy`, or too much in all.
    """
    data = read_bytes(path, "numpy archive", MOST_ARRAY_BYTES)
    found: dict[str, npt.NDArray[Any]] = {}
    with decoding(path, "a numpy archive (.npz)"), zipfile.ZipFile(io.BytesIO(data)) as archive:
        members = archive.infolist()
        _check_members(members)
        for member in members:
            name = member.filename.removesuffix(".npy")
            if name in found:
                raise FileFormatError(f"{path}: array {name!r} is there twice")
            with archive.open(member) as file:
                content = file.read(member.file_size + 1)
            with decoding(path, f"a numpy archive: array {name!r}"):
                found[name] = _array(io.BytesIO(content), len(content), kinds)
    return found


def _check_members(members: list[zipfile.ZipInfo]) -> None:
    if len(members) > MOST_ARRAYS:
        raise ValueError(f"{len(members)} arrays; at most {MOST_ARRAYS} are read")
    total = sum(m.file_size for m in members)
    if total > MOST_ARRAY_BYTES:
        raise ValueError(f"{total} bytes unpacked; at most {MOST_ARRAY_BYTES} are read")
    for member in members:
        if member.compress_type not in _HOW or member.flag_bits & 1:
            raise ValueError(f"{member.filename!r} is encrypted, or packed in an unknown way")


def _array(file: IO[bytes], size: int, kinds: str = NUMBERS) -> npt.NDArray[Any]:
    read_header = _HEADERS.get(npy.read_magic(file))
    if read_header is None:
        raise ValueError("a version of the format that numpy does not write for numbers")
    shape, fortran, dtype = read_header(file)
    if dtype.hasobject or dtype.kind not in kinds or dtype.shape:
        raise ValueError(f"its values are {dtype}, not plain numbers")
    if len(shape) > MOST_DIMENSIONS or any(n < 0 for n in shape):
        raise ValueError(f"it has the shape {shape}")
    wanted, there = prod(shape) * dtype.itemsize, size - file.tell()
    if wanted != there:
        raise ValueError(f"{shape} {dtype} needs {wanted} bytes, there are {there}")
    array = np.frombuffer(file.read(), dtype=dtype).reshape(shape, order="F" if fortran else "C")
    return np.array(array, dtype=dtype.newbyteorder("="))
