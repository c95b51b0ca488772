"""One scene over time: the newest view wins, what ought to be visible and is not has gone.

What could not have been seen is kept and said to be remembered or unobserved. The robot's own
sense of its hand decides what is held. Called by `perceiver.py`; calls `tracks.py` for what views
say about remembered places, and `support.py`, `relations.py`, `blocking.py` for relations.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence

import numpy as np

from forestall.domain.model import Domain
from forestall.domain.truth import is_shut
from forestall.perception.blocking import blocking, cuts
from forestall.perception.config import PerceptionConfig
from forestall.perception.forgetting import doubt, give_way, let_go, merge_renamed, remove
from forestall.perception.geometry import Stack, Thing
from forestall.perception.own_names import settled
from forestall.perception.relations import directions
from forestall.perception.sightings import gather, placing, take_states, unlocated
from forestall.perception.support import Parent, circular, parents
from forestall.perception.surfaces import SURFACE, fixed
from forestall.perception.tracks import (
    Fate,
    Fates,
    Track,
    View,
    expected_pixels,
    fates,
    gap_m,
    interior_observed,
    middle,
    riding,
    thinned,
    vec,
)
from forestall.perception.unproject import Points, robust_box
from forestall.perception.unseen import Taken, look_over, unseen_m2
from forestall.types.facts import Change, Truth, category_of
from forestall.types.graph import Box, ObjectNode, Relation, SceneGraph, Seen
from forestall.types.observation import GripperState, Observation, Vec3

_STILL_M = 0.03


class SceneMemory:
    """Everything believed about the scene; `integrate` changes it, `graph` states it."""

    def __init__(self, domain: Domain, config: PerceptionConfig) -> None:
        self._domain = domain
        self._changing = tuple(a.name for a in domain.attributes.values() if a.in_hand)
        self._config = config
        self.reset()

    def reset(self) -> None:
        """Forget everything."""
        self.tracks: dict[str, Track] = {}
        self.held: str | None = None
        self._hands: tuple[GripperState, ...] = ()
        self._relations: list[Relation] = []
        self.forgotten: tuple[str, ...] = ()  # in the newest observation, for want of room

    def doubt(self, changes: Iterable[Change], succeeded: bool) -> None:
        """See `forgetting.doubt`."""
        doubt(self.tracks, changes, succeeded, self._domain)

    # --- integration ----------------------------------------------------------------------------

    def integrate(self, observation: Observation, views: Sequence[View]) -> None:
        """Take in one observation: all its views show the world at one time."""
        before = [self.tracks[i] for i in sorted(self.tracks)]
        fate = fates(before, views, self._config)
        self._hands = observation.hands
        former = self.held
        self.held = observation.gripper.holding if observation.gripper.told else None
        places = {t.id: middle(t) for t in before if t.points_world_m is not None}
        seen = self._take_in(views, fate, observation.time_s)
        for hand in self._hands:
            if hand.holding is not None:
                self._hold(hand.holding, hand.position_world_m, seen)
        put = self._put_down(observation.gripper, seen)
        moved = put | self._carry(places, seen | put)
        if former is not None and former != self.held and former not in seen | put:
            self._drop_from_memory(former, seen)
        kept = seen | moved | {h.holding for h in self._hands if h.holding is not None}
        kept |= set(unlocated(views))
        was = {t.id for t in before}
        gone = {n for n in was - kept if not self._is_fixture(self.tracks[n].category)}
        merge_renamed(self.tracks, gone, seen - was, self._config)
        seen -= give_way(self.tracks, seen, self._domain, self._config)
        self._forget_gone(fate, seen, moved, views)
        self._replace_cut(seen, fate, former, observation.time_s)
        self.forgotten = let_go(self.tracks, kept, self._config)
        self._relate(seen, views)
        self._mark(seen, fate, views)
        guessed = {n for v in views for n in v.guessed if n in seen - was}
        told, rules = observation.told, (self._domain, self._config)
        self._relations = settled(self.tracks, self._relations, guessed, told, *rules)

    def _take_in(self, views: Sequence[View], fate: Mapping[str, Fates], time_s: float) -> set[str]:
        """Update what is in view; returns its ids."""
        found = gather(views)
        movables = {n: f for n, f in found.items() if not self._is_fixture(f[-1].category)}
        shown = placing(movables, self.held, riding(self.tracks, self.held), self._config.ring_m)
        shown |= {n: f for n, f in found.items() if n not in movables}
        for name in sorted(shown):
            track = self.tracks.get(name)
            if track is None:
                track = Track(name, shown[name][-1].category, first_seen_s=time_s)
                self.tracks[name] = track
            points = [s.cloud.points_world_m for s in shown[name]]
            self._place(track, np.concatenate(points), fate.get(name))
            track.pixels = found[name][-1].cloud.pixels
            track.last_seen_s = time_s
            track.sightings += len(shown[name])
            movable, held = name in movables, name == self.held
            take_states(track, found[name], held, self._changing, movable, self._config)
        self._take_note(views, time_s)
        return set(shown)

    def _take_note(self, views: Sequence[View], time_s: float) -> None:
        """Things that are seen and have no place: their names and states are known, no more."""
        for track in self.tracks.values():
            track.vague = track.vague and track.points_world_m is None
        for name, (view, label) in sorted(unlocated(views).items()):
            track = self.tracks.setdefault(
                name, Track(name, view.categories[label], first_seen_s=time_s)
            )
            track.vague = track.points_world_m is None
            track.pixels = int(np.count_nonzero(view.labels == label))
            track.last_seen_s = time_s
            told = {a: v for a, v in view.states[label].items() if v is not None}
            track.states.update(told)
            track.sure.update((a, view.sure[label].get(a, 1.0)) for a in told)

    def _place(self, track: Track, fresh: Points, fate: Fates | None) -> None:
        """Set a track's cloud from the newest views and what they leave standing of the old."""
        old = track.points_world_m
        track.unmoved = False
        fixture = self._is_fixture(track.category)
        voxel = self._config.fixture_voxel_m if fixture else self._config.voxel_m
        if old is not None and fate is not None:
            kept = old[fate != Fate.GONE]
            track.unmoved = fixture or self._unmoved(track, fate)
            if track.unmoved:
                fresh = np.concatenate([fresh, kept])
        track.points_world_m = thinned(fresh, voxel)
        track.low_m, track.high_m = robust_box(track.points_world_m, self._config.box_percentile)
        track.centroid_m = track.points_world_m.mean(axis=0)

    def _unmoved(self, track: Track, fate: Fates) -> bool:
        """Whether a movable thing is where it was: what can be seen of the old place agrees."""
        agree = int(np.count_nonzero(fate == Fate.CONFIRMED))
        differ = int(np.count_nonzero(fate == Fate.GONE))
        still = agree >= self._config.unmoved_share * (agree + differ)
        return agree > 0 and still and track.id != self.held

    def _hold(self, held: str, hand_m: Vec3, seen: set[str]) -> None:
        track = self.tracks.get(held)
        if track is None:
            track = Track(held, category_of(self._domain.canonical(held)))
            self.tracks[held] = track
        track.parent = track.meant = None
        if held not in seen:
            hand = np.asarray(hand_m, dtype=np.float64)
            if track.points_world_m is None:
                track.points_world_m = hand[None, :]
                track.low_m = track.high_m = track.centroid_m = hand
            else:
                track.move(hand - middle(track))

    def _put_down(self, gripper: GripperState, seen: set[str]) -> set[str]:
        """What the arm let go is where it let go, even where no view shows it."""
        track = self.tracks.get(gripper.released or "")
        if track is None or track.id in seen or gripper.released_world_m is None:
            return set()
        place = np.asarray(gripper.released_world_m, dtype=np.float64)
        if track.points_world_m is None:
            return set()
        track.move(place - middle(track))
        return {track.id}

    def _carry(self, places: Mapping[str, Points], seen: set[str]) -> set[str]:
        """Move what rests in or on something that moved; returns what was moved unseen."""
        moved: set[str] = set()
        pending = [
            (name, middle(t) - places[name])
            for name, t in sorted(self.tracks.items())
            if name in places
            and t.points_world_m is not None
            and (name in seen or name == self.held)
            and not self._is_fixture(t.category)
        ]
        while pending:
            name, offset = pending.pop()
            if float(np.linalg.norm(offset)) < _STILL_M and name != self.held:
                continue
            for child in self._children(name):
                if child.id not in seen and child.id not in moved:
                    child.move(offset)
                    moved.add(child.id)
                    pending.append((child.id, offset))
        return moved

    def _children(self, name: str) -> list[Track]:
        return [t for _, t in sorted(self.tracks.items()) if t.parent and t.parent[1] == name]

    def _drop_from_memory(self, former: str, seen: set[str]) -> None:
        """What is no longer held and not in view may be anywhere, with what is in it."""
        self.tracks[former].lose()
        for child in self._children(former):
            if child.id not in seen:
                child.points_world_m = None

    def _forget_gone(
        self,
        fate: Mapping[str, Fates],
        seen: set[str],
        moved: set[str],
        views: Sequence[View],
    ) -> None:
        held = {h.holding for h in self._hands}
        enough = self._config.expected_pixels * self._config.min_pixels
        for name, track in sorted(self.tracks.items()):
            spared = name in seen or name in moved or name in held
            if spared or name not in fate or self._is_fixture(track.category):
                continue
            if track.points_world_m is None or self._shut_in(track):
                continue
            share = float((fate[name] == Fate.GONE).mean())
            if share >= self._config.gone_share and expected_pixels(track, views) >= enough:
                track.lose()

    def _replace_cut(
        self, seen: set[str], fate: Mapping[str, Fates], former: str | None, time_s: float
    ) -> None:
        """Remove things that turned into other things (slices, a cracked egg) in view."""
        fresh = [self.tracks[i] for i in sorted(seen) if self.tracks[i].first_seen_s == time_s]
        for name in sorted(self.tracks):
            track = self.tracks[name]
            if name in seen or name == self.held:
                continue
            becomes = self._domain.becomes(track.category)
            pieces = [t for t in fresh if t.category in becomes]
            if not pieces:
                continue
            gone = track.points_world_m is None or bool(np.any(fate.get(name, 0) == Fate.GONE))
            near = any(gap_m(track, p) <= self._config.same_place_m for p in pieces)
            if gone and (near or name == former or track.points_world_m is None):
                remove(self.tracks, name)

    # --- relations and truth values -------------------------------------------------------------

    def _relate(self, seen: set[str], views: Sequence[View]) -> None:
        stack = Stack.of(
            [
                Thing(t.id, t.category, t.points_world_m, t.low_m, t.high_m, self._closed(t))
                for t in self.tracks.values()
                if t.points_world_m is not None
            ]
        )
        homeless = {n for n, t in self.tracks.items() if t.parent is None and n not in seen}
        held = {h.holding for h in self._hands if h.holding is not None}
        subjects = (seen | homeless) - held
        meant = {n: place for n in subjects if (place := self.tracks[n].meant) is not None}
        found = parents(stack, subjects, meant, self._domain, self._config)
        for name in sorted(subjects):
            track = self.tracks[name]
            track.parent = found.get(name) or self._former_parent(track)
            track.meant = None if name in seen else track.meant
        links = {n: t.parent for n, t in self.tracks.items() if t.parent is not None}
        for name in circular(links, found):
            self.tracks[name].parent = None
            del links[name]
        relations = [Relation(n, predicate, r) for n, (predicate, r) in links.items()]
        if self._domain.roles.holding is not None:
            relations += [
                Relation(h.holding, self._domain.roles.holding, h.name)
                for h in self._hands
                if h.holding is not None
            ]
        newest = [v for v in views if not v.frame.colour_only] or views
        camera = newest[-1].frame.camera_to_world
        skip = {n for n, t in self.tracks.items() if self._is_large_support(t.category)}
        skip |= held
        tied = [(n, r) for n, (_, r) in links.items()]
        relations += directions(stack, camera, skip, tied, self._config)
        eye = (float(camera[0, 3]), float(camera[1, 3]), float(camera[2, 3]))
        cut = self._cut_shares(views)
        relations += blocking(stack, links, eye, cut, self._domain, self._config)
        self._relations = relations

    def _former_parent(self, track: Track) -> Parent | None:
        """Keep a relation that the newest view cannot show again.

        That is so for what did not move (its foot may be out of the picture) and for what is still
        at its parent (on a held plate).
        """
        if track.parent is None or track.parent[1] not in self.tracks:
            return None
        parent = self.tracks[track.parent[1]]
        if parent.points_world_m is None:
            return None
        close = track.unmoved or gap_m(track, parent) <= self._config.ring_m
        return track.parent if close else None

    def _cut_shares(self, views: Sequence[View]) -> dict[tuple[str, str], float]:
        shares: dict[tuple[str, str], float] = {}
        for view in views:
            count = len(view.ids)
            cut = cuts(view.labels, view.frame.depth_m, count, self._config.depth_edge_m)
            for b, a in np.argwhere(cut >= self._config.occlusion_share):
                pair = (view.ids[b], view.ids[a])
                shares[pair] = max(shares.get(pair, 0.0), float(cut[b, a]))
        return shares

    def _mark(self, seen: set[str], fate: Mapping[str, Fates], views: Sequence[View]) -> None:
        for name, track in self.tracks.items():
            if self._domain.encloses(track.category):
                shut = is_shut(self._domain, track.category, track.states)
                if shut is Truth.TRUE:
                    track.interior_seen = False
                elif shut is Truth.FALSE and name in seen:
                    track.interior_seen |= interior_observed(track, views, self._config)
        look_over(self.tracks.values(), views, self._domain, self._config)
        held = {h.holding for h in self._hands}
        noted = {n for n in unlocated(views) if self.tracks[n].vague}
        for name, track in self.tracks.items():
            codes = fate.get(name)
            if name in seen or name in noted:
                track.seen = Seen.VISIBLE
            else:
                covered = codes is not None and float((codes == Fate.OCCLUDED).mean()) > 0.5
                lost = track.points_world_m is None
                out_of_sight = lost or covered or self._shut_in(track)
                track.seen = Seen.UNOBSERVED if out_of_sight else Seen.REMEMBERED
            if name in held and name not in seen:
                track.seen = Seen.REMEMBERED

    def graph(self) -> SceneGraph:
        """The scene as believed now."""
        taken = Taken.of(self.tracks.values())
        nodes = [self._node(t, taken) for t in self.tracks.values()]
        nodes += [
            ObjectNode(h.name, "Gripper", centroid_m=vec(np.asarray(h.position_world_m)))
            for h in self._hands
        ]
        hidden = [
            n
            for n, t in self.tracks.items()
            if t.vague or (self._domain.encloses(t.category) and not t.interior_seen)
        ]
        return SceneGraph(tuple(nodes), tuple(self._relations), hidden=tuple(hidden))

    def _node(self, track: Track, taken: Taken) -> ObjectNode:
        category = self._domain.find(track.category)
        attributes: tuple[str, ...] = () if category is None else category.attributes
        states = {a: track.states.get(a) for a in attributes}
        located = track.points_world_m is not None
        return ObjectNode(
            id=track.id,
            category=track.category,
            states=tuple(states.items()),
            centroid_m=vec(track.centroid_m) if located else None,
            box_m=Box(vec(track.low_m), vec(track.high_m)) if located else None,
            seen=track.seen,
            pixels=track.pixels,
            last_seen_s=track.last_seen_s,
            feature=track.feature,
            presumed=tuple((a, v) for a, v in track.presumed.items() if states.get(a, v) is None),
            unseen_m2=unseen_m2(track, taken, self._domain, self._config),
        )

    # --- small questions ------------------------------------------------------------------------

    def _is_fixture(self, category: str) -> bool:
        return fixed(self._domain, category)

    def _is_large_support(self, category: str) -> bool:
        return category == SURFACE or self._domain.is_open_support(category)

    def _closed(self, track: Track) -> bool:
        return is_shut(self._domain, track.category, track.states) is Truth.TRUE

    def _shut_in(self, track: Track) -> bool:
        """Whether something closed is around it, at any depth."""
        passed = {track.id}
        while track.parent is not None and track.parent[1] in self.tracks:
            track = self.tracks[track.parent[1]]
            if track.id in passed:
                return False
            if self._closed(track):
                return True
            passed.add(track.id)
        return False
