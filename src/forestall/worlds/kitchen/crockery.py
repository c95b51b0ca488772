"""Builds vessels, dishes and bottles, with their liquids, stains and shards."""

from __future__ import annotations

import itertools
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from forestall.worlds.kitchen import meshes
from forestall.worlds.kitchen.assembly import Assembly, When
from forestall.worlds.kitchen.forms import Form, Rect, Region, Rgba

LIQUIDS: dict[str, Rgba] = {
    "water": (0.46, 0.70, 0.88, 1),
    "coffee": (0.17, 0.085, 0.035, 1),
    "wine": (0.42, 0.02, 0.09, 1),
}
STAIN: Rgba = (0.27, 0.155, 0.05, 1)
_STAIN_ON_DARK: Rgba = (0.56, 0.38, 0.17, 1)
WHOLE: When = {"broken": ("intact",)}

_CHINA: tuple[Rgba, ...] = (
    (0.93, 0.92, 0.89, 1),
    (0.84, 0.88, 0.92, 1),
    (0.90, 0.84, 0.72, 1),
    (0.72, 0.83, 0.80, 1),
    (0.93, 0.80, 0.77, 1),
)
_VIVID: tuple[Rgba, ...] = (
    *_CHINA,
    (0.75, 0.22, 0.18, 1),
    (0.18, 0.36, 0.60, 1),
    (0.88, 0.66, 0.20, 1),
    (0.25, 0.50, 0.36, 1),
)
_STEEL: tuple[Rgba, ...] = ((0.74, 0.75, 0.77, 1), (0.66, 0.67, 0.69, 1), (0.80, 0.78, 0.74, 1))
_COLOURS: Mapping[str, tuple[Rgba, ...]] = {
    "Mug": _VIVID,
    "Cup": _CHINA,
    "Bowl": _CHINA,
    "Plate": _CHINA,
    "Pot": (*_STEEL, (0.60, 0.18, 0.15, 1), (0.22, 0.33, 0.42, 1)),
    "Pan": ((0.13, 0.13, 0.14, 1), (0.20, 0.20, 0.21, 1), (0.30, 0.28, 0.27, 1)),
    "Kettle": (*_STEEL, (0.63, 0.16, 0.14, 1), (0.20, 0.42, 0.44, 1)),
    "WineBottle": ((0.16, 0.27, 0.15, 1), (0.22, 0.24, 0.10, 1), (0.13, 0.22, 0.20, 1)),
}


def chosen(category: str, rng: np.random.Generator, otherwise: Sequence[Rgba] = _VIVID) -> Rgba:
    """A plausible colour of a category, slightly varied."""
    options = _COLOURS.get(category, tuple(otherwise))
    r, g, b, a = options[int(rng.integers(len(options)))]
    shade = float(rng.uniform(0.95, 1.05))
    return (min(r * shade, 1), min(g * shade, 1), min(b * shade, 1), a)


def stain_on(rgba: Rgba) -> Rgba:
    """A brown that stands out on a colour."""
    return STAIN if sum(rgba[:3]) > 0.9 else _STAIN_ON_DARK


def darker(rgba: Rgba, factor: float) -> Rgba:
    """The same hue, darker (or lighter with a factor above 1)."""
    return (
        min(rgba[0] * factor, 1),
        min(rgba[1] * factor, 1),
        min(rgba[2] * factor, 1),
        rgba[3],
    )


@dataclass(frozen=True, slots=True)
class _Walls:
    """Inner and outer wall lines, (radius, height) from the floor up."""

    outer: list[tuple[float, float]]
    inner: list[tuple[float, float]]
    floor_m: float

    @property
    def closed(self) -> list[tuple[float, float]]:
        return [(0, 0), *self.outer, *reversed(self.inner), (0, self.floor_m)]

    def inner_radius(self, z: float) -> float:
        line = np.array(self.inner)
        return float(np.interp(z, line[:, 1], line[:, 0]))


