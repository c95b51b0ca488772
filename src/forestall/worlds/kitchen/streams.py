"""Named random streams of one scene: what one of them draws never changes what another draws.

`model` makes them; `plans`, `contents`, `stocking` and `changes` draw from them, and from those of
`chance` what happens while a robot works there. A stream belongs
to an axis of variety (`needs.AXES`) or to nothing that varies alone (places). Which
layout is being tried enters the streams of the room and of places, not those of looks, so that a
scene that needs its second layout keeps its colours.
"""

from __future__ import annotations

import zlib
from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from forestall.types.scene import SceneNeeds

_OF_THE_SEED = frozenset({"colours", "light", "clutter"})
"""Axes whose draws stay the same whichever layout of the seed is tried."""


@dataclass(frozen=True, slots=True)
class Streams:
    """The random streams of one seed.

    Args:
        seed: of the scene.
        attempt: which layout is tried.
        numbers: axis → number of its variation; 0 is the undisturbed scene's.
    """

    seed: int
    attempt: int = 0
    numbers: Mapping[str, int] = field(default_factory=dict)

    def __call__(self, axis: str, *of: str | int) -> np.random.Generator:
        """A new generator for an axis and what it is drawn for, the same each time."""
        attempt = 0 if axis in _OF_THE_SEED else self.attempt
        name = zlib.crc32("/".join(map(str, (axis, *of))).encode())
        return np.random.default_rng([self.seed, attempt, self.numbers.get(axis, 0), name])

    def varied(self, axis: str) -> bool:
        """Whether an axis is drawn anew."""
        return self.numbers.get(axis, 0) != 0

    def without(self, axis: str) -> Streams:
        """The same streams with one axis as in the undisturbed scene."""
        return replace(self, numbers={a: n for a, n in self.numbers.items() if a != axis})


def chance(needs: SceneNeeds, seed: int) -> Streams:
    """The streams of what happens by chance in a scene, the same with and without a scenario.

    Scenes of one seed that are made for different tasks have different ones.
    """
    made_for = " ".join(sorted(n.id for n in (needs.undisturbed or needs).objects))
    return Streams(zlib.crc32(f"{seed} {made_for}".encode()))
