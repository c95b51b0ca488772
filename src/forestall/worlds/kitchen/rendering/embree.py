"""Casts rays with Embree (through embreex); the default.

Two Embree scenes: what has never changed, and the rest. Only the second is built anew when
something moves; a geom that changes for the first time wanders over to it.
"""

from __future__ import annotations

from dataclasses import dataclass

import mujoco
import numpy as np
import numpy.typing as npt
from embreex.mesh_construction import TriangleMesh
from embreex.rtcore import EmbreeDevice
from embreex.rtcore_scene import EmbreeScene

from forestall.worlds.kitchen.rendering.tessellate import TriangleSet, tessellate
from forestall.worlds.kitchen.rendering.tracer import (
    LAMP_CLEARANCE_M,
    Bool,
    Float,
    Hits,
    Int,
    drawn,
    facing,
)
from forestall.worlds.kitchen.rendering.vectors import norm, rows

_FAR_M = 1e30


@dataclass(frozen=True, slots=True, eq=False)
class _Part:
    """One committed Embree scene with what is needed to read its hits.

    The tables have one row more than there are triangles: Embree's -1 for no hit reads the last.
    """

    scene: EmbreeScene
    geom: Int  # (f + 1,) geom of each triangle, then -1
    normal: Float  # (f + 1, 3) unit face normals, then 0
    smooth: Bool  # (f + 1,), then False
    corners: Float  # (f, 3, 3) corner normals


@dataclass(frozen=True, slots=True, eq=False)
class _State:
    """What decides where the triangles are, per geom."""

    visible: Bool
    pose: npt.NDArray[np.float64]  # (ngeom, 12)
    shape: npt.NDArray[np.float64]  # (ngeom, 5) type, mesh, size

    @classmethod
    def read(cls, model: mujoco.MjModel, data: mujoco.MjData) -> _State:
        kind = np.stack([model.geom_type, model.geom_dataid], axis=1).astype(np.float64)
        return cls(
            drawn(model),
            np.concatenate([data.geom_xpos, data.geom_xmat], axis=1),
            np.concatenate([kind, model.geom_size], axis=1),
        )

    def changed_since(self, old: _State) -> Bool:
        """Geoms that look different; a hidden geom that moves does not."""
        moved = (self.pose != old.pose).any(axis=1) | (self.shape != old.shape).any(axis=1)
        return np.asarray((self.visible != old.visible) | (moved & self.visible))


