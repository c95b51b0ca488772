"""Sizes, places and poses of the household's things; pure numpy, imported by every scene module.

Frames: a thing or a piece of furniture has its origin on its lower side, z up and +y to its front
(where the robot stands). Poses are (4, 4) matrices into the world or into another body.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

Pose = npt.NDArray[np.float64]
Float = npt.NDArray[np.float64]
Rgba = tuple[float, float, float, float]
Vec = tuple[float, float, float]

FLOOR = "Floor-1"
"""The instance that carries what lies on the floor."""


@dataclass(frozen=True, slots=True)
class Rect:
    """An axis-aligned rectangle in metres."""

    x0: float
    y0: float
    x1: float
    y1: float

    def grown(self, dx: float, dy: float | None = None) -> Rect:
        """Wider by `dx` on the left and right and by `dy` (default `dx`) on the others."""
        dy = dx if dy is None else dy
        return Rect(self.x0 - dx, self.y0 - dy, self.x1 + dx, self.y1 + dy)

    def moved(self, x: float, y: float) -> Rect:
        """Shifted by (x, y)."""
        return Rect(self.x0 + x, self.y0 + y, self.x1 + x, self.y1 + y)

    def turned(self, yaw_rad: float) -> Rect:
        """Bounding rectangle after a turn about the origin."""
        c, s = float(np.cos(yaw_rad)), float(np.sin(yaw_rad))
        corners = [(x * c - y * s, x * s + y * c) for x in (self.x0, self.x1) for y in self._ys]
        xs, ys = [p[0] for p in corners], [p[1] for p in corners]
        return Rect(min(xs), min(ys), max(xs), max(ys))

    @property
    def _ys(self) -> tuple[float, float]:
        return (self.y0, self.y1)

    def overlaps(self, other: Rect) -> bool:
        """Whether the interiors meet."""
        return (
            self.x0 < other.x1 and other.x0 < self.x1 and self.y0 < other.y1 and other.y0 < self.y1
        )

    def distance(self, x: float, y: float) -> float:
        """Distance of a point, 0 inside."""
        dx = max(self.x0 - x, x - self.x1, 0.0)
        dy = max(self.y0 - y, y - self.y1, 0.0)
        return float(np.hypot(dx, dy))

    @property
    def centre(self) -> tuple[float, float]:
        """Middle point."""
        return ((self.x0 + self.x1) / 2, (self.y0 + self.y1) / 2)

    @property
    def size(self) -> tuple[float, float]:
        """Width along x and along y."""
        return (self.x1 - self.x0, self.y1 - self.y0)


@dataclass(frozen=True, slots=True)
class Region:
    """A place on or in a receptacle where things can be put.

    Args:
        receptacle: instance name.
        carrier: MuJoCo body that carries it; what lies here moves with that body.
        area: where footprints may lie, in the carrier's frame.
        z_m: height of the support in the carrier's frame.
        clearance_m: how tall a thing may be.
        kind: "surface" (many, side by side), "spot" (one, in the middle of `area`), "pile" (round
            hollow: things lie on each other) or "slot" (one, standing on its edge).
        profile: of a pile: (height above `z_m`, inner radius) pairs, ascending.
        keep_out: parts of `area` that stay empty.
        front_m: y of the open edge; None where nothing can be in the way.
        first_m: y nearest to which things are put first (default: the front of `area`).
        yaw_rad: how a thing in a "spot" is turned.
    """

    receptacle: str
    carrier: str
    area: Rect
    z_m: float
    clearance_m: float = 10.0
    kind: str = "surface"
    profile: tuple[tuple[float, float], ...] = ()
    keep_out: tuple[Rect, ...] = ()
    front_m: float | None = None
    first_m: float | None = None
    yaw_rad: float = 0.0


@dataclass(frozen=True, slots=True)
class Stance:
    """How the robot stands before a piece of furniture.

    Args:
        front_m: y of the edge that it stands before, in the furniture's frame.
        distance_m: from that edge to the robot's axis.
        aside_m: how far along +x of the target the robot prefers to stand.
    """

    front_m: float
    distance_m: float = 0.65
    aside_m: float = 0.0


@dataclass(frozen=True, slots=True)
class Form:
    """Extents of something built, in its own frame.

    Args:
        footprint: bounding rectangle in every state that it can take.
        height_m: highest point above its origin in every state.
        core_m: radius of the upright cylinder that it fills (for piles).
        regions: places on and in it.
        stance: furniture only.
    """

    footprint: Rect
    height_m: float
    core_m: float = 0.0
    regions: tuple[Region, ...] = ()
    stance: Stance | None = None

    @property
    def middle_x(self) -> float:
        """X of the middle of the widest free stretch on which things can be put."""
        if not self.regions or self.regions[0].kind != "surface":
            return self.footprint.centre[0]
        region = self.regions[0]
        edges = sorted((r.x0, r.x1) for r in region.keep_out)
        x, best = region.area.x0, (0.0, self.footprint.centre[0])
        for a, b in [*edges, (region.area.x1, region.area.x1)]:
            best = max(best, (round(a - x, 6), (a + x) / 2))
            x = max(x, b)
        return best[1]


@dataclass(frozen=True, slots=True)
class Instance:
    """One thing or fixture of a scene as it starts.

    Args:
        name: instance name.
        category: its category.
        parent: receptacle that it starts on or in; FLOOR for the floor; None for fixtures.
        states: (attribute, value) pairs.
        prepared: not there yet; waits to replace something.
        made_from: of a prepared thing: what it replaces.
    """

    name: str
    category: str
    parent: str | None
    states: tuple[tuple[str, str], ...]
    prepared: bool = False
    made_from: str | None = None


def pose_at(x: float, y: float, z: float, yaw_rad: float = 0.0) -> Pose:
    """Upright pose."""
    c, s = np.cos(yaw_rad), np.sin(yaw_rad)
    return np.array([[c, -s, 0, x], [s, c, 0, y], [0, 0, 1, z], [0, 0, 0, 1]], dtype=np.float64)


def pose_on_edge(x: float, y: float, z: float) -> Pose:
    """Standing on its front edge, thickness along y."""
    return np.array([[1, 0, 0, x], [0, 0, -1, y], [0, 1, 0, z], [0, 0, 0, 1]], dtype=np.float64)


def inverse(pose: Pose) -> Pose:
    """Inverse of a rigid pose."""
    out = np.eye(4)
    out[:3, :3] = pose[:3, :3].T
    out[:3, 3] = -pose[:3, :3].T @ pose[:3, 3]
    return out


def yaw_of(pose: Pose) -> float:
    """Turn about z of an upright pose."""
    return float(np.arctan2(pose[1, 0], pose[0, 0]))


def quaternion(axis: Vec, angle_rad: float) -> tuple[float, float, float, float]:
    """Unit quaternion (w, x, y, z) of a turn about a unit axis."""
    s = float(np.sin(angle_rad / 2))
    return (float(np.cos(angle_rad / 2)), axis[0] * s, axis[1] * s, axis[2] * s)
