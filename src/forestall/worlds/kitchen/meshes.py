"""Triangle meshes of round, flat and lumpy things; pure numpy, called by the object builders."""

from __future__ import annotations

import itertools
from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

Float = npt.NDArray[np.float64]
Int = npt.NDArray[np.int32]
Mesh = tuple[Float, Int]
"""Vertices (v, 3) in metres and faces (f, 3), counter-clockwise from outside."""


def lathe(profile: Sequence[tuple[float, float]], segments: int = 22) -> Mesh:
    """Turn a line of (radius, height) points about z; end points with radius 0 close it.

    The line runs from the lowest outer point up the outside and back down the inside.
    """
    angle = 2 * np.pi * np.arange(segments) / segments
    ring = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    vertices: list[Float] = []
    starts: list[tuple[int, int]] = []
    count = 0
    for radius, height in profile:
        if radius < 1e-9:
            points = np.array([[0.0, 0.0, height]])
        else:
            points = np.column_stack([radius * ring, np.full(segments, height)])
        vertices.append(points)
        starts.append((count, len(points)))
        count += len(points)
    faces: list[Int] = []
    here, after = np.arange(segments), (np.arange(segments) + 1) % segments
    for (a, na), (b, nb) in itertools.pairwise(starts):
        if na > 1:
            faces.append(np.stack([a + here, a + after, b + (after if nb > 1 else 0 * here)], 1))
        if nb > 1:
            faces.append(np.stack([a + (here if na > 1 else 0 * here), b + after, b + here], 1))
    return np.concatenate(vertices), np.concatenate(faces).astype(np.int32)


def extrude(outline: Sequence[tuple[float, float]], low: float, high: float) -> Mesh:
    """Prism over a star-shaped counter-clockwise outline in the xy plane."""
    flat = np.array(outline, dtype=np.float64)
    n = len(flat)
    centre = flat.mean(axis=0)
    levels = [np.column_stack([flat, np.full(n, z)]) for z in (low, high)]
    middle = np.array([[*centre, low], [*centre, high]])
    i, j = np.arange(n), (np.arange(n) + 1) % n
    faces = np.concatenate(
        [
            np.stack([i, j, j + n], 1),
            np.stack([i, j + n, i + n], 1),
            np.stack([j, i, np.full(n, 2 * n)], 1),
            np.stack([i + n, j + n, np.full(n, 2 * n + 1)], 1),
        ]
    )
    return np.concatenate([*levels, middle]), faces.astype(np.int32)


def lump(
    radii: tuple[float, float, float], rough: float, rng: np.random.Generator, rings: int = 9
) -> Mesh:
    """A bumpy ellipsoid resting on z = 0, inside the box of its radii."""
    segments = 2 * rings
    polar = np.pi * np.arange(rings + 1) / rings
    around = 2 * np.pi * np.arange(segments) / segments
    waves = [
        (rng.uniform(0, 2 * np.pi), rng.uniform(0, 2 * np.pi), int(rng.integers(1, 5)))
        for _ in range(5)
    ]
    profile = []
    for t in polar:
        row = np.zeros(segments)
        for phase, tilt, k in waves:
            row += np.sin(k * around + phase) * np.sin(t) * np.cos(k * t + tilt)
        profile.append(1 - rough * (1 + row / len(waves)) / 2)
    scale = np.array(profile)
    theta, phi = np.meshgrid(polar, around, indexing="ij")
    unit = np.stack([np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)], -1)
    points = (unit * scale[..., None]).reshape(-1, 3) * np.array(radii)
    points[:, 2] -= points[:, 2].min()
    faces = []
    for r in range(rings):
        a = r * segments + np.arange(segments)
        b = r * segments + (np.arange(segments) + 1) % segments
        if r > 0:
            faces.append(np.stack([a, a + segments, b], 1))
        if r < rings - 1:
            faces.append(np.stack([b, a + segments, b + segments], 1))
    return points, np.concatenate(faces).astype(np.int32)


def blob(radius: float, rng: np.random.Generator, points: int = 11) -> list[tuple[float, float]]:
    """An irregular outline around the origin."""
    angle = 2 * np.pi * np.arange(points) / points
    r = radius * rng.uniform(0.62, 1.0, points)
    return [(float(a), float(b)) for a, b in zip(r * np.cos(angle), r * np.sin(angle), strict=True)]


def merged(parts: Sequence[Mesh]) -> Mesh:
    """Several meshes as one."""
    vertices, faces, count = [], [], 0
    for v, f in parts:
        vertices.append(v)
        faces.append(f + count)
        count += len(v)
    return np.concatenate(vertices), np.concatenate(faces).astype(np.int32)


def moved(mesh: Mesh, x: float, y: float, z: float, yaw_rad: float = 0.0) -> Mesh:
    """A mesh turned about z and shifted."""
    c, s = np.cos(yaw_rad), np.sin(yaw_rad)
    turn = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1.0]])
    return mesh[0] @ turn.T + np.array([x, y, z]), mesh[1]


def patch_on_lathe(
    wall: Sequence[tuple[float, float]],
    angle_rad: float,
    at: float,
    size_m: float,
    off_m: float,
    rng: np.random.Generator,
) -> Mesh:
    """An irregular thin patch that follows a turned wall.

    Args:
        wall: (radius, height) points of the wall line.
        angle_rad: where around the axis.
        at: where along the wall line, 0..1.
        size_m: radius of the patch.
        off_m: distance from the wall, positive outwards.
        rng: shape of the outline.
    """
    line = np.array(wall, dtype=np.float64)
    run = np.concatenate([[0], np.cumsum(np.hypot(*np.diff(line, axis=0).T))])
    outline = [(0.0, 0.0), *blob(size_m, rng, 9)]
    points = []
    for along_circle, along_wall in outline:
        s = float(np.clip(at * run[-1] + along_wall, 0.002, run[-1] - 0.001))
        r = float(np.interp(s, run, line[:, 0]))
        z = float(np.interp(s, run, line[:, 1]))
        a = angle_rad + along_circle / max(r, 0.01)
        points.append([(r + off_m) * np.cos(a), (r + off_m) * np.sin(a), z])
    n = len(outline) - 1
    i, j = 1 + np.arange(n), 1 + (np.arange(n) + 1) % n
    order = (i, j) if off_m > 0 else (j, i)
    faces = np.stack([np.zeros(n, dtype=np.int64), *order], 1)
    return np.array(points), faces.astype(np.int32)


def leaf(length: float, width: float, droop: float) -> Mesh:
    """A two-sided leaf along +x from the origin, rising and drooping."""
    t = np.array([0.0, 0.3, 0.65, 1.0])
    half = width / 2 * np.array([0.15, 1.0, 0.8, 0.02])
    z = length * (0.55 * t - droop * t**2)
    x = length * t * 0.85
    top = np.concatenate([np.column_stack([x, half, z]), np.column_stack([x, -half, z + 0.002])])
    faces = []
    for k in range(3):
        faces += [[k, k + 4, k + 5], [k, k + 5, k + 1]]
    front = np.array(faces)
    return top, np.concatenate([front, front[:, ::-1]]).astype(np.int32)
