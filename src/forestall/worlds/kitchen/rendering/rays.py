"""Casts rays with MuJoCo itself, for machines where embreex cannot be imported.

`mj_multiRay` sends many rays from one point, so shadows are cast from the light towards the
surfaces and ambient occlusion, which needs an origin for each ray, is not available. It lets go of
the interpreter lock and needs one MjData per thread.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from queue import Empty, SimpleQueue

import mujoco
import numpy as np

from forestall.worlds.kitchen.rendering.tracer import (
    DRAWN_GROUPS,
    LAMP_CLEARANCE_M,
    Bool,
    Float,
    Hits,
    Int,
    facing,
)
from forestall.worlds.kitchen.rendering.vectors import norm

_FAR_M = 1e6
_GROUPS = (np.arange(6) < DRAWN_GROUPS).astype(np.uint8)


class MujocoTracer:
    """The ray caster of MuJoCo for one model."""

    name = "rays"

    def __init__(self, model: mujoco.MjModel) -> None:
        self._model = model
        self._source: mujoco.MjData | None = None
        self._version = 0
        self._idle: SimpleQueue[tuple[int, mujoco.MjData]] = SimpleQueue()

    def update(self, data: mujoco.MjData) -> None:
        """Take over the state; each thread copies it when it next casts rays."""
        self._source = data
        self._version += 1

    def closest(self, origin_world_m: Float, directions: Float) -> Hits:
        """See `Tracer.closest`."""
        with self._data() as data:
            geom, distance, normal = self._cast(data, origin_world_m, directions)
        missed = geom < 0
        distance[missed] = 0
        normal[missed] = 0
        return Hits(geom, distance, facing(normal, directions))

    def beyond(self, origins_world_m: Float, directions: Float) -> Hits:
        """See `Tracer.beyond`; one call per ray, so meant for few rays."""
        n = len(directions)
        geom, distance = np.full(n, -1, np.int32), np.zeros(n, np.float32)
        normal = np.zeros((n, 3), np.float32)
        origins, rays = origins_world_m.astype(np.float64), directions.astype(np.float64)
        found, facet = np.zeros(1, np.int32), np.zeros(3)
        with self._data() as data:
            for i in range(n):
                reach = mujoco.mj_ray(
                    self._model, data, origins[i], rays[i], _GROUPS, True, -1, found, facet
                )
                if reach >= 0:
                    geom[i], distance[i], normal[i] = found[0], reach, facet
        return Hits(geom, distance, facing(normal, directions))

    def shadowed(self, points_world_m: Float, sources_world_m: Float, source: Int) -> Bool:
        """See `Tracer.shadowed`."""
        dark = np.zeros(len(points_world_m), dtype=bool)
        with self._data() as data:
            for k in np.unique(source):
                some = np.flatnonzero(source == k)
                rays = points_world_m[some] - sources_world_m[k]
                _, distance, _ = self._cast(data, sources_world_m[k], rays)
                length = norm(rays)
                before = (distance >= 0) & (distance < 1 - 1e-4)
                dark[some] = before & (distance * length > LAMP_CLEARANCE_M)
        return dark

    def occluded(self, points_world_m: Float, directions: Float, reach: Float) -> Bool | None:
        """See `Tracer.occluded`: not available here."""
        del points_world_m, directions, reach
        return None

    def _cast(
        self, data: mujoco.MjData, origin: Float, directions: Float
    ) -> tuple[Int, Float, Float]:
        n = len(directions)
        geom, distance = np.full(n, -1, np.int32), np.full(n, -1.0)
        normal = np.zeros(3 * n)
        if n:
            mujoco.mj_multiRay(
                self._model,
                data,
                np.asarray(origin, dtype=np.float64),
                np.ascontiguousarray(directions, dtype=np.float64).ravel(),
                _GROUPS,
                True,
                -1,
                geom,
                distance,
                normal,
                n,
                _FAR_M,
            )
        return geom, distance.astype(np.float32), normal.reshape(n, 3).astype(np.float32)

    @contextmanager
    def _data(self) -> Iterator[mujoco.MjData]:
        try:
            version, data = self._idle.get_nowait()
        except Empty:
            version, data = -1, mujoco.MjData(self._model)
        if version != self._version:
            mujoco.mj_copyData(data, self._model, self._source)
        yield data
        self._idle.put((self._version, data))
