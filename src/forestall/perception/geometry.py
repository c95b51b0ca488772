"""Things as the relations see them: clouds, boxes and footprints, stacked into arrays.

A footprint is the 16-gon around a cloud seen from above (its support values in 16 directions):
nearly a convex hull, and tested for many points and many things with one comparison. Called by
`support.py`, `relations.py` and `blocking.py`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
import numpy.typing as npt

from forestall.perception.unproject import Points

_ANGLES = np.arange(16) * (2 * np.pi / 16)
DIRECTIONS: Points = np.stack([np.cos(_ANGLES), np.sin(_ANGLES)])
"""(2, 16) unit vectors of the footprint's sides."""

_SAMPLES = 256
_OUTLINE = 1024


@dataclass(frozen=True, slots=True, eq=False)
class Thing:
    """One located object.

    Args:
        id: node id.
        category: of the domain.
        points_world_m: (n, 3), n ≥ 1.
        low_m: (3,) lower corner of its box.
        high_m: (3,) upper corner.
        closed: it encloses its contents and is closed now.
    """

    id: str
    category: str
    points_world_m: Points
    low_m: Points
    high_m: Points
    closed: bool = False


@dataclass(frozen=True, slots=True, eq=False)
class Stack:
    """Arrays over all things: boxes (n, 3), footprints (n, 16) and samples of clouds."""

    things: tuple[Thing, ...]
    low_m: Points
    high_m: Points
    footprint_m: Points
    samples: tuple[Points, ...]

    @classmethod
    def of(cls, things: Sequence[Thing]) -> Stack:
        """Stack things in id order."""
        ordered = tuple(sorted(things, key=lambda t: t.id))
        if not ordered:
            empty = np.zeros((0, 3))
            return cls((), empty, empty, np.zeros((0, 16)), ())
        outlines = [sampled(t.points_world_m, _OUTLINE)[:, :2] for t in ordered]
        starts = np.concatenate([[0], np.cumsum([len(o) for o in outlines])[:-1]])
        along = DIRECTIONS.T @ np.concatenate(outlines).T
        reach = np.ascontiguousarray(np.maximum.reduceat(along, starts, axis=1).T)
        return cls(
            things=ordered,
            low_m=np.stack([t.low_m for t in ordered]),
            high_m=np.stack([t.high_m for t in ordered]),
            footprint_m=reach,
            samples=tuple(sampled(t.points_world_m) for t in ordered),
        )

    def over(self, points_m: Points, which: Sequence[int], slack_m: float) -> npt.NDArray[np.bool_]:
        """(n, len(which)) whether each point lies above or below each footprint."""
        reach = points_m[:, :2] @ DIRECTIONS
        within: npt.NDArray[np.bool_] = np.all(
            reach[:, None, :] <= self.footprint_m[None, list(which), :] + slack_m, axis=2
        )
        return within

    def gaps_m(self) -> Points:
        """(things, things) distance between boxes, 0 where they touch."""
        apart = np.maximum(
            self.low_m[:, None, :] - self.high_m[None, :, :],
            self.low_m[None, :, :] - self.high_m[:, None, :],
        )
        gap: Points = np.round(np.linalg.norm(np.maximum(apart, 0.0), axis=2), 6)
        return gap


def sampled(points_m: Points, most: int = _SAMPLES) -> Points:
    """At most `most` points, evenly over the stored order."""
    if len(points_m) <= most:
        return points_m
    picked: Points = points_m[_evenly(len(points_m), most)]
    return picked


@lru_cache(maxsize=1024)
def _evenly(count: int, most: int) -> npt.NDArray[np.int64]:
    return np.linspace(0, count - 1, most).astype(np.int64)


def filled(one_m: Points, other_m: Points) -> float:
    """The volume that two boxes share, as a share of the smaller one's.

    Boxes are (2, 3): the low and the high corner.
    """
    low, high = np.maximum(one_m[0], other_m[0]), np.minimum(one_m[1], other_m[1])
    both = float(np.prod(np.maximum(high - low, 0.0)))
    return both / min(float(np.prod(np.maximum(np.ptp(b, axis=0), 1e-4))) for b in (one_m, other_m))
