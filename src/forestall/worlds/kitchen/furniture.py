"""Builds what stands on the floor or hangs on a wall: counters, sink, stove, tables, shelves.

Frames: origin on the floor at the middle of the back edge, +y to the front. Every instance has a
body of its own name; called by `rooms`.
"""

from __future__ import annotations

import numpy as np

from forestall.worlds.kitchen import meshes
from forestall.worlds.kitchen.assembly import Assembly, Kit
from forestall.worlds.kitchen.crockery import darker
from forestall.worlds.kitchen.forms import Form, Rect, Region, Stance, quaternion
from forestall.worlds.kitchen.layout import (
    COUNTER_DEPTH_M,
    COUNTER_HEIGHT_M,
    ROOM_HEIGHT_M,
    Item,
    columns_of,
)
from forestall.worlds.kitchen.style import DARK, STEEL, Style

Forms = dict[str, Form]

_SLAB, _BAND, _TOE, _FACE = 0.86, 0.66, 0.10, 0.58
_SINK = (0.50, 0.36, 0.18)
_SINK_Y = 0.33


def counter(kit: Kit, item: Item, style: Style) -> Forms:
    """A counter with base cabinets, its drawers, and the sink and faucet set into it."""
    part = kit.furniture(item.name, item.name, (item.x, item.y, 0, item.yaw))
    w, d = item.width, COUNTER_DEPTH_M
    sink_x = item.sink_x
    hole = None
    if sink_x is not None:
        sx, sy, _ = _SINK
        hole = Rect(sink_x - sx / 2, _SINK_Y - sy / 2, sink_x + sx / 2, _SINK_Y + sy / 2)
    for r in _around(Rect(-w / 2, 0, w / 2, d), hole):
        _plate(part, r, _SLAB, COUNTER_HEIGHT_M, style)
    part.box((0, 0.26, _TOE / 2), (w, 0.52, _TOE), DARK)
    mid = (_TOE + _BAND) / 2
    part.box(
        (0, _FACE / 2, mid), (w, _FACE, _BAND - _TOE), style.front, texture=style.front_texture
    )
    columns = columns_of(w)
    drawers = dict(item.drawers)
    _upper_band(part, w, hole, [columns[c] for c in drawers.values()], style)
    for k, (x0, x1) in enumerate(columns):
        _front(part, x0, x1, _TOE + 0.02, _BAND - 0.004, style, bar_up=True)
        if k not in drawers.values():
            _front(part, x0, x1, _BAND + 0.004, _SLAB - 0.008, style, bar_up=False)
    if item.splash:
        splash = kit.furniture(None, f"{item.name}/splash", (item.x, item.y, 0, item.yaw))
        splash.box((0, 0.005, 1.12), (w, 0.01, 0.44), style.splash, texture="tiles")
    forms: Forms = {}
    for name, column in drawers.items():
        forms[name] = _drawer(kit, item, name, columns[column], style)
    keep_out = [Rect(x0, 0, x1, d) for x0, x1 in item.keep_out]
    if hole is not None and sink_x is not None:
        keep_out.append(Rect(hole.x0 - 0.03, 0, hole.x1 + 0.03, d))
        forms |= _sink(kit, item, sink_x, hole)
    region = Region(
        receptacle=item.name,
        carrier=item.name,
        area=Rect(-w / 2 + 0.02, 0.05, w / 2 - 0.02, d - 0.03),
        z_m=COUNTER_HEIGHT_M,
        kind="surface",
        keep_out=tuple(keep_out),
        front_m=d,
        clearance_m=0.44,
    )
    forms[item.name] = Form(
        Rect(-w / 2, 0, w / 2, d), COUNTER_HEIGHT_M, regions=(region,), stance=Stance(d)
    )
    return forms


def _around(outer: Rect, hole: Rect | None) -> list[Rect]:
    if hole is None:
        return [outer]
    return [
        Rect(outer.x0, outer.y0, hole.x0, outer.y1),
        Rect(hole.x1, outer.y0, outer.x1, outer.y1),
        Rect(hole.x0, outer.y0, hole.x1, hole.y0),
        Rect(hole.x0, hole.y1, hole.x1, outer.y1),
    ]


