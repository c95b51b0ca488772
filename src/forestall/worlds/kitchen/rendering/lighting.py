"""Light of a scene and how much of it reaches a place.

Key light visibility (soft shadow) and ambient visibility (occlusion nearby) are estimated with
two rays each on every second pixel of every second row. The sixteen places of each 4×4 block use
different rays, and a filter over neighbours of the same surface weighs all sixteen alike, so that
what is seen is the mean of 32 rays.
"""

from __future__ import annotations

from dataclasses import dataclass

import mujoco
import numpy as np

from forestall.worlds.kitchen.rendering.tracer import Bool, Float, Int, Tracer
from forestall.worlds.kitchen.rendering.vectors import dot, norm, rows

RAYS = 2
GROUPS = 16
STRIDE = 2
LAMP_RADIUS_M = 0.11
AMBIENT_REACH_M = (0.06, 0.14, 0.30, 0.55)
SURFACE_OFFSET_M = 1.5e-3

_SKY = (0.50, 0.50, 0.52)
_GROUND = (0.30, 0.27, 0.24)


@dataclass(frozen=True, slots=True, eq=False)
class Light:
    """One light of the model, in linear colour.

    `position` is its place, or for a directional light a place far against its direction.
    """

    position_world_m: Float
    direction: Float
    colour: Float
    attenuation: Float
    cone_cosine: float  # -1 shines everywhere
    directional: bool


@dataclass(frozen=True, slots=True, eq=False)
class Lights:
    """The shadowed key light, the other lights, and the ambient from above and from below."""

    key: Light
    fill: tuple[Light, ...]
    sky: Float
    ground: Float

    @classmethod
    def read(cls, model: mujoco.MjModel, data: mujoco.MjData) -> Lights:
        """The lights as they are now; one above the scene when the model has none.

        The key is the strongest shadow-casting light that has a place, else the strongest.
        """
        active = [i for i in range(model.nlight) if model.light_active[i]]
        lights = [_read_one(model, data, i) for i in active]
        if not lights:
            above = np.array([0.0, 0.0, 1.0], np.float32) * 0.45 * float(model.stat.extent)
            place = np.asarray(model.stat.center, np.float32) + above
            lights = [_omni(place, np.full(3, 0.75, np.float32))]
            casts = [True]
        else:
            casts = [bool(model.light_castshadow[i]) for i in active]
        rank = [
            (cast and not light.directional, float(light.colour.sum()), -k)
            for k, (light, cast) in enumerate(zip(lights, casts, strict=True))
        ]
        best = rank.index(max(rank))
        fill = tuple(light for k, light in enumerate(lights) if k != best)
        tone = lights[best].colour / max(float(lights[best].colour.max()), 1e-6)
        tint = 0.5 + 0.5 * tone
        return cls(lights[best], fill, tint * np.array(_SKY, np.float32), tint * _GROUND)


def _read_one(model: mujoco.MjModel, data: mujoco.MjData, i: int) -> Light:
    kind = int(model.light_type[i])
    directional = kind == int(mujoco.mjtLightType.mjLIGHT_DIRECTIONAL)
    direction = np.asarray(data.light_xdir[i], np.float32)
    direction = direction / max(float(np.linalg.norm(direction)), 1e-9)
    position = np.asarray(data.light_xpos[i], np.float32)
    spot = kind == int(mujoco.mjtLightType.mjLIGHT_SPOT)
    cosine = float(np.cos(np.deg2rad(min(float(model.light_cutoff[i]), 180.0)))) if spot else -1.0
    return Light(
        position - 20.0 * direction if directional else position.copy(),
        direction,
        np.asarray(model.light_diffuse[i], np.float32).copy(),
        np.asarray(model.light_attenuation[i], np.float32).copy(),
        cosine,
        directional,
    )


def _omni(position: Float, colour: Float) -> Light:
    down = np.array([0, 0, -1], np.float32)
    return Light(position, down, colour, np.array([1, 0, 0], np.float32), -1.0, False)


