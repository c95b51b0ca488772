"""From where more would be seen of some things: the next view, chosen by what is remembered.

Of a place that is open to the eye that is the part of its surface that no picture has shown, of a
thing its sides. Whatever else is remembered stands in the way. Called by the perceiver; nothing is
drawn: directions to all remembered points are sorted into cells, of which the nearest counts.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence

import numpy as np
import numpy.typing as npt

from forestall.domain.looked import in_sight
from forestall.domain.model import Domain
from forestall.perception.config import PerceptionConfig
from forestall.perception.support import contains
from forestall.perception.tracks import Track
from forestall.perception.unproject import Points
from forestall.perception.unseen import unshown
from forestall.types.observation import Vec3

WORTH = 0.25
"""So much more of what is looked for must be seen from a place than from here, as a share."""

ALIKE = 0.1
"""Of places from which nearly as much is seen the nearest is the best."""

_MEANT_M = 0.1
"""How near to a point the centroid of the thing must be that is meant by it."""
_CELL_RAD = np.deg2rad(2.0)
_SLACK_M = 0.03
_OWN_SLACK_M = 0.1
_SIDES = np.linspace(-0.9, 0.9, 3)


def best_vantage(
    tracks: Mapping[str, Track],
    points: Sequence[Vec3],
    eyes: Sequence[Vec3],
    here: Vec3,
    domain: Domain,
    config: PerceptionConfig,
) -> int | None:
    """Which of some places of the camera shows noticeably more than it sees from where it is.

    Args:
        tracks: everything that is known, by name.
        points: centroids of the things that are looked for, in the world.
        eyes: where the camera could be.
        here: where it is.
        domain: which things are places, and how they take others.
        config: thresholds.

    Returns:
        Its position in `eyes`; None where none is worth the way, or nothing there is unseen.
    """
    located = [t for _, t in sorted(tracks.items()) if t.points_world_m is not None]
    meant = _meant(located, points)
    if not meant or not eyes:
        return None
    sought = [_sought(t, domain, config) for t in meant]
    if not sum(map(len, sought)):
        return None
    every = np.asarray([here, *eyes], dtype=np.float64)
    seen = np.zeros(len(every))
    for track, wanted in zip(meant, sought, strict=True):
        apart = {track.id, track.parent[1] if track.parent is not None else track.id}
        others = _cloud(located, apart)
        own = track.points_world_m if contains(track.category, domain) else None
        for k, eye in enumerate(every):
            clear = _clear(eye, wanted, others, _SLACK_M)
            if own is not None:
                clear &= _clear(eye, wanted, own, _OWN_SLACK_M)
            seen[k] += np.count_nonzero(clear)
    share = seen / sum(map(len, sought))
    if share.max() < share[0] + WORTH:
        return None
    way = np.linalg.norm(every[:, :2] - every[0, :2], axis=1)
    good = (share >= share.max() - ALIKE) & (share >= share[0] + WORTH)
    return int(np.where(good, way, np.inf).argmin()) - 1


def _meant(located: Sequence[Track], points: Sequence[Vec3]) -> list[Track]:
    """The things whose centroids are at the points, each once."""
    found: dict[str, Track] = {}
    for point in points:
        apart = [float(np.linalg.norm(t.centroid_m - np.asarray(point))) for t in located]
        nearest = int(np.argmin(apart)) if apart else 0
        if apart and apart[nearest] <= _MEANT_M:
            found[located[nearest].id] = located[nearest]
    return list(found.values())


def _sought(track: Track, domain: Domain, config: PerceptionConfig) -> Points:
    """(n, 3) what should be seen: the unseen surface of an open place, the sides of a thing."""
    if in_sight(track.category, domain):
        return unshown(track, domain, config)
    low, high = _whole(track, domain)
    centre, half = (low + high) / 2, (high - low) / 2
    lattice = np.stack(np.meshgrid(_SIDES, _SIDES, indexing="ij"), axis=-1).reshape(-1, 2)
    faces = [
        np.insert(lattice, axis, sign, axis=1)
        for axis, sign in ((0, -1.0), (0, 1.0), (1, -1.0), (1, 1.0), (2, 1.0))
    ]
    sides: Points = centre + np.concatenate(faces) * half
    return sides


def _whole(track: Track, domain: Domain) -> tuple[Points, Points]:
    """Corners of the box of a thing as large as its kind, where only a part of it was seen.

    What was seen is its top, and the middle of it.
    """
    category = domain.find(track.category)
    low, high = track.low_m, track.high_m
    if category is None or not category.size_m:
        return low, high
    half = np.maximum(np.asarray(category.size_m), high - low) / 2
    centre = (low + high) / 2
    centre[2] = high[2] - half[2]
    return centre - half, centre + half


def _cloud(located: Sequence[Track], apart: Collection[str]) -> Points:
    """(n, 3) all that is remembered, some things apart."""
    clouds = [t.points_world_m for t in located if t.id not in apart]
    there = [c for c in clouds if c is not None]
    return np.concatenate(there) if there else np.zeros((0, 3))


def _clear(eye: Points, wanted: Points, cloud: Points, slack_m: float) -> npt.NDArray[np.bool_]:
    """(n,) whether nothing of a cloud stands before each point, as seen from a place."""
    (cells, far), (own, apart) = _directions(eye, cloud), _directions(eye, wanted)
    if not len(cells):
        return np.ones(len(wanted), dtype=np.bool_)
    order = np.lexsort((far, cells))
    taken, at = np.unique(cells[order], return_index=True)
    place = np.minimum(np.searchsorted(taken, own), len(taken) - 1)
    free: npt.NDArray[np.bool_] = taken[place] != own
    return free | (far[order][at][place] >= apart - slack_m)


def _directions(eye: Points, some: Points) -> tuple[npt.NDArray[np.int64], Points]:
    """(n,) the cell in which each point is seen from a place, and (n,) how far away."""
    way = some - eye
    far: Points = np.linalg.norm(way, axis=1)
    turn = np.floor(np.arctan2(way[:, 1], way[:, 0]) / _CELL_RAD).astype(np.int64)
    rise = np.arcsin(np.clip(way[:, 2] / np.maximum(far, 1e-9), -1.0, 1.0))
    return turn * 1000 + np.floor(rise / _CELL_RAD).astype(np.int64), far
