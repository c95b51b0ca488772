"""Procedural textures: small tileable pictures made once from hashed value noise, with mipmaps.

A texture is a tone that multiplies the colour of its geom (mean near 1), so that colours stay those
of the scene. It is laid on each face along the two axes of the geom that lie in it.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
import numpy.typing as npt

from forestall.worlds.kitchen.rendering.appearance import TEXTURES

Float = npt.NDArray[np.float32]

SIZE = 512


@dataclass(frozen=True, slots=True, eq=False)
class Texture:
    """A tileable picture with its mipmaps, the finest first.

    Attributes:
        extent_m: length of one tile's side.
        texels: (sum of all levels,) float32 tones, level after level, row-major.
        offsets: where each level begins in `texels`.
        sizes: side of each level in texels.
    """

    extent_m: float
    texels: Float
    offsets: npt.NDArray[np.int32]
    sizes: npt.NDArray[np.int32]

    def sample(self, uv_m: Float, footprint_m: Float) -> Float:
        """Bilinear tones (n,) at (n, 2) metres; `footprint_m` (n,) chooses the mipmap."""
        finest = self.extent_m / SIZE
        level = np.log2(np.maximum(footprint_m / np.float32(finest), 1)).astype(np.int32)
        level = np.minimum(level, len(self.sizes) - 1)
        size, offset = self.sizes[level], self.offsets[level]
        scale = (size / np.float32(self.extent_m)).astype(np.float32)
        x, y = uv_m[:, 0] * scale - np.float32(0.5), uv_m[:, 1] * scale - np.float32(0.5)
        left, top = np.floor(x), np.floor(y)
        fraction_x, fraction_y = x - left, y - top
        wrap = size - 1
        x0, y0 = left.astype(np.int32) & wrap, top.astype(np.int32) & wrap
        x1, y1 = (x0 + 1) & wrap, offset + ((y0 + 1) & wrap) * size
        y0 = offset + y0 * size
        upper = _between(self.texels.take(y0 + x0), self.texels.take(y0 + x1), fraction_x)
        lower = _between(self.texels.take(y1 + x0), self.texels.take(y1 + x1), fraction_x)
        return _between(upper, lower, fraction_y)


def _between(a: Float, b: Float, weight: Float) -> Float:
    return np.asarray(a + (b - a) * weight)


def hashed(cells: npt.NDArray[np.int64], seed: int) -> Float:
    """Uniform [0, 1) values of integer cells, by an integer hash."""
    x = cells.astype(np.uint64) + np.uint64(seed * 0x9E3779B9)
    for shift, factor in ((30, 0xBF58476D1CE4E5B9), (27, 0x94D049BB133111EB)):
        x = (x ^ (x >> np.uint64(shift))) * np.uint64(factor)
    x ^= x >> np.uint64(31)
    return ((x >> np.uint64(40)).astype(np.float64) / 2**24).astype(np.float32)


def value_noise(cells_x: int, cells_y: int, seed: int, size: int = SIZE) -> Float:
    """Tileable (size, size) value noise in [0, 1] with that many cells along each side."""
    y, x = np.meshgrid(np.arange(size), np.arange(size), indexing="ij")
    px, py = x * (cells_x / size), y * (cells_y / size)
    ix, iy = px.astype(np.int64), py.astype(np.int64)
    fx, fy = px - ix, py - iy
    fx, fy = fx * fx * (3 - 2 * fx), fy * fy * (3 - 2 * fy)

    def corner(dx: int, dy: int) -> Float:
        return hashed((ix + dx) % cells_x + cells_x * ((iy + dy) % cells_y), seed)

    top = corner(0, 0) * (1 - fx) + corner(1, 0) * fx
    bottom = corner(0, 1) * (1 - fx) + corner(1, 1) * fx
    return np.asarray(top * (1 - fy) + bottom * fy, dtype=np.float32)


def fractal_noise(cells_x: int, cells_y: int, octaves: int, seed: int) -> Float:
    """Sum of octaves of value noise, each half as strong as the one before; mean near 0.5."""
    total = np.zeros((SIZE, SIZE), np.float32)
    norm = 0.0
    for k in range(octaves):
        weight = 0.5**k
        total += weight * value_noise(cells_x << k, cells_y << k, seed + k)
        norm += weight
    return np.asarray(total / norm)


def _wood() -> Float:
    warp = fractal_noise(2, 3, 3, 11)
    _, y = np.meshgrid(np.arange(SIZE), np.arange(SIZE))
    rings = 0.5 + 0.5 * np.sin(2 * np.pi * (9 * y / SIZE + 2.2 * warp))
    grain = fractal_noise(4, 128, 2, 12)
    pores = np.clip((value_noise(24, 256, 14) - 0.78) * 4, 0, 1)
    tone = 1.0 + 0.20 * (rings**2 - 0.4) + 0.26 * (grain - 0.5) - 0.16 * pores
    return np.asarray(tone, dtype=np.float32)


def _tiles() -> Float:
    count, joint = 4, 3
    pixel = np.arange(SIZE)
    inside = (pixel % (SIZE // count)) >= joint
    cell = pixel // (SIZE // count)
    shade = hashed(cell[:, None] * count + cell[None, :], 21) - 0.5
    tone = 1.02 + 0.06 * shade + 0.05 * (fractal_noise(16, 16, 4, 22) - 0.5)
    tone = np.where(inside[:, None] & inside[None, :], tone, 0.62)
    return np.asarray(tone, dtype=np.float32)


def _stone() -> Float:
    clouds = fractal_noise(6, 6, 4, 31) - 0.5
    dark = np.clip((value_noise(128, 128, 32) - 0.72) * 5, 0, 1)
    light = np.clip((value_noise(96, 96, 33) - 0.78) * 5, 0, 1)
    tone = 1.0 + 0.22 * clouds - 0.32 * dark + 0.28 * light
    return np.asarray(tone, dtype=np.float32)


def _plaster() -> Float:
    tone = (
        1.0 + 0.06 * (fractal_noise(4, 4, 3, 41) - 0.5) + 0.10 * (value_noise(192, 192, 42) - 0.5)
    )
    return np.asarray(tone, dtype=np.float32)


def _metal() -> Float:
    brushed = fractal_noise(6, 256, 2, 51) - 0.5
    tone = 1.0 + 0.20 * brushed + 0.10 * (fractal_noise(2, 4, 2, 52) - 0.5)
    return np.asarray(tone, dtype=np.float32)


def _fabric() -> Float:
    pixel = np.arange(SIZE)
    thread = 0.5 + 0.5 * np.sin(2 * np.pi * 64 * pixel / SIZE)
    over = ((pixel[:, None] // 8 + pixel[None, :] // 8) % 2).astype(np.float32)
    weave = over * thread[:, None] + (1 - over) * thread[None, :]
    tone = 0.88 + 0.24 * weave + 0.16 * (fractal_noise(32, 32, 2, 61) - 0.5)
    return np.asarray(tone, dtype=np.float32)


def _food() -> Float:
    mottle = fractal_noise(12, 12, 3, 71) - 0.5
    spots = np.clip((value_noise(56, 56, 72) - 0.75) * 5, 0, 1)
    return np.asarray(1.02 + 0.36 * mottle - 0.22 * spots, dtype=np.float32)


def _ceramic() -> Float:
    return np.asarray(1.0 + 0.04 * (fractal_noise(6, 6, 3, 81) - 0.5), dtype=np.float32)


_MAKERS: dict[str, tuple[Callable[[], Float], float]] = {
    "wood": (_wood, 0.9),
    "tiles": (_tiles, 1.2),
    "stone": (_stone, 0.8),
    "plaster": (_plaster, 1.0),
    "metal": (_metal, 0.5),
    "fabric": (_fabric, 0.25),
    "food": (_food, 0.25),
    "ceramic": (_ceramic, 0.4),
}


TINTS: dict[str, tuple[float, float, float]] = {
    name: {"wood": (0.92, 1.0, 1.12), "stone": (0.97, 1.0, 1.05), "food": (0.9, 1.0, 1.15)}.get(
        name, (1.0, 1.0, 1.0)
    )
    for name in TEXTURES
}
"""How strongly each colour channel follows the tone."""


@lru_cache(maxsize=len(TEXTURES))
def texture(name: str) -> Texture:
    """The texture of that name (one of `appearance.TEXTURES`)."""
    make, extent_m = _MAKERS[name]
    levels = [np.clip(make(), 0.1, 1.9).astype(np.float32)]
    while levels[-1].shape[0] > 1:
        fine = levels[-1]
        half = fine.shape[0] // 2
        levels.append(fine.reshape(half, 2, half, 2).mean(axis=(1, 3), dtype=np.float32))
    sizes = np.array([level.shape[0] for level in levels], dtype=np.int32)
    offsets = np.concatenate([[0], np.cumsum(sizes**2)[:-1]]).astype(np.int32)
    texels = np.concatenate([level.ravel() for level in levels])
    return Texture(extent_m, texels, offsets, sizes)
