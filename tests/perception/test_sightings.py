from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
import pytest

from forestall.perception.config import PerceptionConfig
from forestall.perception.sightings import Sighting, in_hand, readings, take_states
from forestall.perception.tracks import Track
from forestall.perception.unproject import Cloud


def sighting(pixels: int, **states: str | None) -> Sighting:
    nothing = np.zeros(3)
    cloud = Cloud(np.zeros((1, 3)), nothing, nothing, nothing, pixels)
    return Sighting(0, "Mug", cloud, states, None)


@pytest.mark.parametrize(
    ("views", "said"),
    [
        ([sighting(2000, dirty="clean"), sighting(400, dirty="dirty")], {"dirty": "clean"}),
        ([sighting(400, dirty="dirty"), sighting(2000, dirty=None)], {}),
        ([sighting(1500, dirty="dirty"), sighting(2000, dirty=None)], {"dirty": "dirty"}),
        ([sighting(2000, dirty="clean"), sighting(1900, dirty="dirty")], {"dirty": "clean"}),
        ([sighting(30, filled="water")], {"filled": "water"}),
    ],
)
def test_a_glimpse_does_not_contradict_a_view(
    views: list[Sighting], said: Mapping[str, str]
) -> None:
    assert readings(views, 0.5) == said
    assert readings(views[::-1], 0.5) == said


def test_in_the_hand_only_contents_change() -> None:
    known = {"dirty": "clean", "filled": "water", "broken": None}
    read = {"dirty": "dirty", "filled": "empty", "broken": "intact"}
    assert in_hand(read, known, ("filled",)) == {"filled": "empty", "broken": "intact"}
    assert in_hand(read, {}, ("filled",)) == read
    assert in_hand(read, known, tuple(read)) == read


def test_a_sliver_confirms_and_contradicts_nothing() -> None:
    track = Track("Mug-1", "Mug", states={"dirty": "clean", "broken": "intact"})
    track.presumed = {"filled": "water"}
    config = PerceptionConfig(sliver_share=0.25)

    def see(area_m2: float, **states: str) -> None:
        seen = replace(sighting(100, **states), area_m2=area_m2)
        take_states(track, [seen], False, (), True, config)

    see(0.008, broken="intact")
    see(0.0019, dirty="dirty", filled="empty", broken="intact", temperature="hot")
    assert track.states == {"broken": "intact", "temperature": "hot"}
    assert track.presumed == {"dirty": "clean", "filled": "water"}
    see(0.0019, filled="water", dirty="clean")
    assert track.states | {"temperature": None} == {
        "broken": "intact",
        "dirty": "clean",
        "filled": "water",
        "temperature": None,
    }
    see(0.0021, filled="empty", dirty="dirty")
    assert (track.states["filled"], track.states["dirty"]) == ("empty", "dirty"), "enough of it"


def test_a_part_of_the_furniture_is_believed() -> None:
    track = Track("Fridge-1", "Fridge", states={"open": "closed"}, shown_m2=1.0)
    seen = replace(sighting(100, open="open"), area_m2=0.1)
    take_states(track, [seen], False, (), False, PerceptionConfig())
    assert track.states == {"open": "open"}
