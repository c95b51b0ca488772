"""Builds every movable thing by the shape of its category; the entry is `build_thing`."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from forestall.errors import InputError
from forestall.worlds.kitchen import crockery, food, meshes, plants
from forestall.worlds.kitchen.assembly import Assembly, Kit
from forestall.worlds.kitchen.catalogue import Category
from forestall.worlds.kitchen.crockery import chosen, darker
from forestall.worlds.kitchen.forms import Form, Rect, Region, Rgba

Builder = Callable[[Assembly, str, Mapping[str, Any], frozenset[str]], Form]

_DARK: Rgba = (0.08, 0.08, 0.09, 1)


def build_thing(kit: Kit, name: str, category: Category) -> Form:
    """Add a free thing to the scene.

    Raises:
        InputError: the category's shape has no usable size.
    """
    shape = dict(category.shape)
    size = shape.get("size_m", [0.08, 0.08, 0.08])
    if len(size) != 3 or min(float(s) for s in size) <= 0:
        raise InputError(f"shape of {category.name}: size_m must be three lengths above 0 (metres)")
    shape["size_m"] = size
    kind = str(shape.get("kind", "box"))
    build = _BUILDERS.get(kind, box)
    if kind == "box" and category.food:
        build = food.loaf
    part = kit.thing(name)
    form = build(part, category.name, shape, frozenset(category.attributes))
    if category.receptacle is not None and not form.regions:
        form = _with_top(form, name)
    return form


def _with_top(form: Form, name: str) -> Form:
    """A solid thing that takes others takes them on its upper side."""
    region = Region(name, name, form.footprint, form.height_m, clearance_m=1.0)
    return Form(form.footprint, form.height_m, form.core_m, (region,))


def _plain(size: tuple[float, float, float]) -> Form:
    x, y, z = size
    return Form(Rect(-x / 2, -y / 2, x / 2, y / 2), z, float(np.hypot(x, y)) / 2)


def _size(shape: Mapping[str, Any]) -> tuple[float, float, float]:
    x, y, z = (float(s) for s in shape["size_m"])
    return x, y, z


def box(part: Assembly, category: str, shape: Mapping[str, Any], states: frozenset[str]) -> Form:
    """A box: a phone, a remote control, or anything else of its size."""
    size = _size(shape)
    x, y, z = size
    rng = part.kit.rng
    if category == "CellPhone":
        part.box((0, 0, z / 2), size, chosen("", rng, (_DARK, (0.75, 0.75, 0.78, 1))))
        screens = {"off": (0.03, 0.03, 0.04, 1.0), "on": (0.45, 0.80, 1.0, 1.0)}
        part.box(
            (0, 0, z),
            (x * 0.88, y * 0.88, 0.001),
            screens["off"],
            tints=("toggled", screens),
            solid=False,
        )
        lit = {"toggled": ("on",)}
        for k, tone in enumerate(((0.95, 0.45, 0.2), (0.3, 0.8, 0.35), (0.9, 0.85, 0.3))):
            at = ((k - 1) * x * 0.26, y * 0.12, z + 0.0006)
            part.box(at, (x * 0.18, x * 0.18, 0.001), (*tone, 1), when=lit, solid=False)
        return _plain(size)
    if category == "RemoteControl":
        part.box((0, 0, z * 0.45), (x, y, z * 0.9), chosen("", rng, (_DARK, (0.3, 0.3, 0.33, 1))))
        part.cylinder((0, y * 0.36, z * 0.93), x * 0.14, z * 0.12, (0.8, 0.1, 0.1, 1), solid=False)
        key = meshes.extrude(_square(x * 0.09), 0, z * 0.1)
        keys = [
            meshes.moved(key, i * x * 0.28, j * y * 0.1, z * 0.9)
            for i in (-1, 0, 1)
            for j in (-3, -2, -1, 0, 1)
        ]
        part.mesh(meshes.merged(keys), (0.75, 0.75, 0.75, 1))
        return _plain(size)
    rgba = chosen(category, rng)
    tints = {"tints": ("toggled", {"off": rgba, "on": darker(rgba, 1.6)})}
    part.box((0, 0, z / 2), size, rgba, **(tints if "toggled" in states else {}))
    _marks(part, size, states)
    return _plain(size)


def _square(half: float) -> list[tuple[float, float]]:
    return [(-half, -half), (half, -half), (half, half), (-half, half)]


def _marks(part: Assembly, size: tuple[float, float, float], states: frozenset[str]) -> None:
    """Stains on top of a plain thing that can be dirty."""
    if "dirty" not in states:
        return
    rng = part.kit.rng
    reach = min(size[0], size[1]) / 2
    spots = [
        meshes.moved(
            meshes.extrude(meshes.blob(reach * 0.4, rng), 0, 0.001),
            float(rng.uniform(-0.5, 0.5)) * reach,
            float(rng.uniform(-0.5, 0.5)) * reach,
            size[2],
        )
        for _ in range(4)
    ]
    part.mesh(meshes.merged(spots), crockery.STAIN, when={"dirty": ("dirty",)})


def cylinder(
    part: Assembly, category: str, shape: Mapping[str, Any], states: frozenset[str]
) -> Form:
    """An upright cylinder."""
    x, y, z = _size(shape)
    r = min(x, y) / 2
    part.cylinder((0, 0, z / 2), r, z, chosen(category, part.kit.rng))
    _marks(part, (2 * r, 2 * r, z), states)
    return Form(Rect(-r, -r, r, r), z, r)


def knife(part: Assembly, category: str, shape: Mapping[str, Any], states: frozenset[str]) -> Form:
    """A knife lying flat along x."""
    x, y, z = _size(shape)
    grip = chosen("", part.kit.rng, (_DARK, (0.42, 0.26, 0.14, 1), (0.55, 0.12, 0.10, 1)))
    hilt = -x / 2 + 0.40 * x
    blade = [
        (hilt, -0.38 * y),
        (x / 2 - 0.15 * x, -0.40 * y),
        (x / 2, 0.30 * y),
        (hilt, 0.42 * y),
    ]
    mid = z * 0.5
    part.mesh(
        meshes.extrude(blade, mid - 0.0015, mid + 0.0015), (0.82, 0.83, 0.85, 1), texture="metal"
    )
    part.box((-x / 2 + 0.2 * x, 0, mid), (0.40 * x, 0.62 * y, z), grip)
    for k in (-0.1, 0.1):
        at = (-x / 2 + 0.2 * x + k * x, 0.0, z)
        part.cylinder(at, 0.003, 0.001, (0.8, 0.8, 0.8, 1), solid=False)
    part.proxy_box((0.2 * x, 0, mid), (0.6 * x, 0.8 * y, 0.006))
    return _plain((x, y, z))


def hinged(part: Assembly, category: str, shape: Mapping[str, Any], states: frozenset[str]) -> Form:
    """Two leaves on a hinge: a laptop when wide, else a book."""
    size = _size(shape)
    return (_laptop if size[0] > 0.25 else _book)(part, size)


def _laptop(part: Assembly, size: tuple[float, float, float]) -> Form:
    x, y, z = size
    rng = part.kit.rng
    shell = chosen("", rng, ((0.70, 0.71, 0.73, 1), (0.22, 0.22, 0.24, 1), (0.85, 0.84, 0.82, 1)))
    base, lid = z * 0.6, z * 0.36
    part.box((0, 0, base / 2), (x, y, base), shell, texture="metal")
    part.box((0, -y * 0.08, base), (x * 0.88, y * 0.50, 0.001), _DARK, solid=False)
    part.box((0, y * 0.32, base), (x * 0.30, y * 0.24, 0.001), darker(shell, 0.8), solid=False)
    angle = float(np.deg2rad(108))
    leaf = part.swinging(
        "lid", (0, -y / 2, base + lid / 2), (1, 0, 0), "open", {"closed": 0.0, "open": angle}
    )
    gap = 0.0008
    leaf.box((0, y / 2, gap), (x, y, lid - gap), shell, texture="metal")
    under = -lid / 2 + gap
    leaf.box((0, y / 2, under), (x * 0.94, y * 0.88, 0.0012), _DARK, solid=False)
    on = {"open": ("open",)}
    leaf.box(
        (0, y / 2, under - 0.0004),
        (x * 0.90, y * 0.82, 0.001),
        (0.35, 0.60, 0.86, 1),
        solid=False,
        when=on,
    )
    for k, tone in enumerate(((0.92, 0.92, 0.95), (0.95, 0.75, 0.35))):
        at = ((k - 0.5) * x * 0.36, y / 2, under - 0.0012)
        leaf.box(at, (x * 0.3, y * 0.5, 0.001), (*tone, 1), solid=False, when=on)
    back = -y / 2 - y * float(-np.cos(angle)) - lid
    tall = base + y * float(np.sin(angle)) + lid
    return Form(Rect(-x / 2, back, x / 2, y / 2), tall, x)


def _book(part: Assembly, size: tuple[float, float, float]) -> Form:
    x, y, z = size
    cover = chosen(
        "",
        part.kit.rng,
        (
            (0.55, 0.13, 0.13, 1),
            (0.13, 0.28, 0.48, 1),
            (0.18, 0.38, 0.26, 1),
            (0.72, 0.52, 0.18, 1),
        ),
    )
    page, half = (0.95, 0.93, 0.86, 1), z / 2
    ink = (0.35, 0.35, 0.38, 1)

    def leaf(to: Assembly, top: bool) -> None:
        side = 1 if top else -1
        x0 = 0.0 if not top else x / 2
        board = side * (half - 0.002) if top else 0.002
        to.box((x0, 0, board), (x, y, 0.004), cover, texture="fabric")
        inner = (half - 0.004) / 2
        middle = inner if top else half - inner
        to.box((x0, 0, middle), (x * 0.94, y * 0.94, half - 0.0046), page, solid=False)
        face = -0.0001 if top else half
        for k in range(5):
            at = (x0, y * (0.34 - 0.17 * k), face)
            to.box(at, (x * 0.7, y * 0.05, 0.0006), ink, solid=False, when={"open": ("open",)})

    leaf(part, top=False)
    upper = part.swinging(
        "cover", (-x / 2, 0, half), (0, 1, 0), "open", {"closed": 0.0, "open": -float(np.pi)}
    )
    leaf(upper, top=True)
    return Form(Rect(-1.5 * x, -y / 2, x / 2, y / 2), z, 1.5 * x)


_BUILDERS: Mapping[str, Builder] = {
    "box": box,
    "cylinder": cylinder,
    "ellipsoid": food.ellipsoid,
    "vessel": crockery.vessel,
    "dish": crockery.dish,
    "bottle": crockery.bottle,
    "plant": plants.plant,
    "slab": food.slab,
    "egg_cracked": food.egg_cracked,
    "knife": knife,
    "hinged": hinged,
}
