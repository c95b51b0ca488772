"""What the memory of a scene lets go: one thing under two names, things long lost or too many.

Called by `fuse.py` on all that is remembered. A tracker that gives the same things new names at
every look would else fill the memory with things that are nowhere.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable

import numpy as np

from forestall.domain.model import LOCATED, Domain
from forestall.perception.config import PerceptionConfig
from forestall.perception.geometry import filled
from forestall.perception.surfaces import SURFACE, fixed
from forestall.perception.tracks import Track
from forestall.types.facts import Change
from forestall.types.graph import Seen

Tracks = dict[str, Track]


def remove(tracks: Tracks, name: str, heir: str | None = None) -> None:
    """Take a thing out; what rests in or on it then rests in or on `heir`."""
    del tracks[name]
    for child in tracks.values():
        if child.parent is not None and child.parent[1] == name:
            child.parent = None if heir is None else (child.parent[0], heir)


def doubt(tracks: Tracks, changes: Iterable[Change], succeeded: bool, domain: Domain) -> None:
    """Forget what was read of some states, until they are read again.

    Until then they are presumed to be what they were meant to become, or what they were before if
    what should have changed them is said to have failed. A thing that was to turn into others is
    nowhere until it is seen. Where one was put is what little of it can be seen there must not
    contradict.
    """
    for name, attribute, before, after in changes:
        if name not in tracks:
            continue
        if attribute == LOCATED:
            if succeeded:
                tracks[name].lose()
        elif attribute in domain.containing:
            tracks[name].meant = (attribute, after) if succeeded else None
        else:
            tracks[name].states.pop(attribute, None)
            tracks[name].sure.pop(attribute, None)
            tracks[name].presumed[attribute] = after if succeeded else before


def merge_renamed(
    tracks: Tracks,
    gone: Collection[str],
    fresh: Collection[str],
    config: PerceptionConfig,
) -> None:
    """Where a thing was and is not seen, a new one of its category stands: it has another name now.

    Two cannot be at one place. The new name stays, since it is the one that whoever gave it knows;
    what is known of the old one's states goes with it.

    Args:
        tracks: by name.
        gone: located before, and not seen now.
        fresh: seen now for the first time.
        config: how much of the smaller box both must share.
    """
    for old in sorted(gone):
        alike = [n for n in sorted(fresh) if tracks[n].category == tracks[old].category]
        shares = {n: _shared(tracks[old], tracks[n]) for n in alike}
        new = max(alike, key=lambda n: shares[n], default=None)
        if new is not None and shares[new] >= config.same_share:
            _inherit(tracks[new], tracks[old])
            remove(tracks, old, new)


def join(tracks: Tracks, part: str, whole: str) -> None:
    """Two things are one: what is known of the larger stays, under the name of the whole."""
    if part not in tracks:
        return
    one, other = tracks[part], tracks.get(whole)
    remove(tracks, part, whole)
    if other is None or _size(one) > _size(other):
        if other is not None:
            _inherit(one, other)
            one.parent, one.first_seen_s = other.parent, other.first_seen_s
        one.id, tracks[whole] = whole, one
    else:
        _inherit(other, one)


def _inherit(track: Track, old: Track) -> None:
    """What was known of a thing under another name."""
    track.remember(old)
    track.interior_seen |= old.interior_seen
    track.shown = np.union1d(track.shown, old.shown)


def _size(track: Track) -> int:
    return 0 if track.points_world_m is None else len(track.points_world_m)


def give_way(
    tracks: Tracks, seen: Collection[str], domain: Domain, config: PerceptionConfig
) -> set[str]:
    """Surfaces are taken out where furniture is seen in their place, in this view or another.

    Returns:
        Their names.
    """
    kinds = {n: tracks[n].category for n in sorted(seen)}
    furniture = [n for n, c in kinds.items() if c != SURFACE and fixed(domain, c)]
    gone: set[str] = set()
    for name in [n for n, t in sorted(tracks.items()) if t.category == SURFACE]:
        heir = next((n for n in furniture if _lies_in(tracks[name], tracks[n], config)), None)
        if heir is not None:
            remove(tracks, name, heir)
            gone.add(name)
    return gone


def _lies_in(surface: Track, track: Track, config: PerceptionConfig) -> bool:
    """Whether most of what is known of one thing lies within the box of another."""
    p = surface.points_world_m
    if p is None or track.points_world_m is None:
        return False
    within = (p >= track.low_m - config.surface_m) & (p <= track.high_m + config.surface_m)
    return float(within.all(axis=1).mean()) >= config.covered_share


def let_go(tracks: Tracks, kept: Collection[str], config: PerceptionConfig) -> tuple[str, ...]:
    """Of each category all but a few lost things, and what is over the budget.

    Args:
        tracks: by name.
        kept: what is seen, held, or was just moved.
        config: how many are remembered.

    Returns:
        What there was no room for any more: unlocated things first, then unobserved ones, those
        that were seen longest ago first.
    """
    lost: dict[str, list[Track]] = {}
    for name, track in tracks.items():
        if track.points_world_m is None and name not in kept:
            lost.setdefault(track.category, []).append(track)
    for some in lost.values():
        newest = sorted(some, key=lambda t: (-t.last_seen_s, t.id))
        for track in newest[config.max_lost :]:
            remove(tracks, track.id)
    may_go = sorted((t for n, t in tracks.items() if n not in kept), key=_order)
    over = may_go[: max(0, len(tracks) - config.max_things)]
    for track in over:
        remove(tracks, track.id)
    return tuple(t.id for t in over)


def _order(track: Track) -> tuple[bool, bool, float, str]:
    located = track.points_world_m is not None
    return (located, track.seen is not Seen.UNOBSERVED, track.last_seen_s, track.id)


def _shared(one: Track, other: Track) -> float:
    """The volume that two boxes share, as a share of the smaller one's."""
    if one.points_world_m is None or other.points_world_m is None:
        return 0.0
    return filled(np.stack([one.low_m, one.high_m]), np.stack([other.low_m, other.high_m]))
