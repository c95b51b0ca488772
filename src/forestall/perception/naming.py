"""Names for detections whose segmenter does not track instances.

A detection takes the name of what is known where it is (assignment by least total distance, in
which size and look decide between things side by side), or a new number. Nothing moves by itself:
what is known is where its box was, as far as a pose may be wrong; where a thing was moved,
`own_names.py` finds it again. Of furniture a view shows a part, and the part lies on what is known
of it, or, where it can be opened, in its place: open it shows other sides, and two of a kind do not
fill one place. What is in the hand goes round with the robot between two views. Called by the
perceiver.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from forestall.perception.config import PerceptionConfig
from forestall.perception.geometry import filled
from forestall.perception.unproject import Cloud, Labels, Points
from forestall.types.facts import category_of
from forestall.types.observation import Detection, Rgb

Cells = npt.NDArray[np.int64]

_NEVER = 1e6
_CELL_M = 0.03
_MARGIN_M = np.array([[-0.5], [0.5]]) * _CELL_M  # around a box, so that a flat one has a volume
_SAMPLES = 300
_EDGE_SHARE = 0.02  # what two sides of one piece share: the edge between them
_FLAT = 0.2  # thickness of a side, as a share of its middle extent
_THIN = 3  # every so many pixels tell a colour
_LEAST_M = 0.01  # extents under it are alike
_PART_SHARE = 0.5  # of a part that lies on a piece
_BITS = 16
_AROUND = np.array([(x << 2 * _BITS) + (y << _BITS) + z for x, y, z in np.ndindex(3, 3, 3)]) - (
    (1 << 2 * _BITS) + (1 << _BITS) + 1
)


@dataclass(frozen=True, slots=True, eq=False)
class Known:
    """Where a thing is expected.

    Args:
        centroid_m: (3,) in the world.
        cells: what is known of the surface of a piece of furniture, as sorted keys of a grid; None
            for other things.
        box_m: (2, 3) lower and upper corner of what is known; None for what was just let go.
        look: (3,) mean colour from 0 to 1, None where it is not known.
        hollow: whether it can be opened: then it looks another way, at the same place.
        only: whether there is no other of its category: the ground.
        turning: whether it is in the hand, or on what is: it stands at another side of the robot
            in every view, as far from its axis and as high.
    """

    centroid_m: Points
    cells: Cells | None = None
    box_m: Points | None = None
    turning: bool = False
    only: bool = False
    look: Points | None = None
    hollow: bool = False

    @classmethod
    def of(
        cls, points_m: Points, centroid_m: Points, fixed: bool, look: Points | None = None
    ) -> Known:
        """Of all that is remembered of a thing."""
        cells = _cells(points_m) if fixed else None
        return cls(centroid_m, cells, _box(points_m), look=look)

    def with_view(self, seen: Known) -> Known:
        """What is known with one more view of it."""
        if seen.cells is not None and self.cells is not None:
            return self.joined(seen)
        look = self.look if seen.look is None else seen.look
        if self.turning or self.box_m is None or seen.box_m is None:
            return replace(seen, turning=self.turning, look=look)
        return replace(seen, box_m=_box(np.concatenate([self.box_m, seen.box_m])), look=look)

    def joined(self, other: Known) -> Known:
        """A piece of furniture of which two parts are known."""
        assert self.cells is not None and other.cells is not None, "both are furniture"
        cells = np.union1d(self.cells, other.cells)
        assert self.box_m is not None and other.box_m is not None, "with a box"
        box_m = _box(np.concatenate([self.box_m, other.box_m]))
        return replace(other, cells=cells, box_m=box_m, only=self.only)

    def touches(self, box_m: Points) -> bool:
        """Whether a box comes near the surface's."""
        if self.box_m is None:
            return False
        apart = np.maximum(self.box_m[0] - box_m[1], box_m[0] - self.box_m[1])
        return bool(apart.max() <= 2 * _CELL_M)