class EmbreeTracer:
    """The Embree ray caster of one model."""

    name = "embree"

    def __init__(self, model: mujoco.MjModel) -> None:
        self._model = model
        self._device = EmbreeDevice()
        self._triangles: dict[int, TriangleSet] = {}
        self._state: _State | None = None
        welded = np.asarray(model.body_weldid)[model.geom_bodyid] == 0
        self._still: Bool = np.asarray(welded)
        self._parts: list[_Part] = []

    def update(self, data: mujoco.MjData) -> None:
        """Rebuild what changed since the last call."""
        new, old = _State.read(self._model, data), self._state
        if old is None:
            changed = np.ones(self._model.ngeom, dtype=bool)
            self._still = self._still & new.visible
            rebuild_still = True
        else:
            changed = new.changed_since(old)
            if not changed.any():
                return
            for geom in np.flatnonzero((new.shape != old.shape).any(axis=1)):
                self._triangles.pop(int(geom), None)
            rebuild_still = bool((changed & self._still).any())
            self._still = self._still & ~changed
        self._state = new
        still = self._part(new, new.visible & self._still) if rebuild_still else self._parts[0]
        self._parts = [still, self._part(new, new.visible & ~self._still)]

    def closest(self, origin_world_m: Float, directions: Float) -> Hits:
        """See `Tracer.closest`."""
        origins = np.broadcast_to(origin_world_m.astype(np.float32), directions.shape)
        return self.beyond(origins, directions)

    def beyond(self, origins_world_m: Float, directions: Float) -> Hits:
        """See `Tracer.beyond`."""
        distance = np.full(len(directions), _FAR_M, np.float32)
        still, moving = self._parts
        out = still.scene.run(origins_world_m, directions, dists=distance, output=True)
        face = out["primID"]
        geom, normal = rows(still.geom, face), rows(still.normal, face)
        _bend(normal, still, face, np.arange(len(face)), out)
        out = moving.scene.run(origins_world_m, directions, dists=distance, output=True)
        nearer = np.flatnonzero(out["primID"] >= 0)
        face = rows(out["primID"], nearer)
        geom[nearer], normal[nearer] = rows(moving.geom, face), rows(moving.normal, face)
        _bend(normal, moving, face, nearer, out)
        distance[geom < 0] = 0
        return Hits(geom, distance, facing(normal, directions))

    def shadowed(self, points_world_m: Float, sources_world_m: Float, source: Int) -> Bool:
        """See `Tracer.shadowed`."""
        directions = rows(sources_world_m, source) - points_world_m
        reach = np.maximum(1 - LAMP_CLEARANCE_M / np.maximum(norm(directions), 1e-6), 0)
        return self.occluded(points_world_m, directions, reach.astype(np.float32))

    def occluded(self, points_world_m: Float, directions: Float, reach: Float) -> Bool:
        """See `Tracer.occluded`."""
        answer = self._parts[0].scene.run(points_world_m, directions, dists=reach, query="OCCLUDED")
        blocked: Bool = np.asarray(answer >= 0)
        for part in self._parts[1:]:
            free = np.flatnonzero(~blocked)
            answer = part.scene.run(
                rows(points_world_m, free),
                rows(directions, free),
                dists=rows(reach, free),
                query="OCCLUDED",
            )
            blocked[free] = answer >= 0
        return blocked

    def _part(self, state: _State, chosen: Bool) -> _Part:
        geoms = np.flatnonzero(chosen)
        if not geoms.size:
            return _empty_part(EmbreeScene(self._device))
        sets = [self._local(int(g)) for g in geoms]
        per_vertex = np.repeat(geoms, [len(s.vertices_m) for s in sets])
        faces_of = [len(s.faces) for s in sets]
        per_face = np.repeat(geoms, faces_of)
        first = np.cumsum([0] + [len(s.vertices_m) for s in sets[:-1]])
        rotation = state.pose[:, 3:].reshape(-1, 3, 3)
        local = np.concatenate([s.vertices_m for s in sets])
        world = np.einsum("nij,nj->ni", rotation[per_vertex], local) + state.pose[per_vertex, :3]
        faces = np.concatenate([s.faces for s in sets]) + np.repeat(first, faces_of)[:, None]
        normals = np.concatenate([s.corner_normals for s in sets])
        corners = np.einsum("nij,nkj->nki", rotation[per_face], normals).astype(np.float32)
        corner_m = world.astype(np.float32)
        scene = EmbreeScene(self._device)
        TriangleMesh(scene, corner_m, faces.astype(np.int32))
        scene.run(np.zeros((1, 3), np.float32), np.ones((1, 3), np.float32))
        triangles = corner_m[faces]
        normal = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
        normal /= np.linalg.norm(normal, axis=1, keepdims=True) + 1e-30
        smooth = np.concatenate([s.smooth for s in sets])
        return _Part(
            scene,
            np.append(per_face, -1).astype(np.int32),
            np.concatenate([normal, np.zeros((1, 3), np.float32)]),
            np.append(smooth, False),
            corners,
        )

    def _local(self, geom: int) -> TriangleSet:
        if geom not in self._triangles:
            self._triangles[geom] = tessellate(self._model, geom)
        return self._triangles[geom]


def _empty_part(scene: EmbreeScene) -> _Part:
    return _Part(
        scene,
        np.full(1, -1, np.int32),
        np.zeros((1, 3), np.float32),
        np.zeros(1, dtype=bool),
        np.zeros((0, 3, 3), np.float32),
    )


def _bend(
    normal: Float, part: _Part, face: Int, at: npt.NDArray[np.intp], out: dict[str, Float]
) -> None:
    """Interpolate the normals of smooth triangles; `at` are the rays that hit `face`."""
    some = np.flatnonzero(rows(part.smooth, face))
    if not some.size:
        return
    at = rows(at, some)
    u, v = rows(out["u"], at), rows(out["v"], at)  # weights of the second and third corner
    corner = rows(part.corners, rows(face, some))
    mixed = corner[:, 0] * (1 - u - v)[:, None]
    mixed += corner[:, 1] * u[:, None]
    mixed += corner[:, 2] * v[:, None]
    mixed /= (norm(mixed) + 1e-12)[:, None]
    normal[at] = mixed
