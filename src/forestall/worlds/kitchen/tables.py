"""Builds tables, shelves, wall cabinets, bins and seats; frames as in `furniture`."""

from __future__ import annotations

import numpy as np

from forestall.worlds.kitchen import meshes
from forestall.worlds.kitchen.assembly import Assembly, Kit
from forestall.worlds.kitchen.crockery import darker
from forestall.worlds.kitchen.forms import Form, Rect, Region, Stance
from forestall.worlds.kitchen.furniture import Forms
from forestall.worlds.kitchen.layout import COUNTER_DEPTH_M, Item
from forestall.worlds.kitchen.style import DARK, STEEL, Style


def cabinet(kit: Kit, item: Item, style: Style) -> Forms:
    """A wall cabinet above a counter, hinged at the side `item.hinge`."""
    z0, w, d, h, t = item.z, item.width, 0.33, 0.60, 0.018
    part = kit.furniture(item.name, item.name, (item.x, item.y, z0, item.yaw))
    inside = darker(style.front, 1.05)
    for side in (-1, 1):
        part.box(
            (side * (w / 2 - t / 2), d / 2, h / 2),
            (t, d, h),
            style.front,
            texture=style.front_texture,
        )
    for z in (t / 2, h - t / 2):
        part.box((0, d / 2, z), (w - 2 * t, d, t), style.front, texture=style.front_texture)
    part.box((0, 0.005, h / 2), (w - 2 * t, 0.01, h - 2 * t), inside)
    k = item.hinge
    angle = -k * float(np.deg2rad(105))
    door = part.swinging(
        "door", (k * w / 2, d + 0.001, 0), (0, 0, 1), "open", {"closed": 0.0, "open": angle}
    )
    door.box(
        (-k * w / 2, 0.010, h / 2),
        (w - 0.006, 0.018, h - 0.006),
        style.front,
        texture=style.front_texture,
    )
    door.box(
        (-k * w / 2, 0.020, h / 2),
        (w - 0.12, 0.004, h - 0.12),
        darker(style.front, 0.90),
        texture=style.front_texture,
        solid=False,
    )
    door.box(
        (-k * (w - 0.05), 0.034, 0.12),
        (0.012, 0.010, 0.14),
        style.handle,
        texture="metal",
        solid=False,
    )
    for z in (0.06, 0.18):
        door.box((-k * (w - 0.05), 0.026, z), (0.01, 0.02, 0.01), style.handle, solid=False)
    area = Rect(-w / 2 + t + 0.006, 0.03, w / 2 - t - 0.006, d - 0.02)
    region = Region(item.name, item.name, area, t, h - 2 * t - 0.01, front_m=d)
    stance = Stance(COUNTER_DEPTH_M, distance_m=0.62, aside_m=-k * 0.12)
    return {item.name: Form(Rect(-w / 2, 0, w / 2, d + 0.04), h, regions=(region,), stance=stance)}


def table(kit: Kit, item: Item, style: Style) -> Forms:
    """A dining table on four legs."""
    part = kit.furniture(item.name, item.name, (item.x, item.y, 0, item.yaw))
    w, d, top = item.width, item.depth, 0.75
    part.box((0, d / 2, top - 0.018), (w, d, 0.036), style.table, texture="wood")
    part.box(
        (0, d / 2, top - 0.066),
        (w - 0.14, d - 0.14, 0.06),
        darker(style.table, 0.85),
        texture="wood",
    )
    for x in (-w / 2 + 0.06, w / 2 - 0.06):
        for y in (0.06, d - 0.06):
            part.box(
                (x, y, (top - 0.036) / 2), (0.06, 0.06, top - 0.036), style.table, texture="wood"
            )
    area = Rect(-w / 2 + 0.03, max(0.03, d - 0.62), w / 2 - 0.03, d - 0.03)
    region = Region(item.name, item.name, area, top, front_m=d)
    return {item.name: Form(Rect(-w / 2, 0, w / 2, d), top, regions=(region,), stance=Stance(d))}


def coffee_table(kit: Kit, item: Item, style: Style) -> Forms:
    """Scenery: a low table."""
    part = kit.furniture(None, item.name, (item.x, item.y, 0, item.yaw))
    w, d, top = item.width, item.depth, 0.42
    wood = darker(style.table, 0.9)
    part.box((0, d / 2, top - 0.02), (w, d, 0.04), wood, texture="wood")
    for x in (-w / 2 + 0.04, w / 2 - 0.04):
        for y in (0.04, d - 0.04):
            part.box((x, y, top / 2 - 0.02), (0.05, 0.05, top - 0.04), wood, texture="wood")
    return {}


