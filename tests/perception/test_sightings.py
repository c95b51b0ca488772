from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import pytest

from forestall.perception.sightings import Sighting, in_hand, readings
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
