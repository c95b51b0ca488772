"""Names that perception itself gives: to what is felt in the hand, found again, or pointed at.

Called by the perceiver before and by `fuse.py` after an observation is taken in; where a segmenter
tracks, and the hand knows a name, nothing here changes anything.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import replace

import numpy as np

from forestall.domain.model import Domain
from forestall.perception.config import PerceptionConfig
from forestall.perception.forgetting import Tracks
from forestall.perception.naming import Known, of_one_piece, unlike, unused
from forestall.perception.surfaces import fixed
from forestall.perception.tracks import Track, View, middle, riding
from forestall.perception.unproject import Points
from forestall.types.facts import by_number, category_of, is_instance
from forestall.types.graph import Relation
from forestall.types.observation import GripperState, Observation, Vec3

_POINTED_M = 0.07  # a part that shows of a thing may lie so far from the middle that is pointed at


def _named(
    hand: GripperState, tracks: Tracks, former: str | None, domain: Domain, used: set[str]
) -> GripperState:
    """A hand with a name for what it holds, where it only knows of which kind that is.

    What it held before, else the nearest thing of the kind, else a new one with no name in `used`.
    """
    return replace(
        hand,
        holding=_felt(hand, tracks, former, domain, used),
        released=former if _is_kind(hand.released, former, domain) else hand.released,
    )


def _is_kind(name: str | None, thing: str | None, domain: Domain) -> bool:
    """Whether a name is the category of a thing and no more."""
    if name is None or thing is None or is_instance(name):
        return False
    return domain.canonical(name) == category_of(thing)


def _felt(
    hand: GripperState, tracks: Tracks, former: str | None, domain: Domain, used: set[str]
) -> str | None:
    name = hand.holding
    if name is None or is_instance(name) or name in tracks or domain.find(name) is None:
        return name
    if _is_kind(name, former, domain):
        return former
    category = domain.canonical(name)
    place = np.asarray(hand.position_world_m)
    alike = [t for t in tracks.values() if t.category == category]
    near = min(alike, key=lambda t: (_away(t, place), t.id), default=None)
    return unused(category, used) if near is None else near.id


def _away(track: Track, place: Points) -> float:
    lost = track.points_world_m is None
    return float("inf") if lost else float(np.linalg.norm(track.centroid_m - place))


def known(
    category: str,
    points_m: Points,
    centroid_m: Points,
    domain: Domain,
    kinds: Collection[str],
    look: Points | None = None,
) -> Known:
    """Where a thing of a category is expected of which some points are known.

    `kinds`: categories for whose things a name is looked for; others are not told apart.
    """
    if category not in kinds:
        return Known(centroid_m)
    found = Known.of(points_m, centroid_m, fixed(domain, category), look)
    ground, encloses = domain.roles.ground, domain.roles.encloses
    return replace(
        found,
        only=ground is not None and domain.is_a(category, ground),
        hollow=encloses is not None and domain.is_a(category, encloses),
    )


def expected(
    tracks: Tracks, observation: Observation, domain: Domain, kinds: Collection[str]
) -> dict[str, Known]:
    """Where everything located is expected now.

    What a hand holds or has let go, and what is in or on it, is where the hand says. `kinds` are
    the categories for whose things a name is looked for.
    """
    found = {
        name: known(t.category, t.points_world_m, t.centroid_m, domain, kinds, t.look)
        for name, t in tracks.items()
        if t.points_world_m is not None
    }
    for hand in observation.hands:
        for name, place, turning in (
            (hand.released, hand.released_world_m, False),
            (hand.holding, hand.position_world_m, True),
        ):
            if name is None or place is None or name not in tracks:
                continue
            at, track = np.asarray(place, dtype=np.float64), tracks[name]
            offset = at - middle(track)
            for rider in riding(tracks, name):
                if rider in found:
                    there = found[rider].centroid_m + offset
                    found[rider] = Known(there, turning=turning, look=found[rider].look)
            found[name] = Known(at, turning=turning, look=track.look)
    return found


def join_parts(
    view: View, places: dict[str, Known], tracks: Tracks, apart: Sequence[Collection[str]]
) -> dict[str, str]:
    """Names of furniture that turns out to be a part of other furniture → the name of both.

    Of two names the one that was known first stays: it is the one that plans speak of.

    Args:
        view: shows both.
        places: where everything is expected; changed.
        tracks: what was known before.
        apart: names of each view of this moment: what one view shows twice is two things.
    """
    parts: dict[str, str] = {}
    for one, other in of_one_piece(view.ids, view.clouds, places).items():
        if other not in view.guessed or any(one in ids and other in ids for ids in apart):
            continue
        whole, part = sorted((one, other), key=lambda n: _since(n, tracks))
        if part in places and whole in places:
            parts[part] = whole
            places[whole] = places[whole].joined(places.pop(part))
    return parts


def _since(name: str, tracks: Tracks) -> tuple[float, str, int]:
    """Since when a name is known: what has none yet is the newest."""
    track = tracks.get(name)
    return (float("inf") if track is None else track.first_seen_s, *by_number(name))


def settled(
    tracks: Tracks,
    relations: Sequence[Relation],
    fresh: Collection[str],
    told: Sequence[tuple[str, Vec3]],
    domain: Domain,
    config: PerceptionConfig,
) -> list[Relation]:
    """Relations once new names have given way to those of lost things, and to what was pointed at.

    Args:
        tracks: by name; changed.
        relations: in the names that they had.
        fresh: named by perception in this observation for the first time.
        told: names that somebody gave to what is at a point.
        domain: tells what does not move.
        config: how much a thing's look counts.
    """
    names = _found_again(tracks, fresh, domain, config)
    relations = _renamed(relations, names)
    return _renamed(relations, _pointed_at(tracks, told, domain))


def _found_again(
    tracks: Tracks, fresh: Collection[str], domain: Domain, config: PerceptionConfig
) -> dict[str, str]:
    """New names → those of lost things of their kind that they must be, which they now bear.

    Of several that it can be a thing is the one that was nearest, and that looks most like it.
    """
    from scipy.optimize import linear_sum_assignment

    names: dict[str, str] = {}
    kinds = {tracks[n].category for n in fresh if n in tracks}
    for category in sorted(k for k in kinds if not domain.is_a(k, domain.roles.fixture)):
        new = sorted(n for n in fresh if n in tracks and tracks[n].category == category)
        lost = [
            t
            for _, t in sorted(tracks.items())
            if t.category == category and t.points_world_m is None and not t.vague
        ]
        if not lost:
            continue
        gaps = [[_unlikely(tracks[n], t, config) for t in lost] for n in new]
        for row, column in zip(*linear_sum_assignment(np.array(gaps)), strict=True):
            names[new[row]] = lost[column].id
    for name, old in names.items():
        tracks[name].remember(tracks[old])
        del tracks[old]
    _rename(tracks, names)
    return names


def _unlikely(new: Track, lost: Track, config: PerceptionConfig) -> float:
    """How little a new thing is likely to be a lost one."""
    away = float(np.linalg.norm(new.centroid_m - lost.centroid_m))
    sizes = new.high_m - new.low_m, lost.high_m - lost.low_m
    return away + config.unlike_far_m * unlike(sizes[0], new.look, sizes[1], lost.look)


def _pointed_at(tracks: Tracks, told: Sequence[tuple[str, Vec3]], domain: Domain) -> dict[str, str]:
    """Names → those that somebody gave to the same things, which they now bear."""
    names: dict[str, str] = {}
    for name, point in told:
        if name in tracks:
            continue
        at, category = np.asarray(point), category_of(domain.canonical(name))
        away = {
            n: float(np.linalg.norm(np.maximum(np.maximum(t.low_m - at, at - t.high_m), 0.0)))
            for n, t in sorted(tracks.items())
            if t.category == category and t.points_world_m is not None and n not in names
        }
        nearest = min(
            away,
            key=lambda n: (away[n], float(np.linalg.norm(middle(tracks[n]) - at))),
            default=None,
        )
        if nearest is not None and away[nearest] <= _POINTED_M:
            names[nearest] = name
    _rename(tracks, names)
    return names


def _rename(tracks: Tracks, names: dict[str, str]) -> None:
    for old, new in names.items():
        track = tracks.pop(old)
        track.id = new
        tracks[new] = track
    for track in tracks.values():
        if track.parent is not None and track.parent[1] in names:
            track.parent = (track.parent[0], names[track.parent[1]])


def _renamed(relations: Sequence[Relation], names: dict[str, str]) -> list[Relation]:
    """Relations in the new names."""
    return [
        Relation(names.get(r.subject, r.subject), r.predicate, names.get(r.object, r.object))
        for r in relations
    ]


def named_hands(
    observation: Observation, tracks: Tracks, former: str | None, domain: Domain
) -> Observation:
    """An observation in which every hand has a name for what it holds."""
    used = {*tracks, *(n for n, _ in observation.told)}
    both = (observation.gripper, *observation.others)
    hands = [_named(h, tracks, former, domain, used) for h in both]
    return replace(observation, gripper=hands[0], others=tuple(hands[1:]))
