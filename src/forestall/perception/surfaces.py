"""Level surfaces that nothing masks, and on which something stands: a table that was not detected.

They are found in depth: what is not masked, lies level by the stated pose, and reaches to the foot
of a thing that no known piece of furniture carries. At the height of the floor it is the floor,
else a surface of no category of the domain, which takes anything. Called by the perceiver, for each
frame before its things are named.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from forestall.domain.model import Domain
from forestall.perception.config import PerceptionConfig
from forestall.perception.unproject import Labels, Points, heights, rays
from forestall.types.observation import Detection, Frame

SURFACE = "Surface"
"""Category of a level surface of which no more is known."""

Flags = npt.NDArray[np.bool_]
Corners = tuple[Points, Points]
"""Low and high corner of a box."""

_AROUND = 4  # cells
_UP = 0.25  # steepest slope of what counts as level (14 degrees)


def fixed(domain: Domain, category: str) -> bool:
    """Whether a thing of a category stays where it is."""
    return category == SURFACE or domain.is_a(category, domain.roles.fixture)


def with_surfaces(
    frame: Frame,
    detections: Sequence[Detection],
    labels: Labels,
    known: Sequence[Corners],
    floor_m: float,
    domain: Domain,
    config: PerceptionConfig,
) -> tuple[list[Detection], Labels]:
    """Detections and labels with those of surfaces behind them.

    Args:
        frame: depth and camera.
        detections: what a segmenter found.
        labels: (H, W) index of the detection at each pixel, -1 for none.
        known: boxes of furniture that is known already.
        floor_m: height of the floor on which the robot stands.
        domain: which things can be moved, and what the ground is called.
        config: thresholds.
    """
    found, marked = list(detections), labels
    things = [i for i, d in enumerate(detections) if not fixed(domain, d.category)]
    if not things:
        return found, labels
    ground = _ground(domain)
    for height_m, cells in _needed(_Lattice.of(frame, labels, config), things, known, config):
        wide = cells.repeat(config.lattice_px, axis=0).repeat(config.lattice_px, axis=1)
        mask = wide[: labels.shape[0], : labels.shape[1]] & (labels < 0) & (frame.depth_m > 0)
        high = heights(frame.depth_m, *rays(frame.intrinsics), frame.camera_to_world)
        mask &= np.abs(high - height_m) <= config.surface_m
        at_floor = ground is not None and abs(height_m - floor_m) <= config.floor_slack_m
        category = ground if at_floor and ground is not None else SURFACE
        if any(d.category == category == ground for d in found):
            continue
        if marked is labels:
            marked = labels.copy()
        marked[mask] = len(found)
        found.append(Detection(category, mask))
    return found, marked


def _ground(domain: Domain) -> str | None:
    """The one category that is the ground, None where there is none or several."""
    if domain.roles.ground is None:
        return None
    named = [c for c in domain.categories if domain.is_a(c, domain.roles.ground)]
    return named[0] if len(named) == 1 else None


@dataclass(frozen=True, slots=True, eq=False)
class _Lattice:
    """Every n-th pixel of a frame: (h, w) labels, (h, w, 3) points, and where depth is known."""

    labels: Labels
    points_m: npt.NDArray[np.float32]
    known: Flags

    @classmethod
    def of(cls, frame: Frame, labels: Labels, config: PerceptionConfig) -> _Lattice:
        """Thin a frame."""
        step = config.lattice_px
        z = frame.depth_m[::step, ::step]
        x, y = rays(frame.intrinsics)
        across, down = np.meshgrid(x[::step], y[::step])
        turn = frame.camera_to_world[:3, :3].astype(np.float32)
        local = np.stack([across * z, down * z, z], axis=-1)
        points = local @ turn.T + frame.camera_to_world[:3, 3].astype(np.float32)
        return cls(labels[::step, ::step], points, z > 0)

    def level(self) -> Flags:
        """(h, w) unmasked cells that lie level, seen from above."""
        p = self.points_m
        flat = np.zeros(self.known.shape, dtype=np.bool_)
        inner = np.s_[1:-1, 1:-1]
        free = self.known & (self.labels < 0)
        good = free[inner].copy()
        for one, two in (
            (p[1:-1, 2:], p[1:-1, :-2]),
            (p[2:, 1:-1], p[:-2, 1:-1]),
        ):
            way = one - two
            run = np.hypot(way[..., 0], way[..., 1])
            good &= np.abs(way[..., 2]) <= _UP * np.maximum(run, 0.01)
        for ends in (free[1:-1, 2:], free[1:-1, :-2], free[2:, 1:-1], free[:-2, 1:-1]):
            good &= ends
        flat[inner] = good
        return flat


def _needed(
    look: _Lattice, things: Sequence[int], known: Sequence[Corners], config: PerceptionConfig
) -> Iterator[tuple[float, Flags]]:
    """Height and cells of each level surface on which a thing stands that nothing else carries."""
    from scipy.ndimage import binary_dilation, label

    level = look.level()
    if int(level.sum()) < config.surface_cells:
        return
    taken = np.zeros(level.shape, dtype=np.bool_)
    for thing in things:
        foot = _foot(look, thing, level & ~taken, known, config)
        if foot is None:
            continue
        height_m, around = foot
        at_height = look.known & (np.abs(look.points_m[..., 2] - height_m) <= config.surface_m)
        free = at_height & (look.labels < 0)
        pieces, _ = label(binary_dilation(free & level, iterations=2))
        mine = np.unique(pieces[around])
        cells = free & np.isin(pieces, mine[mine > 0])
        if int((cells & level).sum()) >= config.surface_cells:
            taken |= cells
            yield height_m, cells


def _foot(
    look: _Lattice,
    thing: int,
    level: Flags,
    known: Sequence[Corners],
    config: PerceptionConfig,
) -> tuple[float, Flags] | None:
    """Height and cells of the unmasked surface around a foot; None where something else carries."""
    mine = (look.labels == thing) & look.known
    if not mine.any():
        return None
    low, high = np.percentile(look.points_m[mine], (3, 97), axis=0)
    if any(_carries(corners, low, high, config) for corners in known):
        return None
    rows, columns = np.nonzero(mine)
    box = np.s_[
        max(0, int(rows.min()) - _AROUND) : int(rows.max()) + _AROUND + 1,
        max(0, int(columns.min()) - _AROUND) : int(columns.max()) + _AROUND + 1,
    ]
    p = look.points_m[box]
    reach = 2 * config.ring_m
    beside = look.known[box] & (look.labels[box] != thing)
    beside &= ((p[..., :2] >= low[:2] - reach) & (p[..., :2] <= high[:2] + reach)).all(axis=-1)
    near = beside & (p[..., 2] >= low[2] - config.contact_below_m)
    near &= p[..., 2] <= low[2] + config.contact_above_m
    free = near & level[box]
    least = max(config.foot_cells, config.foot_share * int(beside.sum()))
    if int(free.sum()) < least or int((near & (look.labels[box] >= 0)).sum()) > int(free.sum()):
        return None
    around = np.zeros(level.shape, dtype=np.bool_)
    around[box] = free
    return float(np.median(p[..., 2][free])), around


def _carries(corners: Corners, low: Points, high: Points, config: PerceptionConfig) -> bool:
    """Whether known furniture is where the foot of a thing is, and goes down from there."""
    margin = np.array([config.ring_m, config.ring_m, config.contact_below_m])
    here = (corners[0] <= high + margin).all() and (corners[1] >= low - margin).all()
    return bool(here and corners[0][2] <= low[2] + config.contact_above_m)
