"""Parts of a picture and what is known of them while they are drawn; filled by `picture`."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt

from forestall.worlds.kitchen.rendering.drawn import Basis
from forestall.worlds.kitchen.rendering.lighting import STRIDE, Lights
from forestall.worlds.kitchen.rendering.tracer import Float, Int


@dataclass(frozen=True, slots=True)
class Window:
    """A part of the picture; `top` and `left` are even, the other ends are excluded."""

    top: int
    left: int
    bottom: int
    right: int

    @property
    def pixels(self) -> tuple[slice, slice]:
        """The part of an array of pixels."""
        return np.s_[self.top : self.bottom, self.left : self.right]

    @property
    def grid(self) -> tuple[slice, slice]:
        """The part of the light grid."""
        rows, columns = -(-self.bottom // STRIDE), -(-self.right // STRIDE)
        return np.s_[self.top // STRIDE : rows, self.left // STRIDE : columns]

    @property
    def size(self) -> tuple[int, int]:
        """Rows and columns."""
        return self.bottom - self.top, self.right - self.left


@dataclass(frozen=True, slots=True, eq=False)
class Shot:
    """Where the camera is, and the lights."""

    origin: Float
    rotation: Float
    lights: Lights


@dataclass(frozen=True, slots=True, eq=False)
class View:
    """A shot, and the light that was measured in a window of it.

    `grid_*` are rows of the window's light grid (every STRIDE-th pixel of every STRIDE-th row);
    `own` collects the flat pixels and the places of points that cast light rays of their own.
    """

    shot: Shot
    window: Window
    grid_size: tuple[int, int]
    grid_points: Float
    grid_normals: Float
    grid_reach: Float
    own: list[tuple[Int, Float]] = field(default_factory=list)


@dataclass(frozen=True, slots=True, eq=False)
class Patch:
    """What a window shows."""

    window: Window
    rgb: npt.NDArray[np.uint8]
    depth_m: Float
    basis: Basis
