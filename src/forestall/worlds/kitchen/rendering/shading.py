"""Colour of surface points: material, texture, light, reflection, tone.

Works on flat arrays of points, whatever traced them; called by `picture`.
"""

from __future__ import annotations

import mujoco
import numpy as np
import numpy.typing as npt

from forestall.worlds.kitchen.rendering.appearance import TEXTURES, Appearance
from forestall.worlds.kitchen.rendering.lighting import Light, Lights
from forestall.worlds.kitchen.rendering.textures import TINTS, texture
from forestall.worlds.kitchen.rendering.tracer import Float, Hits, Int
from forestall.worlds.kitchen.rendering.vectors import dot, norm, rotated_back, rows

_SHINE: dict[str | None, tuple[float, float, float]] = {
    # highlight, exponent, mirror-like reflection of the room
    "metal": (0.55, 40.0, 0.45),
    "ceramic": (0.35, 70.0, 0.05),
    "tiles": (0.12, 40.0, 0.03),
    "stone": (0.18, 50.0, 0.04),
    "wood": (0.08, 20.0, 0.0),
    "food": (0.10, 16.0, 0.0),
    None: (0.05, 20.0, 0.0),
}
_BACKGROUND = (0.55, 0.62, 0.70)
_GLOW = 2.2
_LEAST_AMBIENT = np.float32(0.2)
"""Share of the ambient that reaches even the tightest corner."""
TEXTURE_PLACES = 64
"""After how many geoms textures begin at the same place again."""
CLEAR_BELOW = 0.98
"""Opacity from which on nothing shines through."""
_GAMMA_STEPS = 1 << 14
_TINTS = np.array([*(TINTS[name] for name in TEXTURES), (1.0, 1.0, 1.0)], np.float32)
_STEPS = np.arange(TEXTURE_PLACES)
_SHIFT_M = np.stack([0.113 * _STEPS, 0.071 * (37 * _STEPS % TEXTURE_PLACES)], 1).astype(np.float32)
"""Where a geom's texture begins, so that neighbours do not show the same piece."""


class Surfaces:
    """What every geom looks like now; the colours are read anew at each `refresh`."""

    def __init__(self, model: mujoco.MjModel, appearance: Appearance) -> None:
        self._model = model
        names = [model.geom(g).name for g in range(model.ngeom)]
        no_material = np.asarray(model.geom_matid) < 0
        self._glows = np.array([n.endswith("_glow") for n in names], dtype=bool) & no_material
        self.kind = np.array(
            [-1 if t is None else TEXTURES.index(t) for t in appearance.texture], dtype=np.int32
        )
        self.place = texture_places(model, appearance)
        shine = [_SHINE.get(t, _SHINE[None]) for t in appearance.texture]
        self.shine: Float = np.array(shine, dtype=np.float32).reshape(-1, 3)
        self.metal: Float = (self.kind == TEXTURES.index("metal")).astype(np.float32)
        for kind in np.unique(self.kind[self.kind >= 0]):
            texture(TEXTURES[kind])
        self.albedo: Float = np.zeros((model.ngeom, 3), np.float32)
        self.alpha: Float = np.ones(model.ngeom, np.float32)
        self.emission: Float = np.zeros(model.ngeom, np.float32)
        self.position: Float = np.zeros((model.ngeom, 3), np.float32)
        self.rotation: Float = np.zeros((model.ngeom, 3, 3), np.float32)
        self.axes: Int = np.zeros((model.ngeom, 3), np.int32)

    def refresh(self, data: mujoco.MjData) -> None:
        """Read colours, sizes and poses."""
        model = self._model
        rgba = np.asarray(model.geom_rgba, np.float32).copy()
        emission = np.where(self._glows, np.float32(1.0), np.float32(0.0))
        owner = np.flatnonzero(model.geom_matid >= 0)
        if owner.size:
            material = model.geom_matid[owner]
            rgba[owner] = model.mat_rgba[material]
            emission[owner] = model.mat_emission[material]
        self.albedo = np.clip(rgba[:, :3], 0, 1) ** np.float32(2.2)
        self.alpha = rgba[:, 3]
        self.emission = emission.astype(np.float32)
        self.position = np.asarray(data.geom_xpos, np.float32)
        self.rotation = np.asarray(data.geom_xmat, np.float32).reshape(-1, 3, 3)
        half = np.asarray(model.geom_aabb[:, 3:])
        self.axes = np.argsort(-half, axis=1, kind="stable").astype(np.int32)