def _plate(part: Assembly, r: Rect, low: float, high: float, style: Style) -> None:
    (x, y), (sx, sy) = r.centre, r.size
    part.box(
        (x, y, (low + high) / 2), (sx, sy, high - low), style.counter, texture=style.counter_texture
    )


def _upper_band(
    part: Assembly, w: float, hole: Rect | None, open_at: list[tuple[float, float]], style: Style
) -> None:
    """Fill the band under the slab except where a drawer or the basin is."""
    voids = sorted(open_at + ([(hole.x0 - 0.012, hole.x1 + 0.012)] if hole else []))
    x, z = -w / 2, (_BAND + _SLAB) / 2
    for a, b in [*voids, (w / 2, w / 2)]:
        if a - x > 0.004:
            part.box(((x + a) / 2, _FACE / 2, z), (a - x, _FACE, _SLAB - _BAND), style.front)
        x = max(x, b)
    if hole is not None:
        x = (hole.x0 + hole.x1) / 2
        part.box(
            (x, _FACE - 0.01, z), (hole.x1 - hole.x0 + 0.024, 0.02, _SLAB - _BAND), style.front
        )


def _front(
    part: Assembly, x0: float, x1: float, z0: float, z1: float, style: Style, bar_up: bool
) -> None:
    """A door or drawer front with its handle."""
    mid, width = (x0 + x1) / 2, x1 - x0 - 0.008
    part.box(
        (mid, _FACE + 0.009, (z0 + z1) / 2),
        (width, 0.018, z1 - z0),
        style.front,
        texture=style.front_texture,
        solid=False,
    )
    inset = (width - 0.10, 0.004, z1 - z0 - 0.10)
    if bar_up:
        part.box(
            (mid, _FACE + 0.018, (z0 + z1) / 2),
            inset,
            darker(style.front, 0.90),
            texture=style.front_texture,
            solid=False,
        )
    _bar(part, mid, _FACE + 0.018, z1 - 0.035 if bar_up else (z0 + z1) / 2, style)


def _bar(part: Assembly, x: float, y: float, z: float, style: Style) -> None:
    part.box((x, y + 0.018, z), (0.13, 0.010, 0.012), style.handle, texture="metal", solid=False)
    for side in (-0.055, 0.055):
        part.box((x + side, y + 0.008, z), (0.01, 0.018, 0.01), style.handle, solid=False)


def _drawer(kit: Kit, item: Item, name: str, column: tuple[float, float], style: Style) -> Form:
    x = (column[0] + column[1]) / 2
    w, deep = column[1] - column[0] - 0.03, 0.50
    part = kit.furniture(name, name, item.local_pose(x, 0.0))
    slide = part.sliding("slide", (0, 0, 0), (0, 1, 0), "open", {"closed": 0.0, "open": 0.36})
    low, high, back = 0.69, 0.82, _FACE - deep
    tone = (0.78, 0.68, 0.52, 1.0)
    middle, z = back + deep / 2, (low + high) / 2
    slide.box((0, middle, low + 0.005), (w, deep, 0.01), tone, texture="wood")
    for side in (-1, 1):
        slide.box((side * (w / 2 - 0.006), middle, z), (0.012, deep, high - low), tone)
    slide.box((0, back + 0.006, z), (w - 0.024, 0.012, high - low), tone)
    slide.box((0, _FACE - 0.006, z), (w - 0.024, 0.012, high - low), tone)
    half = (column[1] - column[0]) / 2
    slide.box(
        (0, _FACE + 0.009, (_BAND + _SLAB) / 2),
        (2 * half - 0.008, 0.018, 0.188),
        style.front,
        texture=style.front_texture,
    )
    _bar(slide, 0, _FACE + 0.018, (_BAND + _SLAB) / 2, style)
    area = Rect(-w / 2 + 0.018, _FACE - 0.31, w / 2 - 0.018, _FACE - 0.018)
    region = Region(name, f"{name}/slide", area, low + 0.01, high + 0.03 - low)
    footprint = Rect(-half, 0, half, _FACE + 0.03)
    return Form(
        footprint, _SLAB, regions=(region,), stance=Stance(COUNTER_DEPTH_M, distance_m=0.80)
    )


