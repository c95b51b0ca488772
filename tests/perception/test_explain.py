from __future__ import annotations

from dataclasses import replace

import numpy as np
from PIL import Image

from forestall.domain.load import shipped
from forestall.perception.explain import explain
from forestall.perception.given import GivenStateEstimator
from forestall.perception.perceiver import GraphPerceiver
from forestall.perception.segmenters import InstanceSegmenter
from forestall.types.finding import Finding
from forestall.types.graph import SceneGraph
from forestall.types.observation import Observation

from .rooms import detected, room, with_frame
from .synthetic import CAMERA

HOUSEHOLD = shipped("household")
PLAN = slice(CAMERA.width, None)


def graph_of(seen: Observation) -> SceneGraph:
    return GraphPerceiver(InstanceSegmenter(), GivenStateEstimator({}), HOUSEHOLD).perceive(seen)


def pixels(image: Image.Image) -> np.ndarray:
    return np.asarray(image).astype(int)


def test_masks_are_tinted_and_the_rest_of_the_picture_is_not() -> None:
    seen = room()
    ids = seen.frames[0].instance_ids
    assert ids is not None
    nothing = np.where(ids == ids[120, 160], ids, -1).astype(np.int32)
    one = with_frame(seen, lambda f: replace(f, instance_ids=nothing))
    drawn = pixels(explain(one, graph_of(seen)))[: CAMERA.height, : CAMERA.width]
    changed = (drawn != seen.frames[0].rgb).any(axis=2)
    assert changed[nothing >= 0].mean() > 0.95
    assert changed[nothing < 0].mean() < 0.05  # the label


def drawn_at(name: str) -> tuple[float, float]:
    """Mean row and column of the plan that change when a thing is left out."""
    seen, graph = room(), graph_of(room())
    without = SceneGraph(tuple(n for n in graph.nodes if n.id != name))
    one, two = (pixels(explain(seen, g))[:640, PLAN] for g in (graph, without))
    rows, columns = np.nonzero((one != two).any(axis=2))
    return float(rows.mean()), float(columns.mean())


def test_the_plan_shows_things_where_they_are() -> None:
    oven, mug, pot, plate = map(drawn_at, ("Microwave-1", "Mug-1", "Pot-1", "Plate-1"))
    assert oven[1] < mug[1] < pot[1]  # x to the right
    assert plate[0] > mug[0] > oven[0]  # y upwards


def test_findings_and_relations_are_written_below() -> None:
    seen, graph = room(), graph_of(room())
    plain = explain(seen, graph, predicates=())
    more = explain(seen, graph, [Finding("floor", "is too high")], HOUSEHOLD.scored)
    scored = [r for r in graph.relations if r.predicate in HOUSEHOLD.scored]
    assert len(scored) > 3
    assert more.height == plain.height + 16 * (len(scored) + 1)


def test_masks_ids_and_colour_alone_are_drawn_alike() -> None:
    graph = graph_of(room())
    by_ids = pixels(explain(room(), graph))
    by_masks = pixels(explain(detected(room()), graph))
    assert np.array_equal(by_ids, by_masks)
    blind = with_frame(
        detected(room()), lambda f: replace(f, depth_m=f.depth_m * 0, colour_only=True)
    )
    assert explain(blind, SceneGraph(())).size[0] == CAMERA.width + 640


def test_a_graph_without_pictures_is_drawn_from_above() -> None:
    seen = replace(room(), frames=(), graph=graph_of(room()))
    assert explain(seen, graph_of(room())).width == 640
