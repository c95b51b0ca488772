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
    return Sighting(0, "Mug", cloud, states, {}, None)


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
    assert readings(views, 0.5) == readings(views[::-1], 0.5) == (said, dict.fromkeys(said, 1.0))


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


@pytest.mark.parametrize(
    ("before", "now", "believed"),
    [
        (0.999, 0.88, None),  # a doubtful look does not undo a sure one, and casts doubt on it
        (0.999, 0.99, "dirty"),
        (0.81, 0.88, None),
        (0.81, 0.95, "dirty"),  # a sure look undoes a doubtful one sooner
        (0.999, 1.0, "dirty"),
        (None, 0.88, "dirty"),  # nothing was known
    ],
)
def test_what_contradicts_a_state_must_outweigh_it(
    before: float | None, now: float, believed: str | None
) -> None:
    track = Track("Pot-1", "Pot")

    def look(value: str, confidence: float) -> None:
        seen = replace(sighting(100, dirty=value), sure={"dirty": confidence})
        take_states(track, [seen], False, (), True, PerceptionConfig())

    if before is not None:
        look("clean", before)
    for _ in range(3):
        look("dirty", now)
        assert track.states.get("dirty") == believed, "the same look again tells nothing new"
    assert track.presumed.get("dirty") == (None if believed else "clean")
    look("clean", 1.0)
    assert track.states["dirty"] == "clean"


def test_what_a_skill_should_have_done_is_not_undone_by_a_doubtful_look() -> None:
    track = Track("Pot-1", "Pot", presumed={"dirty": "clean"})
    seen = replace(sighting(100, dirty="dirty"), sure={"dirty": 0.9})
    take_states(track, [seen], False, (), True, PerceptionConfig())
    assert "dirty" not in track.states
    take_states(track, [replace(seen, sure={"dirty": 0.99})], False, (), True, PerceptionConfig())
    assert track.states["dirty"] == "dirty", "the skill has failed"


def test_a_part_of_the_furniture_is_believed() -> None:
    track = Track("Fridge-1", "Fridge", states={"open": "closed"}, shown_m2=1.0)
    seen = replace(sighting(100, open="open"), area_m2=0.1)
    take_states(track, [seen], False, (), False, PerceptionConfig())
    assert track.states == {"open": "open"}
