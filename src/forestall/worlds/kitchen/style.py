"""Colours, surfaces and light of a room, drawn once from the scene's seed; read by its builders."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from forestall.worlds.kitchen.forms import Rgba

_COUNTERS: tuple[tuple[Rgba, str], ...] = (
    ((0.80, 0.78, 0.74, 1), "stone"),
    ((0.30, 0.30, 0.32, 1), "stone"),
    ((0.62, 0.58, 0.52, 1), "stone"),
    ((0.66, 0.46, 0.28, 1), "wood"),
    ((0.78, 0.62, 0.42, 1), "wood"),
)
_FRONTS: tuple[tuple[Rgba, str | None], ...] = (
    ((0.90, 0.89, 0.86, 1), None),
    ((0.42, 0.51, 0.55, 1), None),
    ((0.45, 0.53, 0.43, 1), None),
    ((0.64, 0.46, 0.29, 1), "wood"),
    ((0.50, 0.33, 0.20, 1), "wood"),
    ((0.82, 0.76, 0.66, 1), None),
    ((0.24, 0.30, 0.38, 1), None),
)
_WALLS: tuple[Rgba, ...] = (
    (0.88, 0.86, 0.80, 1),
    (0.80, 0.85, 0.86, 1),
    (0.86, 0.82, 0.74, 1),
    (0.78, 0.83, 0.76, 1),
    (0.90, 0.89, 0.88, 1),
)
_FLOORS: tuple[tuple[Rgba, str], ...] = (
    ((0.60, 0.43, 0.28, 1), "wood"),
    ((0.72, 0.55, 0.38, 1), "wood"),
    ((0.42, 0.30, 0.21, 1), "wood"),
    ((0.76, 0.74, 0.70, 1), "tiles"),
    ((0.58, 0.56, 0.54, 1), "tiles"),
)
_SPLASHES: tuple[Rgba, ...] = (
    (0.90, 0.91, 0.90, 1),
    (0.62, 0.76, 0.76, 1),
    (0.84, 0.78, 0.66, 1),
    (0.58, 0.66, 0.74, 1),
)
_APPLIANCES: tuple[Rgba, ...] = (
    (0.78, 0.79, 0.80, 1),
    (0.90, 0.90, 0.89, 1),
    (0.22, 0.23, 0.25, 1),
    (0.70, 0.71, 0.70, 1),
)
_TABLES: tuple[Rgba, ...] = (
    (0.58, 0.38, 0.22, 1),
    (0.74, 0.57, 0.37, 1),
    (0.36, 0.23, 0.15, 1),
    (0.86, 0.83, 0.78, 1),
)
_CLOTHS: tuple[Rgba, ...] = (
    (0.35, 0.42, 0.50, 1),
    (0.55, 0.32, 0.28, 1),
    (0.50, 0.50, 0.44, 1),
    (0.70, 0.62, 0.50, 1),
    (0.30, 0.42, 0.36, 1),
)

STEEL: Rgba = (0.70, 0.71, 0.73, 1)
DARK: Rgba = (0.07, 0.07, 0.08, 1)


@dataclass(frozen=True, slots=True)
class Style:
    """What a room is made of."""

    counter: Rgba
    counter_texture: str
    front: Rgba
    front_texture: str | None
    wall: Rgba
    floor: Rgba
    floor_texture: str
    splash: Rgba
    appliance: Rgba
    fridge: Rgba
    table: Rgba
    cloth: Rgba
    rug: Rgba
    handle: Rgba


def draw_style(rng: np.random.Generator) -> Style:
    """A seeded style."""

    def shade(rgba: Rgba, by: float = 0.06) -> Rgba:
        factor = float(rng.uniform(1 - by, 1 + by))
        return (min(rgba[0] * factor, 1), min(rgba[1] * factor, 1), min(rgba[2] * factor, 1), 1)

    def pick(options: tuple[Rgba, ...]) -> Rgba:
        return shade(options[int(rng.integers(len(options)))])

    counter, counter_texture = _COUNTERS[int(rng.integers(len(_COUNTERS)))]
    front, front_texture = _FRONTS[int(rng.integers(len(_FRONTS)))]
    floor, floor_texture = _FLOORS[int(rng.integers(len(_FLOORS)))]
    return Style(
        counter=shade(counter),
        counter_texture=counter_texture,
        front=shade(front),
        front_texture=front_texture,
        wall=pick(_WALLS),
        floor=shade(floor),
        floor_texture=floor_texture,
        splash=pick(_SPLASHES),
        appliance=pick(_APPLIANCES),
        fridge=pick(_APPLIANCES),
        table=pick(_TABLES),
        cloth=pick(_CLOTHS),
        rug=pick(_CLOTHS),
        handle=DARK if rng.uniform() < 0.4 else STEEL,
    )


@dataclass(frozen=True, slots=True)
class Light:
    """How a room is lit.

    Args:
        aside: where the lamp hangs, as shares of the room's width and depth from its middle.
        strength: of the lamp.
        warm: 1 for white, less for yellow.
        fill: strength of the light from the window.
    """

    aside: tuple[float, float]
    strength: float
    warm: float
    fill: float


def draw_light(rng: np.random.Generator) -> Light:
    """A seeded light."""
    return Light(
        aside=(float(rng.uniform(-0.22, 0.22)), float(rng.uniform(-0.22, 0.22))),
        strength=float(rng.uniform(0.62, 0.92)),
        warm=float(rng.uniform(0.86, 1.0)),
        fill=0.14 * float(rng.uniform(0.7, 1.3)),
    )
