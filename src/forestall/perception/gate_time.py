"""The input gate over time: senses that are dead, clocks that run backwards, things that jump.

`SenseWatch.look` is called once for each observation, in order, by whoever owns a run; it keeps the
last pictures and where small things were. What one observation shows by itself is `gate.py`'s.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field

import numpy as np

from forestall.perception.coarse import Coarse
from forestall.perception.gate_config import GateConfig, WatchConfig
from forestall.perception.unproject import Points
from forestall.types.finding import Finding
from forestall.types.observation import Frame, GripperState, Observation

Places = dict[str, Points]
"""Instance → (2, 3) lower and upper corner of what was seen of it."""


@dataclass(slots=True)
class _Last:
    """The observation before."""

    observation: Observation
    places: Places = field(default_factory=dict)


class SenseWatch:
    """Looks at one observation after the other of one run.

    Args:
        config: what may change.
        gate: the lattice on which pictures are looked at.
    """

    def __init__(self, config: WatchConfig | None = None, gate: GateConfig | None = None) -> None:
        self._config = config or WatchConfig()
        self._gate = gate or GateConfig()
        self.reset()

    def reset(self) -> None:
        """Forget everything: a run begins."""
        self._last: _Last | None = None
        self._equal = 0

    def look(self, observation: Observation) -> tuple[Finding, ...]:
        """What this observation and those before it cannot be together.

        Returns:
            Findings; those that refuse say that the senses are not to be believed now.
        """
        last = self._last
        places = _places(observation, self._gate, self._config)
        now = _Last(observation, places)
        if last is None:
            self._last = now
            return tuple(self._alike(observation.frames))
        findings = [*self._clock(last.observation, observation)]
        if findings:
            return tuple(findings)
        findings += self._alike(observation.frames)
        findings += self._frozen(last.observation, observation)
        findings += self._jumps(last, observation, places)
        self._last = now
        return tuple(findings)

    def _clock(self, last: Observation, now: Observation) -> Iterator[Finding]:
        if not math.isfinite(now.time_s):
            yield Finding("time", f"time_s is {now.time_s}")
        elif now.time_s < last.time_s:
            yield Finding(
                "time",
                f"time runs backwards: {now.time_s:g} s after {last.time_s:g} s; observations must "
                "come in their order",
            )

    def _alike(self, frames: Sequence[Frame]) -> Iterator[Finding]:
        """Two pictures of one observation from different places that are the same picture."""
        for index in range(1, len(frames)):
            one, two = frames[index - 1], frames[index]
            if self._moved(one, two) and _equal(one, two):
                yield Finding("frozen", "the camera turned and its picture did not change", index)

    def _frozen(self, last: Observation, now: Observation) -> Iterator[Finding]:
        """The same pictures again, to the last bit."""
        if len(last.frames) == len(now.frames):
            pairs = list(zip(last.frames, now.frames, strict=True))
        else:  # one look, and one all around: a camera that froze shows one picture in both
            pairs = [(last.frames[-1], frame) for frame in now.frames if last.frames]
        same = [_equal(a, b) for a, b in pairs]
        if not pairs or not all(same):
            self._equal = 0
            return
        gap_s = now.time_s - last.time_s
        if any(self._moved(a, b) for a, b in pairs):
            yield Finding(
                "frozen", "the camera moved and its picture is the same to the last bit: it froze"
            )
        elif gap_s > 0:
            self._equal += 1
            yield Finding(
                "frozen",
                f"the picture has been the same to the last bit {self._equal + 1} times in a row, "
                f"now for {gap_s:.3g} s more: the camera froze, or is a drawing",
                refuses=self._equal >= self._config.most_equal,
            )

    def _moved(self, one: Frame, two: Frame) -> bool:
        off = np.abs(one.camera_to_world - two.camera_to_world)
        shift = float(off[:3, 3].max())
        return shift > self._config.moved_m or float(off[:3, :3].max()) > self._config.turned

    def _jumps(self, last: _Last, now: Observation, places: Places) -> Iterator[Finding]:
        if now.frames and last.observation.frames:
            yield from self._camera(last.observation, now)
        hands = (*last.observation.hands, *now.hands)
        busy = {n for hand in hands for n in (hand.holding, hand.released)}
        both = [
            n
            for n in sorted((places.keys() & last.places.keys()) - busy)
            if not any(self._in_reach(p[n], hands) for p in (places, last.places))
        ]
        off = {n: _gap_m(last.places[n], places[n]) for n in both}
        jumped = [n for n in both if off[n] > self._config.jump_m]
        if not jumped:
            return
        far = ", ".join(f"{n} {off[n]:.2g} m" for n in jumped[:3])
        doubt = len(jumped) >= self._config.jump_share * len(both)
        many = doubt and len(jumped) >= self._config.min_jumps
        what = "the pose of the camera, or the names of things, cannot be believed"
        yield Finding(
            "jump",
            f"{len(jumped)} of {len(both)} things are far from where they were and nothing moved "
            f"them ({far})" + (f": {what}" if many else ""),
            refuses=many,
        )

    def _in_reach(self, place: Points, hands: Sequence[GripperState]) -> bool:
        """Whether the arm may have moved what is there, or what it rides on."""
        spots = [h.position_world_m for h in hands]
        spots += [h.released_world_m for h in hands if h.released_world_m is not None]
        return any(_gap_m(place, np.array([s, s])) < self._config.arm_m for s in spots)

    def _camera(self, last: Observation, now: Observation) -> Iterator[Finding]:
        gap_s = now.time_s - last.time_s
        way = now.frames[-1].camera_to_world[:3, 3] - last.frames[-1].camera_to_world[:3, 3]
        length = float(np.linalg.norm(way))
        if gap_s > 0 and length > self._config.jump_m + self._config.max_speed_m_s * gap_s:
            yield Finding(
                "jump",
                f"the camera went {length:.3g} m in {gap_s:.3g} s: its pose is wrong, or the clock",
            )


def _equal(one: Frame, two: Frame) -> bool:
    """Equal to the last bit; a lattice first, which settles it nearly always."""
    if one is two:
        return True
    if one.rgb.shape != two.rgb.shape or not np.array_equal(
        one.rgb[::16, ::16], two.rgb[::16, ::16]
    ):
        return False
    return np.array_equal(one.rgb, two.rgb) and np.array_equal(one.depth_m, two.depth_m)


def _gap_m(one: Points, two: Points) -> float:
    apart = np.maximum(one[0] - two[1], two[0] - one[1])
    return float(np.linalg.norm(np.maximum(apart, 0.0)))


def _places(observation: Observation, gate: GateConfig, config: WatchConfig) -> Places:
    """Where small named things are seen, from the newest picture that shows them."""
    found: Places = {}
    for frame in observation.frames:
        if frame.colour_only:
            continue
        look = Coarse.of(frame, None, gate.rows)
        cells = look.known & (look.labels >= 0)
        owner, points = look.labels[cells], look.points_world_m[cells]
        order = np.argsort(owner, kind="stable")
        owner, points = owner[order], points[order]
        starts = np.flatnonzero(np.diff(owner, prepend=-1))
        ends = np.append(starts[1:], len(owner))[: len(starts)]
        for start, end in zip(starts.tolist(), ends.tolist(), strict=True):
            label = int(owner[start])
            name = look.instances[label]
            if name is None or end - start < config.least_cells or look.cut(label):
                continue
            low, high = np.percentile(points[start:end], (10, 90), axis=0)
            if float((high - low).max()) <= config.small_m:
                found[name] = np.stack([low, high])
    return found
