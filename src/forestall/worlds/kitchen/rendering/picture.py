"""Makes a frame from a tracer: rays, light, colour, transparent layers, smooth edges.

`RayRenderer` serves both ray casters. Work is cut into bands of rows that two threads share; the
bands do not depend on the number of threads, so neither does the picture.
"""

from __future__ import annotations

import os
import time
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

import mujoco
import numpy as np
import numpy.typing as npt

from forestall.errors import InputError
from forestall.types.observation import Frame, Intrinsics
from forestall.worlds.kitchen.rendering.appearance import Appearance
from forestall.worlds.kitchen.rendering.lighting import (
    GROUPS,
    STRIDE,
    Lights,
    block_group,
    same_surface,
    smoothed,
    visibility,
)
from forestall.worlds.kitchen.rendering.shading import Surfaces, shade, to_display
from forestall.worlds.kitchen.rendering.tracer import Bool, Float, Hits, Int, Tracer
from forestall.worlds.kitchen.rendering.vectors import dot, rows

BAND_ROWS = 48
CHUNK = 16384
OWN_GROUP_STEP = 2
"""Of the sample groups, every how-manieth a point without neighbours on the grid uses."""

LAYERS = 3
"""How many transparent surfaces a ray passes at most."""

LEAST_CONTRAST = 0.025
"""Steps of the square root of linear colour that are worth smoothing (full scale is 1)."""

_SUBPIXELS = ((-0.125, -0.375), (0.375, -0.125), (0.125, 0.375), (-0.375, 0.125))


@dataclass(frozen=True, slots=True, eq=False)
class View:
    """Where the camera is, and the light that was measured from there.

    `grid_*` are rows of the light grid (every STRIDE-th pixel of every STRIDE-th row).
    """

    origin: Float
    rotation: Float
    grid_size: tuple[int, int]
    grid_points: Float
    grid_normals: Float
    grid_reach: Float


