"""How much of a surface no view has shown: behind things, and no more once it is seen."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from forestall.domain.load import shipped
from forestall.perception.given import GivenStateEstimator
from forestall.perception.perceiver import GraphPerceiver
from forestall.perception.segmenters import InstanceSegmenter
from forestall.types.graph import SceneGraph

from .synthetic import Solid, at, hollow, looking, observed

DOMAIN = shipped("household")
COUNTER = Solid("CounterTop-1", (-1.0, 0.0, 0.0), (1.0, 0.6, 0.9))
MACHINE = at("CoffeeMachine-1", 0.0, 0.2, 0.9, (0.3, 0.2, 0.4))
FRONT = looking((0.0, -1.6, 1.4), (0.0, 0.3, 0.9))
LEFT = looking((-1.3, 1.2, 1.6), (0.0, 0.4, 0.9))
RIGHT = looking((1.3, 1.2, 1.6), (0.0, 0.4, 0.9))


def perceiver() -> GraphPerceiver:
    return GraphPerceiver(InstanceSegmenter(), GivenStateEstimator({}), DOMAIN, gate=None)


def unseen(graph: SceneGraph, name: str = "CounterTop-1") -> float:
    node = graph.get(name)
    assert node is not None
    return node.unseen_m2


def seen_from(solids: Sequence[Solid], *poses: np.ndarray) -> SceneGraph:
    return perceiver().perceive(observed(solids, *poses))


def test_an_empty_counter_hides_nothing() -> None:
    assert unseen(seen_from([COUNTER], FRONT)) == 0.0


def test_what_lies_behind_a_thing_is_unseen_and_what_is_under_it_is_not() -> None:
    shadow_m2 = unseen(seen_from([COUNTER, MACHINE], FRONT))
    behind_m2 = 0.3 * (0.6 - 0.3)  # at most: over it the camera sees the far edge
    assert 0.3 * behind_m2 < shadow_m2 < 1.5 * behind_m2


def test_views_from_the_sides_show_it_and_it_stays_seen() -> None:
    eyes = perceiver()
    things = [COUNTER, MACHINE]
    before = unseen(eyes.perceive(observed(things, FRONT)))
    after = unseen(eyes.perceive(observed(things, LEFT, RIGHT, time_s=1.0)))
    again = unseen(eyes.perceive(observed(things, FRONT, time_s=2.0)))
    assert before > 0.0 and after == again == 0.0


def test_a_low_thing_that_a_camera_sees_over_hides_too_little_to_count() -> None:
    plate = at("Plate-1", 0.0, 0.2, 0.9, (0.2, 0.2, 0.02), round=True)
    assert unseen(seen_from([COUNTER, plate], FRONT)) == 0.0


def test_the_far_side_of_a_deep_basin_is_unseen_from_afar() -> None:
    basin = hollow("Sink-1", (-0.3, 0.1, 0.6), (0.3, 0.5, 0.9))
    far = looking((0.0, -3.0, 1.2), (0.0, 0.3, 0.8))
    above = looking((0.0, -0.5, 2.0), (0.0, 0.2, 0.7))
    assert unseen(seen_from(basin, far), "Sink-1") > unseen(seen_from(basin, far, above), "Sink-1")


def test_of_shut_things_and_of_the_ground_it_is_not_told() -> None:
    fridge = Solid("Fridge-1", (-0.4, 0.0, 0.0), (0.4, 0.7, 1.7))
    floor = Solid("Floor-1", (-3.0, -3.0, -0.01), (3.0, 3.0, 0.0))
    graph = seen_from([fridge, floor], FRONT)
    assert unseen(graph, "Fridge-1") == unseen(graph, "Floor-1") == 0.0


def test_it_survives_json_and_is_left_out_where_all_is_seen() -> None:
    graph = seen_from([COUNTER, MACHINE], FRONT)
    nodes = {n["id"]: n for n in graph.to_json()["nodes"]}
    assert "unseen_m2" not in nodes["CoffeeMachine-1"]
    assert abs(unseen(SceneGraph.from_json(graph.to_json())) - unseen(graph)) < 1e-3
