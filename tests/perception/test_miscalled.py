"""One thing that pictures call by two names, things that no mask shows, and looks of things."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from forestall.domain.load import shipped
from forestall.perception.given import GivenStateEstimator
from forestall.perception.naming import mean_looks, unlike
from forestall.perception.perceiver import GraphPerceiver
from forestall.perception.segmenters import InstanceSegmenter
from forestall.types.graph import SceneGraph
from forestall.types.observation import Frame, Intrinsics, Observation

from .synthetic import Solid, at, looking, observed
from .test_own_names import bare

DOMAIN = shipped("household")
EYE = looking((0.0, -0.7, 1.65), (0.0, 0.3, 0.9))
LEFT = looking((-0.6, -0.7, 1.65), (-0.1, 0.3, 0.9))
RIGHT = looking((0.6, -0.7, 1.65), (0.1, 0.3, 0.9))
COUNTER = Solid("CounterTop-1", (-1.0, 0.0, 0.86), (1.0, 0.6, 0.9))
SIZE = (0.085, 0.085, 0.10)
MUG, BOWL = at("Mug-1", 0.0, 0.3, 0.9, SIZE, True), at("Bowl-7", 0.0, 0.3, 0.9, SIZE, True)
PLATE = at("Plate-1", 0.0, 0.3, 0.9, (0.22, 0.22, 0.025), True)
POTATO = at("Potato-1", 0.0, 0.3, 0.925, (0.09, 0.07, 0.06), True)


def _perceiver() -> GraphPerceiver:
    return GraphPerceiver(InstanceSegmenter(), GivenStateEstimator({}), DOMAIN, gate=None)


def _things(graph: SceneGraph) -> set[str]:
    return {n.id for n in graph.nodes if n.centroid_m is not None and n.category != "CounterTop"}


def both(one: Observation, *others: Observation) -> Observation:
    """One observation with the views of several."""
    return replace(one, frames=tuple(f for o in (one, *others) for f in o.frames))


def without(observation: Observation, name: str) -> Observation:
    """The same with a mask missing."""

    def change(frame: Frame) -> Frame:
        assert frame.instance_ids is not None
        gone = frame.instance_ids == frame.instance_names.index(name)
        return replace(frame, instance_ids=np.where(gone, np.int32(-1), frame.instance_ids))

    return replace(observation, frames=tuple(map(change, observation.frames)))


@pytest.mark.parametrize("named", [True, False])
def test_a_single_view_that_calls_a_thing_something_else_is_not_believed(named: bool) -> None:
    perceiver = _perceiver()
    show = (lambda o: o) if named else bare
    first = perceiver.perceive(show(observed([COUNTER, MUG], EYE, LEFT)))
    assert _things(first) == {"Mug-1", "gripper"}
    wrong = show(observed([COUNTER, BOWL], EYE, time_s=1.0))
    assert _things(perceiver.perceive(wrong)) == {"Mug-1", "gripper"}
    again = show(observed([COUNTER, BOWL], LEFT, time_s=2.0))
    (new,) = _things(perceiver.perceive(again)) - {"gripper"}
    assert new.startswith("Bowl-")


def test_two_views_are_believed_and_what_was_there_is_lost() -> None:
    perceiver = _perceiver()
    perceiver.perceive(observed([COUNTER, MUG], EYE, LEFT, RIGHT))
    perceiver.perceive(observed([COUNTER, MUG], EYE, time_s=1.0))
    graph = perceiver.perceive(observed([COUNTER, BOWL], EYE, LEFT, time_s=2.0))
    assert _things(graph) == {"Bowl-7", "gripper"}
    gone = graph.get("Mug-1")
    assert gone is not None and gone.centroid_m is None


def test_what_may_be_another_known_thing_is_believed_at_once() -> None:
    elsewhere = at("Bowl-7", 0.6, 0.3, 0.9, SIZE, True)
    perceiver = _perceiver()
    first = perceiver.perceive(bare(observed([COUNTER, MUG, elsewhere], EYE, LEFT)))
    assert _things(first) == {"Mug-1", "Bowl-1", "gripper"}
    graph = perceiver.perceive(bare(observed([COUNTER, BOWL], EYE, time_s=1.0)))
    assert _things(graph) == {"Bowl-1", "gripper"}


def test_of_the_views_of_one_moment_most_count() -> None:
    right, wrong = observed([COUNTER, MUG], EYE, LEFT), observed([COUNTER, BOWL], RIGHT)
    assert _things(_perceiver().perceive(both(right, wrong))) == {"Mug-1", "gripper"}
    assert _things(_perceiver().perceive(both(wrong, right))) == {"Mug-1", "gripper"}


def test_what_was_seen_once_and_is_something_else_was_never_there() -> None:
    perceiver = _perceiver()
    perceiver.perceive(observed([COUNTER, BOWL], EYE))
    graph = perceiver.perceive(observed([COUNTER, MUG], EYE, LEFT, time_s=1.0))
    assert graph.get("Bowl-7") is None
    assert _things(graph) == {"Mug-1", "gripper"}


def test_what_lies_on_something_and_what_it_turns_into_are_no_mistakes() -> None:
    perceiver = _perceiver()
    perceiver.perceive(without(observed([COUNTER, PLATE, POTATO], EYE), "Potato-1"))
    graph = perceiver.perceive(
        without(observed([COUNTER, PLATE, POTATO], EYE, time_s=1.0), "Plate-1")
    )
    assert {"Plate-1", "Potato-1"} <= _things(graph)
    sliced = replace(POTATO, id="PotatoSliced-1")
    graph = perceiver.perceive(observed([COUNTER, PLATE, sliced], EYE, time_s=2.0))
    assert "PotatoSliced-1" in _things(graph) and "Potato-1" not in _things(graph)


def test_what_rode_on_what_was_let_go_is_not_something_else_there() -> None:
    """The plate was carried to the left with the potato on it, and a single view miscalls that."""
    perceiver = _perceiver()
    perceiver.perceive(observed([COUNTER, PLATE, POTATO], EYE, LEFT))
    aside = (-0.5, 0.05, 0.0)
    other = replace(POTATO, id="Bowl-3").moved((-0.53, 0.08, 0.0))
    seen = observed([COUNTER, PLATE.moved(aside), other], LEFT, time_s=1.0)
    hand = replace(seen.gripper, released="Plate-1", released_world_m=(-0.5, 0.35, 0.9125))
    graph = perceiver.perceive(replace(seen, gripper=hand))
    assert _things(graph) == {"Plate-1", "Potato-1", "gripper"}
    node = graph.get("Potato-1")
    assert node is not None and node.centroid_m is not None
    assert node.centroid_m[0] == pytest.approx(-0.53, abs=0.03)


def test_a_thing_that_no_mask_shows_and_that_is_still_there_stays() -> None:
    perceiver = _perceiver()
    perceiver.perceive(observed([COUNTER, PLATE, POTATO], EYE))
    missed = without(observed([COUNTER, PLATE, POTATO], EYE, time_s=1.0), "Potato-1")
    graph = perceiver.perceive(missed)
    node = graph.get("Potato-1")
    assert node is not None and node.centroid_m is not None
    assert any((r.subject, r.object) == ("Potato-1", "Plate-1") for r in graph.relations)
    gone = perceiver.perceive(observed([COUNTER, PLATE], EYE, time_s=2.0)).get("Potato-1")
    assert gone is not None and gone.centroid_m is None


def test_what_nothing_moved_is_no_other_one_that_turns_up_beside_it() -> None:
    """The first mug is out of the second picture: the other one there is not it."""
    here, beside = (at("Mug-8", x, 0.3, 0.9, SIZE, True) for x in (-0.35, -0.1))
    narrow = Intrinsics.from_vertical_fov(240, 240, 40.0)
    aside = looking((0.2, -0.1, 1.15), (0.05, 0.3, 0.9))
    perceiver = _perceiver()
    perceiver.perceive(bare(observed([COUNTER, here], EYE)))
    both_there = bare(observed([COUNTER, here, beside], aside, time_s=1.0, camera=narrow))
    graph = perceiver.perceive(both_there)
    assert len(graph.of_category("Mug")) == 2


def test_two_that_were_moved_are_told_apart_by_their_looks() -> None:
    left, right = at("Mug-1", -0.3, 0.3, 0.9, SIZE, True), at("Mug-2", 0.3, 0.3, 0.9, SIZE, True)
    perceiver = _perceiver()
    first = perceiver.perceive(bare(painted(observed([COUNTER, left, right], EYE))))
    names = {
        ("left" if n.centroid_m[0] < 0 else "right"): n.id
        for n in first.of_category("Mug")
        if n.centroid_m
    }
    swapped = [replace(right, id="Mug-1"), replace(left, id="Mug-2")]
    perceiver.perceive(bare(painted(observed([COUNTER], EYE, time_s=1.0))))
    moved = [s.moved((0.0, -0.12, 0.0)) for s in swapped]
    graph = perceiver.perceive(bare(painted(observed([COUNTER, *moved], EYE, time_s=2.0))))
    places = {n.id: n.centroid_m[0] for n in graph.of_category("Mug") if n.centroid_m}
    assert places[names["left"]] > 0 > places[names["right"]]


def painted(observation: Observation) -> Observation:
    """The first mug red, the second one blue."""

    def change(frame: Frame) -> Frame:
        assert frame.instance_ids is not None
        rgb = frame.rgb.copy()
        for name, colour in (("Mug-1", (200, 20, 20)), ("Mug-2", (20, 20, 200))):
            if name in frame.instance_names:
                rgb[frame.instance_ids == frame.instance_names.index(name)] = colour
        return replace(frame, rgb=rgb)

    return replace(observation, frames=tuple(map(change, observation.frames)))


def test_looks_are_mean_colours_and_unlike_adds_colour_and_size() -> None:
    labels = np.full((30, 30), -1, dtype=np.int16)
    labels[:, :15] = 0
    rgb = np.zeros((30, 30, 3), dtype=np.uint8)
    rgb[labels == 0] = (255, 0, 51)
    found = mean_looks(rgb, labels, 2)
    assert found[0] is not None and np.allclose(found[0], (1.0, 0.0, 0.2))
    assert found[1] is None
    size, red, blue = np.array([0.1, 0.1, 0.1]), np.array([1.0, 0, 0]), np.array([0, 0, 1.0])
    assert unlike(size, red, size, red) == 0.0
    assert unlike(size, red, size, blue) == pytest.approx(2**0.5)
    assert unlike(size, None, size * 2, blue) == pytest.approx(np.log(2))
