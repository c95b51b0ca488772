"""Builds potted plants."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from forestall.worlds.kitchen import meshes
from forestall.worlds.kitchen.assembly import Assembly
from forestall.worlds.kitchen.crockery import LIQUIDS, chosen
from forestall.worlds.kitchen.forms import Form, Rect


def plant(part: Assembly, category: str, shape: Mapping[str, Any], states: frozenset[str]) -> Form:
    """A potted plant; the soil is dark and wet once it has been watered."""
    rng = part.kit.rng
    sx, _, height = (float(s) for s in shape["size_m"])
    r, tall = sx / 2 * 0.72, height * 0.38
    clay = chosen("", rng, ((0.68, 0.36, 0.24, 1), (0.85, 0.84, 0.80, 1), (0.35, 0.42, 0.45, 1)))
    line = [
        (0, 0),
        (r * 0.72, 0),
        (r * 0.96, tall * 0.85),
        (r, tall * 0.86),
        (r, tall),
        (r * 0.88, tall),
        (r * 0.86, tall * 0.84),
        (0, tall * 0.84),
    ]
    part.mesh(meshes.lathe(line, 20), clay, texture="ceramic")
    dry, wet = (0.52, 0.40, 0.28, 1), (0.16, 0.095, 0.055, 1)
    soil = {"empty": dry, **dict.fromkeys(LIQUIDS, wet)}
    part.cylinder(
        (0, 0, tall * 0.88),
        r * 0.86,
        tall * 0.06,
        dry,
        texture="food",
        tints=("filled", soil),
        solid=False,
    )
    if "filled" in states:
        sheen = []
        for k in range(5):
            a = 2 * np.pi * k / 5 + float(rng.uniform(-0.3, 0.3))
            pool = meshes.extrude(meshes.blob(r * 0.22, rng, 8), 0, 0.001)
            x, y = float(r * 0.58 * np.cos(a)), float(r * 0.58 * np.sin(a))
            sheen.append(meshes.moved(pool, x, y, tall * 0.913))
        part.mesh(meshes.merged(sheen), LIQUIDS["water"], when={"filled": tuple(LIQUIDS)})
    green = chosen("", rng, ((0.20, 0.42, 0.16, 1), (0.27, 0.48, 0.20, 1), (0.16, 0.36, 0.22, 1)))
    leaves = []
    for k in range(15):
        length = float(rng.uniform(0.8, 1.0)) * sx / 2
        base = tall + (height - tall) * (0.12 + 0.55 * k / 15)
        droop = float(rng.uniform(0.45, 0.75))
        one = meshes.leaf(length, length * 0.42, droop)
        leaves.append(meshes.moved(one, 0, 0, base, 2.4 * k + float(rng.uniform(-0.3, 0.3))))
    part.mesh(meshes.merged(leaves), green)
    stem = (0.30, 0.34, 0.16, 1)
    part.capsule((0, 0, tall * 0.85), (0, 0, height * 0.92), 0.006, stem, solid=False)
    part.proxy((0, 0, height / 2), sx / 2, height)
    return Form(Rect(-sx / 2, -sx / 2, sx / 2, sx / 2), height, sx / 2)