def _sink(kit: Kit, item: Item, sink_x: float, hole: Rect) -> Forms:
    basin_name, faucet_name = item.extra
    part = kit.furniture(basin_name, basin_name, item.local_pose(sink_x, 0.0))
    sx, sy, deep = _SINK
    top, thick = COUNTER_HEIGHT_M + 0.003, 0.006
    floor = COUNTER_HEIGHT_M - deep
    z, tall = (top + floor) / 2, top - floor
    for side in (-1, 1):
        part.box(
            (side * (sx / 2 - thick / 2), _SINK_Y, z), (thick, sy, tall), STEEL, texture="metal"
        )
        y = _SINK_Y + side * (sy / 2 - thick / 2)
        part.box((0, y, z), (sx, thick, tall), STEEL, texture="metal")
    for side in (-1, 1):
        part.box(
            (side * (sx / 2 + 0.006), _SINK_Y, top - 0.0015),
            (0.024, sy + 0.03, 0.003),
            darker(STEEL, 1.1),
            texture="metal",
            solid=False,
        )
        part.box(
            (0, _SINK_Y + side * (sy / 2 + 0.006), top - 0.0015),
            (sx + 0.03, 0.024, 0.003),
            darker(STEEL, 1.1),
            texture="metal",
            solid=False,
        )
    part.box(
        (0, _SINK_Y, floor + 0.004),
        (sx - 2 * thick, sy - 2 * thick, 0.008),
        darker(STEEL, 0.92),
        texture="metal",
    )
    part.cylinder((0, _SINK_Y, floor + 0.009), 0.035, 0.003, darker(STEEL, 0.45), solid=False)
    area = Rect(-sx / 2, _SINK_Y - sy / 2, sx / 2, _SINK_Y + sy / 2).grown(-thick - 0.004)
    region = Region(basin_name, basin_name, area, floor + 0.0105, first_m=_SINK_Y + 0.02)
    basin = Form(
        Rect(-sx / 2 - 0.02, _SINK_Y - sy / 2 - 0.02, sx / 2 + 0.02, _SINK_Y + sy / 2 + 0.02),
        top,
        regions=(region,),
        stance=Stance(COUNTER_DEPTH_M, distance_m=0.6),
    )
    return {basin_name: basin, faucet_name: _faucet(kit, item, sink_x, faucet_name, floor + 0.011)}


def _faucet(kit: Kit, item: Item, sink_x: float, name: str, floor: float) -> Form:
    part = kit.furniture(name, name, item.local_pose(sink_x, 0.0))
    z0, z1, reach = COUNTER_HEIGHT_M, COUNTER_HEIGHT_M + 0.30, 0.31
    metal = darker(STEEL, 1.12)
    part.cylinder((0, 0.09, z0 + 0.012), 0.026, 0.024, metal, texture="metal")
    part.capsule((0, 0.09, z0 + 0.02), (0, 0.09, z1 - 0.05), 0.012, metal, texture="metal")
    part.capsule((0, 0.09, z1 - 0.05), (0, 0.13, z1), 0.012, metal, texture="metal", solid=False)
    part.capsule((0, 0.13, z1), (0, reach - 0.04, z1), 0.012, metal, texture="metal", solid=False)
    part.capsule(
        (0, reach - 0.04, z1), (0, reach, z1 - 0.05), 0.011, metal, texture="metal", solid=False
    )
    lever = part.swinging("lever", (0.05, 0.09, z0), (0, 0, 1), "toggled", {"off": 0.0, "on": 1.0})
    lever.cylinder((0, 0, 0.025), 0.016, 0.05, metal, texture="metal", solid=False)
    lever.capsule((0, 0, 0.055), (0.06, 0, 0.075), 0.006, metal, texture="metal", solid=False)
    lever.box((0.066, 0, 0.078), (0.02, 0.02, 0.016), (0.2, 0.45, 0.85, 1), solid=False)
    water, on = (0.62, 0.82, 0.96, 1.0), {"toggled": ("on",)}
    stream = z1 - 0.06
    part.cylinder(
        (0, reach, (stream + floor) / 2), 0.009, stream - floor, water, when=on, solid=False
    )
    pool = [(0.0, 0.0), (0.10, 0.0), (0.085, 0.002), (0.0, 0.003)]
    part.mesh(meshes.lathe(pool, 18), water, at=(0, reach, floor), when=on)
    box = Rect(-0.03, 0.06, 0.13, reach + 0.01)
    return Form(box, z1 + 0.012, stance=Stance(COUNTER_DEPTH_M, distance_m=0.6))


