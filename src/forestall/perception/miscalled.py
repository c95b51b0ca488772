"""Things that one picture calls by another category than the others: they keep their own.

Two things cannot be at one place. Where a view shows something new in the place of something else,
and no view shows both, the detector has called one thing by two names: what more views say counts,
and what was known before counts as somewhat more than one view, if several showed it. So a single
view that calls a thing something else is not believed unless the next observation says the same;
two views are believed at once, since somebody may have put something else there, and so is one
where a thing of that category is known and not seen: it may be that one. What hardly ever was seen
was then never there. What a thing can turn into is no mistake.
Called by the perceiver once all views of an observation have names; calls `tracks.py`.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from forestall.domain.model import Domain
from forestall.perception.forgetting import Tracks, remove
from forestall.perception.surfaces import fixed
from forestall.perception.tracks import View, middle, riding
from forestall.perception.unproject import Points
from forestall.types.observation import GripperState, Vec3

_SAME_SHARE = 0.4  # of the volume that two boxes have together, to be of one thing
_MOVED_M = 0.08  # how far from where the hand says a thing may be that it carried there
_PAD_M = 0.01  # boxes of flat things have hardly any volume
_KNOWN, _EACH = 1.5, 0.75  # views that it weighs to have been known: at most, and for each view
_AGAIN = 1.0  # that it weighs to have been called so in the last observation, too

Corners = tuple[Points, Points]


@dataclass(slots=True)
class _Seen:
    """One name in the views of an observation: where each view shows it."""

    category: str
    boxes: dict[int, Corners]


def called_right(
    views: Sequence[View],
    tracks: Tracks,
    hands: Sequence[GripperState],
    axis_m: Vec3,
    domain: Domain,
) -> list[View]:
    """Views in which a thing bears one name, that of the category which it most likely is.

    Args:
        views: of one observation.
        tracks: what was known before; what a single view called each is noted there, and what
            was never there goes.
        hands: what they hold turns with the robot from view to view; what they let go is there.
        axis_m: where the robot stands.
        domain: tells what can be moved, and what turns into what.
    """
    seen = _seen(views, domain)
    held = [h.holding for h in hands if h.holding is not None]
    turning = {*held, *(r for h in held for r in riding(tracks, h))}
    known = {n: t for n, t in tracks.items() if not fixed(domain, t.category)}
    absent = {t.category for n, t in known.items() if n not in seen}
    carried = _carried({n: t for n, t in tracks.items() if n not in turning}, hands)
    things = _Things.of(seen, known, turning, carried, np.asarray(axis_m), domain)
    names: dict[str, str] = {}
    doubts: dict[str, str] = {}
    never: set[str] = set()
    for new in sorted(n for n, s in seen.items() if n not in tracks and s.category not in absent):
        old = things.in_whose_place(new)
        if old is None or new in names or old in names or old in never:
            continue
        if not _wins(new, old, seen, tracks):
            names[new] = old
            doubts[old] = seen[new].category
        elif old not in tracks:
            names[old] = new
        elif old not in turning and tracks[old].sightings < 2 * len(seen[new].boxes):
            remove(tracks, old, new)
            never.add(old)
    for name, track in tracks.items():
        if name in doubts or name in seen:
            track.doubted = doubts.get(name)
    names = {n: names.get(o, o) for n, o in names.items()}
    categories = {n: tracks[n].category if n in tracks else s.category for n, s in seen.items()}
    categories |= {n: tracks[n].category for n in names.values() if n in tracks}
    return [_renamed(v, names, categories) for v in views] if names else list(views)


def _carried(tracks: Tracks, hands: Sequence[GripperState]) -> dict[str, Points]:
    """What was let go, and what is in or on it: how far it was carried since it was seen."""
    found: dict[str, Points] = {}
    for hand in hands:
        track = tracks.get(hand.released or "")
        if track is not None and track.points_world_m is not None and hand.released_world_m:
            offset = np.asarray(hand.released_world_m) - middle(track)
            found |= dict.fromkeys({track.id, *riding(tracks, track.id)}, offset)
    return found


def _seen(views: Sequence[View], domain: Domain) -> dict[str, _Seen]:
    found: dict[str, _Seen] = {}
    for index, view in enumerate(views):
        for name, category, cloud in zip(view.ids, view.categories, view.clouds, strict=True):
            if cloud is not None and not fixed(domain, category):
                of = found.setdefault(name, _Seen(category, {}))
                of.boxes[index] = (cloud.low_m, cloud.high_m)
    return found


@dataclass(frozen=True, slots=True)
class _Things:
    """Everything movable that is seen or known, with the boxes in which it is.

    Args:
        seen: of this observation.
        boxes: of each thing, in every view and as it was known.
        categories: of each thing.
        turning: what goes round with the robot.
        carried: what was let go, and how far it went.
        axis_m: where that stands.
        domain: what turns into what.
        hulls: (n, 2, 3) around the boxes of each thing, in their order.
    """

    seen: Mapping[str, _Seen]
    boxes: Mapping[str, Sequence[Corners]]
    categories: Mapping[str, str]
    turning: Collection[str]
    carried: Collection[str]
    axis_m: Points
    domain: Domain
    hulls: Points

    @classmethod
    def of(
        cls,
        seen: Mapping[str, _Seen],
        known: Tracks,
        turning: Collection[str],
        carried: Mapping[str, Points],
        axis_m: Points,
        domain: Domain,
    ) -> _Things:
        """What there is."""
        boxes = {name: list(s.boxes.values()) for name, s in sorted(seen.items())}
        categories = {name: s.category for name, s in seen.items()}
        for name, track in sorted(known.items()):
            categories[name] = track.category
            if track.points_world_m is not None:
                way = carried.get(name, np.zeros(3))
                boxes.setdefault(name, []).append((track.low_m + way, track.high_m + way))
        hulls = [
            (np.min([low for low, _ in of], axis=0), np.max([high for _, high in of], axis=0))
            for of in boxes.values()
        ]
        return cls(seen, boxes, categories, turning, carried, axis_m, domain, np.array(hulls))

    def in_whose_place(self, new: str) -> str | None:
        """The thing of another category of which a new name shows the place, None for none."""
        mine = self.seen[new]
        low, high = self.hulls[list(self.boxes).index(new)]
        low, high = low - _MOVED_M, high + _MOVED_M
        near = (self.hulls[:, 0] <= high).all(axis=1) & (self.hulls[:, 1] >= low).all(axis=1)
        shares: dict[str, float] = {}
        for name, close in zip(self.boxes, near, strict=True):
            turns = name in self.turning
            if (close or turns) and name != new and self._may_be(name, mine):
                slack_m = _MOVED_M if name in self.carried else 0.0
                shares[name] = max(
                    _share(box, place, self.axis_m if turns else None, slack_m)
                    for box in mine.boxes.values()
                    for place in self.boxes[name]
                )
        best = max(shares, key=lambda n: shares[n], default=None)
        return best if best is not None and shares[best] >= _SAME_SHARE else None

    def _may_be(self, name: str, mine: _Seen) -> bool:
        """Whether a thing may be what was called otherwise: no view shows both."""
        category, there = self.categories[name], self.seen.get(name)
        if category == mine.category or (there is not None and there.boxes.keys() & mine.boxes):
            return False
        becomes = self.domain.becomes
        return mine.category not in becomes(category) and category not in becomes(mine.category)


def _wins(new: str, old: str, seen: Mapping[str, _Seen], tracks: Tracks) -> bool:
    """Whether a thing is what its new name says."""
    track, views = tracks.get(old), len(seen[old].boxes) if old in seen else 0
    before, after = float(views), float(len(seen[new].boxes))
    if track is not None:
        before += min(_KNOWN, _EACH * track.sightings)
        after += _AGAIN * (track.doubted == seen[new].category)
    return after > before


def _share(one: Corners, other: Corners, axis_m: Points | None, slack_m: float) -> float:
    """The volume that two boxes share, as a share of what they have together.

    With an axis one of them is first turned about it until both lie in one direction, and with
    slack it is moved by so much at most to lie on the other.
    """
    low, high = one[0] - _PAD_M, one[1] + _PAD_M
    if axis_m is not None:
        here, there = (low + high) / 2, (other[0] + other[1]) / 2
        way = there[:2] - axis_m[:2]
        away = float(np.linalg.norm(here[:2] - axis_m[:2]))
        far = float(np.linalg.norm(way))
        if far > 0:
            offset = axis_m[:2] + way * (away / far) - here[:2]
            low, high = low.copy(), high.copy()
            low[:2] += offset
            high[:2] += offset
    way = (other[0] + other[1] - low - high) / 2
    if slack_m > 0 and float(np.linalg.norm(way)) <= slack_m:
        low, high = low + way, high + way
    low_m, high_m = other[0] - _PAD_M, other[1] + _PAD_M
    both = float(np.prod(np.maximum(np.minimum(high, high_m) - np.maximum(low, low_m), 0.0)))
    return both / (float(np.prod(high - low)) + float(np.prod(high_m - low_m)) - both)


def _renamed(view: View, names: Mapping[str, str], categories: Mapping[str, str]) -> View:
    """A view with other names; states were asked of another category and are not known."""
    if not names.keys() & set(view.ids):
        return view
    ids = tuple(names.get(n, n) for n in view.ids)
    return replace(
        view,
        ids=ids,
        categories=tuple(
            categories[name] if old in names else category
            for old, name, category in zip(view.ids, ids, view.categories, strict=True)
        ),
        states=tuple({} if n in names else s for n, s in zip(view.ids, view.states, strict=True)),
        sure=tuple({} if n in names else s for n, s in zip(view.ids, view.sure, strict=True)),
        guessed=frozenset(names.get(n, n) for n in view.guessed),
    )
