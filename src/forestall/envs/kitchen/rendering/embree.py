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

from forestall.envs.kitchen.rendering.tessellate import TriangleSet, tessellate
from forestall.envs.kitchen.rendering.tracer import (
    LAMP_CLEARANCE_M,
    Bool,
    Float,
    Hits,
    Int,
    drawn,
    facing,
)


@dataclass(frozen=True, slots=True, eq=False)
class _Part:
    """One committed Embree scene with what is needed to read its hits."""

    scene: EmbreeScene
    geom: Int  # (f,) geom of each triangle
    normal: Float  # (f, 3) unit face normals
    smooth: Bool  # (f,)
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
        self._parts: list[_Part | None] = [None, None]

    def update(self, data: mujoco.MjData) -> None:
        """Rebuild what changed since the last call."""
        new, old = _State.read(self._model, data), self._state
        if old is None:
            changed = np.ones(self._model.ngeom, dtype=bool)
            rebuild_still = True
            self._still &= new.visible
        else:
            changed = new.changed_since(old)
            if not changed.any():
                return
            for geom in np.flatnonzero((new.shape != old.shape).any(axis=1)):
                self._triangles.pop(int(geom), None)
            rebuild_still = bool((changed & self._still).any())
            self._still = self._still & ~changed
        self._state = new
        if rebuild_still:
            self._parts[0] = self._build(new, np.flatnonzero(new.visible & self._still))
        self._parts[1] = self._build(new, np.flatnonzero(new.visible & ~self._still))

    def closest(self, origin_world_m: Float, directions: Float) -> Hits:
        """See `Tracer.closest`."""
        origins = np.broadcast_to(origin_world_m.astype(np.float32), directions.shape)
        return self.beyond(origins, directions)

    def beyond(self, origins_world_m: Float, directions: Float) -> Hits:
        """See `Tracer.beyond`."""
        n = len(directions)
        far = np.full(n, 1e30, np.float32)
        geom = np.full(n, -1, np.int32)
        normal = np.zeros((n, 3), np.float32)
        for part in self._parts:
            if part is None:
                continue
            out = part.scene.run(origins_world_m, directions, dists=far, output=True)
            hit = np.flatnonzero(out["primID"] >= 0)
            face = out["primID"][hit]
            geom[hit] = part.geom[face]
            normal[hit] = part.normal[face]
            bent = np.flatnonzero(part.smooth[face])
            if bent.size:
                at = hit[bent]
                u, v = out["u"][at, None], out["v"][at, None]
                corner = part.corners[face[bent]]
                mixed = corner[:, 0] * (1 - u - v) + corner[:, 1] * u + corner[:, 2] * v
                mixed /= np.sqrt(np.einsum("ij,ij->i", mixed, mixed))[:, None] + 1e-12
                normal[at] = mixed
        far[geom < 0] = 0
        return Hits(geom, far, facing(normal, directions))

    def shadowed(self, points_world_m: Float, sources_world_m: Float, source: Int) -> Bool:
        """See `Tracer.shadowed`."""
        directions = sources_world_m[source] - points_world_m
        length = np.sqrt(np.einsum("ij,ij->i", directions, directions))
        reach = np.maximum(1 - LAMP_CLEARANCE_M / np.maximum(length, 1e-6), 0)
        return self.occluded(points_world_m, directions, reach.astype(np.float32))

    def occluded(self, points_world_m: Float, directions: Float, reach: Float) -> Bool:
        """See `Tracer.occluded`."""
        blocked = np.zeros(len(directions), dtype=bool)
        free = np.arange(len(directions))
        for part in self._parts:
            if part is None or not free.size:
                continue
            answer = part.scene.run(
                points_world_m[free], directions[free], dists=reach[free], query="OCCLUDED"
            )
            blocked[free[answer >= 0]] = True
            free = free[answer < 0]
        return blocked

    def _build(self, state: _State, geoms: npt.NDArray[np.intp]) -> _Part | None:
        if not geoms.size:
            return None
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
        return _Part(scene, per_face.astype(np.int32), normal, smooth, corners)

    def _local(self, geom: int) -> TriangleSet:
        if geom not in self._triangles:
            self._triangles[geom] = tessellate(self._model, geom)
        return self._triangles[geom]