def name_detections(
    detections: Sequence[Detection],
    clouds: Sequence[Cloud | None],
    known: Mapping[str, Known],
    axis_m: Sequence[float],
    config: PerceptionConfig,
    reserved: Collection[str] = (),
    looks: Sequence[Points | None] = (),
) -> list[str]:
    """An instance name for every detection.

    Args:
        detections: of one frame; those with an instance keep it.
        clouds: where they are; None where depth is missing.
        known: instance → where it is expected.
        axis_m: where the robot stands.
        config: how far off a thing may be, and how much of what a view shows must be known.
        reserved: names that nothing gets for its place.
        looks: mean colour of each, where it is known.
    """
    shown = dict(enumerate(looks))
    names = [d.instance or "" for d in detections]
    taken = {n for n in names if n}
    open_ones = [i for i, n in enumerate(names) if not n]
    for category in sorted({detections[i].category for i in open_ones}):
        mine = [i for i in open_ones if detections[i].category == category]
        mine.sort(key=lambda i: _order(clouds[i]))
        options = [n for n in sorted(known) if category_of(n) == category and n not in taken]
        located = {i: (cloud, shown.get(i)) for i in mine if (cloud := clouds[i]) is not None}
        there = {n: known[n] for n in options}
        for i, name in _assigned(located, there, np.asarray(axis_m), config).items():
            names[i] = name
            taken.add(name)
        used = {n for n in (*known, *taken, *reserved) if category_of(n) == category}
        for i in mine:
            if not names[i]:
                names[i] = unused(category, used)
                used.add(names[i])
    return names


def unused(category: str, names: set[str]) -> str:
    """The name of a category with the lowest number that nothing has."""
    number = 1
    while f"{category}-{number}" in names:
        number += 1
    return f"{category}-{number}"


def _order(cloud: Cloud | None) -> tuple[float, ...]:
    return (np.inf,) if cloud is None else tuple(float(v) for v in cloud.centroid_m)


def _assigned(
    clouds: Mapping[int, tuple[Cloud, Points | None]],
    known: Mapping[str, Known],
    axis_m: Points,
    config: PerceptionConfig,
) -> dict[int, str]:
    """Detection → what it shows, where something is known there."""
    from scipy.optimize import linear_sum_assignment

    if not clouds or not known:
        return {}
    cost = np.array(
        [[_cost(*c, k, axis_m, config) for k in known.values()] for c in clouds.values()]
    )
    rows, columns = linear_sum_assignment(cost)
    numbers, names = list(clouds), list(known)
    pairs = [(int(r), int(c)) for r, c in zip(rows, columns, strict=True)]
    return {numbers[r]: names[c] for r, c in pairs if cost[r, c] < _NEVER}


def _cost(
    cloud: Cloud, look: Points | None, known: Known, axis_m: Points, config: PerceptionConfig
) -> float:
    """How little a detection looks like a known thing; `_NEVER` where it is another."""
    if known.only:
        return 0.0
    if known.cells is not None:
        box_m = np.stack([cloud.low_m, cloud.high_m])
        if known.box_m is None or not known.touches(box_m):
            return _NEVER
        share = _shared(cloud.points_world_m, known.cells)
        if share >= config.same_surface_share:
            return 1.0 - share
        if share >= _EDGE_SHARE and _is_side(cloud, known):
            return 1.0 - share / 2
        within = filled(box_m + _MARGIN_M, known.box_m + _MARGIN_M) if known.hollow else 0.0
        return 1.0 - within / 2 if within >= config.same_share else _NEVER
    if known.turning:
        here, there = (_around(p, axis_m) for p in (cloud.centroid_m, known.centroid_m))
        away = float(np.linalg.norm(here - there))
    else:
        away = float(np.linalg.norm(cloud.centroid_m - known.centroid_m))
        far = float(np.linalg.norm(cloud.centroid_m - axis_m))
        slack = config.same_gap_m + config.same_gap_share * far
        if known.box_m is not None and _gap_m(cloud, known.box_m) > slack:
            return _NEVER
    if away > config.same_place_m:
        return _NEVER
    size_m = None if known.box_m is None else np.ptp(known.box_m, axis=0)
    return away + config.unlike_m * unlike(cloud.high_m - cloud.low_m, look, size_m, known.look)


