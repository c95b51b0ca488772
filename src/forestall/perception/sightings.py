"""Which views of one observation tell where a thing is.

The views of an observation show one moment, but the robot turns between them, and what it holds
turns with it. So what is held, and what rides in or on it, is placed from one view only. Called by
`fuse.py`.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from forestall.perception.config import PerceptionConfig
from forestall.perception.tracks import Track, View
from forestall.perception.unproject import Cloud, Points


@dataclass(frozen=True, slots=True, eq=False)
class Sighting:
    """One thing in one view (`view` is its index).

    `area_m2` is what its mask would cover at the distance of the thing.
    """

    view: int
    category: str
    cloud: Cloud
    states: Mapping[str, str | None]
    sure: Mapping[str, float]
    feature: bytes | None
    look: Points | None = None
    area_m2: float = 0.0


def gather(views: Sequence[View]) -> dict[str, list[Sighting]]:
    """Every located thing's sightings, oldest first."""
    found: dict[str, list[Sighting]] = {}
    for index, view in enumerate(views):
        looks = view.looks or (None,) * len(view.ids)
        of_view = (view.ids, view.categories, view.clouds, view.states, view.sure, view.features)
        for name, category, cloud, states, sure, feature, look in zip(*of_view, looks, strict=True):
            if cloud is not None:
                area_m2 = _area_m2(view, cloud)
                sighting = Sighting(index, category, cloud, states, sure, feature, look, area_m2)
                found.setdefault(name, []).append(sighting)
    return found


def _area_m2(view: View, cloud: Cloud) -> float:
    camera, k = view.frame.camera_to_world, view.frame.intrinsics
    depth_m = float((cloud.centroid_m - camera[:3, 3]) @ camera[:3, 2])
    return cloud.pixels * depth_m**2 / (k.fx * k.fy)


def unlocated(views: Sequence[View]) -> dict[str, tuple[View, int]]:
    """What views show and none locates: the view that shows it largest, and its label there."""
    located = gather(views)
    found: dict[str, tuple[int, View, int]] = {}
    for view in views:
        for label, name in enumerate(view.ids):
            if view.unlocated[label] and name not in located:
                pixels = int(np.count_nonzero(view.labels == label))
                if name not in found or pixels > found[name][0]:
                    found[name] = (pixels, view, label)
    return {name: (view, label) for name, (_, view, label) in found.items()}


def readings(
    sightings: Sequence[Sighting], share: float
) -> tuple[dict[str, str], dict[str, float]]:
    """What one observation says about a thing's states; the larger the view, the more it counts.

    Values, and how sure they are.

    Args:
        sightings: of one thing, at least one.
        share: a view with less than this share of the largest one's pixels says nothing: a handle
            at the edge of a picture is no judge of a mug that another picture shows whole.
    """
    least = share * max(s.cloud.pixels for s in sightings)
    found: dict[str, str] = {}
    sure: dict[str, float] = {}
    for sighting in sorted(sightings, key=lambda s: s.cloud.pixels):
        if sighting.cloud.pixels >= least:
            told = {a: v for a, v in sighting.states.items() if v is not None}
            found.update(told)
            sure.update((a, sighting.sure.get(a, 1.0)) for a in told)
    return found, sure


def take_states(
    track: Track,
    sightings: Sequence[Sighting],
    held: bool,
    changing: Collection[str],
    movable: bool,
    config: PerceptionConfig,
) -> None:
    """Believe what one observation shows of a thing's states and looks.

    Args:
        track: of the thing; changed.
        sightings: of it, at least one.
        held: whether it is in the hand.
        changing: attributes that may be read anew there.
        movable: whether it is a thing of which little shows only where something hides it; a piece
            of furniture often shows a part of itself.
        config: thresholds.
    """
    read, sure = readings(sightings, config.glimpse_share)
    if held:
        read = in_hand(read, track.states, changing)
    area_m2 = max(s.area_m2 for s in sightings)
    if movable and area_m2 < config.sliver_share * track.shown_m2:
        read = contradicting(read, track, ())
    read = contradicting(read, track, outweighing(read, sure, track, config))
    for attribute, value in read.items():
        before = track.sure.get(attribute, 1.0) if track.states.get(attribute) == value else 0.0
        track.sure[attribute] = max(before, sure[attribute])
    track.states.update(read)
    track.shown_m2 = max(track.shown_m2, area_m2)
    for sighting in sorted(sightings, key=lambda s: s.cloud.pixels):
        track.feature = sighting.feature or track.feature
        track.look = track.look if sighting.look is None else sighting.look


