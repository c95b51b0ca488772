"""What is remembered of each object, and what the newest views say about remembered places.

Called by `fuse.py`.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from enum import IntEnum

import numpy as np
import numpy.typing as npt

from forestall.perception.config import PerceptionConfig
from forestall.perception.support import Parent
from forestall.perception.unproject import Cloud, Labels, Points, project
from forestall.types.graph import Seen
from forestall.types.observation import Frame, Vec3


@dataclass(slots=True)
class Track:
    """One object as believed now; `points_world_m` is None when its place is not known.

    `look` is its mean colour, (3,) from 0 to 1, where perception has to tell things apart itself.
    `interior_seen` says that a view reached into it since it was opened, `unmoved` that the newest
    view that showed it showed it where it was before, `vague` that it was seen and never located,
    `sure` how sure a state was when it was read, 1 where nobody says, `presumed` what skills should
    have made of states since they were read, `meant` in or on what one should have put it since it
    was seen. `sightings` counts the views that showed it, `shown_m2` is the largest area that one
    of them showed, `doubted` is another category that a single view of the newest observation
    called it, `shown` the cells of its surface that views have shown (`unseen.py`).
    """

    id: str
    category: str
    points_world_m: Points | None = None
    low_m: Points = field(default_factory=lambda: np.zeros(3))
    high_m: Points = field(default_factory=lambda: np.zeros(3))
    centroid_m: Points = field(default_factory=lambda: np.zeros(3))
    pixels: int = 0
    sightings: int = 0
    seen: Seen = Seen.UNOBSERVED
    first_seen_s: float = 0.0
    last_seen_s: float = 0.0
    states: dict[str, str | None] = field(default_factory=dict)
    sure: dict[str, float] = field(default_factory=dict)
    presumed: dict[str, str] = field(default_factory=dict)
    meant: Parent | None = None
    feature: bytes | None = None
    look: Points | None = None
    parent: Parent | None = None
    interior_seen: bool = False
    unmoved: bool = False
    vague: bool = False
    doubted: str | None = None
    shown_m2: float = 0.0
    shown: npt.NDArray[np.int64] = field(default_factory=lambda: np.zeros(0, dtype=np.int64))

    def move(self, offset_m: Points) -> None:
        """Shift everything that is remembered of its place."""
        if self.points_world_m is not None:
            self.points_world_m = self.points_world_m + offset_m
            self.low_m = self.low_m + offset_m
            self.high_m = self.high_m + offset_m
            self.centroid_m = self.centroid_m + offset_m

    def remember(self, other: Track) -> None:
        """Take over what is known under another name: states not read anew, where it was put."""
        known = {a: v for a, v in other.states.items() if v is not None}
        self.sure = {**{a: other.sure.get(a, 1.0) for a in known}, **self.sure}
        self.states = {**known, **self.states}
        self.meant = self.meant or other.meant

    def lose(self) -> None:
        """Forget where it is."""
        self.points_world_m = None
        self.parent = None


@dataclass(frozen=True, slots=True, eq=False)
class View:
    """One frame with what was found in it; everything but the frame and `labels` by label.

    `sure` are the probabilities of the states that were read, where the estimator says any.
    `features` are None without an image encoder and for what has no cloud. `unlocated` tells what
    is seen and has no place, because no depth returned or the segmenter is not sure of its mask.
    `guessed` are the ids that perception gave, and no segmenter that tracks. `looks` are mean
    colours, empty where every id is a segmenter's.
    """

    frame: Frame
    labels: Labels
    ids: tuple[str, ...]
    categories: tuple[str, ...]
    clouds: tuple[Cloud | None, ...]
    states: tuple[Mapping[str, str | None], ...]
    sure: tuple[Mapping[str, float], ...]
    features: tuple[bytes | None, ...]
    unlocated: tuple[bool, ...]
    guessed: frozenset[str] = frozenset()
    looks: tuple[Points | None, ...] = ()


def riding(tracks: Mapping[str, Track], name: str | None) -> set[str]:
    """What is in or on a thing, at any depth."""
    found: set[str] = set()
    pending = [] if name is None else [name]
    while pending:
        top = pending.pop()
        on = {n for n, t in tracks.items() if t.parent is not None and t.parent[1] == top} - found
        found |= on
        pending += sorted(on)
    return found


_MOST_POINTS = 6000


class Fate(IntEnum):
    """What a view says about a remembered point; of several views the largest counts.

    Unmasked is a surface where it was, which no mask shows: its detector missed the thing.
    """

    OUT_OF_VIEW = 0
    OCCLUDED = 1
    UNMASKED = 2
    GONE = 3
    CONFIRMED = 4


Fates = npt.NDArray[np.int8]


def fates(
    tracks: Sequence[Track], views: Sequence[View], config: PerceptionConfig
) -> dict[str, Fates]:
    """For each located track, what became of its points (`Fate` values)."""
    located = [t for t in tracks if t.points_world_m is not None]
    clouds = [t.points_world_m for t in located if t.points_world_m is not None]
    if not clouds:
        return {}
    cloud = np.concatenate(clouds)
    sizes = [len(c) for c in clouds]
    result: Fates = np.zeros(len(cloud), dtype=np.int8)
    for view in views:
        label_of = {name: i for i, name in enumerate(view.ids)}
        own = np.repeat([label_of.get(t.id, -2) for t in located], sizes)
        np.maximum(result, _fates_in(view, cloud, own, config), out=result)
    ends = np.cumsum(sizes)
    return {t.id: result[e - n : e] for t, n, e in zip(located, sizes, ends, strict=True)}


def _fates_in(
    view: View, cloud: Points, own: npt.NDArray[np.int64], config: PerceptionConfig
) -> Fates:
    u, v, z, inside = project(cloud, view.frame.intrinsics, view.frame.camera_to_world)
    depth = view.frame.depth_m[v, u]
    known = inside & (depth > 0)
    margin = config.free_margin_m + config.free_margin_share * z
    fate: Fates = np.full(len(cloud), Fate.OUT_OF_VIEW, dtype=np.int8)
    fate[known & (depth < z - margin)] = Fate.OCCLUDED
    reached = known & (depth >= z - margin)
    fate[reached] = Fate.GONE
    label, there = view.labels[v, u], reached & (depth <= z + margin)
    fate[there & (label < 0)] = Fate.UNMASKED
    fate[there & (label == own)] = Fate.CONFIRMED
    return fate


def expected_pixels(track: Track, views: Sequence[View]) -> float:
    """How large the remembered box would look in the view that shows it largest."""
    if track.points_world_m is None:
        return 0.0
    best = 0.0
    for view in views:
        u, v, _, inside = project(
            track.points_world_m, view.frame.intrinsics, view.frame.camera_to_world
        )
        if int(inside.sum()) > 1:
            best = max(best, 0.5 * float(np.ptp(u[inside]) * np.ptp(v[inside])))
    return best


def interior_observed(track: Track, views: Sequence[View], config: PerceptionConfig) -> bool:
    """Whether enough of the far part of a container's box was looked into.

    The far part, because an open door makes the box larger on the near side.
    """
    if track.points_world_m is None:
        return False
    steps = np.linspace(0.2, 0.8, 5)
    grid = np.stack(np.meshgrid(steps, steps, steps, indexing="ij"), axis=-1).reshape(-1, 3)
    samples = track.low_m + grid * (track.high_m - track.low_m)
    for view in views:
        eye = view.frame.camera_to_world[:3, 3]
        distance = np.linalg.norm(samples[:, :2] - eye[:2], axis=1)
        far = samples[distance >= np.quantile(distance, 0.4)]
        u, v, z, inside = project(far, view.frame.intrinsics, view.frame.camera_to_world)
        depth = view.frame.depth_m[v, u]
        open_view = inside & (depth >= z - config.free_margin_m)
        if float(open_view.mean()) >= config.interior_share:
            return True
    return False


def middle(track: Track) -> Points:
    """Midpoint of a track's box."""
    centre: Points = (track.low_m + track.high_m) / 2
    return centre


def gap_m(one: Track, other: Track) -> float:
    """Distance between two boxes."""
    apart = np.maximum(one.low_m - other.high_m, other.low_m - one.high_m)
    return float(np.linalg.norm(np.maximum(apart, 0.0)))


def thinned(points: Points, voxel_m: float) -> Points:
    """One point for each voxel (the first, that is the newest), at most a fixed number."""
    cell = np.floor(points / voxel_m).astype(np.int64) + (1 << 19)
    key = (cell[:, 0] << 40) | (cell[:, 1] << 20) | cell[:, 2]
    _, first = np.unique(key, return_index=True)
    if len(first) > _MOST_POINTS:
        first = first[np.linspace(0, len(first) - 1, _MOST_POINTS).astype(np.int64)]
    kept: Points = points[first]
    return kept


def vec(values: Points) -> Vec3:
    """Three numbers, rounded to a tenth of a millimetre."""
    x, y, z = (round(float(v), 4) for v in values)
    return (x, y, z)