def shelf(kit: Kit, item: Item, style: Style) -> Forms:
    """A low open rack; things stand on its top board."""
    part = kit.furniture(item.name, item.name, (item.x, item.y, 0, item.yaw))
    w, d, top = item.width, item.depth, 1.02
    wood = darker(style.table, 1.05)
    for x in (-w / 2 + 0.012, w / 2 - 0.012):
        part.box((x, d / 2, top / 2 - 0.012), (0.024, d, top - 0.024), wood, texture="wood")
    part.box((0, d / 2, top - 0.012), (w, d, 0.024), wood, texture="wood")
    for z in (0.08, 0.40, 0.71):
        part.box((0, d / 2, z), (w - 0.048, d - 0.01, 0.02), wood, texture="wood")
    part.box((0, 0.005, top / 2), (w - 0.048, 0.01, top - 0.06), darker(wood, 0.8), texture="wood")
    _row_of_books(part, w, d, 0.41)
    area = Rect(-w / 2 + 0.02, 0.03, w / 2 - 0.02, d - 0.015)
    region = Region(item.name, item.name, area, top, front_m=d)
    return {item.name: Form(Rect(-w / 2, 0, w / 2, d), top, regions=(region,), stance=Stance(d))}


def _row_of_books(part: Assembly, w: float, d: float, z: float) -> None:
    """Scenery that belongs to the shelf."""
    rng = part.kit.rng
    tones = ((0.5, 0.2, 0.2), (0.2, 0.3, 0.45), (0.75, 0.65, 0.45), (0.25, 0.4, 0.3))
    x = -w / 2 + 0.05
    for _ in range(int(rng.integers(4, 8))):
        thick, tall = float(rng.uniform(0.02, 0.045)), float(rng.uniform(0.18, 0.25))
        tone = tones[int(rng.integers(len(tones)))]
        part.box(
            (x + thick / 2, d * 0.45, z + tall / 2),
            (thick, 0.15, tall),
            (*tone, 1),
            texture="fabric",
            solid=False,
        )
        x += thick + 0.002


def garbage_can(kit: Kit, item: Item, style: Style) -> Forms:
    """An open bin."""
    part = kit.furniture(item.name, item.name, (item.x, item.y, 0, item.yaw))
    w, d, h, t = item.width, item.depth, 0.48, 0.008
    rgba = STEEL if style.handle == DARK else (0.25, 0.27, 0.29, 1)
    part.box((0, d / 2, 0.005), (w, d, 0.01), rgba)
    for side in (-1, 1):
        part.box((side * (w / 2 - t / 2), d / 2, h / 2), (t, d, h), rgba, texture="metal")
        y = d / 2 + side * (d / 2 - t / 2)
        part.box((0, y, h / 2), (w - 2 * t, t, h), rgba, texture="metal")
        part.box((side * (w / 2 - 0.004), d / 2, h), (0.024, d + 0.016, 0.02), DARK, solid=False)
        part.box(
            (0, d / 2 + side * (d / 2 - 0.004), h), (w + 0.016, 0.024, 0.02), DARK, solid=False
        )
    area = Rect(-w / 2 + 0.014, 0.014, w / 2 - 0.014, d - 0.014)
    region = Region(item.name, item.name, area, 0.0105, first_m=d / 2)
    stance = Stance(d, distance_m=0.5)
    return {item.name: Form(Rect(-w / 2, 0, w / 2, d), h, regions=(region,), stance=stance)}


def chair(kit: Kit, item: Item, style: Style) -> Forms:
    """Scenery: a chair whose back is at y = 0."""
    part = kit.furniture(None, item.name, (item.x, item.y, 0, item.yaw))
    w, d = item.width, item.depth
    wood = darker(style.table, 0.95)
    part.box((0, d / 2, 0.44), (w, d, 0.03), style.cloth, texture="fabric")
    for x in (-w / 2 + 0.02, w / 2 - 0.02):
        part.box((x, 0.02, 0.44), (0.035, 0.035, 0.88), wood, texture="wood")
        part.box((x, d - 0.02, 0.215), (0.035, 0.035, 0.43), wood, texture="wood")
    for z in (0.62, 0.80):
        part.box((0, 0.02, z), (w - 0.07, 0.02, 0.09), wood, texture="wood")
    return {}


def sofa(kit: Kit, item: Item, style: Style) -> Forms:
    """Scenery: a sofa."""
    part = kit.furniture(None, item.name, (item.x, item.y, 0, item.yaw))
    w, d = item.width, item.depth
    cloth, dark = style.cloth, darker(style.cloth, 0.85)
    part.box((0, d / 2, 0.14), (w, d, 0.22), dark, texture="fabric")
    part.box((0, 0.10, 0.50), (w, 0.20, 0.50), cloth, texture="fabric")
    for side in (-1, 1):
        part.box((side * (w / 2 - 0.09), d / 2, 0.42), (0.18, d, 0.34), cloth, texture="fabric")
        seat = (w - 0.38) / 2
        part.box(
            (side * seat / 2, d / 2 + 0.09, 0.32),
            (seat - 0.01, d - 0.20, 0.16),
            cloth,
            texture="fabric",
        )
    pillow = style.rug
    part.box(
        (w * 0.28, 0.28, 0.52),
        (0.38, 0.12, 0.30),
        pillow,
        texture="fabric",
        quat=(float(np.cos(0.12)), float(-np.sin(0.12)), 0, 0),
        solid=False,
    )
    return {}


