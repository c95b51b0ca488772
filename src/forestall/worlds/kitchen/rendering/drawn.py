"""A drawn frame with what is needed to redraw a part of it; imports no simulator.

Made by `picture`, kept by `memory`, read by `redrawing`.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from mmap import mmap
from sys import getsizeof
from typing import Any

import numpy as np
import numpy.typing as npt

from forestall.types.observation import Frame

Float = npt.NDArray[np.float32]


@dataclass(frozen=True, slots=True, eq=False)
class Content:
    """What a scene shows: one entry for each geom.

    Attributes:
        look: digest of place, shape and colour, b"" for a geom that is not drawn.
        form: digest of place and shape alone, b"" likewise.
        corners_m: (ngeom, 8, 3) of a box around each geom, in the world.
        instance: (ngeom,) instance ids, -1 for none.
        instance_names: by instance id.
        clear: (ngeom,) whether something shines through.
    """

    look: tuple[bytes, ...]
    form: tuple[bytes, ...]
    corners_m: Float
    instance: npt.NDArray[np.int32]
    instance_names: tuple[str, ...]
    clear: npt.NDArray[np.bool_]


@dataclass(frozen=True, slots=True, eq=False)
class Basis:
    """What a picture was made from, as far as a later one needs it.

    Attributes:
        geom: (h, w) int16 geom at each pixel, -1 for none.
        normal: (rows, columns, 3) unit normals on the light grid.
        reach: (rows, columns, 2) uint8 on the light grid: how many of the rays to the key light and
            of those into the open got through.
        smoothed: (h, w) whether the pixel is a mean of subpixels.
        own_at: (k,) flat indices of pixels in which a point cast light rays of its own.
        own_points: (k, 3) those points, in the world.
    """

    geom: npt.NDArray[np.int16]
    normal: Float
    reach: npt.NDArray[np.uint8]
    smoothed: npt.NDArray[np.bool_]
    own_at: npt.NDArray[np.int32]
    own_points: Float


@dataclass(frozen=True, slots=True, eq=False)
class Drawn:
    """A frame; what it shows and what it was made from where that is known."""

    frame: Frame
    content: Content | None = None
    basis: Basis | None = None

    @property
    def nbytes(self) -> int:
        """Of the memory that is held for it: an array that shows a part of another holds it all."""
        digests = 0
        if self.content is not None:
            digests = sum(map(getsizeof, (*self.content.look, *self.content.form)))
        arrays = (a for part, names in self._parts() for a in _of(part, names).values())
        return digests + sum({id(h): h.nbytes for h in map(_held, arrays)}.values())

    def packed(self) -> Drawn:
        """The same in a block of memory of its own, read-only.

        Among what comes and goes between one frame and the next, what is kept for long would leave
        holes that the process cannot give back: it grew by 150 MB an episode, however little was
        remembered besides.
        """
        parts = [(part, _of(part, names)) for part, names in self._parts()]
        sizes = [_rounded(a.nbytes) for _, arrays in parts for a in arrays.values()]
        block, at = mmap(-1, max(sum(sizes), 1)), 0
        made: list[Any] = []
        for part, arrays in parts:
            copies = {}
            for name, array in arrays.items():
                copy = np.frombuffer(block, array.dtype, array.size, at).reshape(array.shape)
                copy[...] = array
                copy.flags.writeable = False
                copies[name] = copy
                at += _rounded(array.nbytes)
            made.append(replace(part, **copies))
        frame, *rest = made
        content = next((p for p in rest if isinstance(p, Content)), None)
        basis = next((p for p in rest if isinstance(p, Basis)), None)
        return Drawn(frame, content, basis)

    def _parts(self) -> list[tuple[Any, tuple[str, ...]]]:
        """What it consists of, each with the names of its arrays."""
        found: list[tuple[Any, tuple[str, ...]]] = [(self.frame, _PICTURES)]
        if self.content is not None:
            found.append((self.content, ("corners_m", "instance", "clear")))
        if self.basis is not None:
            found.append((self.basis, tuple(self.basis.__dataclass_fields__)))
        return found


_PICTURES = ("rgb", "depth_m", "instance_ids")

_ALIGNED = 64
"""Bytes: what an array of any type may begin at."""


def _rounded(size: int) -> int:
    return -(-size // _ALIGNED) * _ALIGNED


def _of(part: Any, names: tuple[str, ...]) -> dict[str, npt.NDArray[Any]]:
    """The arrays of a part that it has."""
    found = {name: getattr(part, name) for name in names}
    return {name: array for name, array in found.items() if array is not None}


def _held(array: npt.NDArray[Any]) -> npt.NDArray[Any]:
    """The array whose memory another one shows a part of."""
    return _held(array.base) if isinstance(array.base, np.ndarray) else array
