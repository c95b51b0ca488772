"""Builds a planned room: its shell, its light, its decoration, and every piece of furniture."""

from __future__ import annotations

from collections.abc import Callable, Mapping

import mujoco
import numpy as np

from forestall.worlds.kitchen import appliances, furniture, tables
from forestall.worlds.kitchen.assembly import Assembly, Kit
from forestall.worlds.kitchen.crockery import darker
from forestall.worlds.kitchen.forms import FLOOR, Form, Rect, Region
from forestall.worlds.kitchen.furniture import Forms
from forestall.worlds.kitchen.layout import Item, Plan
from forestall.worlds.kitchen.style import STEEL, Light, Style

_WALL_M = 0.06

_BUILDERS: Mapping[str, Callable[[Kit, Item, Style], Forms]] = {
    "counter": furniture.counter,
    "corner": furniture.corner,
    "stove": furniture.stove,
    "cabinet": tables.cabinet,
    "fridge": appliances.fridge,
    "microwave": appliances.microwave,
    "coffee_machine": appliances.coffee_machine,
    "toaster": appliances.toaster,
    "table": tables.table,
    "shelf": tables.shelf,
    "garbage_can": tables.garbage_can,
    "chair": tables.chair,
    "sofa": tables.sofa,
    "tv_stand": tables.tv_stand,
    "floor_lamp": tables.floor_lamp,
    "coffee_table": tables.coffee_table,
    "block": furniture.block,
}


def build_room(kit: Kit, plan: Plan, style: Style, light: Light) -> Forms:
    """Add a room; the forms of its fixtures by instance name."""
    _shell(kit, plan, style)
    for kind, wall, u, z, w, h in plan.decor:
        _hang(kit, plan, style, kind, (wall, u, z, w, h))
    forms: Forms = {}
    for item in plan.items:
        forms |= _BUILDERS[item.kind](kit, item, style)
    half = Rect(-plan.width / 2, -plan.depth / 2, plan.width / 2, plan.depth / 2)
    region = Region(FLOOR, FLOOR, half.grown(-0.02), 0.0)
    forms[FLOOR] = Form(half, 0.0, regions=(region,))
    _light(kit, plan, light)
    return forms


def _shell(kit: Kit, plan: Plan, style: Style) -> None:
    w, d, h, t = plan.width, plan.depth, plan.height, _WALL_M
    floor = kit.furniture(FLOOR, FLOOR, (0, 0, 0, 0))
    floor.box((0, 0, -t / 2), (w + 2 * t, d + 2 * t, t), style.floor, texture=style.floor_texture)
    shell = kit.furniture(None, "walls", (0, 0, 0, 0))
    for side in (-1, 1):
        shell.box(
            (side * (w / 2 + t / 2), 0, h / 2), (t, d + 2 * t, h), style.wall, texture="plaster"
        )
        shell.box((0, side * (d / 2 + t / 2), h / 2), (w, t, h), style.wall, texture="plaster")
    shell.box(
        (0, 0, h + t / 2), (w + 2 * t, d + 2 * t, t), (0.93, 0.93, 0.92, 1), texture="plaster"
    )
    skirt = darker(style.wall, 1.12)
    for side in (-1, 1):
        shell.box((side * (w / 2 - 0.004), 0, 0.04), (0.008, d, 0.08), skirt, solid=False)
        shell.box((0, side * (d / 2 - 0.004), 0.04), (w, 0.008, 0.08), skirt, solid=False)


def _light(kit: Kit, plan: Plan, light: Light) -> None:
    x, y, z = light.aside[0] * plan.width, light.aside[1] * plan.depth, plan.height - 0.12
    bulb = kit.furniture(None, "lamp", (x, y, z, 0))
    bulb.cylinder((0, 0, 0.095), 0.17, 0.03, (0.97, 0.96, 0.92, 1), solid=False)
    kit.spec.worldbody.add_light(
        name="ceiling",
        type=mujoco.mjtLightType.mjLIGHT_POINT,
        pos=[x, y, z],
        dir=[0, 0, -1],
        diffuse=[light.strength * s for s in (1.0, 0.5 + light.warm / 2, light.warm)],
        castshadow=True,
    )
    kit.spec.worldbody.add_light(
        name="window",
        type=mujoco.mjtLightType.mjLIGHT_POINT,
        pos=[-0.35 * plan.width * float(np.sign(x or 1.0)), -0.6 * y, 1.7],
        dir=[0, 0, -1],
        diffuse=[light.fill, light.fill, light.fill * 1.1],
        castshadow=False,
    )


