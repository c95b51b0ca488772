"""Builds fridge, microwave, coffee machine and toaster; frames as in `furniture`.

What stands on a counter has its origin on the counter's surface at the middle of its own back.
"""

from __future__ import annotations

import numpy as np

from forestall.worlds.kitchen.assembly import Assembly, Kit
from forestall.worlds.kitchen.crockery import darker
from forestall.worlds.kitchen.forms import Form, Rect, Region, Stance
from forestall.worlds.kitchen.furniture import Forms
from forestall.worlds.kitchen.layout import COUNTER_DEPTH_M, Item
from forestall.worlds.kitchen.style import DARK, STEEL, Style

_WHITE = (0.92, 0.93, 0.94, 1.0)


def fridge(kit: Kit, item: Item, style: Style) -> Forms:
    """A fridge over a freezer drawer, its door hinged at the side `item.hinge`."""
    part = kit.furniture(item.name, item.name, (item.x, item.y, 0, item.yaw))
    w, d, h, t, low = item.width, 0.64, 1.80, 0.035, 0.86
    shell = style.fridge
    part.box((0, d / 2, low / 2), (w, d, low), shell, texture="metal")
    part.box((0, d + 0.026, 0.485), (w - 0.004, 0.045, 0.73), shell, texture="metal", solid=False)
    part.box((0, d + 0.010, 0.06), (w - 0.01, 0.02, 0.10), DARK, solid=False)
    part.box(
        (0, d + 0.075, 0.76), (w * 0.6, 0.018, 0.022), style.handle, texture="metal", solid=False
    )
    for side in (-1, 1):
        part.box(
            (side * w * 0.26, d + 0.058, 0.76), (0.016, 0.03, 0.016), style.handle, solid=False
        )
        part.box((side * (w / 2 - t / 2), d / 2, (low + h) / 2), (t, d, h - low), shell)
        part.box(
            (side * (w / 2 - t - 0.002), d / 2, (low + h) / 2),
            (0.004, d - 0.01, h - low - 0.01),
            _WHITE,
            solid=False,
        )
    part.box((0, d / 2, h - t / 2), (w - 2 * t, d, t), shell)
    part.box((0, t / 2, (low + h) / 2), (w - 2 * t, t, h - low), _WHITE)
    part.box((0, d / 2, low + 0.012), (w - 2 * t, d - 0.01, 0.024), _WHITE)
    upper = 1.31
    part.box(
        (0, (d - 0.09) / 2 + t, upper - 0.006),
        (w - 2 * t, d - 0.16, 0.012),
        (0.78, 0.86, 0.88, 1),
        texture="ceramic",
    )
    part.box((0, d - 0.11, upper - 0.004), (w - 2 * t, 0.012, 0.022), STEEL, solid=False)
    part.box((0, 0.20, h - t - 0.006), (0.18, 0.10, 0.012), (1.0, 0.98, 0.88, 1), solid=False)
    _fridge_door(part, item, style, (low, h, d))
    inner = Rect(-w / 2 + t + 0.015, 0.10, w / 2 - t - 0.015, d - 0.05)
    shelf = Rect(inner.x0, inner.y0, inner.x1, d - 0.13)
    regions = (
        Region(
            item.name,
            item.name,
            inner,
            low + 0.024,
            upper - low - 0.06,
            front_m=d,
            first_m=d - 0.18,
        ),
        Region(
            item.name, item.name, shelf, upper, h - t - upper - 0.03, front_m=d, first_m=d - 0.24
        ),
    )
    stance = Stance(d + 0.06, distance_m=0.85, aside_m=-item.hinge * 0.15)
    return {item.name: Form(Rect(-w / 2, 0, w / 2, d + 0.09), h, regions=regions, stance=stance)}


def _fridge_door(
    part: Assembly, item: Item, style: Style, size: tuple[float, float, float]
) -> None:
    low, h, d = size
    k, w = item.hinge, item.width
    door = part.swinging(
        "door",
        (k * w / 2, d + 0.002, 0),
        (0, 0, 1),
        "open",
        {"closed": 0.0, "open": -k * float(np.deg2rad(105))},
    )
    middle = (low + h) / 2 + 0.002
    door.box(
        (-k * w / 2, 0.024, middle),
        (w - 0.004, 0.045, h - low - 0.008),
        style.fridge,
        texture="metal",
    )
    door.box((-k * w / 2, 0.001, middle), (w - 0.10, 0.002, h - low - 0.10), _WHITE, solid=False)
    x = -k * (w - 0.05)
    door.box((x, 0.072, middle), (0.020, 0.018, 0.55), style.handle, texture="metal", solid=False)
    for z in (-0.24, 0.24):
        door.box((x, 0.055, middle + z), (0.016, 0.03, 0.016), style.handle, solid=False)