def stove(kit: Kit, item: Item, style: Style) -> Forms:
    """A stove with an oven, four burners and four knobs, and the hood above it."""
    part = kit.furniture(None, item.name, (item.x, item.y, 0, item.yaw))
    w, d, top = item.width, 0.60, 0.90
    body = style.appliance
    part.box((0, 0.26, _TOE / 2), (w - 0.02, 0.52, _TOE), DARK)
    part.box(
        (0, d / 2, (_TOE + top) / 2 - 0.006),
        (w - 0.006, d, top - _TOE - 0.012),
        body,
        texture="metal",
    )
    part.box((0, 0.31, top - 0.006), (w - 0.006, COUNTER_DEPTH_M, 0.012), DARK, texture="ceramic")
    part.box(
        (0, d + 0.012, 0.46),
        (w - 0.05, 0.024, 0.46),
        darker(body, 0.95),
        texture="metal",
        solid=False,
    )
    part.box((0, d + 0.0245, 0.45), (w - 0.22, 0.004, 0.26), DARK, texture="ceramic", solid=False)
    part.box((0, d + 0.055, 0.665), (w - 0.14, 0.016, 0.018), STEEL, texture="metal", solid=False)
    for side in (-1, 1):
        part.box(
            (side * (w / 2 - 0.09), d + 0.035, 0.665), (0.014, 0.04, 0.014), STEEL, solid=False
        )
    tilt = float(np.deg2rad(-52))
    part.box(
        (0, d + 0.012, 0.80),
        (w - 0.03, 0.10, 0.012),
        darker(body, 0.9),
        texture="metal",
        quat=quaternion((1, 0, 0), tilt),
        solid=False,
    )
    _hood(kit, item, style)
    forms: Forms = {}
    places = [(0.18, 0.455), (-0.18, 0.455), (0.18, 0.165), (-0.18, 0.165)]
    knobs = [0.10, -0.10, 0.28, -0.28]
    for k, ((x, y), knob_x) in enumerate(zip(places, knobs, strict=True)):
        burner, knob = item.extra[k], item.extra[4 + k]
        forms[burner] = _burner(kit, item, burner, (x, y), top)
        forms[knob] = _knob(kit, item, knob, burner, knob_x, d + 0.022, 0.808, tilt)
    return forms