def tv_stand(kit: Kit, item: Item, style: Style) -> Forms:
    """A low stand with the television at its back."""
    part = kit.furniture(item.name, item.name, (item.x, item.y, 0, item.yaw))
    w, d, top = item.width, item.depth, 0.52
    wood = style.table
    part.box((0, d / 2, top - 0.015), (w, d, 0.03), wood, texture="wood")
    part.box((0, d / 2, 0.07), (w, d, 0.06), wood, texture="wood")
    part.box((0, 0.008, top / 2), (w, 0.016, top - 0.06), darker(wood, 0.7), texture="wood")
    for x in (-w / 2 + 0.015, -w / 6, w / 6, w / 2 - 0.015):
        part.box((x, d / 2, top / 2 + 0.02), (0.025, d, top - 0.11), wood, texture="wood")
    for x in (-w / 3, w / 3):
        part.box(
            (x, d - 0.012, top / 2 + 0.02),
            (w / 3 - 0.04, 0.018, top - 0.13),
            darker(wood, 1.12),
            texture="wood",
            solid=False,
        )
        part.box((x, d + 0.004, top / 2 + 0.02), (0.10, 0.014, 0.012), style.handle, solid=False)
    area = Rect(-w / 2 + 0.03, 0.13, w / 2 - 0.03, d - 0.02)
    region = Region(item.name, item.name, area, top, front_m=d)
    forms = {item.name: Form(Rect(-w / 2, 0, w / 2, d), top, regions=(region,), stance=Stance(d))}
    return forms | {item.extra[0]: _television(kit, item, item.extra[0], top, d)}


def _television(kit: Kit, item: Item, name: str, top: float, depth: float) -> Form:
    px, py, _, yaw = item.local_pose(0, 0.0)
    part = kit.furniture(name, name, (px, py, top, yaw))
    w, h, foot = 1.02, 0.60, 0.06
    part.box((0, 0.07, 0.006), (0.36, 0.10, 0.012), DARK)
    part.box((0, 0.06, 0.04), (0.08, 0.03, 0.07), DARK)
    part.box((0, 0.075, foot + h / 2), (w, 0.035, h), DARK)
    face, tall, wide = 0.0935, h - 0.05, w - 0.04
    screens = {"off": (0.025, 0.028, 0.033, 1.0), "on": (0.42, 0.72, 1.0, 1.0)}
    middle = foot + h / 2
    part.box(
        (0, face, middle),
        (wide, 0.003, tall),
        screens["off"],
        texture="ceramic",
        tints=("toggled", screens),
        solid=False,
    )
    on = {"toggled": ("on",)}
    low = middle - tall / 2
    scene = (
        ((0, low + tall * 0.16), (wide, tall * 0.32), (0.36, 0.80, 0.30, 1.0)),
        ((wide * 0.24, low + tall * 0.42), (wide * 0.34, tall * 0.22), (0.22, 0.60, 0.28, 1.0)),
        ((-wide * 0.22, low + tall * 0.40), (wide * 0.16, tall * 0.30), (0.95, 0.40, 0.25, 1.0)),
        ((-wide * 0.34, low + tall * 0.80), (tall * 0.20, tall * 0.20), (1.0, 0.93, 0.45, 1.0)),
    )
    for k, ((x, z), (sx, sz), rgba) in enumerate(scene):
        part.box((x, face + 0.0008 * (k + 1), z), (sx, 0.003, sz), rgba, when=on, solid=False)
    lamps = {"off": (0.6, 0.05, 0.05, 1.0), "on": (0.1, 0.95, 0.2, 1.0)}
    part.box(
        (wide * 0.46, 0.0935, foot + 0.012),
        (0.015, 0.004, 0.006),
        lamps["off"],
        tints=("toggled", lamps),
        solid=False,
    )
    stance = Stance(depth, distance_m=0.85)
    return Form(Rect(-w / 2, 0.02, w / 2, 0.12), foot + h, stance=stance)


def floor_lamp(kit: Kit, item: Item, style: Style) -> Forms:
    """A standing lamp whose shade is bright when it is on."""
    part = kit.furniture(item.name, item.name, (item.x, item.y, 0, item.yaw))
    d = item.depth
    y = d / 2
    part.cylinder((0, y, 0.012), 0.14, 0.024, DARK, texture="metal")
    part.cylinder((0, y, 0.68), 0.012, 1.32, style.handle, texture="metal")
    shades = {"off": (0.62, 0.56, 0.46, 1.0), "on": (1.0, 0.95, 0.72, 1.0)}
    line = [(0.17, 1.22), (0.11, 1.50), (0.107, 1.50), (0.167, 1.22), (0.17, 1.22)]
    part.mesh(
        meshes.lathe(line, 24),
        shades["off"],
        at=(0, y, 0),
        texture="fabric",
        tints=("toggled", shades),
    )
    bulbs = {"off": (0.75, 0.75, 0.72, 1.0), "on": (1.0, 1.0, 0.92, 1.0)}
    part.ellipsoid(
        (0, y, 1.36), (0.04, 0.04, 0.055), bulbs["off"], tints=("toggled", bulbs), solid=False
    )
    stance = Stance(d, distance_m=0.7)
    return {item.name: Form(Rect(-d / 2, 0, d / 2, d), 1.5, stance=stance)}