def texture_places(model: mujoco.MjModel, appearance: Appearance) -> Int:
    """(ngeom,) where each geom's texture begins.

    What is no instance (the robot) comes after all that there is: counted within its own body, it
    looks the same however many things there are.
    """
    own = np.arange(model.ngeom) - np.asarray(model.body_geomadr)[model.geom_bodyid]
    index = np.where(appearance.geom_instance < 0, own, np.arange(model.ngeom))
    return np.asarray(index % TEXTURE_PLACES, dtype=np.int32)


def shade(
    surfaces: Surfaces,
    lights: Lights,
    hits: Hits,
    points_world_m: Float,
    directions: Float,
    reach: Float,
    pixel_m: float,
) -> Float:
    """Linear colours in [0, 1] of hits; the background where nothing was hit.

    Args:
        surfaces: materials of the geoms.
        lights: the lights.
        hits: what n rays met.
        points_world_m: (n, 3) where.
        directions: (n, 3) rays of unit z in the camera frame.
        reach: (n, 2) visibility of the key light and of the ambient.
        pixel_m: width of a pixel at 1 m.
    """
    geom, normal = hits.geom, hits.normal
    albedo = rows(surfaces.albedo, geom)
    albedo *= _texture_factor(surfaces, hits, points_world_m, pixel_m)
    open_ = _LEAST_AMBIENT + (1 - _LEAST_AMBIENT) * reach[:, 1]
    up = (normal[:, 2] * np.float32(0.5) + np.float32(0.5)) * open_
    light = lights.ground * (open_ - up)[:, None] + lights.sky * up[:, None]
    towards, strength = _arriving(lights.key, points_world_m, normal)
    light += lights.key.colour * (strength * reach[:, 0] * (0.7 + 0.3 * open_))[:, None]
    for lamp in lights.fill:
        _, more = _arriving(lamp, points_world_m, normal)
        light += lamp.colour * (more * (0.35 + 0.65 * open_))[:, None]
    colour = albedo * light
    glint, mirror = _gloss(surfaces, geom, normal, directions, towards, reach)
    if glint.any() or mirror.any():
        metal = rows(surfaces.metal, geom)[:, None]
        tint = 1 + metal * (albedo - 1)
        colour += (glint[:, None] * lights.key.colour + mirror[:, None]) * tint
    emission = rows(surfaces.emission, geom)
    if emission.any():
        colour += albedo * (_GLOW * emission)[:, None]
        colour += (0.12 * emission)[:, None]
    colour = soft_clip(colour)
    missed = np.flatnonzero(geom < 0)
    if missed.size:
        colour[missed] = np.array(_BACKGROUND, np.float32)
    return colour


def _arriving(light: Light, points: Float, normal: Float) -> tuple[Float, Float]:
    """Unit directions to the light and the cosine-weighted strength that arrives."""
    if light.directional:
        towards = np.broadcast_to(-light.direction, points.shape)
        cosine = dot(normal, towards)
        return towards, np.maximum(cosine, 0).astype(np.float32)
    towards = light.position_world_m - points
    distance = norm(towards)
    towards /= np.maximum(distance, 1e-6)[:, None]
    strength = np.maximum(dot(normal, towards), 0)
    c, linear, square = light.attenuation
    if linear or square or c != 1.0:
        strength = strength / np.maximum(c + distance * (linear + square * distance), 1e-3)
    if light.cone_cosine > -1:
        along = -dot(towards, light.direction)
        strength = strength * np.clip((along - light.cone_cosine + 0.1) / 0.25, 0, 1)
    return towards, strength.astype(np.float32)


