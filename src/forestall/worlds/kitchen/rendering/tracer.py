"""What a ray caster must answer; `embree` and `rays` implement it, the picture is made from it.

All arrays are float32 in the world frame unless a name says otherwise.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import mujoco
import numpy as np
import numpy.typing as npt

from forestall.worlds.kitchen.rendering.vectors import dot

Float = npt.NDArray[np.float32]
Int = npt.NDArray[np.int32]
Bool = npt.NDArray[np.bool_]

DRAWN_GROUPS = 3
"""Geoms of group 0, 1 and 2 are drawn, all others are not."""

LAMP_CLEARANCE_M = 0.25
"""What is nearer to a light than this is its own lamp and casts no shadow of it."""


@dataclass(frozen=True, slots=True, eq=False)
class Hits:
    """Nearest hits of n rays.

    Attributes:
        geom: (n,) int32, -1 where nothing was hit.
        distance: (n,) float32 in units of the ray direction (z-depth for rays of unit z), 0 for
            no hit.
        normal: (n, 3) float32 unit shading normal that faces the origin of the ray.
    """

    geom: Int
    distance: Float
    normal: Float


class Tracer(Protocol):
    """Casts rays into the present state of one model. Calls may come from several threads."""

    name: str

    def update(self, data: mujoco.MjData) -> None:
        """Take over poses, sizes and visibility; not to be called while rays are cast."""

    def closest(self, origin_world_m: Float, directions: Float) -> Hits:
        """Nearest hits of rays (n, 3) from one origin (3,)."""

    def beyond(self, origins_world_m: Float, directions: Float) -> Hits:
        """Nearest hits of rays (n, 3) from their own origins (n, 3)."""

    def shadowed(self, points_world_m: Float, sources_world_m: Float, source: Int) -> Bool:
        """Whether something stands between points (n, 3) and `sources_world_m[source]`."""

    def occluded(self, points_world_m: Float, directions: Float, reach: Float) -> Bool | None:
        """Whether rays hit something within `reach` (n,), in units of their direction.

        None when this tracer cannot answer for many origins at once.
        """


def drawn(model: mujoco.MjModel) -> Bool:
    """(ngeom,) whether each geom is drawn: its group is drawn and its colour not fully clear."""
    alpha = np.asarray(model.geom_rgba[:, 3]).copy()
    has_material = model.geom_matid >= 0
    if model.nmat:
        alpha[has_material] = model.mat_rgba[model.geom_matid[has_material], 3]
    return np.asarray((model.geom_group < DRAWN_GROUPS) & (alpha > 0.0))


def facing(normal: Float, directions: Float) -> Float:
    """Normals turned against the rays that hit them."""
    sign = np.where(dot(normal, directions) > 0, np.float32(-1), np.float32(1))
    return np.asarray(normal * sign[:, None])