def _walls(radius: float, height: float, flare: float, thick: float, neck: float) -> _Walls:
    """A wall that widens by `flare` from the foot to the rim, or narrows to `neck`."""
    steps = np.linspace(0, 1, 6 if flare != 1 or neck != 1 else 2)
    foot = radius / flare
    outer = []
    for t in steps:
        r = foot + (radius - foot) * float(np.sin(t * np.pi / 2) ** 0.85)
        if neck != 1:
            r = (
                radius
                * (0.94 + 0.06 * min(1.0, t * 4))
                * (1 - (1 - neck) * max(t - 0.35, 0) / 0.65)
            )
        outer.append((r, float(t) * height))
    floor = min(max(2 * thick, 0.006), 0.012)
    inner = [
        (r - thick, floor + (height - floor) * float(t))
        for (r, _), t in zip(outer, steps, strict=True)
    ]
    return _Walls(outer, inner, floor)


def vessel(part: Assembly, category: str, shape: Mapping[str, Any], states: frozenset[str]) -> Form:
    """A hollow thing, open at the top.

    Args:
        part: where to build.
        category: its category (for its colours).
        shape: `size_m` and the options `flare`, `handle`, `long_handle` of the catalogue.
        states: attributes that it can have.
    """
    rng = part.kit.rng
    sx, _, height = (float(s) for s in shape["size_m"])
    radius = sx / 2
    kettle = bool(shape.get("handle")) and height >= sx > 0.12
    metal = "broken" not in states
    walls = _walls(
        radius,
        height,
        float(shape.get("flare", 1.08 if not kettle else 1.0)),
        0.0035 if radius < 0.06 else 0.005,
        0.55 if kettle else 1.0,
    )
    rgba = chosen(category, rng)
    whole: When = WHOLE if "broken" in states else {}
    texture = "metal" if metal else "ceramic"
    part.mesh(meshes.lathe(walls.closed, 24), rgba, texture=texture, when=whole)
    part.proxy((0, 0, height / 2), radius, height)
    footprint = Rect(-radius, -radius, radius, radius)
    if shape.get("handle"):
        footprint = _handles(part, footprint, walls, height, rgba, whole, shape, kettle)
    if "filled" in states:
        level = walls.floor_m + (height - walls.floor_m) * 0.80
        part.cylinder(
            (0, 0, level - 0.001),
            walls.inner_radius(level) + 0.001,
            0.002,
            LIQUIDS["water"],
            when={"filled": ("water", "coffee", "wine"), **whole},
            tints=("filled", LIQUIDS),
            solid=False,
        )
    if "dirty" in states:
        _stain_walls(part, walls, whole, stain_on(rgba))
    if "broken" in states:
        _shards(part, radius, rgba)
    profile = tuple((z - walls.floor_m, r) for r, z in walls.inner)
    region = Region(
        receptacle=part.name,
        carrier=part.name,
        area=Rect(-radius, -radius, radius, radius),
        z_m=walls.floor_m + 0.0005,
        clearance_m=height - walls.floor_m,
        kind="pile",
        profile=profile,
    )
    return Form(footprint, height * (1.35 if kettle else 1.0), radius, (region,))


def _handles(
    part: Assembly,
    footprint: Rect,
    walls: _Walls,
    height: float,
    rgba: Rgba,
    whole: When,
    shape: Mapping[str, Any],
    kettle: bool,
) -> Rect:
    radius = footprint.x1
    dark: Rgba = (0.09, 0.09, 0.10, 1)
    if shape.get("long_handle"):
        z = height * 0.72
        end = radius + 0.19
        part.capsule((0, radius - 0.004, z), (0, radius + 0.05, z + 0.012), 0.008, rgba, when=whole)
        part.capsule(
            (0, radius + 0.05, z + 0.012), (0, end - 0.011, z + 0.024), 0.011, dark, when=whole
        )
        return Rect(footprint.x0, footprint.y0, radius, end)
    if kettle:
        top, out = height * 1.28, radius * 0.72
        arc = [(-out, height * 0.80), (-out * 0.75, top), (out * 0.75, top), (out, height * 0.80)]
        for (y0, z0), (y1, z1) in itertools.pairwise(arc):
            part.capsule((0, y0, z0), (0, y1, z1), 0.008, dark, when=whole, solid=False)
        part.capsule(
            (radius * 0.8, 0, height * 0.45),
            (radius + 0.035, 0, height * 0.80),
            0.013,
            rgba,
            texture="metal",
            when=whole,
            solid=False,
        )
        return Rect(footprint.x0, footprint.y0, radius + 0.05, footprint.y1)
    if radius < 0.06:
        return _ring_handle(part, footprint, walls, height, rgba, whole)
    z = height * 0.80
    for side in (-1, 1):
        x = side * (radius + 0.018)
        for y in (-0.03, 0.03):
            part.capsule(
                (side * (radius - 0.005), y, z), (x, y, z), 0.006, dark, when=whole, solid=False
            )
        part.capsule((x, -0.03, z), (x, 0.03, z), 0.007, dark, when=whole)
    return Rect(footprint.x0 - 0.027, footprint.y0, footprint.x1 + 0.027, footprint.y1)