def _gloss(
    surfaces: Surfaces, geom: Int, normal: Float, directions: Float, towards: Float, reach: Float
) -> tuple[Float, Float]:
    """Highlight of the key light and a blurred reflection of a bright ceiling and dark floor."""
    glint, mirror = np.zeros(len(geom), np.float32), np.zeros(len(geom), np.float32)
    some = np.flatnonzero(rows(surfaces.shine[:, 0] > 0.06, geom) & (geom >= 0))
    if not some.size:
        return glint, mirror
    shine, metal = rows(surfaces.shine, geom[some]), rows(surfaces.metal, geom[some])
    facing, light = rows(normal, some), rows(reach, some)
    view = -rows(directions, some)
    view /= norm(view)[:, None]
    half = view + rows(towards, some)
    half /= (norm(half) + np.float32(1e-6))[:, None]
    peak = np.maximum(dot(half, facing), 0) ** shine[:, 1]
    glint[some] = shine[:, 0] * peak * light[:, 0]
    cosine = np.maximum(dot(view, facing), 0)
    grazing = (1 - cosine) * (1 - cosine)
    fresnel = (0.04 + 0.96 * grazing * grazing) * (shine[:, 2] > 0) * (1 - metal)
    rising = 2 * cosine * facing[:, 2] - view[:, 2]
    bright = np.clip(0.45 + 0.75 * rising, 0, 1)
    room = (0.18 + 0.75 * bright * bright) * (0.3 + 0.7 * light[:, 1])
    mirror[some] = (shine[:, 2] + 0.5 * fresnel) * room
    return glint, mirror


def _texture_factor(surfaces: Surfaces, hits: Hits, points: Float, pixel_m: float) -> Float:
    """(n, 3) what the colours of the geoms are multiplied with."""
    kinds = rows(surfaces.kind, hits.geom)
    kinds[hits.geom < 0] = -1
    textured = np.flatnonzero(kinds >= 0)
    deviation = np.zeros(len(kinds), np.float32)
    if textured.size:
        geom = rows(hits.geom, textured)
        rotation = rows(surfaces.rotation, geom)
        local = rotated_back(rotation, rows(points, textured) - rows(surfaces.position, geom))
        across = np.abs(rotated_back(rotation, rows(hits.normal, textured)))
        uv = face_coordinates(local, across, rows(surfaces.axes, geom))
        uv += rows(_SHIFT_M, rows(surfaces.place, geom))
        footprint = rows(hits.distance, textured) * np.float32(pixel_m)
        kind_here = rows(kinds, textured)
        for kind in np.unique(kind_here):
            some = np.flatnonzero(kind_here == kind)
            tone = texture(TEXTURES[kind]).sample(rows(uv, some), rows(footprint, some))
            deviation[rows(textured, some)] = tone - 1
    return np.asarray(1 + deviation[:, None] * rows(_TINTS, kinds))


def face_coordinates(local_m: Float, across: Float, axes: Int) -> Float:
    """Coordinates (n, 2) in the face that each point lies on, the geom's longer axis first.

    Args:
        local_m: (n, 3) points in the geom's frame.
        across: (n, 3) absolute components of the normal there.
        axes: (n, 3) the geom's axes by falling extent.
    """
    x, y, z = across[:, 0], across[:, 1], across[:, 2]
    normal_axis = np.where(x >= y, np.where(x >= z, 0, 2), np.where(y >= z, 1, 2))
    first = np.where(axes[:, 0] == normal_axis, axes[:, 1], axes[:, 0])
    second = 3 - normal_axis - first
    start = 3 * np.arange(len(local_m))
    flat = local_m.ravel()
    return np.stack([flat.take(start + first), flat.take(start + second)], axis=1)


def soft_clip(colour: Float) -> Float:
    """Compresses what is brighter than 0.6 so that nothing burns out."""
    knee = np.float32(0.6)
    over = np.maximum(colour - knee, 0)
    return np.asarray(np.minimum(colour, knee) + (1 - knee) * over / (over + (1 - knee)))


_TO_DISPLAY = np.round(255 * np.linspace(0, 1, _GAMMA_STEPS) ** (1 / 2.2)).astype(np.uint8)


def to_display(colour: Float) -> npt.NDArray[np.uint8]:
    """Linear [0, 1] to 8-bit with gamma 2.2."""
    return _TO_DISPLAY[(np.clip(colour, 0, 1) * (_GAMMA_STEPS - 1) + 0.5).astype(np.int32)]
