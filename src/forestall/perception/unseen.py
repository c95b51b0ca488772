"""How much of a place's surface no picture has shown: there something may stand behind a thing.

Called by `fuse.py`. A piece of furniture keeps what was ever seen of it, so what lacks in its
cloud, and is under nothing that is known, was never seen.
"""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from forestall.perception.config import PerceptionConfig
from forestall.perception.tracks import Track


def unseen_m2(place: Track, others: Iterable[Track], top: bool, config: PerceptionConfig) -> float:
    """Area in square metres that was never seen, in pieces on which a small thing has room.

    Args:
        place: what takes things; located.
        others: everything else that is located.
        top: whether they stand on its top, rather than in it.
        config: `cell_m` and `piece_cells`.
    """
    from scipy.ndimage import binary_opening

    cell = config.cell_m
    low, high = place.low_m, place.high_m
    shape = np.maximum(np.floor((high[:2] - low[:2]) / cell), 1).astype(int)
    seen = np.zeros(shape, dtype=bool)
    points = place.points_world_m
    if points is not None:
        if top:
            points = points[points[:, 2] >= high[2] - cell]
        at = np.floor((points[:, :2] - low[:2]) / cell).astype(int)
        at = at[((at >= 0) & (at < shape)).all(axis=1)]
        seen[at[:, 0], at[:, 1]] = True
    floor_m = high[2] if top else low[2]
    for other in others:
        if other.high_m[2] < floor_m - cell or other.low_m[2] > high[2] + cell:
            continue
        a = np.rint((other.low_m[:2] - low[:2]) / cell).astype(int)
        b = np.rint((other.high_m[:2] - low[:2]) / cell).astype(int)
        (x0, y0), (x1, y1) = np.clip(a, 0, shape), np.clip(b, 0, shape)
        seen[x0:x1, y0:y1] = True
    side = min(config.piece_cells, *shape)
    pieces = binary_opening(~seen, structure=np.ones((side, side), dtype=bool))
    return float(np.count_nonzero(pieces)) * cell**2