def _ring_handle(
    part: Assembly, footprint: Rect, walls: _Walls, height: float, rgba: Rgba, whole: When
) -> Rect:
    radius = footprint.x1
    out = radius + 0.026
    low, high = height * 0.27, height * 0.75
    low_r = float(np.interp(low, [z for _, z in walls.outer], [r for r, _ in walls.outer]))
    line = [(low_r - 0.002, low), (out, low + 0.01), (out, high - 0.01), (radius - 0.004, high)]
    for (x0, z0), (x1, z1) in itertools.pairwise(line):
        part.capsule((x0, 0, z0), (x1, 0, z1), 0.0055, rgba, texture="ceramic", when=whole)
    return Rect(footprint.x0, footprint.y0, out + 0.006, footprint.y1)


def _stain_walls(part: Assembly, walls: _Walls, whole: When, brown: Rgba) -> None:
    """Irregular brown patches on the floor, the inner wall up to the rim, and the outer wall."""
    rng = part.kit.rng
    radius, height = walls.outer[-1]
    inside = [(0.001, walls.floor_m), *walls.inner]
    scale = float(np.clip(radius * 0.42, 0.019, 0.040))
    turns = rng.uniform(0, 2 * np.pi) + np.arange(7) * 2 * np.pi / 7
    patches = []
    for k, angle in enumerate(turns):
        size = scale * float(rng.uniform(0.75, 1.15))
        size_in = min(size, height * 0.8)
        at_in = float(rng.uniform(0.72, 0.88) if k % 2 else rng.uniform(0.25, 0.5))
        patches.append(meshes.patch_on_lathe(inside, angle, at_in, size_in, -0.0012, rng))
        if k % 3 != 2:
            size_out = min(size, height * 0.44)
            at = float(rng.uniform(0.45, 0.7))
            patches.append(
                meshes.patch_on_lathe(walls.outer, angle + 0.5, at, size_out, 0.0012, rng)
            )
    for _ in range(3):
        r, a = walls.inner[0][0] * 0.5 * rng.uniform(0.2, 1), rng.uniform(0, 2 * np.pi)
        size = min(scale * 1.1, walls.inner[0][0] * 0.48)
        spot = meshes.extrude(meshes.blob(size, rng), 0, 0.0012)
        x, y = float(r * np.cos(a)), float(r * np.sin(a))
        patches.append(meshes.moved(spot, x, y, walls.floor_m))
    part.mesh(meshes.merged(patches), brown, texture="food", when={"dirty": ("dirty",), **whole})


def _shards(part: Assembly, radius: float, rgba: Rgba) -> None:
    rng = part.kit.rng
    pieces = []
    for k in range(7):
        angle = 2 * np.pi * k / 7 + rng.uniform(-0.3, 0.3)
        reach = radius * rng.uniform(0.25, 0.75)
        outline = meshes.blob(radius * float(rng.uniform(0.22, 0.38)), rng, 5)
        piece = meshes.extrude(outline, 0.0, 0.006 + 0.008 * float(rng.uniform()))
        x, y = float(reach * np.cos(angle)), float(reach * np.sin(angle))
        pieces.append(meshes.moved(piece, x, y, 0.0))
    part.mesh(meshes.merged(pieces), rgba, texture="ceramic", when={"broken": ("broken",)})


