"""Names that perception gives where pictures tell kinds alone, and the hand its kind at most."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from forestall.domain.load import shipped
from forestall.perception.given import GivenStateEstimator
from forestall.perception.oracle import OracleStateEstimator
from forestall.perception.perceiver import GraphPerceiver
from forestall.perception.segmenters import InstanceSegmenter
from forestall.types.facts import category_of
from forestall.types.graph import Box, ObjectNode, SceneGraph
from forestall.types.observation import Observation

from .synthetic import Solid, at, looking, observed

DOMAIN = shipped("household")
EYE = looking((0.0, -0.7, 1.65), (0.0, 0.3, 0.9))
LEFT = looking((-0.6, -0.7, 1.65), (-0.1, 0.3, 0.9))
COUNTER = Solid("CounterTop-1", (-1.0, 0.0, 0.86), (1.0, 0.6, 0.9))
MUG = (0.085, 0.085, 0.10)
PAIR = [at("Mug-8", -0.05, 0.3, 0.9, MUG, True), at("Mug-3", 0.05, 0.3, 0.9, MUG, True)]
BURNERS = [
    at("StoveBurner-7", 0.0, 0.3, 0.9, (0.2, 0.2, 0.01)),
    at("StoveBurner-9", 0.22, 0.3, 0.9, (0.2, 0.2, 0.01)),
]
HAND = (0.45, -0.9, 1.125)


def _perceiver() -> GraphPerceiver:
    return GraphPerceiver(InstanceSegmenter(), GivenStateEstimator({}), DOMAIN, gate=None)


def bare(observation: Observation) -> Observation:
    """The same without identities."""
    frames = tuple(
        replace(f, instance_names=tuple(map(category_of, f.instance_names)))
        for f in observation.frames
    )
    return replace(observation, frames=frames)


def _where(graph: SceneGraph, category: str) -> dict[str, tuple[float, ...]]:
    return {n.id: n.centroid_m for n in graph.of_category(category) if n.centroid_m is not None}


def test_two_of_a_kind_side_by_side_keep_their_names() -> None:
    scene = [
        COUNTER,
        at("Mug-8", -0.05, 0.3, 0.9, MUG, True),
        at("Mug-3", 0.05, 0.3, 0.9, MUG, True),
    ]
    perceiver = _perceiver()
    first = _where(perceiver.perceive(bare(observed(scene, EYE))), "Mug")
    second = _where(perceiver.perceive(bare(observed(scene, LEFT, time_s=1.0))), "Mug")
    assert first.keys() == second.keys() == {"Mug-1", "Mug-2"}
    for name, place in first.items():
        assert np.allclose(place, second[name], atol=0.03)


def test_one_of_two_is_taken_and_the_other_keeps_its_name() -> None:
    stays, goes = at("Mug-8", -0.06, 0.3, 0.9, MUG, True), at("Mug-3", 0.06, 0.3, 0.9, MUG, True)
    perceiver = _perceiver()
    first = _where(perceiver.perceive(bare(observed([COUNTER, stays, goes], EYE))), "Mug")
    taken = min(first, key=lambda n: -first[n][0])
    held = goes.moved((0.39, -1.2, 0.17))
    seen = observed([COUNTER, stays, held], EYE, holding=taken, hand=HAND, time_s=1.0)
    graph = perceiver.perceive(bare(seen))
    assert graph.in_hands(("gripper",)) == (taken,)
    left = next(n for n in first if n != taken)
    assert np.allclose(_where(graph, "Mug")[left], first[left], atol=0.03)
    assert len(graph.of_category("Mug")) == 2


def test_what_is_held_turns_with_the_robot_and_is_one_thing() -> None:
    """Two views of one moment: the robot turned between them, and the mug in its hand with it."""
    mug = at("Mug-3", 0.0, 0.3, 0.9, MUG, True)
    perceiver = _perceiver()
    first = perceiver.perceive(bare(observed([COUNTER, mug], EYE)))
    (name,) = _where(first, "Mug")
    in_front = at("Mug-3", 0.0, -0.2, 1.1, MUG, True)
    aside = at("Mug-3", 0.5, -0.7, 1.1, MUG, True)
    turned = looking((0.0, -0.7, 1.65), (1.0, -0.7, 0.9))
    one = observed([COUNTER, in_front], EYE, holding="Mug", hand=(0.5, -0.7, 1.15), time_s=1.0)
    two = observed([COUNTER, aside], turned)
    graph = perceiver.perceive(bare(replace(one, frames=(*one.frames, *two.frames))))
    assert graph.in_hands(("gripper",)) == (name,)
    assert [n.id for n in graph.of_category("Mug")] == [name]


def test_a_hand_that_knows_only_the_kind_holds_what_perception_thinks_it_holds() -> None:
    near, far = at("Mug-8", 0.3, 0.2, 0.9, MUG, True), at("Mug-3", -0.5, 0.4, 0.9, MUG, True)
    perceiver = _perceiver()
    first = _where(perceiver.perceive(bare(observed([COUNTER, near, far], EYE))), "Mug")
    nearest = max(first, key=lambda n: first[n][0])
    felt = observed([COUNTER, far], EYE, holding="Mug", hand=HAND, time_s=1.0)
    assert perceiver.perceive(bare(felt)).in_hands(("gripper",)) == (nearest,)
    unseen = observed([COUNTER, far], EYE, holding="Pot", hand=HAND, time_s=2.0)
    assert perceiver.perceive(bare(unseen)).in_hands(("gripper",)) == ("Pot-1",)


def test_furniture_seen_in_parts_is_one_piece_and_burners_side_by_side_are_two() -> None:
    top = Solid("CounterTop-4", (-2.0, 0.0, 0.86), (2.0, 0.6, 0.9))
    views = [looking((x, -0.7, 1.65), (x, 0.3, 0.9)) for x in (-1.2, -0.6, 0.0, 0.6, 1.2)]
    perceiver = _perceiver()
    first = perceiver.perceive(bare(observed([top, *BURNERS], *views)))
    assert [n.id for n in first.of_category("CounterTop")] == ["CounterTop-1"]
    places = _where(first, "StoveBurner")
    assert len(places) == 2
    again = perceiver.perceive(bare(observed([top, *BURNERS], views[1], time_s=1.0)))
    for name, place in _where(again, "StoveBurner").items():
        assert np.allclose(place, places[name], atol=0.02)


def test_the_side_of_a_piece_whose_front_is_known_is_the_same_piece() -> None:
    fridge = Solid("Fridge-6", (-0.4, 0.0, 0.0), (0.4, 0.7, 1.8))
    front = looking((0.0, -1.6, 1.5), (0.0, 0.0, 0.9))
    side = looking((2.0, 0.35, 1.5), (0.4, 0.35, 0.9))
    perceiver = _perceiver()
    perceiver.perceive(bare(observed([fridge], front)))
    graph = perceiver.perceive(bare(observed([fridge], side, time_s=1.0)))
    assert [n.id for n in graph.of_category("Fridge")] == ["Fridge-1"]


def test_what_was_opened_shows_other_sides_and_is_the_same_piece() -> None:
    shut = Solid("Fridge-6", (-0.4, 0.0, 0.0), (0.4, 0.7, 1.8))
    back = Solid("Fridge-6", (-0.4, 0.6, 0.0), (0.4, 0.7, 1.8))
    door = Solid("Fridge-6", (0.38, -0.75, 0.0), (0.42, 0.0, 1.8))
    before, after = (looking((x, -1.9, 1.5), (0.0, 0.3, 0.9)) for x in (0.0, -0.3))
    perceiver = _perceiver()
    perceiver.perceive(bare(observed([shut], before)))
    graph = perceiver.perceive(bare(observed([back, door], after, time_s=1.0)))
    (fridge,) = graph.of_category("Fridge")
    assert fridge.id == "Fridge-1" and fridge.box_m is not None
    assert fridge.box_m.low[1] < -0.5 and fridge.box_m.high[1] > 0.55


def test_a_neighbour_of_what_is_open_is_another_piece() -> None:
    """The door of one stands before the other, which is seen for the first time."""
    back = Solid("Cabinet-6", (-0.4, 0.25, 1.4), (0.0, 0.3, 2.0))
    door = Solid("Cabinet-6", (-0.03, -0.38, 1.4), (0.0, 0.0, 2.0))
    neighbour = Solid("Cabinet-2", (0.02, 0.0, 1.4), (0.42, 0.3, 2.0))
    left, right = (looking((x, -1.6, 1.6), (x, 0.0, 1.7)) for x in (-0.4, 0.6))
    perceiver = _perceiver()
    perceiver.perceive(bare(observed([back, door], left)))
    graph = perceiver.perceive(bare(observed([back, door, neighbour], right, time_s=1.0)))
    places = _where(graph, "Cabinet")
    assert set(places) == {"Cabinet-1", "Cabinet-2"}
    assert places["Cabinet-2"][0] == pytest.approx(0.22, abs=0.1)


@pytest.mark.parametrize("at_once", [False, True])
def test_two_parts_that_one_view_shows_whole_are_joined_under_the_first_name(at_once: bool) -> None:
    """Also where it looks more like the second one, of which more is seen: plans speak of it."""
    whole = Solid("CounterTop-4", (-1.0, 0.0, 0.86), (1.0, 0.6, 0.9))
    ends = [
        Solid("CounterTop-4", (-1.0, 0.0, 0.66), (-0.7, 0.6, 0.9)),  # with a cloth over its edge
        Solid("CounterTop-4", (0.5, 0.0, 0.86), (1.0, 0.6, 0.9)),
    ]
    places = [looking((x, -0.9, 1.65), (x, 0.3, 0.9)) for x in (-0.85, 0.75)]
    back = looking((0.0, -1.5, 1.9), (0.0, 0.3, 0.9))
    mug = at("Mug-1", -0.85, 0.3, 0.9, MUG, True)
    shown = [
        bare(observed([ends[0], mug], places[0], time_s=0.0)),
        bare(observed([ends[1]], places[1], time_s=1.0)),
        bare(observed([whole, mug], back, time_s=5.0)),
    ]
    perceiver = _perceiver()
    if at_once:
        graph = perceiver.perceive(
            replace(shown[2], frames=tuple(f for o in shown for f in o.frames))
        )
    else:
        parts = [perceiver.perceive(o) for o in shown[:2]]
        assert len(parts[1].of_category("CounterTop")) == 2
        graph = perceiver.perceive(shown[2])
    (counter,) = graph.of_category("CounterTop")
    assert counter.id == "CounterTop-1" and counter.box_m is not None
    assert counter.box_m.low[0] < -0.9 and counter.box_m.high[0] > 0.9
    assert ("Mug-1", "on_top_of", "CounterTop-1") in [
        (r.subject, r.predicate, r.object) for r in graph.relations
    ]


@pytest.mark.parametrize("later", [False, True])
def test_a_thing_that_was_moved_is_found_again_under_its_name(later: bool) -> None:
    there, here = at("Mug-8", -0.6, 0.3, 0.9, MUG, True), at("Mug-8", 0.5, 0.3, 0.9, MUG, True)
    perceiver = _perceiver()
    (name,) = _where(perceiver.perceive(bare(observed([COUNTER, there], EYE))), "Mug")
    if later:
        empty = perceiver.perceive(bare(observed([COUNTER], EYE, time_s=1.0)))
        node = empty.get(name)
        assert node is not None and node.centroid_m is None
    found = _where(perceiver.perceive(bare(observed([COUNTER, here], EYE, time_s=2.0))), "Mug")
    assert found.keys() == {name}
    assert found[name][0] == pytest.approx(0.5, abs=0.05)


@pytest.mark.parametrize("name", ["StoveBurner-4", "StoveBurner-1", "StoveBurner-2"])
def test_what_somebody_points_at_bears_the_name_that_is_said(name: str) -> None:
    perceiver = _perceiver()
    told = ((name, (0.22, 0.3, 0.9)), ("StoveBurner-8", (0.9, 0.3, 0.9)))
    graph = perceiver.perceive(replace(bare(observed([COUNTER, *BURNERS], EYE)), told=told))
    places = _where(graph, "StoveBurner")
    assert len(places) == 2 and "StoveBurner-8" not in places
    assert places[name][0] == pytest.approx(0.22, abs=0.02)
    on = {r.object for r in graph.relations} | {r.subject for r in graph.relations}
    assert on <= {n.id for n in graph.nodes}


def test_a_neighbour_of_what_is_hidden_does_not_get_its_name() -> None:
    pan = at("Pan-1", 0.22, 0.3, 0.91, (0.3, 0.3, 0.06), True)
    told = (("StoveBurner-4", (0.22, 0.3, 0.905)),)
    perceiver = _perceiver()
    hidden = perceiver.perceive(replace(bare(observed([COUNTER, BURNERS[0], pan], EYE)), told=told))
    assert "StoveBurner-4" not in _where(hidden, "StoveBurner")
    shown = replace(bare(observed([COUNTER, *BURNERS], EYE, time_s=1.0)), told=told)
    places = _where(perceiver.perceive(shown), "StoveBurner")
    assert places["StoveBurner-4"][0] == pytest.approx(0.22, abs=0.02)


def test_true_states_are_found_by_place_where_masks_have_no_names() -> None:
    mugs = [at("Mug-8", -0.3, 0.3, 0.9, MUG, True), at("Mug-3", 0.3, 0.3, 0.9, MUG, True)]
    truth = SceneGraph(tuple(ObjectNode(s.id, "Mug", box_m=Box(s.low, s.high)) for s in mugs))
    states = {"Mug-8": {"dirty": "dirty"}, "Mug-3": {"dirty": "clean"}}
    oracle = OracleStateEstimator(lambda n: states[n], DOMAIN, lambda: truth, fine_pixels=1)
    perceiver = GraphPerceiver(InstanceSegmenter(), oracle, DOMAIN, gate=None)
    graph = perceiver.perceive(bare(observed([COUNTER, *mugs], EYE)))
    read = {
        round(n.centroid_m[0], 1): n.state("dirty")
        for n in graph.of_category("Mug")
        if n.centroid_m is not None
    }
    assert read == {-0.3: "dirty", 0.3: "clean"}
