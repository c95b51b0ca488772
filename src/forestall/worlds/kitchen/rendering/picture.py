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
from typing import Any

import mujoco
import numpy as np
import numpy.typing as npt

from forestall.errors import InputError
from forestall.types.observation import Frame, Intrinsics
from forestall.worlds.kitchen.rendering.appearance import Appearance
from forestall.worlds.kitchen.rendering.drawn import Basis
from forestall.worlds.kitchen.rendering.lighting import (
    GROUPS,
    RAYS,
    STRIDE,
    Lights,
    block_group,
    same_surface,
    smoothed,
    visibility,
)
from forestall.worlds.kitchen.rendering.pixels import contrasts, discontinuities, enlarged, grown
from forestall.worlds.kitchen.rendering.shading import CLEAR_BELOW, Surfaces, shade, to_display
from forestall.worlds.kitchen.rendering.tracer import Bool, Float, Hits, Int, Tracer
from forestall.worlds.kitchen.rendering.vectors import rows, turned
from forestall.worlds.kitchen.rendering.window import Patch, Shot, View, Window

BAND_ROWS = 48
CHUNK = 16384
OWN_GROUP_STEP = 2
"""Of the sample groups, every how-manieth a point without neighbours on the grid uses."""

INFLUENCE = 8
"""How many pixels away what is hit at one pixel may change the colour of another.

The filter over the light grid reaches 4 pixels, its interpolation 2, and whether a pixel is
smoothed depends on the colours of its neighbours.
"""

LAYERS = 3
"""How many transparent surfaces a ray passes at most."""