def fibonacci_sphere(count: int) -> Float:
    """`count` well-spread unit vectors, (count, 3)."""
    k = np.arange(count)
    z = 1 - (2 * k + 1) / count
    angle = k * np.pi * (3 - np.sqrt(5))
    ring = np.sqrt(1 - z * z)
    return np.stack([ring * np.cos(angle), ring * np.sin(angle), z], axis=1).astype(np.float32)


_SPHERE = fibonacci_sphere(RAYS * GROUPS)
_REACH = np.resize(np.array(AMBIENT_REACH_M, np.float32), RAYS * GROUPS)


def light_samples(light: Light) -> Float:
    """(RAYS * GROUPS, 3) points spread over the bulb of a light."""
    return np.asarray(light.position_world_m + LAMP_RADIUS_M * _SPHERE, dtype=np.float32)


def visibility(
    tracer: Tracer, light: Light, points_world_m: Float, normals: Float, group: Int
) -> Float:
    """Fractions (n, 2) of the key light and of the ambient that reach points.

    Args:
        tracer: casts the rays.
        light: the key light.
        points_world_m: (n, 3).
        normals: (n, 3) unit.
        group: (n,) below GROUPS, which of the sample directions each point uses.
    """
    start = points_world_m + SURFACE_OFFSET_M * normals
    lit = np.zeros(len(start), np.float32)
    sources = light_samples(light)
    faces = dot(light.position_world_m - start, normals) > -LAMP_RADIUS_M
    turned = np.flatnonzero(faces)
    near, lit_near, group_near = (
        rows(start, turned),
        np.zeros(len(turned), np.float32),
        group[turned],
    )
    open_ = np.zeros(len(start), np.float32)
    known = True
    for k in range(RAYS):
        lit_near += ~tracer.shadowed(near, sources, group_near + GROUPS * k)
        if not known:
            continue
        direction = normals + np.float32(0.97) * rows(_SPHERE, group + GROUPS * k)
        length = np.maximum(norm(direction), np.float32(1e-3))
        reach = np.asarray(rows(_REACH, group + GROUPS * k) / length, dtype=np.float32)
        hidden = tracer.occluded(start, direction, reach)
        known = hidden is not None
        if hidden is not None:
            open_ += ~hidden
    lit[turned] = lit_near / RAYS
    return np.stack([lit, open_ / RAYS if known else np.ones_like(open_)], axis=1)


def block_group(rows: Int, columns: Int) -> Int:
    """Which sample group a place of the light grid uses: all sixteen in each 4×4 block."""
    return np.asarray(((rows % 4) * 4 + (columns + 2 * rows) % 4).astype(np.int32))


def smoothed(points_world_m: Float, normals: Float, depth_m: Float, values: Float) -> Float:
    """Rows, then columns, filtered with 1 2 2 2 1 over grid neighbours on the same surface.

    Args:
        points_world_m: (h, w, 3).
        normals: (h, w, 3) unit, 0 where nothing was hit.
        depth_m: (h, w).
        values: (h, w, c) to be smoothed.
    """
    tolerance = 0.004 + 0.004 * depth_m
    for axis in (1, 0):
        total, weights = 2.0 * values, np.full(depth_m.shape, 2.0, np.float32)
        for shift, share in ((1, 2.0), (2, 1.0)):
            first = (slice(None),) * axis + (slice(None, -shift),)
            second = (slice(None),) * axis + (slice(shift, None),)
            alike = np.float32(share) * same_surface(
                points_world_m[first],
                normals[first],
                tolerance[first],
                points_world_m[second],
                normals[second],
            )
            total[first] += alike[..., None] * values[second]
            total[second] += alike[..., None] * values[first]
            weights[first] += alike
            weights[second] += alike
        values = total / weights[..., None]
    return np.asarray(values)


def same_surface(
    point: Float, normal: Float, tolerance_m: Float, other_point: Float, other_normal: Float
) -> Bool:
    """Whether other points lie in the tangent plane and face alike."""
    across = np.abs(dot(other_point - point, normal))
    return np.asarray((dot(other_normal, normal) > 0.9) & (across < tolerance_m))