def _burner(kit: Kit, item: Item, name: str, at: tuple[float, float], top: float) -> Form:
    x, y = at
    px, py, _, yaw = item.local_pose(x, y)
    part = kit.furniture(name, name, (px, py, top, yaw))
    part.cylinder((0, 0, 0.002), 0.134, 0.004, (0.13, 0.13, 0.14, 1), texture="metal")
    part.cylinder((0, 0, 0.007), 0.05, 0.010, (0.24, 0.24, 0.25, 1), texture="metal")
    iron = (0.05, 0.05, 0.055, 1.0)
    for k in range(2):
        turn = quaternion((0, 0, 1), np.pi / 4 + k * np.pi / 2)
        part.box((0, 0, 0.016), (0.27, 0.012, 0.012), iron, quat=turn)
    on = {"toggled": ("on",)}
    ring = [(0.060, 0.0045), (0.134, 0.0045), (0.134, 0.0065), (0.060, 0.0065), (0.060, 0.0045)]
    part.mesh(meshes.lathe(ring, 28), (1.0, 0.23, 0.04, 1), when=on)
    flames = []
    for k in range(18):
        a = 2 * np.pi * k / 18
        tongue = meshes.lathe([(0, 0.0), (0.008, 0.002), (0.005, 0.010), (0, 0.0215)], 6)
        flames.append(meshes.moved(tongue, 0.118 * np.cos(a), 0.118 * np.sin(a), 0.005))
    part.mesh(meshes.merged(flames), (1.0, 0.62, 0.10, 1), when=on)
    area = Rect(-0.12, -0.12, 0.12, 0.12)
    turn_rad = -float(np.sign(x)) * float(np.deg2rad(40 if y > 0.3 else 65))
    region = Region(name, name, area, 0.0225, kind="spot", yaw_rad=turn_rad)
    return Form(
        Rect(-0.134, -0.134, 0.134, 0.134),
        0.022,
        regions=(region,),
        stance=Stance(COUNTER_DEPTH_M - y, distance_m=0.62),
    )


def _knob(
    kit: Kit, item: Item, name: str, burner: str, x: float, y: float, z: float, tilt: float
) -> Form:
    px, py, _, yaw = item.local_pose(x, y)
    part = kit.furniture(name, name, (px, py, z, yaw))
    normal = (0.0, float(-np.sin(tilt)), float(np.cos(tilt)))
    up = (0.0, float(-np.cos(tilt)), float(-np.sin(tilt)))
    dial = part.swinging(
        "dial", (0, 0, 0), normal, "toggled", {"off": 0.0, "on": -1.6}, follows=burner
    )
    turn = quaternion((1, 0, 0), tilt)
    at = (0.0, normal[1] * 0.014, normal[2] * 0.014)
    dial.cylinder(at, 0.024, 0.028, DARK, quat=turn, texture="metal", solid=False)
    mark = (0.0, normal[1] * 0.029 + up[1] * 0.011, normal[2] * 0.029 + up[2] * 0.011)
    dial.box(mark, (0.006, 0.022, 0.003), (0.95, 0.95, 0.95, 1), quat=turn, solid=False)
    return Form(
        Rect(-0.025, -0.03, 0.025, 0.03), 0.03, stance=Stance(COUNTER_DEPTH_M - y, distance_m=0.62)
    )


def _hood(kit: Kit, item: Item, style: Style) -> None:
    part = kit.furniture(None, f"{item.name}/hood", (item.x, item.y, 0, item.yaw))
    w = item.width
    part.box((0, 0.005, 1.28), (w, 0.01, 0.76), style.splash, texture="tiles")
    part.box((0, 0.24, 1.70), (w - 0.02, 0.46, 0.07), STEEL, texture="metal")
    part.box((0, 0.16, 1.80), (w * 0.6, 0.30, 0.14), STEEL, texture="metal")
    part.box((0, 0.13, 2.15), (0.28, 0.24, 0.60), STEEL, texture="metal")


def corner(kit: Kit, item: Item, style: Style) -> Forms:
    """Scenery: the corner between two counters."""
    part = kit.furniture(None, item.name, (item.x, item.y, 0, item.yaw))
    w, d = item.width, COUNTER_DEPTH_M
    _plate(part, Rect(-w / 2, 0, w / 2, w), _SLAB, COUNTER_HEIGHT_M, style)
    part.box((0, d / 2, _SLAB / 2), (w, d, _SLAB), style.front, texture=style.front_texture)
    part.box((0, 0.005, 1.12), (w, 0.01, 0.44), style.splash, texture="tiles")
    return {}


def block(kit: Kit, item: Item, style: Style) -> Forms:
    """Scenery: a wall inside of the room."""
    part = kit.furniture(None, item.name, (item.x, item.y, 0, item.yaw))
    size = (item.width, item.depth, ROOM_HEIGHT_M)
    part.box((0, item.depth / 2, ROOM_HEIGHT_M / 2), size, style.wall, texture="plaster")
    return {}
