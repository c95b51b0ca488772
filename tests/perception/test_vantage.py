"""The next view: from where more would be seen of what has not been seen."""

from __future__ import annotations

from forestall.domain.load import shipped
from forestall.perception.given import GivenStateEstimator
from forestall.perception.perceiver import GraphPerceiver
from forestall.perception.segmenters import InstanceSegmenter
from forestall.types.graph import SceneGraph
from forestall.types.observation import Vec3

from .synthetic import Solid, at, hollow, looking, observed

HERE = (0.0, -0.9, 1.4)
COUNTER = Solid("CounterTop-1", (-1.2, 0.0, 0.86), (1.2, 1.2, 0.9))
MUG = at("Mug-1", 0.0, 0.45, 0.9, (0.085, 0.085, 0.1), True)
POT = at("Pot-1", 0.0, 0.3, 0.9, (0.16, 0.16, 0.085), True)
EYES: tuple[Vec3, ...] = ((0.05, -1.0, 1.4), (0.9, 0.6, 1.4), (-0.8, 0.55, 1.4), (2.4, 0.5, 1.4))


def seen(*solids: Solid) -> tuple[GraphPerceiver, SceneGraph]:
    eyes = GraphPerceiver(
        InstanceSegmenter(), GivenStateEstimator({}), shipped("household"), gate=None
    )
    return eyes, eyes.perceive(observed(solids, looking(HERE, (0.0, 0.4, 0.9))))


def point(graph: SceneGraph, name: str) -> Vec3:
    node = graph.get(name)
    assert node is not None and node.centroid_m is not None
    return node.centroid_m


def test_what_stands_behind_a_pot_is_looked_at_from_the_side_that_is_nearest() -> None:
    eyes, graph = seen(COUNTER, MUG, POT)
    assert eyes.best_vantage(EYES, [point(graph, "Mug-1")]) == 2
    assert eyes.best_vantage(EYES[:1], [point(graph, "Mug-1")]) is None, "the pot hides it, too"
    assert eyes.best_vantage((), [point(graph, "Mug-1")]) is None


def test_for_what_is_seen_as_well_from_here_nobody_goes_anywhere() -> None:
    eyes, graph = seen(COUNTER, MUG)
    assert eyes.best_vantage(EYES, [point(graph, "Mug-1")]) is None
    assert eyes.best_vantage(EYES, [(0.0, 0.0, 3.0)]) is None, "nothing is known to be there"


def test_the_floor_of_a_sink_is_looked_at_from_above_until_it_was_seen() -> None:
    """Its near half is behind what is before it."""
    sink = hollow("Sink-1", (-0.3, 0.3, 0.5), (0.3, 0.7, 0.9))
    before = Solid("CounterTop-1", (-1.2, -0.1, 0.86), (1.2, 0.3, 0.9))
    eyes, graph = seen(before, *sink)
    places = ((0.0, -1.0, 1.4), (0.0, 0.2, 1.9))
    assert eyes.best_vantage(places, [point(graph, "Sink-1")]) == 1
    above = looking((0.0, 0.5, 2.2), (0.0, 0.51, 0.5))
    graph = eyes.perceive(observed((before, *sink), above, time_s=1.0))
    eyes.perceive(observed((before, *sink), looking(HERE, (0.0, 0.4, 0.9)), time_s=2.0))
    assert eyes.best_vantage(places, [point(graph, "Sink-1")]) is None, "all of it was seen"


def test_before_anything_was_seen_no_place_is_better() -> None:
    eyes = GraphPerceiver(InstanceSegmenter(), GivenStateEstimator({}), shipped("household"))
    assert eyes.best_vantage(EYES, [(0.0, 0.0, 1.0)]) is None
