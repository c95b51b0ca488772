"""A drawn frame with what is needed to redraw a part of it; imports no simulator.

Made by `picture`, kept by `memory`, read by `redrawing`.
"""

from __future__ import annotations

from dataclasses import dataclass
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
        frame, basis, content = self.frame, self.basis, self.content
        arrays: list[npt.NDArray[Any] | None] = [frame.rgb, frame.depth_m, frame.instance_ids]
        if basis is not None:
            arrays += [basis.geom, basis.normal, basis.reach, basis.smoothed]
            arrays += [basis.own_at, basis.own_points]
        digests = 0
        if content is not None:
            arrays += [content.corners_m, content.instance, content.clear]
            digests = sum(map(getsizeof, (*content.look, *content.form)))
        return digests + sum(_held(a).nbytes for a in arrays if a is not None)


def _held(array: npt.NDArray[Any]) -> npt.NDArray[Any]:
    """The array whose memory another one shows a part of."""
    return _held(array.base) if isinstance(array.base, np.ndarray) else array
