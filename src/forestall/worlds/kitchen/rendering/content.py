"""Reads what decides how a scene looks, geom by geom; called by `redrawing`."""

from __future__ import annotations

import hashlib
from collections import Counter
from typing import Any

import mujoco
import numpy as np
import numpy.typing as npt

from forestall.worlds.kitchen.rendering.appearance import TEXTURES, Appearance
from forestall.worlds.kitchen.rendering.drawn import Content
from forestall.worlds.kitchen.rendering.shading import CLEAR_BELOW, Surfaces
from forestall.worlds.kitchen.rendering.tessellate import tessellate
from forestall.worlds.kitchen.rendering.tracer import Float, drawn

_CORNERS = np.array(np.meshgrid([0, 1], [0, 1], [0, 1])).reshape(3, 8).T


class ContentReader:
    """Reads one model with its present sizes, colours and poses."""

    def __init__(self, model: mujoco.MjModel, appearance: Appearance) -> None:
        self._model = model
        self._appearance = appearance
        self._surfaces = Surfaces(model, appearance)
        kind = [-1 if t is None else TEXTURES.index(t) for t in appearance.texture]
        place = np.where(np.array(kind) < 0, 0, self._surfaces.place)
        self._texture = np.stack([np.array(kind), place], axis=1).astype(np.float64)
        self._meshes = [_mesh(model, i) for i in range(model.nmesh)]
        self._boxes: dict[bytes, Float] = {}
        self._last: tuple[bytes, Content] | None = None

    def read(self, data: Any) -> Content:
        """What is to be seen now; the same object as before when nothing has changed."""
        model, surfaces = self._model, self._surfaces
        surfaces.refresh(data)
        visible = drawn(model)
        kinds = np.stack([model.geom_type, model.geom_dataid], axis=1).astype(np.float64)
        shape = np.concatenate([kinds, model.geom_size], axis=1)
        pose = np.concatenate([data.geom_xpos, data.geom_xmat], axis=1)
        paint = np.concatenate(
            [
                surfaces.albedo,
                surfaces.alpha[:, None],
                surfaces.emission[:, None],
                np.where(self._texture[:, :1] < 0, 0, surfaces.axes),
                self._texture,
            ],
            axis=1,
        )
        rows = np.concatenate([visible[:, None], shape, pose, paint], axis=1)
        whole = rows.tobytes()
        if self._last is not None and self._last[0] == whole:
            return self._last[1]
        look, form = [b""] * model.ngeom, [b""] * model.ngeom
        corners = np.zeros((model.ngeom, 8, 3), np.float32)
        for g in np.flatnonzero(visible).tolist():
            figure = shape[g].tobytes() + self._mesh_of(g)
            form[g] = _digest(figure + pose[g].tobytes())
            look[g] = _digest(form[g] + paint[g].tobytes())
            corners[g] = pose[g, :3] + self._box(figure, g) @ pose[g, 3:].reshape(3, 3).T
        content = Content(
            tuple(look),
            tuple(form),
            corners,
            self._appearance.geom_instance,
            self._appearance.instance_names,
            surfaces.alpha < CLEAR_BELOW,
        )
        self._last = whole, content
        return content

    def lights(self, data: Any) -> bytes:
        """Digest of the lights."""
        model = self._model
        arrays = [
            model.light_active, model.light_castshadow, model.light_type, model.light_cutoff,
            model.light_diffuse, model.light_attenuation, data.light_xpos, data.light_xdir,
        ]  # fmt: skip
        if not np.any(model.light_active):
            arrays += [model.stat.center, np.array([model.stat.extent])]
        return _digest(b"".join(np.ascontiguousarray(a).tobytes() for a in arrays))

    def _mesh_of(self, geom: int) -> bytes:
        if self._model.geom_type[geom] != mujoco.mjtGeom.mjGEOM_MESH:
            return b""
        return self._meshes[int(self._model.geom_dataid[geom])]

    def _box(self, figure: bytes, geom: int) -> npt.NDArray[Any]:
        """(8, 3) corners in the geom's own frame."""
        if figure not in self._boxes:
            vertices = tessellate(self._model, geom).vertices_m
            ends = np.stack([vertices.min(axis=0), vertices.max(axis=0)])
            self._boxes[figure] = ends[_CORNERS, np.arange(3)]
        return self._boxes[figure]


def differing(old: Content, new: Content) -> tuple[list[int], list[int]]:
    """Geoms that are gone from the old scene, and those that have come into the new one."""
    return _without(old.look, Counter(new.look)), _without(new.look, Counter(old.look))


def reshaped(geoms: list[int], of: Content, other: Content) -> list[int]:
    """Those among the geoms whose place or shape is nowhere in the other scene."""
    known = set(other.form)
    return [g for g in geoms if of.form[g] not in known]


def translation(old: Content, new: Content) -> npt.NDArray[np.int16]:
    """(ngeom + 1,) index in the new scene of each geom of the old one, -2 for one that is gone.

    The last is that of no geom, -1.
    """
    places: dict[bytes, list[int]] = {}
    for g, look in reversed(list(enumerate(new.look))):
        places.setdefault(look, []).append(g)
    found = [places[x].pop() if x and places.get(x) else -2 for x in old.look]
    return np.array([*found, -1], np.int16)


def _without(looks: tuple[bytes, ...], known: Counter[bytes]) -> list[int]:
    found = []
    for g, look in enumerate(looks):
        if not look:
            continue
        if known[look] > 0:
            known[look] -= 1
        else:
            found.append(g)
    return found


def _mesh(model: mujoco.MjModel, mesh: int) -> bytes:
    first, count = model.mesh_vertadr[mesh], model.mesh_vertnum[mesh]
    face, faces = model.mesh_faceadr[mesh], model.mesh_facenum[mesh]
    vertices, triangles = model.mesh_vert[first : first + count], model.mesh_face
    figure: bytes = vertices.tobytes() + triangles[face : face + faces].tobytes()
    return _digest(figure)


def _digest(data: bytes) -> bytes:
    return hashlib.blake2b(data, digest_size=16).digest()
