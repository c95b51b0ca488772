"""How much of a place's surface no picture has shown: there something may stand behind a thing.

Called by `fuse.py`. The surface is a lattice of cells that stands still in the world; a cell is
seen once a view's ray reaches a point close over it.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from forestall.domain.looked import in_sight
from forestall.domain.model import Domain
from forestall.perception.config import PerceptionConfig
from forestall.perception.support import contains
from forestall.perception.tracks import Track, View
from forestall.perception.unproject import Points, project

Cells = npt.NDArray[np.int64]
_FAR = 1 << 20


def look_over(
    tracks: Iterable[Track], views: Sequence[View], domain: Domain, config: PerceptionConfig
) -> None:
    """Note which cells of the places among some things the views of one observation show.

    Args:
        tracks: everything that is known; `shown` of open places grows.
        views: of one observation.
        domain: which of them are places, and how they take things.
        config: thresholds.
    """
    for place in tracks:
        if place.points_world_m is None or not in_sight(place.category, domain):
            continue
        cells = _unshown(place, config)
        if len(cells) == 0:
            continue
        seen = _seen(_over(cells, place, domain, config), views, config)
        if seen.any():
            place.shown = np.union1d(place.shown, _keys(*cells[seen].T))


def unshown(place: Track, domain: Domain, config: PerceptionConfig) -> Points:
    """(n, 3) points close over the surface of a located place where no view has shown it."""
    return _over(_unshown(place, config), place, domain, config)


def _unshown(place: Track, config: PerceptionConfig) -> Cells:
    """(n, 2) cells of a place that no view has shown."""
    x, y = _lattice(place, config)
    row, column = np.nonzero(_unseen(x, y, place))
    return np.column_stack([x[row], y[column]])


def _unseen(x: Cells, y: Cells, place: Track) -> npt.NDArray[np.bool_]:
    """(nx, ny) which cells of a lattice no view of a place has shown."""
    keys = _keys(x[:, None], y[None, :])
    if len(place.shown) == 0:
        return np.ones(keys.shape, dtype=np.bool_)
    unseen: npt.NDArray[np.bool_] = (
        place.shown.take(np.searchsorted(place.shown, keys), mode="clip") != keys
    )
    return unseen


def _over(cells: Cells, place: Track, domain: Domain, config: PerceptionConfig) -> Points:
    """(n, 3) the middles of cells, close over the surface."""
    level_m = np.full(len(cells), _level_m(place, domain) + config.over_m)
    return np.column_stack([(cells + 0.5) * config.cell_m, level_m])


@dataclass(frozen=True, slots=True, eq=False)
class Taken:
    """Where everything is that is located, for all places of one graph.

    Args:
        ids: of the things.
        low_m: (n, 3) corners of their boxes.
        high_m: (n, 3).
    """

    ids: npt.NDArray[np.object_]
    low_m: Points
    high_m: Points

    @classmethod
    def of(cls, tracks: Iterable[Track]) -> Taken:
        """Of everything that is known."""
        there = [t for t in tracks if t.points_world_m is not None]
        low = np.array([t.low_m for t in there], dtype=np.float64).reshape(-1, 3)
        high = np.array([t.high_m for t in there], dtype=np.float64).reshape(-1, 3)
        return cls(np.array([t.id for t in there], dtype=object), low, high)


def unseen_m2(place: Track, taken: Taken, domain: Domain, config: PerceptionConfig) -> float:
    """Area in square metres that was never seen, in pieces on which a small thing has room.

    Args:
        place: 0 for what is no open place, or not located.
        taken: where everything is: what is under a thing is not unseen.
        domain: whether things stand on its top, or in it.
        config: thresholds.
    """
    from scipy.ndimage import binary_opening

    if place.points_world_m is None or not in_sight(place.category, domain):
        return 0.0
    x, y = _lattice(place, config)
    unseen = _unseen(x, y, place)
    if not unseen.any():
        return 0.0
    first, shape = np.array([x[0], y[0]]), unseen.shape
    above = taken.low_m[:, 2] > place.high_m[2] + config.cell_m
    below = taken.high_m[:, 2] < _level_m(place, domain)
    over = (taken.ids != place.id) & ~above & ~below
    a, b = (
        np.clip(np.rint(corner[over, :2] / config.cell_m).astype(int) - first, 0, shape)
        for corner in (taken.low_m, taken.high_m)
    )
    for (x0, y0), (x1, y1) in zip(a.tolist(), b.tolist(), strict=True):
        unseen[x0:x1, y0:y1] = False
    if not unseen.any():
        return 0.0
    piece = np.ones((config.piece_cells, config.piece_cells), dtype=bool)
    return float(np.count_nonzero(binary_opening(unseen, structure=piece))) * config.cell_m**2


def _seen(points: Points, views: Sequence[View], config: PerceptionConfig) -> npt.NDArray[np.bool_]:
    """Whether a ray of some view reaches each point, as far as depth tells."""
    seen = np.zeros(len(points), dtype=bool)
    for view in views:
        frame = view.frame
        column, row, z, inside = project(points, frame.intrinsics, frame.camera_to_world)
        depth = frame.depth_m[row, column]
        slack = np.maximum(config.free_margin_m, config.free_margin_share * z)
        seen |= inside & (depth > 0) & (depth >= z - slack)
    return seen


def _level_m(place: Track, domain: Domain) -> float:
    """How high the surface is on which things stand: the top, or the bottom that is seen."""
    return float((place.low_m if contains(place.category, domain) else place.high_m)[2])


def _lattice(place: Track, config: PerceptionConfig) -> tuple[Cells, Cells]:
    """(nx,) and (ny,) coordinates of the cells whose middles lie over a place."""
    a = np.ceil(place.low_m[:2] / config.cell_m - 0.5).astype(np.int64)
    b = np.floor(place.high_m[:2] / config.cell_m - 0.5).astype(np.int64)
    x, y = (np.arange(a[k], max(a[k], b[k]) + 1) for k in range(2))
    return x, y


def _keys(x: Cells, y: Cells) -> Cells:
    """One number for each cell, from its coordinates."""
    keys: Cells = x * (2 * _FAR) + y + _FAR
    return keys
