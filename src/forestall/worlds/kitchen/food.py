"""Builds food: whole fruit and vegetables, loaves, slices, whole and cracked eggs."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from forestall.worlds.kitchen import meshes
from forestall.worlds.kitchen.assembly import Assembly, When
from forestall.worlds.kitchen.crockery import chosen, darker
from forestall.worlds.kitchen.forms import Form, Rect, Rgba

_SKIN: Mapping[str, tuple[Rgba, ...]] = {
    "Potato": ((0.72, 0.55, 0.33, 1), (0.66, 0.48, 0.28, 1), (0.78, 0.62, 0.40, 1)),
    "Tomato": ((0.80, 0.13, 0.09, 1), (0.86, 0.22, 0.10, 1)),
    "Lettuce": ((0.45, 0.66, 0.24, 1), (0.38, 0.60, 0.22, 1), (0.52, 0.70, 0.32, 1)),
    "Apple": ((0.75, 0.12, 0.12, 1), (0.55, 0.70, 0.20, 1), (0.85, 0.62, 0.22, 1)),
    "Bread": ((0.71, 0.46, 0.22, 1), (0.62, 0.39, 0.19, 1)),
    "Egg": ((0.94, 0.89, 0.80, 1), (0.84, 0.64, 0.47, 1), (0.97, 0.95, 0.91, 1)),
}
_FLESH: Mapping[str, Rgba] = {
    "Potato": (0.93, 0.86, 0.62, 1),
    "Tomato": (0.93, 0.42, 0.30, 1),
    "Lettuce": (0.74, 0.86, 0.48, 1),
    "Apple": (0.96, 0.92, 0.76, 1),
    "Bread": (0.93, 0.84, 0.66, 1),
}
_FOOD: tuple[Rgba, ...] = ((0.80, 0.45, 0.20, 1), (0.70, 0.60, 0.25, 1), (0.55, 0.25, 0.35, 1))
_BROWN: Rgba = (0.34, 0.19, 0.075, 1)


def _of(category: str) -> str:
    return category.removesuffix("Sliced")


def _browned(rgba: Rgba, share: float = 0.72) -> Rgba:
    mixed = [c * (1 - share) + b * share for c, b in zip(rgba[:3], _BROWN[:3], strict=True)]
    return (mixed[0], mixed[1], mixed[2], 1)


def _cooking(states: frozenset[str], raw: Rgba, done: Rgba) -> dict[str, Any]:
    return {"tints": ("cooked", {"raw": raw, "cooked": done})} if "cooked" in states else {}


def ellipsoid(
    part: Assembly, category: str, shape: Mapping[str, Any], states: frozenset[str]
) -> Form:
    """A whole fruit, vegetable or egg."""
    rng = part.kit.rng
    sx, sy, sz = (float(s) for s in shape["size_m"])
    radii = (sx / 2, sy / 2, sz / 2)
    skin = chosen("", rng, _SKIN.get(category, _FOOD))
    look: dict[str, Any] = {"texture": "food"} | _cooking(states, skin, _browned(skin))
    if category == "Egg":
        part.ellipsoid(
            (0, 0, radii[2]),
            radii,
            skin,
            texture="ceramic",
            solid=False,
            when={"broken": ("intact",)} if "broken" in states else None,
        )
        if "broken" in states:
            _mess(part, sx, skin)
    else:
        rough = {"Potato": 0.16, "Lettuce": 0.26, "Tomato": 0.05, "Apple": 0.06}.get(category, 0.05)
        part.mesh(meshes.lump(radii, rough, rng, 9 if rough > 0.1 else 8), skin, **look)
        _greens(part, category, radii, skin)
    part.proxy((0, 0, sz / 2), 0.9 * min(sx, sy) / 2, sz)
    footprint = Rect(-radii[0], -radii[1], radii[0], radii[1])
    return Form(footprint, sz, max(radii[0], radii[1]))


def _greens(part: Assembly, category: str, radii: tuple[float, float, float], skin: Rgba) -> None:
    rng = part.kit.rng
    if category == "Lettuce":
        leaves = []
        for k in range(9):
            one = meshes.leaf(radii[0] * 0.95, radii[0] * 0.9, 0.55)
            height = radii[2] * float(rng.uniform(0.35, 1.25))
            reach = radii[0] * 0.18
            turn = 2.4 * k
            shifted = meshes.moved(one, reach, 0, height)
            leaves.append(meshes.moved(shifted, 0, 0, 0, turn))
        mesh = meshes.merged(leaves)
        inside = np.clip(mesh[0], [-radii[0], -radii[1], 0.004], [radii[0], radii[1], 2 * radii[2]])
        part.mesh((inside, mesh[1]), darker(skin, 1.18), texture="food")
    elif category in ("Tomato", "Apple"):
        top = 2 * radii[2]
        stem: Rgba = (0.23, 0.36, 0.12, 1) if category == "Tomato" else (0.33, 0.22, 0.12, 1)
        part.cylinder((0, 0, top - 0.004), 0.003, 0.012, stem, solid=False)
        if category == "Tomato":
            star = [
                (r * np.cos(a), r * np.sin(a))
                for a, r in zip(np.arange(10) * np.pi / 5, [0.016, 0.005] * 5, strict=True)
            ]
            part.mesh(meshes.extrude(star, top - 0.006, top - 0.002), stem)


def _mess(part: Assembly, size: float, shell: Rgba) -> None:
    """A broken egg: white and yolk run out between pieces of shell."""
    rng = part.kit.rng
    broken: When = {"broken": ("broken",)}
    part.mesh(
        meshes.extrude(meshes.blob(size * 1.1, rng), 0, 0.003), (0.93, 0.91, 0.80, 1), when=broken
    )
    part.ellipsoid(
        (0, 0, 0.004), (0.016, 0.015, 0.006), (0.95, 0.66, 0.10, 1), when=broken, solid=False
    )
    pieces = []
    for k in range(4):
        piece = meshes.extrude(meshes.blob(size * 0.3, rng, 5), 0, 0.008)
        a = 1.6 * k + float(rng.uniform(0, 0.6))
        pieces.append(meshes.moved(piece, 0.8 * size * np.cos(a), 0.8 * size * np.sin(a), 0.002))
    part.mesh(meshes.merged(pieces), shell, when=broken)


def loaf(part: Assembly, category: str, shape: Mapping[str, Any], states: frozenset[str]) -> Form:
    """A loaf of bread along x, or any box-shaped food."""
    rng = part.kit.rng
    sx, sy, sz = (float(s) for s in shape["size_m"])
    crust = chosen("", rng, _SKIN.get(category, _FOOD))
    look: dict[str, Any] = {"texture": "food"} | _cooking(states, crust, _browned(crust))
    body = _upright(meshes.extrude(_bread_outline(sy, sz), -sx / 2, sx / 2))
    part.mesh(body, crust, **look)
    score = []
    for x in np.linspace(-0.3, 0.3, 4) * sx:
        cut = meshes.extrude(meshes.blob(0.012, rng, 8), 0, 0.002)
        stretched = (cut[0] * np.array([0.45, sy * 26, 1]), cut[1])
        score.append(meshes.moved(stretched, float(x), 0, sz - 0.0012))
    part.mesh(meshes.merged(score), darker(crust, 1.35), texture="food")
    part.proxy_box((0, 0, sz / 2), (sx, sy, sz))
    return Form(Rect(-sx / 2, -sy / 2, sx / 2, sy / 2), sz, float(np.hypot(sx, sy)) / 2)


def _bread_outline(width: float, height: float) -> list[tuple[float, float]]:
    """Cross-section of a loaf: flat below, rounded and bulging above; from y = -w/2, z = 0."""
    w, h = width / 2, height
    return [
        (-0.86 * w, 0),
        (0.86 * w, 0),
        (0.90 * w, 0.5 * h),
        (w, 0.66 * h),
        (0.94 * w, 0.84 * h),
        (0.62 * w, 0.97 * h),
        (0.2 * w, h),
        (-0.2 * w, h),
        (-0.62 * w, 0.97 * h),
        (-0.94 * w, 0.84 * h),
        (-w, 0.66 * h),
        (-0.90 * w, 0.5 * h),
    ]


def _upright(mesh: meshes.Mesh) -> meshes.Mesh:
    """An outline in (y, z) extruded along x."""
    vertices = mesh[0][:, [2, 0, 1]]
    return np.ascontiguousarray(vertices), mesh[1]


def slab(part: Assembly, category: str, shape: Mapping[str, Any], states: frozenset[str]) -> Form:
    """A slice lying flat."""
    rng = part.kit.rng
    sx, sy, sz = (float(s) for s in shape["size_m"])
    of = _of(category)
    skin = chosen("", rng, _SKIN.get(of, _FOOD))
    flesh = _FLESH.get(of, darker(skin, 1.3))
    toasted = (0.50, 0.27, 0.09, 1.0) if of == "Bread" else _browned(flesh, 0.55)
    cook = _cooking(states, flesh, toasted)
    rind = _cooking(states, skin, _browned(skin, 0.85))
    if of == "Bread":
        outline = [(x, y - sy / 2) for x, y in _bread_outline(sx, sy)]
    elif of == "Lettuce":
        outline = meshes.blob(sx / 2, rng, 14)
    else:
        angles = 2 * np.pi * np.arange(16) / 16
        outline = [(sx / 2 * float(np.cos(a)), sy / 2 * float(np.sin(a))) for a in angles]
    core = [(x * 0.88, y * 0.88) for x, y in outline]
    part.mesh(meshes.extrude(outline, 0.0004, sz - 0.0008), skin, texture="food", **rind)
    part.mesh(meshes.extrude(core, 0, sz), flesh, texture="food", **cook)
    if of == "Tomato":
        seeds = []
        for k in range(5):
            a = 2 * np.pi * k / 5
            pocket = meshes.extrude(meshes.blob(sx * 0.11, rng, 7), sz, sz + 0.0006)
            seeds.append(meshes.moved(pocket, sx * 0.24 * np.cos(a), sx * 0.24 * np.sin(a), 0))
        part.mesh(meshes.merged(seeds), (0.93, 0.62, 0.28, 1))
    if of == "Lettuce":
        rib = meshes.extrude(
            [(-0.003, -sy * 0.4), (0.003, -sy * 0.4), (0, sy * 0.4)], sz, sz + 6e-4
        )
        part.mesh(rib, (0.90, 0.93, 0.74, 1))
    if of == "Bread":
        part.proxy_box((0, 0, sz / 2), (sx, sy, sz))
        core_m = float(np.hypot(sx, sy)) / 2 * 0.92
    else:
        core_m = max(sx, sy) / 2
        part.proxy((0, 0, sz / 2), core_m, sz)
    return Form(Rect(-sx / 2, -sy / 2, sx / 2, sy / 2), sz, core_m)


def egg_cracked(
    part: Assembly, category: str, shape: Mapping[str, Any], states: frozenset[str]
) -> Form:
    """White and yolk; firm, with a brown edge, once cooked."""
    rng = part.kit.rng
    sx, sy, sz = (float(s) for s in shape["size_m"])
    r = min(sx, sy) / 2
    raw, firm = (0.86, 0.84, 0.66, 1.0), (0.98, 0.97, 0.95, 1.0)
    outline = meshes.blob(r, rng, 13)
    wide = [(x * 1.0, y * 1.0) for x, y in outline]
    rim = [(x * 0.86, y * 0.86) for x, y in outline]
    tints = _cooking(states, raw, firm)
    part.mesh(
        meshes.extrude(wide, 0, sz * 0.20), raw, **_cooking(states, raw, (0.62, 0.40, 0.17, 1))
    )
    part.mesh(meshes.extrude(rim, 0, sz * 0.34), raw, **tints)
    yolk, done = (0.97, 0.62, 0.06, 1.0), (0.93, 0.73, 0.30, 1.0)
    part.ellipsoid(
        (0, 0, sz * 0.36),
        (r * 0.40, r * 0.38, sz * 0.6),
        yolk,
        solid=False,
        **_cooking(states, yolk, done),
    )
    part.proxy((0, 0, sz * 0.2), r, sz * 0.4)
    return Form(Rect(-r, -r, r, r), sz, r)