def contradicting(read: Mapping[str, str], track: Track, may: Collection[str]) -> dict[str, str]:
    """What is believed of what was read off a glimpse: it confirms, and settles nothing.

    What it contradicts is unobserved from now on, and presumed to be as it was believed to be: the
    rim of a mug behind the edge of a sink is no judge of what is in it.

    Args:
        read: attribute → value.
        track: of the thing; changed.
        may: attributes that may be contradicted.
    """
    believed = believed_of(track)
    denied = {a for a, v in read.items() if a not in may and believed.get(a, v) != v}
    for attribute in denied:
        track.states.pop(attribute, None)
        track.presumed[attribute] = believed[attribute]
    return {a: v for a, v in read.items() if a not in denied}


def believed_of(track: Track) -> dict[str, str]:
    """The states of a thing as they were read last, else as they are presumed to be."""
    return {**track.presumed, **{a: v for a, v in track.states.items() if v is not None}}


def outweighing(
    read: Mapping[str, str], sure: Mapping[str, float], track: Track, config: PerceptionConfig
) -> set[str]:
    """Attributes of which a reading outweighs what was believed, by Bayes' rule.

    What was read a moment ago, or what a skill should have made of it, is so with `steady` times
    the probability that it was read with; the rest is left for what changed unseen and for skills
    that failed. What a look then makes less likely than `outweighs` it does not settle.
    """
    found = set()
    for attribute in read:
        before = config.steady * track.sure.get(attribute, 1.0)
        now = sure[attribute]
        against, supported = (1.0 - now) * before, now * (1.0 - before)
        if supported >= config.outweighs * (supported + against):
            found.add(attribute)
    return found


def in_hand(
    read: Mapping[str, str], known: Mapping[str, str | None], changing: Collection[str]
) -> dict[str, str]:
    """What is believed of what was read off a thing between the fingers.

    They hide half of it and look like stains and cracks, and a thing in the hand does not break,
    get dirty or cook: only attributes in `changing` may contradict what was known before.
    """
    return {a: v for a, v in read.items() if a in changing or known.get(a) in (None, v)}


def placing(
    found: Mapping[str, Sequence[Sighting]], held: str | None, riding: Collection[str], gap_m: float
) -> dict[str, list[Sighting]]:
    """The sightings that tell where each thing is.

    Args:
        found: all sightings of an observation.
        held: what the robot holds.
        riding: what is known to be in or on it; left out where the view that places the held
            thing does not show it.
        gap_m: views of a thing that lie farther apart show it at two places; the one of the view
            that places the held thing counts, else the newest.
    """
    anchor = found[held][-1].view if held is not None and held in found else None
    chosen: dict[str, list[Sighting]] = {}
    for name, sightings in found.items():
        anchored = [s for s in sightings if s.view == anchor]
        if anchor is not None and (name == held or name in riding):
            agreeing = anchored
        else:
            agreeing = _agreeing(sightings, sightings[-1], gap_m)
            if len(agreeing) < len(sightings) and anchored:
                agreeing = _agreeing(sightings, anchored[0], gap_m)
        if agreeing:
            chosen[name] = agreeing
    return chosen


def _agreeing(sightings: Sequence[Sighting], base: Sighting, gap_m: float) -> list[Sighting]:
    return [s for s in sightings if _gap_m(s.cloud, base.cloud) <= gap_m]


def _gap_m(one: Cloud, other: Cloud) -> float:
    apart = np.maximum(one.low_m - other.high_m, other.low_m - one.high_m)
    return float(np.linalg.norm(np.maximum(apart, 0.0)))