def microwave(kit: Kit, item: Item, style: Style) -> Forms:
    """A microwave on a counter, hinged on the robot's left, its panel on the right."""
    part = kit.furniture(item.name, item.name, (item.x, item.y, item.z, item.yaw))
    w, d, h, t = 0.50, 0.37, 0.30, 0.02
    split = -0.125
    shell = style.appliance
    inside = (0.80, 0.81, 0.80, 1.0)
    part.box((0, d / 2, t / 2), (w, d, t), shell, texture="metal")
    part.box((0, d / 2, h - t / 2), (w, d, t), shell, texture="metal")
    part.box((w / 2 - t / 2, d / 2, h / 2), (t, d, h - 2 * t), shell, texture="metal")
    part.box(
        ((split - w / 2) / 2, d / 2 + 0.011, h / 2),
        (split + w / 2, d + 0.022, h - 2 * t),
        shell,
        texture="metal",
    )
    middle, wide = (split + w / 2 - t) / 2, w / 2 - t - split
    part.box((middle, 0.01, h / 2), (wide, 0.02, h - 2 * t), inside)
    part.box((middle, d / 2, t + 0.001), (wide, d - 0.01, 0.002), inside, solid=False)
    part.cylinder(
        (middle, d / 2 + 0.01, t + 0.004), 0.13, 0.004, (0.72, 0.80, 0.82, 1), texture="ceramic"
    )
    _panel(part, (split - w / 2) / 2, d + 0.0225, h)
    lamps = {"off": (0.6, 0.6, 0.55, 1.0), "on": (1.0, 0.93, 0.55, 1.0)}
    part.box(
        (middle, 0.021, h / 2),
        (wide - 0.01, 0.002, h - 2 * t - 0.01),
        inside,
        tints=("toggled", {"off": inside, "on": lamps["on"]}),
        solid=False,
    )
    door = part.swinging(
        "door",
        (w / 2, d + 0.001, 0),
        (0, 0, 1),
        "open",
        {"closed": 0.0, "open": -float(np.deg2rad(105))},
    )
    span = w / 2 - split - 0.003
    door.box((-span / 2, 0.0105, h / 2), (span, 0.019, h - 0.004), shell, texture="metal")
    windows = {"off": (0.05, 0.055, 0.06, 1.0), "on": (1.0, 0.78, 0.28, 1.0)}
    door.box(
        (-span / 2, 0.0205, h / 2),
        (span - 0.09, 0.003, h - 0.09),
        windows["off"],
        texture="ceramic",
        tints=("toggled", windows),
        solid=False,
    )
    door.box((-span / 2, 0.0005, h / 2), (span - 0.09, 0.001, h - 0.09), DARK, solid=False)
    door.box(
        (-span + 0.022, 0.036, h / 2),
        (0.014, 0.016, h * 0.7),
        style.handle,
        texture="metal",
        solid=False,
    )
    area = Rect(middle - wide / 2 + 0.004, 0.024, middle + wide / 2 - 0.004, d - 0.006)
    region = Region(item.name, item.name, area, t + 0.0065, h - 2 * t - 0.014, kind="spot")
    stance = Stance(COUNTER_DEPTH_M - item.inset, distance_m=0.70, aside_m=-0.10)
    box = Rect(-w / 2, 0, w / 2, d + 0.045)
    return {item.name: Form(box, h, regions=(region,), stance=stance)}


def _panel(part: Assembly, x: float, front: float, h: float) -> None:
    """Keys and a display that is lit while the microwave runs."""
    part.box((x, front, h / 2), (0.105, 0.003, h - 0.05), DARK, solid=False)
    screens = {"off": (0.05, 0.14, 0.10, 1.0), "on": (0.25, 1.0, 0.55, 1.0)}
    part.box(
        (x, front + 0.001, h - 0.065),
        (0.085, 0.004, 0.035),
        screens["off"],
        tints=("toggled", screens),
        solid=False,
    )
    for row in range(4):
        part.box(
            (x, front + 0.001, 0.06 + 0.035 * row),
            (0.08, 0.004, 0.02),
            (0.45, 0.46, 0.48, 1),
            solid=False,
        )