def unlike(
    size_m: Points, look: Points | None, other_m: Points | None, other: Points | None
) -> float:
    """How little two things look alike, about 0 to 2: extents and mean colours, where known."""
    colour = 0.0 if look is None or other is None else float(np.linalg.norm(look - other))
    if other_m is None:
        return colour
    one, two = (np.sort(np.maximum(e, _LEAST_M)) for e in (size_m, other_m))
    return colour + float(np.minimum(np.abs(np.log(one / two)).max(), 1.0))


def mean_looks(rgb: Rgb, labels: Labels, count: int) -> list[Points | None]:
    """(3,) mean colour of each label from 0 to 1, None for those that no pixel shows."""
    thin = labels[::_THIN, ::_THIN].ravel() + 1
    pixels = np.bincount(thin, minlength=count + 1)[1 : count + 1]
    colours = rgb[::_THIN, ::_THIN].reshape(-1, 3)
    sums = [np.bincount(thin, colours[:, c], count + 1)[1 : count + 1] for c in range(3)]
    mean = np.stack(sums, axis=1) / np.maximum(pixels, 1)[:, None] / 255.0
    return [m if n else None for m, n in zip(mean, pixels, strict=True)]


def _gap_m(cloud: Cloud, box_m: Points) -> float:
    apart = np.maximum(cloud.low_m - box_m[1], box_m[0] - cloud.high_m)
    return float(np.linalg.norm(np.maximum(apart, 0.0)))


def _is_side(cloud: Cloud, known: Known) -> bool:
    """Whether a view shows a flat side of a piece of which other sides are known.

    Furniture that stands in a row shows the same side.
    """
    size = cloud.high_m - cloud.low_m
    across = int(np.argmin(size))
    flat = size[across] < _FLAT * np.median(size)
    known_m = np.zeros(3) if known.box_m is None else np.ptp(known.box_m, axis=0)
    return bool(flat and known_m[across] > 2 * max(size[across], _CELL_M))


def of_one_piece(
    names: Sequence[str], clouds: Sequence[Cloud | None], known: Mapping[str, Known]
) -> dict[str, str]:
    """Names for a part of a piece of furniture → the name of the piece, of which a view shows both.

    Args:
        names: of a frame's detections; what a frame shows apart is not one.
        clouds: where they are.
        known: what is known with this frame.
    """
    found: dict[str, str] = {}
    for name, cloud in zip(names, clouds, strict=True):
        whole = known.get(name)
        if cloud is None or whole is None or whole.cells is None:
            continue
        for other, part in known.items():
            if other in names or other in found or category_of(other) != category_of(name):
                continue
            if part.cells is None or part.box_m is None or not whole.touches(part.box_m):
                continue
            if _share_of(part.cells, whole.cells) >= _PART_SHARE:
                found[other] = name
    return found


def _around(point_m: Points, axis_m: Points) -> Points:
    """How far from the robot's axis, and how high."""
    return np.array([np.linalg.norm(point_m[:2] - axis_m[:2]), point_m[2]])


def _cells(points_m: Points) -> Cells:
    return np.unique(_keys(points_m))


def _box(points_m: Points) -> Points:
    return np.stack([points_m.min(axis=0), points_m.max(axis=0)])


def _keys(points_m: Points) -> Cells:
    cell = np.floor(points_m / _CELL_M).astype(np.int64) + (1 << (_BITS - 1))
    keys: Cells = (cell[:, 0] << 2 * _BITS) + (cell[:, 1] << _BITS) + cell[:, 2]
    return keys


def _shared(points_m: Points, cells: Cells) -> float:
    """The larger of the shares that what is seen and what is known have of each other."""
    seen = _cells(points_m)
    return max(_share_of(seen, cells), _share_of(cells, seen))


def _share_of(some: Cells, others: Cells) -> float:
    """The share of some cells that have one of the others beside them."""
    thin = some[:: max(1, len(some) // _SAMPLES)]
    near = thin[:, None] + _AROUND[None, :]
    at = np.minimum(np.searchsorted(others, near), len(others) - 1)
    return float((others[at] == near).any(axis=1).mean())
