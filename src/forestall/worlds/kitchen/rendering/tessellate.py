"""Turns MuJoCo geoms into triangles in their own frame; called by the Embree tracer only."""

from __future__ import annotations

from dataclasses import dataclass

import mujoco
import numpy as np
import numpy.typing as npt

from forestall.errors import InputError

Float = npt.NDArray[np.float32]
Int = npt.NDArray[np.int32]

INFINITE_HALF_EXTENT_M = 50.0
"""Half extent drawn for a plane whose size is 0 (infinite in MuJoCo)."""

CREASE_DEG = 40.0
"""Mesh faces that meet at more than this keep a sharp edge."""


@dataclass(frozen=True, slots=True, eq=False)
class TriangleSet:
    """Triangles of one geom in its local frame.

    Attributes:
        vertices_m: (v, 3) float32.
        faces: (f, 3) int32 into `vertices_m`.
        corner_normals: (f, 3, 3) float32 unit normals, one for each corner of each face.
        smooth: (f,) bool, false where all three corners carry the face normal.
    """

    vertices_m: Float
    faces: Int
    corner_normals: Float
    smooth: npt.NDArray[np.bool_]


def tessellate(model: mujoco.MjModel, geom: int, chord_error_m: float = 2.5e-4) -> TriangleSet:
    """Triangles of one geom with its present type, size and mesh.

    Args:
        model: compiled model.
        geom: geom id.
        chord_error_m: how far a facet may lie inside the round surface it stands for.

    Raises:
        InputError: the geom is of a type that cannot be drawn (height field, SDF).
    """
    kind = int(model.geom_type[geom])
    size = np.asarray(model.geom_size[geom], dtype=np.float64)
    kinds = mujoco.mjtGeom
    if kind == int(kinds.mjGEOM_BOX):
        return _box(size)
    if kind == int(kinds.mjGEOM_PLANE):
        return _plane(size)
    if kind == int(kinds.mjGEOM_CYLINDER):
        return _cylinder(float(size[0]), float(size[1]), chord_error_m)
    if kind == int(kinds.mjGEOM_CAPSULE):
        return _capsule(float(size[0]), float(size[1]), chord_error_m)
    if kind == int(kinds.mjGEOM_SPHERE):
        return _ellipsoid(np.full(3, size[0]), chord_error_m)
    if kind == int(kinds.mjGEOM_ELLIPSOID):
        return _ellipsoid(size, chord_error_m)
    if kind == int(kinds.mjGEOM_MESH):
        return _mesh(model, int(model.geom_dataid[geom]))
    raise InputError(f"geom {geom} has type {kind}, which the renderers cannot draw")


def segments_for(radius_m: float, chord_error_m: float) -> int:
    """How many segments keep a circle within the chord error (between 12 and 64, even)."""
    ratio = min(chord_error_m / max(radius_m, 1e-9), 0.5)
    count = int(np.ceil(np.pi / np.arccos(1.0 - ratio)))
    return int(np.clip(count + count % 2, 12, 64))


def _box(half: npt.NDArray[np.float64]) -> TriangleSet:
    signs = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], np.float32)
    quads = ((0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3))
    faces = [face for a, b, c, d in quads for face in ((a, b, c), (a, c, d))]
    return _flat(signs * half.astype(np.float32), np.array(faces, np.int32))


def _plane(size: npt.NDArray[np.float64]) -> TriangleSet:
    x, y = (float(s) if s > 0 else INFINITE_HALF_EXTENT_M for s in size[:2])
    vertices = np.array([[-x, -y, 0], [x, -y, 0], [x, y, 0], [-x, y, 0]], np.float32)
    return _flat(vertices, np.array([[0, 1, 2], [0, 2, 3]], np.int32))


def _cylinder(radius: float, half_length: float, chord_error: float) -> TriangleSet:
    n = segments_for(radius, chord_error)
    angle = 2 * np.pi * np.arange(n) / n
    circle = np.stack([np.cos(angle), np.sin(angle), np.zeros(n)], axis=1)
    axis = np.array([0.0, 0.0, half_length])
    vertices = np.concatenate([radius * circle - axis, radius * circle + axis])
    here, after = np.arange(n), (np.arange(n) + 1) % n
    side = _quads(here, after, after + n, here + n)
    fan = np.arange(1, n - 1)
    zero = np.zeros_like(fan)
    caps = np.concatenate(
        [np.stack([zero, fan + 1, fan], axis=1), np.stack([zero, fan, fan + 1], axis=1) + n]
    )
    faces = np.concatenate([side, caps]).astype(np.int32)
    flat = _flat(vertices.astype(np.float32), faces)
    normals = flat.corner_normals.copy()
    normals[: 2 * n] = circle.astype(np.float32)[side % n]
    return TriangleSet(flat.vertices_m, faces, normals, np.arange(len(faces)) < 2 * n)