def coffee_machine(kit: Kit, item: Item, style: Style) -> Forms:
    """A coffee machine with a platform under its spout, open to the front."""
    part = kit.furniture(item.name, item.name, (item.x, item.y, item.z, item.yaw))
    rng = kit.rng
    tones = ((0.14, 0.14, 0.15, 1.0), (0.62, 0.12, 0.11, 1.0), (0.74, 0.75, 0.76, 1.0))
    shell = tones[int(rng.integers(len(tones)))]
    w, d, h = 0.23, 0.31, 0.37
    part.box((0, d / 2, 0.013), (w, d, 0.026), shell, texture="metal")
    part.box((0, 0.22, 0.028), (w - 0.04, 0.15, 0.004), STEEL, texture="metal")
    part.box((0, 0.06, 0.14), (w, 0.12, 0.23), shell, texture="ceramic")
    part.box((0, 0.13, 0.312), (w, 0.26, 0.115), shell, texture="ceramic")
    part.box((0, 0.13, h + 0.004), (w - 0.04, 0.20, 0.008), darker(shell, 0.7), solid=False)
    part.cylinder((0, 0.215, 0.247), 0.018, 0.018, DARK, solid=False)
    part.cylinder((0, 0.122, 0.15), 0.05, 0.004, STEEL, quat=(0.70711, 0.70711, 0, 0), solid=False)
    lamps = {"off": (0.20, 0.05, 0.05, 1.0), "on": (0.20, 1.0, 0.25, 1.0)}
    part.cylinder(
        (-0.05, 0.263, 0.31),
        0.014,
        0.008,
        lamps["off"],
        quat=(0.70711, 0.70711, 0, 0),
        tints=("toggled", lamps),
        solid=False,
    )
    bars = {"off": (0.30, 0.30, 0.31, 1.0), "on": (1.0, 0.72, 0.15, 1.0)}
    part.box(
        (0.045, 0.262, 0.31), (0.09, 0.005, 0.04), bars["off"], tints=("toggled", bars), solid=False
    )
    area = Rect(-w / 2, 0.125, w / 2, d)
    region = Region(item.name, item.name, area, 0.0305, 0.205, kind="spot")
    stance = Stance(COUNTER_DEPTH_M - item.inset, distance_m=0.76)
    return {item.name: Form(Rect(-w / 2, 0, w / 2, d), h, regions=(region,), stance=stance)}


def toaster(kit: Kit, item: Item, style: Style) -> Forms:
    """A toaster with a slot for one slice, which stands on its edge."""
    part = kit.furniture(item.name, item.name, (item.x, item.y, item.z, item.yaw))
    shell = darker(style.appliance, 1.05)
    w, d, h, deep = 0.27, 0.18, 0.19, 0.115
    slot = Rect(-0.068, 0.100, 0.068, 0.130)
    part.box((0, d / 2, deep / 2), (w, d, deep), shell, texture="metal")
    z, tall = (deep + h) / 2, h - deep
    part.box((0, slot.y0 / 2, z), (w, slot.y0, tall), shell, texture="metal")
    part.box((0, (slot.y1 + d) / 2, z), (w, d - slot.y1, tall), shell, texture="metal")
    for side in (-1, 1):
        x = side * (w / 2 + slot.x1) / 2
        part.box((x, 0.115, z), (w / 2 - slot.x1, 0.03, tall), shell, texture="metal")
    part.box((0, 0.055, h), (0.136, 0.026, 0.002), DARK, solid=False)
    part.box((0, 0.115, deep + 0.001), (0.13, 0.028, 0.002), DARK, solid=False)
    on, off = {"toggled": ("on",)}, {"toggled": ("off",)}
    for when, at in ((off, 0.15), (on, 0.07)):
        part.box((0.07, d + 0.012, at), (0.045, 0.024, 0.016), DARK, when=when, solid=False)
    part.box((0.07, d + 0.001, 0.11), (0.012, 0.002, 0.12), DARK, solid=False)
    lamps = {"off": (0.25, 0.10, 0.05, 1.0), "on": (1.0, 0.40, 0.05, 1.0)}
    part.cylinder(
        (-0.07, d + 0.002, 0.10),
        0.013,
        0.006,
        lamps["off"],
        quat=(0.70711, 0.70711, 0, 0),
        tints=("toggled", lamps),
        solid=False,
    )
    for y in (0.1012, 0.1288, 0.0425, 0.0675):
        part.box((0, y, h), (0.13, 0.004, 0.006), (1.0, 0.32, 0.05, 1), when=on, solid=False)
    for side in (-1, 1):
        for y in (0.03, d - 0.03):
            part.cylinder((side * 0.11, y, 0.001), 0.01, 0.002, DARK, solid=False)
    region = Region(item.name, item.name, slot, deep + 0.0025, kind="slot")
    stance = Stance(COUNTER_DEPTH_M - item.inset, distance_m=0.62)
    return {item.name: Form(Rect(-w / 2, 0, w / 2, d + 0.02), h, regions=(region,), stance=stance)}