def dish(part: Assembly, category: str, shape: Mapping[str, Any], states: frozenset[str]) -> Form:
    """A shallow plate with a raised rim."""
    rng = part.kit.rng
    sx, _, height = (float(s) for s in shape["size_m"])
    radius = sx / 2
    flat = radius * 0.62
    whole: When = WHOLE if "broken" in states else {}
    rgba = chosen(category, rng)
    outer = [(flat * 0.9, 0.0), (flat * 1.05, 0.004), (radius, height)]
    inner = [(flat, 0.006), (radius - 0.006, height)]
    line = [(0, 0.0), *outer, *reversed(inner), (0, 0.006)]
    part.mesh(meshes.lathe(line, 28), rgba, texture="ceramic", when=whole)
    if rng.uniform() < 0.5:
        ring = [(radius * 0.80, height * 0.66), (radius * 0.88, height * 0.86)]
        band = meshes.lathe(ring[::-1], 28)
        tone = darker(chosen("", rng), 0.8)
        part.mesh((band[0] + [0, 0, 0.0022], band[1]), tone, when=whole)
    part.proxy((0, 0, 0.003), radius * 0.7, 0.006)
    part.proxy((0, 0, height / 2 + 0.003), radius, max(height - 0.006, 0.004))
    if "dirty" in states:
        spots = []
        for k in range(6):
            angle = 2 * np.pi * k / 6 + float(rng.uniform(-0.4, 0.4))
            size = radius * float(rng.uniform(0.20, 0.32))
            if k % 2:
                spots.append(meshes.patch_on_lathe(inner, angle, 0.5, size * 0.7, -0.0015, rng))
            reach = radius * float(rng.uniform(0.12, 0.42))
            spot = meshes.extrude(meshes.blob(size, rng), 0, 0.0012)
            x, y = float(reach * np.cos(angle)), float(reach * np.sin(angle))
            spots.append(meshes.moved(spot, x, y, 0.006))
        part.mesh(meshes.merged(spots), STAIN, texture="food", when={"dirty": ("dirty",), **whole})
    if "broken" in states:
        _shards(part, radius, rgba)
    region = Region(
        receptacle=part.name,
        carrier=part.name,
        area=Rect(-flat, -flat, flat, flat),
        z_m=0.0065,
        clearance_m=0.14,
        kind="pile",
        profile=((0.0, flat), (height - 0.006, radius * 0.95), (0.15, radius * 0.95)),
    )
    return Form(Rect(-radius, -radius, radius, radius), height, radius, (region,))


def bottle(part: Assembly, category: str, shape: Mapping[str, Any], states: frozenset[str]) -> Form:
    """A bottle with a label; its glass is dark up to the level of what is in it."""
    rng = part.kit.rng
    sx, _, height = (float(s) for s in shape["size_m"])
    r = sx / 2
    glass = chosen(category, rng)
    light = (0.42, 0.56, 0.40, 1.0)
    shoulder, neck = height * 0.62, height * 0.76
    line = [
        (0, 0),
        (r * 0.96, 0.0),
        (r, 0.006),
        (r, shoulder),
        (r * 0.36, neck),
        (r * 0.34, height * 0.97),
        (r * 0.40, height * 0.975),
        (r * 0.40, height),
        (0, height),
    ]
    part.mesh(meshes.lathe(line, 20), light if "filled" in states else glass, texture="ceramic")
    if "filled" in states:
        full = [(r + 0.0008, 0.004), (r + 0.0008, shoulder), (r * 0.42, neck), (r * 0.36, neck)]
        shades = {k: darker(glass, 0.35) if k == "wine" else v for k, v in LIQUIDS.items()}
        part.mesh(
            meshes.lathe(full, 20),
            glass,
            texture="ceramic",
            when={"filled": tuple(LIQUIDS)},
            tints=("filled", shades),
        )
    label = [(r + 0.0015, height * 0.18), (r + 0.0015, height * 0.42)]
    part.mesh(meshes.lathe(label, 20), (0.90, 0.86, 0.74, 1))
    part.cylinder((0, 0, height * 0.97), r * 0.42, height * 0.06, chosen("", rng), solid=False)
    part.proxy((0, 0, height / 2), r, height)
    return Form(Rect(-r, -r, r, r), height, r)