class RayRenderer:
    """Renders frames with a ray caster and numpy.

    Args:
        tracer: casts the rays.
        model: the compiled model.
        appearance: instances and textures of its geoms.
        intrinsics: camera of every frame.
        threads: how many threads share a frame; all usable cores up to four by default.
    """

    def __init__(
        self,
        tracer: Tracer,
        model: mujoco.MjModel,
        appearance: Appearance,
        intrinsics: Intrinsics,
        threads: int | None = None,
    ) -> None:
        if len(appearance.texture) != model.ngeom:
            raise InputError(
                f"the appearance describes {len(appearance.texture)} geoms, "
                f"the model has {model.ngeom}"
            )
        self.name = tracer.name
        self.phase_s: dict[str, float] = {}
        self._tracer = tracer
        self._model = model
        self._appearance = appearance
        self._intrinsics = intrinsics
        self._surfaces = Surfaces(model, appearance)
        self._rays = _camera_rays(intrinsics)
        self._pixel_m = 1.0 / intrinsics.fx
        self._instance = np.append(appearance.geom_instance, np.int32(-1)).astype(np.int32)
        self._pool = ThreadPoolExecutor(threads or _usable_cores())

    def render(self, data: Any, camera_to_world: npt.NDArray[np.float64]) -> Frame:
        """See `interfaces.Renderer.render`; `phase_s` then tells the seconds by phase."""
        self.phase_s = {}
        height, width = self._intrinsics.height, self._intrinsics.width
        with self._phase("rebuild"):
            self._tracer.update(data)
            self._surfaces.refresh(data)
            lights = Lights.read(self._model, data)
        origin = camera_to_world[:3, 3].astype(np.float32)
        rotation = camera_to_world[:3, :3].astype(np.float32)
        with self._phase("primary rays"):
            hits, points = self._primary(origin, rotation)
        geom = hits.geom.reshape(height, width)
        depth = hits.distance.reshape(height, width)
        normal = hits.normal.reshape(height, width, 3)
        with self._phase("shadow and ambient rays"):
            view = self._light_grid(origin, rotation, lights, geom, normal, depth, points)
        with self._phase("shading"):
            edges = discontinuities(geom, normal, depth)
            colour = self._colour(view, lights, hits, points, edges)
        with self._phase("anti-aliasing"):
            self._smooth_edges(view, lights, colour, edges & contrasts(colour))
        with self._phase("display"):
            rgb = to_display(colour)
        return Frame(
            rgb=rgb,
            depth_m=depth,
            intrinsics=self._intrinsics,
            camera_to_world=np.array(camera_to_world, dtype=np.float64),
            instance_ids=self._instance[geom],
            instance_names=self._appearance.instance_names,
        )

    def _primary(self, origin: Float, rotation: Float) -> tuple[Hits, Float]:
        count = len(self._rays)
        geom, distance = np.empty(count, np.int32), np.empty(count, np.float32)
        normal, points = np.empty((count, 3), np.float32), np.empty((count, 3), np.float32)

        def work(part: slice) -> None:
            directions = self._rays[part] @ rotation.T
            hits = self._tracer.closest(origin, directions)
            geom[part], distance[part], normal[part] = hits.geom, hits.distance, hits.normal
            points[part] = origin + directions * hits.distance[:, None]

        self._each(work, self._bands())
        return Hits(geom, distance, normal), points

    def _light_grid(
        self,
        origin: Float,
        rotation: Float,
        lights: Lights,
        geom: Int,
        normal: Float,
        depth: Float,
        points: Float,
    ) -> View:
        every = (slice(None, None, STRIDE), slice(None, None, STRIDE))
        size = geom[every].shape
        place = np.ascontiguousarray(points.reshape(*geom.shape, 3)[every]).reshape(-1, 3)
        facing = np.ascontiguousarray(normal[every]).reshape(-1, 3)
        met = np.flatnonzero(geom[every].ravel() >= 0)
        row, column = np.divmod(np.arange(size[0] * size[1]), size[1])
        group = block_group(row, column)
        reach = np.ones((size[0] * size[1], 2), np.float32)

        def work(part: slice) -> None:
            some = met[part]
            reach[some] = visibility(
                self._tracer, lights.key, place[some], facing[some], group[some]
            )

        self._each(work, _chunks(len(met), CHUNK // 2))
        smooth = smoothed(
            place.reshape(*size, 3),
            facing.reshape(*size, 3),
            np.ascontiguousarray(depth[every]),
            reach.reshape(*size, 2),
        )
        return View(origin, rotation, (size[0], size[1]), place, facing, smooth.reshape(-1, 2))

    def _colour(self, view: View, lights: Lights, hits: Hits, points: Float, edges: Bool) -> Float:
        height, width = edges.shape
        reach = _enlarged(view.grid_reach.reshape(*view.grid_size, 2), height, width)
        reach = reach.reshape(-1, 2)
        near_edges = grown(edges, STRIDE).ravel()
        colour = np.empty((height * width, 3), np.float32)

        def work(part: slice) -> None:
            some = Hits(hits.geom[part], hits.distance[part], hits.normal[part])
            light = reach[part]
            careful = np.flatnonzero(near_edges[part])
            if careful.size:
                row, column = np.divmod(careful + part.start, width)
                at = np.stack([column, row], axis=1).astype(np.float32)
                chosen = _pick(some, careful)
                light[careful] = self._reach(view, lights, chosen, points[part][careful], at)
            directions = self._rays[part] @ view.rotation.T
            colour[part] = self._layered(view, lights, some, points[part], directions, light)

        self._each(work, self._bands())
        return colour.reshape(height, width, 3)

    def _smooth_edges(self, view: View, lights: Lights, colour: Float, edges: Bool) -> None:
        row, column = np.nonzero(edges)
        camera = self._intrinsics

        def work(part: slice) -> None:
            centre = np.stack([column[part], row[part]], axis=1).astype(np.float32)
            at = (centre[:, None] + np.array(_SUBPIXELS, np.float32)).reshape(-1, 2)
            rays = np.ones((len(at), 3), np.float32)
            rays[:, 0] = (at[:, 0] - camera.cx) / camera.fx
            rays[:, 1] = (at[:, 1] - camera.cy) / camera.fy
            directions = rays @ view.rotation.T
            hits = self._tracer.closest(view.origin, directions)
            points = view.origin + directions * hits.distance[:, None]
            light = self._reach(view, lights, hits, points, at)
            samples = self._layered(view, lights, hits, points, directions, light)
            total = samples.reshape(-1, len(_SUBPIXELS), 3).sum(axis=1)
            here = row[part], column[part]
            colour[here] = (colour[here] + total) / (len(_SUBPIXELS) + 1)

        self._each(work, _chunks(len(row), CHUNK // 4))

    def _reach(self, view: View, lights: Lights, hits: Hits, points: Float, at: Float) -> Float:
        """Light reach of hits seen at pixels `at` (n, 2): from the grid, else by own rays."""
        height, width = view.grid_size
        base = np.floor(at / STRIDE)
        fraction = at / STRIDE - base
        column, row = base[:, 0].astype(np.int64), base[:, 1].astype(np.int64)
        tolerance = 0.004 + 0.004 * hits.distance
        total = np.zeros((len(at), 2), np.float32)
        weights = np.zeros(len(at), np.float32)
        for dy in (0, 1):
            for dx in (0, 1):
                x, y = np.clip(column + dx, 0, width - 1), np.clip(row + dy, 0, height - 1)
                index = y * width + x
                alike = same_surface(
                    points, hits.normal, tolerance,
                    rows(view.grid_points, index), rows(view.grid_normals, index),
                )  # fmt: skip
                share_x = fraction[:, 0] if dx else 1 - fraction[:, 0]
                share_y = fraction[:, 1] if dy else 1 - fraction[:, 1]
                weight = alike * (share_x * share_y + np.float32(0.01))
                total += weight[:, None] * rows(view.grid_reach, index)
                weights += weight
        reach = total / np.maximum(weights, 1e-6)[:, None]
        lost = np.flatnonzero((weights < 0.005) & (hits.geom >= 0))
        if lost.size:
            reach[lost] = self._own_reach(lights, rows(points, lost), rows(hits.normal, lost))
        return np.asarray(reach)

    def _own_reach(self, lights: Lights, points: Float, normals: Float) -> Float:
        """Light reach from the points' own rays, as many as the filter over the grid combines."""
        total = np.zeros((len(points), 2), np.float32)
        for group in range(0, GROUPS, OWN_GROUP_STEP):
            groups = np.full(len(points), group, np.int32)
            total += visibility(self._tracer, lights.key, points, normals, groups)
        return np.asarray(total / (GROUPS // OWN_GROUP_STEP))

    def _layered(
        self,
        view: View,
        lights: Lights,
        hits: Hits,
        points: Float,
        directions: Float,
        reach: Float,
        layers: int = LAYERS,
    ) -> Float:
        """Colours, with what lies behind transparent surfaces shining through."""
        colour = shade(self._surfaces, lights, hits, points, directions, reach, self._pixel_m)
        alpha = rows(self._surfaces.alpha, hits.geom)
        clear = np.flatnonzero((alpha < 0.98) & (hits.geom >= 0))
        if clear.size and layers:
            along = directions[clear]
            start = points[clear] + along * np.float32(1e-3)
            behind = self._tracer.beyond(start, along)
            place = start + along * behind.distance[:, None]
            depth = hits.distance[clear] + behind.distance
            behind = Hits(behind.geom, depth, behind.normal)
            light = np.full((clear.size, 2), 0.8, np.float32)
            through = self._layered(view, lights, behind, place, along, light, layers - 1)
            cover = alpha[clear, None]
            colour[clear] = cover * colour[clear] + (1 - cover) * through
        return colour

    def _bands(self) -> list[slice]:
        return _chunks(len(self._rays), BAND_ROWS * self._intrinsics.width)

    def _each(self, work: Callable[[slice], None], parts: list[slice]) -> None:
        for _ in self._pool.map(work, parts):
            pass

    @contextmanager
    def _phase(self, name: str) -> Iterator[None]:
        start = time.perf_counter()
        yield
        self.phase_s[name] = time.perf_counter() - start


def discontinuities(geom: Int, normal: Float, depth_m: Float) -> Bool:
    """(h, w) pixels with a neighbour that shows another geom, facing or distance."""
    inverse = 1 / np.where(depth_m > 0, depth_m, np.float32(1e3))
    edges = np.zeros(geom.shape, dtype=bool)
    for first, second in (
        (np.s_[:, :-1], np.s_[:, 1:]),
        (np.s_[:-1], np.s_[1:]),
    ):
        here, there = inverse[first], inverse[second]
        turn = dot(normal[first], normal[second])
        step = np.abs(here - there) > 0.04 * np.minimum(here, there)
        hit = geom[first] >= 0
        jump = (geom[first] != geom[second]) | (hit & ((turn < 0.85) | step))
        edges[first] |= jump
        edges[second] |= jump
    return edges


def contrasts(colour: Float) -> Bool:
    """(h, w) pixels that differ visibly from a neighbour."""
    tone = np.sqrt(colour)
    out = np.zeros(colour.shape[:2], dtype=bool)
    for first, second in ((np.s_[:, :-1], np.s_[:, 1:]), (np.s_[:-1], np.s_[1:])):
        step = np.abs(tone[first] - tone[second]) > LEAST_CONTRAST
        visible = step[..., 0] | step[..., 1] | step[..., 2]
        out[first] |= visible
        out[second] |= visible
    return out


def grown(mask: Bool, by: int) -> Bool:
    """A mask with everything within `by` pixels (square neighbourhood) added."""
    out = mask.copy()
    for _ in range(by):
        row = out.copy()
        row[:, 1:] |= out[:, :-1]
        row[:, :-1] |= out[:, 1:]
        out = row.copy()
        out[1:] |= row[:-1]
        out[:-1] |= row[1:]
    return out


def _enlarged(grid: Float, height: int, width: int) -> Float:
    """Bilinear enlargement by STRIDE (2): grid samples stay where they were taken."""
    tall = np.empty((height, grid.shape[1], grid.shape[2]), np.float32)
    tall[::2] = grid
    below = np.concatenate([grid[1:], grid[-1:]])
    tall[1::2] = 0.5 * (grid + below)[: height // 2]
    out = np.empty((height, width, grid.shape[2]), np.float32)
    out[:, ::2] = tall
    right = np.concatenate([tall[:, 1:], tall[:, -1:]], axis=1)
    out[:, 1::2] = 0.5 * (tall + right)[:, : width // 2]
    return out


def _pick(hits: Hits, index: npt.NDArray[np.intp]) -> Hits:
    return Hits(rows(hits.geom, index), rows(hits.distance, index), rows(hits.normal, index))


def _camera_rays(camera: Intrinsics) -> Float:
    """(h * w, 3) rays of unit z in the camera frame, row by row."""
    x = (np.arange(camera.width) - camera.cx) / camera.fx
    y = (np.arange(camera.height) - camera.cy) / camera.fy
    grid_x, grid_y = np.meshgrid(x, y)
    rays = np.stack([grid_x, grid_y, np.ones_like(grid_x)], axis=-1)
    return np.ascontiguousarray(rays.reshape(-1, 3), dtype=np.float32)


def _chunks(count: int, size: int) -> list[slice]:
    return [slice(start, min(start + size, count)) for start in range(0, count, size)]


def _usable_cores() -> int:
    try:
        cores = len(os.sched_getaffinity(0))
    except AttributeError:
        cores = os.cpu_count() or 1
    return min(cores, 4)