def _capsule(radius: float, half_length: float, chord_error: float) -> TriangleSet:
    directions, faces = _sphere(segments_for(radius, chord_error), split_equator=True)
    shift = np.zeros_like(directions)
    upper = np.arange(len(directions)) < len(directions) // 2
    shift[:, 2] = np.where(upper, half_length, -half_length)
    return _round(radius * directions + shift, directions, faces)


def _ellipsoid(radii: npt.NDArray[np.float64], chord_error: float) -> TriangleSet:
    directions, faces = _sphere(segments_for(float(radii.max()), chord_error))
    normals = directions / np.maximum(radii, 1e-9)
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    return _round(directions * radii, normals, faces)


def _sphere(
    segments: int, split_equator: bool = False
) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.int64]]:
    """Unit directions and faces; ring by ring from +z to -z, each pole as a full ring.

    With `split_equator` the equator is there twice, so that the halves can be pulled apart.
    """
    rings = segments // 2 + (segments // 2) % 2
    polar = np.pi * np.arange(rings + 1) / rings
    if split_equator:
        polar = np.insert(polar, rings // 2, np.pi / 2)
    around = 2 * np.pi * np.arange(segments) / segments
    theta, phi = np.meshgrid(polar, around, indexing="ij")
    directions = np.stack(
        [np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)], axis=-1
    ).reshape(-1, 3)
    row = np.arange(len(polar) - 1)[:, None] * segments
    here, after = np.arange(segments), (np.arange(segments) + 1) % segments
    a, b = (row + here).ravel(), (row + after).ravel()
    faces = _quads(a, a + segments, b + segments, b)
    corner = np.sin(np.repeat(polar, segments))[faces]
    apices = (corner < 1e-9).sum(axis=1)
    return directions, faces[apices < 2]


def _cross_of_faces(
    vertices: npt.NDArray[np.float64], faces: npt.NDArray[np.int64]
) -> npt.NDArray[np.float64]:
    corner = vertices[faces]
    return np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])


def _quads(
    a: npt.NDArray[np.int64],
    b: npt.NDArray[np.int64],
    c: npt.NDArray[np.int64],
    d: npt.NDArray[np.int64],
) -> npt.NDArray[np.int64]:
    return np.concatenate([np.stack([a, b, c], axis=1), np.stack([a, c, d], axis=1)])


def _flat(vertices: Float, faces: Int) -> TriangleSet:
    cross = _cross_of_faces(vertices.astype(np.float64), faces.astype(np.int64))
    normal = cross / np.maximum(np.linalg.norm(cross, axis=1, keepdims=True), 1e-30)
    corners = np.repeat(normal[:, None, :], 3, axis=1).astype(np.float32)
    return TriangleSet(vertices, faces, corners, np.zeros(len(faces), dtype=bool))


def _round(
    vertices: npt.NDArray[np.float64],
    normals: npt.NDArray[np.float64],
    faces: npt.NDArray[np.int64],
) -> TriangleSet:
    return TriangleSet(
        vertices.astype(np.float32),
        faces.astype(np.int32),
        normals.astype(np.float32)[faces],
        np.ones(len(faces), dtype=bool),
    )


def _mesh(model: mujoco.MjModel, mesh: int) -> TriangleSet:
    first, count = int(model.mesh_vertadr[mesh]), int(model.mesh_vertnum[mesh])
    vertices = np.array(model.mesh_vert[first : first + count], dtype=np.float32)
    first, count = int(model.mesh_faceadr[mesh]), int(model.mesh_facenum[mesh])
    faces = np.array(model.mesh_face[first : first + count], dtype=np.int32)
    return _creased(_flat(vertices, faces))


def _creased(flat: TriangleSet) -> TriangleSet:
    """Averages the normals of faces that meet at a place, area-weighted, up to the crease angle."""
    vertices = flat.vertices_m.astype(np.float64)
    _, place = np.unique(np.round(vertices, 6), axis=0, return_inverse=True)
    cross = _cross_of_faces(vertices, flat.faces.astype(np.int64))
    unit = flat.corner_normals[:, 0].astype(np.float64)
    at = place.ravel()[flat.faces].ravel()
    order = np.argsort(at, kind="stable")
    counts = np.bincount(at)
    total = np.zeros((at.size, 3))
    limit = np.cos(np.deg2rad(CREASE_DEG))
    starts = np.concatenate([[0], np.cumsum(counts)[:-1]])
    for shift in range(int(counts.max(initial=0))):
        alive = counts[at] > shift
        mine = np.flatnonzero(alive)
        other = order[starts[at[mine]] + shift] // 3
        close = np.einsum("ij,ij->i", unit[mine // 3], unit[other]) > limit
        total[mine[close]] += cross[other[close]]
    length = np.linalg.norm(total, axis=1, keepdims=True)
    fallback = np.repeat(unit, 3, axis=0)
    corners = np.where(length > 1e-15, total / np.maximum(length, 1e-30), fallback)
    corners = corners.reshape(-1, 3, 3).astype(np.float32)
    smooth = np.abs(corners - flat.corner_normals).max(axis=(1, 2)) > 1e-3
    return TriangleSet(flat.vertices_m, flat.faces, corners, smooth)