def _hang(
    kit: Kit, plan: Plan, style: Style, kind: str, at: tuple[int, float, float, float, float]
) -> None:
    wall, u, z, w, h = at
    yaw = wall * np.pi / 2
    out = (plan.width if wall % 2 else plan.depth) / 2
    c, s = float(np.cos(yaw)), float(np.sin(yaw))
    name = f"{kind}-{len(kit.parts)}"
    if kind == "rug":
        rug = kit.furniture(None, name, (c * u + s * (out - z), s * u - c * (out - z), 0, yaw))
        rug.box((0, 0, 0.0006), (w, h, 0.0012), style.rug, texture="fabric", solid=False)
        rug.box(
            (0, 0, 0.0009),
            (w - 0.16, h - 0.16, 0.0012),
            darker(style.rug, 1.2),
            texture="fabric",
            solid=False,
        )
        return
    part = kit.furniture(None, name, (c * u + s * out, s * u - c * out, z, yaw))
    _DECOR[kind](part, style, w, h)


def _window(part: Assembly, style: Style, w: float, h: float) -> None:
    frame = (0.95, 0.95, 0.94, 1.0)
    part.box((0, 0.002, h / 2), (w, 0.004, h), (0.72, 0.86, 0.98, 1), solid=False)
    part.box((0, 0.003, h * 0.18), (w, 0.004, h * 0.36), (0.55, 0.70, 0.50, 1), solid=False)
    for x in (-w / 2, 0, w / 2):
        part.box((x, 0.012, h / 2), (0.045, 0.024, h + 0.045), frame, solid=False)
    for z in (0, h * 0.5, h):
        part.box((0, 0.012, z), (w, 0.024, 0.045 if z != h * 0.5 else 0.025), frame, solid=False)
    part.box((0, 0.03, -0.03), (w + 0.12, 0.06, 0.02), frame, solid=False)


def _picture(part: Assembly, style: Style, w: float, h: float) -> None:
    rng = part.kit.rng
    part.box((0, 0.008, h / 2), (w, 0.016, h), (0.25, 0.18, 0.12, 1), texture="wood", solid=False)
    part.box((0, 0.017, h / 2), (w - 0.05, 0.003, h - 0.05), (0.93, 0.91, 0.86, 1), solid=False)
    for k in range(3):
        tone = (*(float(v) for v in rng.uniform(0.25, 0.85, 3)), 1.0)
        x = float(rng.uniform(-0.25, 0.25)) * w
        z = h / 2 + float(rng.uniform(-0.2, 0.2)) * h
        size = (float(rng.uniform(0.15, 0.4)) * w, 0.002, float(rng.uniform(0.15, 0.4)) * h)
        part.box((x, 0.0195 + 0.001 * k, z), size, tone, solid=False)  # type: ignore[arg-type]


def _door(part: Assembly, style: Style, w: float, h: float) -> None:
    leaf = darker(style.wall, 0.97) if style.front_texture is None else style.front
    texture = style.front_texture
    part.box((0, 0.010, h / 2), (w + 0.14, 0.020, h + 0.07), (0.94, 0.93, 0.91, 1), solid=False)
    part.box((0, 0.018, h / 2 - 0.01), (w, 0.018, h - 0.03), leaf, texture=texture, solid=False)
    for z in (0.30, 0.72):
        part.box(
            (0, 0.028, h * z),
            (w - 0.26, 0.004, h * 0.34),
            darker(leaf, 0.93),
            texture=texture,
            solid=False,
        )
    part.capsule(
        (w / 2 - 0.16, 0.07, 1.02),
        (w / 2 - 0.06, 0.07, 1.02),
        0.009,
        STEEL,
        texture="metal",
        solid=False,
    )
    part.capsule((w / 2 - 0.06, 0.02, 1.02), (w / 2 - 0.06, 0.07, 1.02), 0.009, STEEL, solid=False)


_DECOR: Mapping[str, Callable[[Assembly, Style, float, float], None]] = {
    "window": _window,
    "picture": _picture,
    "door": _door,
}