_SUBPIXELS = ((-0.125, -0.375), (0.375, -0.125), (0.125, 0.375), (-0.375, 0.125))


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
        return self.draw(data, camera_to_world)[0]

    def draw(self, data: Any, camera_to_world: npt.NDArray[np.float64]) -> tuple[Frame, Basis]:
        """A frame, and what it was made from."""
        patch = self.paint(self.aim(data, camera_to_world), self.everything)
        return self.frame(patch.rgb, patch.depth_m, patch.basis, camera_to_world), patch.basis

    def frame(
        self,
        rgb: npt.NDArray[np.uint8],
        depth_m: Float,
        basis: Basis,
        camera_to_world: npt.NDArray[np.float64],
    ) -> Frame:
        """The frame of a picture."""
        return Frame(
            rgb=rgb,
            depth_m=depth_m,
            intrinsics=self._intrinsics,
            camera_to_world=np.array(camera_to_world, dtype=np.float64),
            instance_ids=self._instance[basis.geom],
            instance_names=self._appearance.instance_names,
        )

    @property
    def everything(self) -> Window:
        """The whole picture."""
        return Window(0, 0, self._intrinsics.height, self._intrinsics.width)

    def aim(self, data: Any, camera_to_world: npt.NDArray[np.float64]) -> Shot:
        """Take over the state of the scene, to draw from one place."""
        self.phase_s = {}
        with self._phase("rebuild"):
            self._tracer.update(data)
            self._surfaces.refresh(data)
            lights = Lights.read(self._model, data)
        origin = camera_to_world[:3, 3].astype(np.float32)
        return Shot(origin, camera_to_world[:3, :3].astype(np.float32), lights)

    def directions(self, shot: Shot, at: Any) -> Float:
        """Rays (n, 3) of unit z through the pixels with these flat indices."""
        return turned(shot.rotation, self._rays[at])

    def trace(self, shot: Shot, at: Any) -> tuple[Hits, Float]:
        """What is seen at the pixels with these flat indices, and where that is."""
        directions = self.directions(shot, at)
        hits = self._tracer.closest(shot.origin, directions)
        return hits, shot.origin + directions * hits.distance[:, None]

    def reach(self, shot: Shot, points: Float, normals: Float, group: Int) -> Float:
        """See `lighting.visibility`."""
        return visibility(self._tracer, shot.lights.key, points, normals, group)

    def paint(self, shot: Shot, window: Window, reach: Float | None = None) -> Patch:
        """Draw a part of the picture; it is right where all within `INFLUENCE` is in the window.

        Args:
            shot: from where.
            window: what to draw.
            reach: (rows, columns, 2) of the window's light grid where that is known already.
        """
        with self._phase("primary rays"):
            hits, points, rays = self._primary(shot, window)
        size = window.size
        geom = hits.geom.reshape(size)
        depth = hits.distance.reshape(size)
        normal = hits.normal.reshape(*size, 3)
        with self._phase("shadow and ambient rays"):
            view, raw = self._light_grid(shot, window, reach, geom, normal, depth, points)
        with self._phase("shading"):
            edges = discontinuities(geom, normal, depth)
            colour = self._colour(view, hits, points, rays, edges)
        with self._phase("anti-aliasing"):
            edges &= contrasts(colour)
            self._smooth_edges(view, colour, edges)
        with self._phase("display"):
            rgb = to_display(colour)
        own_at = np.concatenate([at for at, _ in view.own] or [np.empty(0, np.int32)])
        own_points = np.concatenate([p for _, p in view.own] or [np.empty((0, 3), np.float32)])
        basis = Basis(
            geom.astype(np.int16),
            view.grid_normals.reshape(*view.grid_size, 3),
            np.round(raw * RAYS).astype(np.uint8),
            edges,
            own_at,
            own_points,
        )
        return Patch(window, rgb, depth, basis)

    def _primary(self, shot: Shot, window: Window) -> tuple[Hits, Float, Float]:
        width = window.size[1]
        camera = self._intrinsics
        rays = self._rays.reshape(camera.height, camera.width, 3)[window.pixels].reshape(-1, 3)
        count = len(rays)
        geom, distance = np.empty(count, np.int32), np.empty(count, np.float32)
        normal, points = np.empty((count, 3), np.float32), np.empty((count, 3), np.float32)
        directions = np.empty((count, 3), np.float32)

        def work(part: slice) -> None:
            along = turned(shot.rotation, rays[part])
            hits = self._tracer.closest(shot.origin, along)
            geom[part], distance[part], normal[part] = hits.geom, hits.distance, hits.normal
            points[part] = shot.origin + along * hits.distance[:, None]
            directions[part] = along

        self._each(work, _chunks(count, BAND_ROWS * width))
        return Hits(geom, distance, normal), points, directions

    def _light_grid(
        self,
        shot: Shot,
        window: Window,
        known: Float | None,
        geom: Int,
        normal: Float,
        depth: Float,
        points: Float,
    ) -> tuple[View, Float]:
        every = (slice(None, None, STRIDE), slice(None, None, STRIDE))
        size = (geom[every].shape[0], geom[every].shape[1])
        place = np.ascontiguousarray(points.reshape(*geom.shape, 3)[every]).reshape(-1, 3)
        facing = np.ascontiguousarray(normal[every]).reshape(-1, 3)
        reach = np.ones((size[0] * size[1], 2), np.float32) if known is None else known
        reach = reach.reshape(-1, 2)
        if known is None:
            met = np.flatnonzero(geom[every].ravel() >= 0)
            row, column = np.divmod(np.arange(size[0] * size[1]), size[1])
            group = block_group(row + window.top // STRIDE, column + window.left // STRIDE)

            def work(part: slice) -> None:
                some = met[part]
                reach[some] = self.reach(shot, place[some], facing[some], group[some])

            self._each(work, _chunks(len(met), CHUNK // 2))
        smooth = smoothed(
            place.reshape(*size, 3),
            facing.reshape(*size, 3),
            np.ascontiguousarray(depth[every]),
            reach.reshape(*size, 2),
        )
        view = View(shot, window, size, place, facing, smooth.reshape(-1, 2))
        return view, reach.reshape(*size, 2)

    def _colour(self, view: View, hits: Hits, points: Float, rays: Float, edges: Bool) -> Float:
        height, width = edges.shape
        reach = enlarged(view.grid_reach.reshape(*view.grid_size, 2), height, width)
        reach = reach.reshape(-1, 2)
        near_edges = grown(edges, STRIDE).ravel()
        colour = np.empty((height * width, 3), np.float32)

        def work(part: slice) -> None:
            some = Hits(hits.geom[part], hits.distance[part], hits.normal[part])
            light = reach[part]
            careful = np.flatnonzero(near_edges[part])
            if careful.size:
                row, column = np.divmod(careful + part.start, width)
                at = np.stack([column + view.window.left, row + view.window.top], axis=1)
                chosen = _pick(some, careful)
                place = points[part][careful]
                light[careful] = self._reach(view, chosen, place, at.astype(np.float32))
            colour[part] = self._layered(view.shot, some, points[part], rays[part], light)

        self._each(work, _chunks(len(colour), BAND_ROWS * width))
        return colour.reshape(height, width, 3)

    def _smooth_edges(self, view: View, colour: Float, edges: Bool) -> None:
        row, column = np.nonzero(edges)
        camera, shot = self._intrinsics, view.shot

        def work(part: slice) -> None:
            centre = np.stack(
                [column[part] + view.window.left, row[part] + view.window.top], axis=1
            ).astype(np.float32)
            at = (centre[:, None] + np.array(_SUBPIXELS, np.float32)).reshape(-1, 2)
            rays = np.ones((len(at), 3), np.float32)
            rays[:, 0] = (at[:, 0] - camera.cx) / camera.fx
            rays[:, 1] = (at[:, 1] - camera.cy) / camera.fy
            directions = turned(shot.rotation, rays)
            hits = self._tracer.closest(shot.origin, directions)
            points = shot.origin + directions * hits.distance[:, None]
            light = self._reach(view, hits, points, at)
            samples = self._layered(shot, hits, points, directions, light)
            total = samples.reshape(-1, len(_SUBPIXELS), 3).sum(axis=1)
            here = row[part], column[part]
            colour[here] = (colour[here] + total) / (len(_SUBPIXELS) + 1)

        self._each(work, _chunks(len(row), CHUNK // 4))

    def _reach(self, view: View, hits: Hits, points: Float, at: Float) -> Float:
        """Light reach of hits seen at pixels `at` (n, 2): from the grid, else by own rays."""
        height, width = view.grid_size
        base = np.floor(at / STRIDE)
        fraction = at / STRIDE - base
        column = base[:, 0].astype(np.int64) - view.window.left // STRIDE
        row = base[:, 1].astype(np.int64) - view.window.top // STRIDE
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
            place = rows(points, lost)
            reach[lost] = self._own_reach(view.shot.lights, place, rows(hits.normal, lost))
            pixel = np.rint(rows(at, lost)).astype(np.int32)
            view.own.append((pixel[:, 1] * self._intrinsics.width + pixel[:, 0], place))
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
        shot: Shot,
        hits: Hits,
        points: Float,
        directions: Float,
        reach: Float,
        layers: int = LAYERS,
    ) -> Float:
        """Colours, with what lies behind transparent surfaces shining through."""
        colour = shade(self._surfaces, shot.lights, hits, points, directions, reach, self._pixel_m)
        alpha = rows(self._surfaces.alpha, hits.geom)
        clear = np.flatnonzero((alpha < CLEAR_BELOW) & (hits.geom >= 0))
        if clear.size and layers:
            along = directions[clear]
            start = points[clear] + along * np.float32(1e-3)
            behind = self._tracer.beyond(start, along)
            place = start + along * behind.distance[:, None]
            depth = hits.distance[clear] + behind.distance
            behind = Hits(behind.geom, depth, behind.normal)
            light = np.full((clear.size, 2), 0.8, np.float32)
            through = self._layered(shot, behind, place, along, light, layers - 1)
            cover = alpha[clear, None]
            colour[clear] = cover * colour[clear] + (1 - cover) * through
        return colour

    def _each(self, work: Callable[[slice], None], parts: list[slice]) -> None:
        for _ in self._pool.map(work, parts):
            pass

    @contextmanager
    def _phase(self, name: str) -> Iterator[None]:
        start = time.perf_counter()
        yield
        self.phase_s[name] = self.phase_s.get(name, 0.0) + time.perf_counter() - start


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
