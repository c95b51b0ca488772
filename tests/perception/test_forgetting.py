"""The memory of a scene does not grow without end, whatever names things are given."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from itertools import count

import numpy as np
import pytest

from forestall.domain.load import shipped
from forestall.perception.config import PerceptionConfig
from forestall.perception.forgetting import let_go, merge_renamed
from forestall.perception.given import GivenStateEstimator
from forestall.perception.perceiver import GraphPerceiver
from forestall.perception.segmenters import InstanceSegmenter
from forestall.perception.tracks import Track
from forestall.types.graph import Seen
from forestall.types.observation import Detection, Frame, Intrinsics

from .synthetic import Solid, at, looking, observed

pytestmark = pytest.mark.slow

COUNTER = Solid("CounterTop-1", (-1.0, 0.0, 0.86), (1.0, 0.6, 0.9))
SIZES = {"Mug": (0.085, 0.085, 0.1), "Bowl": (0.15, 0.15, 0.07), "Apple": (0.07, 0.07, 0.07)}
THINGS = 12
CAMERA = Intrinsics.from_vertical_fov(160, 120, 60.0)


class Renaming:
    """Tracks nothing: every thing has another name at every look."""

    name = "renaming"

    def __init__(self) -> None:
        self._numbers = count(100)

    def segment(self, frame: Frame) -> Sequence[Detection]:
        found = InstanceSegmenter().segment(frame)
        return [
            d
            if d.category == "CounterTop"
            else replace(d, instance=f"{d.category}-{next(self._numbers)}")
            for d in found
        ]


def looks(off_m: float, missing: float, number: int) -> Iterator[int]:
    """How many nodes the graph has after each look at a dozen things that do not stay in place."""
    rng = np.random.default_rng(0)
    perceiver = GraphPerceiver(Renaming(), GivenStateEstimator({}), shipped("household"))
    for k in range(number):
        solids = [COUNTER]
        for i in range(THINGS):
            category = list(SIZES)[i % 3]
            x, y = rng.uniform(-off_m, off_m, 2)
            if rng.random() >= missing:
                place = (-0.75 + 0.3 * (i % 6) + x, 0.15 + 0.3 * (i // 6) + y / 2, 0.9)
                solids.append(at(f"{category}-{i // 3 + 1}", *place, SIZES[category]))
        eye = looking((rng.uniform(-0.4, 0.4), -0.7, 1.65), (rng.uniform(-0.6, 0.6), 0.3, 0.9))
        graph = perceiver.perceive(observed(solids, eye, time_s=float(k), camera=CAMERA))
        yield len(graph.nodes)


@pytest.mark.parametrize(("off_m", "missing"), [(0.0, 0.0), (0.02, 0.0), (0.1, 0.3)])
def test_new_names_at_every_look_do_not_fill_the_memory(off_m: float, missing: float) -> None:
    sizes = list(looks(off_m, missing, 40))
    lost = len(SIZES) * PerceptionConfig().max_lost
    assert max(sizes) <= 2 + 3 * THINGS + lost  # of some 480 names that were given


def track(name: str, x: float | None = 0.0, **more: object) -> Track:
    made = Track(name, name.split("-", maxsplit=1)[0])
    if x is not None:
        made.low_m, made.high_m = np.array([x, 0.0, 0.0]), np.array([x + 0.1, 0.1, 0.1])
        made.points_world_m = np.stack([made.low_m, made.high_m])
    for key, value in more.items():
        setattr(made, key, value)
    return made


def tracks(*some: Track) -> dict[str, Track]:
    return {t.id: t for t in some}


def test_what_stands_where_another_was_is_the_other_and_inherits_what_is_known() -> None:
    found = tracks(
        track("Bowl-1", states={"dirty": "dirty", "filled": "empty"}),
        track("Bowl-7", 0.02, states={"dirty": "clean", "filled": None}),
        track("Apple-1", parent=("inside", "Bowl-1")),
    )
    found["Bowl-7"].states = {"dirty": "clean"}
    merge_renamed(found, {"Bowl-1"}, {"Bowl-7"}, PerceptionConfig())
    assert sorted(found) == ["Apple-1", "Bowl-7"]
    assert found["Bowl-7"].states == {"dirty": "clean", "filled": "empty"}
    assert found["Apple-1"].parent == ("inside", "Bowl-7")


@pytest.mark.parametrize("other", [track("Bowl-7", 0.08), track("Mug-7"), track("Bowl-7", None)])
def test_what_stands_beside_or_is_of_another_kind_is_another_thing(other: Track) -> None:
    found = tracks(track("Bowl-1"), other)
    merge_renamed(found, {"Bowl-1"}, {other.id}, PerceptionConfig())
    assert len(found) == 2


def test_the_last_lost_things_of_a_kind_are_remembered() -> None:
    lost = [track(f"Mug-{k}", None, last_seen_s=float(k)) for k in range(9)]
    found = tracks(*lost, track("Bowl-1", None), track("Mug-20", None))
    assert let_go(found, {"Mug-20"}, PerceptionConfig(max_lost=2)) == ()
    assert sorted(found) == ["Bowl-1", "Mug-20", "Mug-7", "Mug-8"]


def test_over_the_budget_the_oldest_unobserved_go_first_and_it_is_said() -> None:
    found = tracks(
        track("Mug-1", 0.0, last_seen_s=1.0, seen=Seen.REMEMBERED),
        track("Mug-2", 1.0, last_seen_s=5.0, seen=Seen.UNOBSERVED),
        track("Mug-3", 2.0, last_seen_s=3.0, seen=Seen.UNOBSERVED),
        track("Mug-4", None, last_seen_s=9.0),
        track("Mug-5", 3.0, last_seen_s=0.0),
    )
    assert let_go(found, {"Mug-5"}, PerceptionConfig(max_things=2)) == ("Mug-4", "Mug-3", "Mug-2")
    assert sorted(found) == ["Mug-1", "Mug-5"]
