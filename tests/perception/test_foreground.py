"""Masks that bleed, erode and overlap, depth that is rough and has holes, tables without a mask."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import replace

import numpy as np
import numpy.typing as npt
import pytest
from scipy import ndimage

from forestall.domain.load import shipped
from forestall.perception.foreground import noise_share
from forestall.perception.given import GivenStateEstimator
from forestall.perception.perceiver import GraphPerceiver
from forestall.perception.segmenters import GivenMasks
from forestall.perception.surfaces import SURFACE
from forestall.types.graph import SceneGraph
from forestall.types.observation import Detection, Frame, Intrinsics, Observation

from .synthetic import Solid, at, hollow, looking, observed

CAMERA = Intrinsics(640, 480, 615.0, 615.0, 319.5, 239.5)
EYE = looking((-0.35, 0.1, 1.2), (0.35, 0.1, 0.75))
TABLE = Solid("DiningTable-1", (-0.2, -0.6, 0.7), (1.2, 0.8, 0.74))
FLOOR = Solid("Floor-1", (-3.0, -3.0, -0.02), (3.0, 3.0, 0.0))
MUG = at("Mug-1", 0.3, 0.1, 0.74, (0.085, 0.085, 0.1), True)
BOWL = hollow("Bowl-1", (0.35, -0.22, 0.74), (0.5, -0.07, 0.81), 0.006)
CANS = [
    at("Can-1", 0.25, 0.25, 0.74, (0.07, 0.07, 0.1), True),
    at("Box-1", 0.36, 0.25, 0.74, (0.06, 0.1, 0.08)),
]
SCENE = [FLOOR, TABLE, MUG, *BOWL, *CANS]
SIZES = {
    "Mug-1": (0.085, 0.085, 0.1),
    "Bowl-1": (0.15, 0.15, 0.07),
    "Can-1": (0.07, 0.07, 0.1),
    "Box-1": (0.06, 0.1, 0.08),
}
BOX = ndimage.generate_binary_structure(2, 2)


def seen(
    grown: int = 0,
    unmasked: Collection[str] = (),
    solids: Sequence[Solid] = SCENE,
    depth: npt.NDArray[np.float32] | None = None,
) -> Observation:
    """The scene with masks that are some pixels too wide, or too narrow."""
    whole = observed(solids, EYE, camera=CAMERA)
    frame = whole.frames[0]
    assert frame.instance_ids is not None
    found = []
    for index, name in enumerate(frame.instance_names):
        mask = frame.instance_ids == index
        if name in unmasked or not mask.any():
            continue
        if grown > 0:
            mask = ndimage.binary_dilation(mask, BOX, iterations=grown)
        if grown < 0:
            mask = ndimage.binary_erosion(mask, BOX, iterations=-grown)
        found.append(Detection(name.rsplit("-", 1)[0], mask, name))
    own = replace(
        frame,
        instance_ids=None,
        instance_names=(),
        detections=tuple(found),
        depth_m=frame.depth_m if depth is None else depth,
    )
    return replace(whole, frames=(own,))


def graph_of(observation: Observation) -> SceneGraph:
    return GraphPerceiver(GivenMasks(), GivenStateEstimator({}), shipped("household")).perceive(
        observation
    )


def facts(graph: SceneGraph, *predicates: str) -> set[tuple[str, str, str]]:
    return {
        (r.subject, r.predicate, r.object) for r in graph.relations if r.predicate in predicates
    }


def off_m(graph: SceneGraph, name: str) -> float:
    node = graph.get(name)
    assert node is not None and node.box_m is not None
    size = np.subtract(node.box_m.high, node.box_m.low)
    return float(np.abs(size - SIZES[name]).max())


@pytest.mark.parametrize("grown", [-4, -2, 0, 2, 3, 4])
def test_boxes_and_relations_survive_masks_that_are_too_wide_or_too_narrow(grown: int) -> None:
    graph = graph_of(seen(grown))
    assert {n: off_m(graph, n) <= 0.02 for n in SIZES} == dict.fromkeys(SIZES, True)
    on = {(n, "on_top_of", "DiningTable-1") for n in SIZES}
    assert facts(graph, "on_top_of", "inside") == on
    assert facts(graph, "blocking") == {("Can-1", "blocking", "Box-1")}


@pytest.mark.parametrize("grown", [0, 4])
def test_what_stands_on_a_table_without_a_mask_stands_on_a_surface(grown: int) -> None:
    graph = graph_of(seen(grown, unmasked={"DiningTable-1", "Floor-1"}))
    assert facts(graph, "on_top_of") == {(n, "on_top_of", f"{SURFACE}-1") for n in SIZES}
    assert facts(graph, "blocking") == {("Can-1", "blocking", "Box-1")}
    surface = graph.get(f"{SURFACE}-1")
    assert surface is not None and surface.box_m is not None
    assert surface.box_m.high[2] == pytest.approx(0.74, abs=0.005)


def test_the_ground_without_a_mask_is_the_ground() -> None:
    solids = [FLOOR, at("Pot-1", 1.0, 0.1, 0.0, (0.2, 0.2, 0.13), True)]
    graph = graph_of(seen(unmasked={"Floor-1"}, solids=solids))
    assert facts(graph, "on_top_of") == {("Pot-1", "on_top_of", "Floor-1")}


def test_no_surface_is_made_where_everything_is_masked() -> None:
    assert [n.id for n in graph_of(seen(2)).nodes if n.category == SURFACE] == []


def test_a_table_whose_mask_is_missing_once_is_still_the_table() -> None:
    perceiver = GraphPerceiver(GivenMasks(), GivenStateEstimator({}), shipped("household"))
    perceiver.perceive(seen())
    graph = perceiver.perceive(replace(seen(unmasked={"DiningTable-1"}), time_s=1.0))
    assert ("Mug-1", "on_top_of", "DiningTable-1") in facts(graph, "on_top_of")
    assert [n.id for n in graph.nodes if n.category == SURFACE] == []


def test_a_surface_gives_way_to_the_mask_that_comes_later() -> None:
    perceiver = GraphPerceiver(GivenMasks(), GivenStateEstimator({}), shipped("household"))
    perceiver.perceive(seen(unmasked={"DiningTable-1"}))
    graph = perceiver.perceive(replace(seen(), time_s=1.0))
    assert ("Mug-1", "on_top_of", "DiningTable-1") in facts(graph, "on_top_of")
    assert [n.id for n in graph.nodes if n.category == SURFACE] == []


def rough(frame: Frame, rng: np.random.Generator) -> npt.NDArray[np.float32]:
    """Depth of a stereo camera: noise by the square of distance, holes at edges and in blobs."""
    z = frame.depth_m.astype(np.float64)
    steps = np.abs(np.diff(z, axis=1, prepend=z[:, :1])) > 0.03
    z += rng.normal(0.0, 0.003, z.shape) * z**2
    z[ndimage.binary_dilation(steps, BOX, iterations=2)] = 0.0
    for _ in range(40):
        y, x = rng.integers(0, 470), rng.integers(0, 630)
        z[y : y + 8, x : x + 8] = 0.0
    return np.maximum(z, 0.0).astype(np.float32)


@pytest.mark.parametrize("grown", [-3, 0, 3])
def test_relations_survive_rough_depth_with_holes(grown: int) -> None:
    frame = observed(SCENE, EYE, camera=CAMERA).frames[0]
    depth = rough(frame, np.random.default_rng(3))
    graph = graph_of(seen(grown, depth=depth))
    on = {(n, "on_top_of", "DiningTable-1") for n in SIZES}
    assert facts(graph, "on_top_of", "inside") == on
    assert {n: off_m(graph, n) <= 0.03 for n in SIZES} == dict.fromkeys(SIZES, True)


def test_the_noise_of_depth_is_told_from_its_edges() -> None:
    frame = observed(SCENE, EYE, camera=CAMERA).frames[0]
    assert noise_share(frame.depth_m) < 1e-4
    z = frame.depth_m.astype(np.float64)
    z += np.random.default_rng(0).normal(0.0, 0.003, z.shape) * z**2
    assert noise_share(z.astype(np.float32)) == pytest.approx(0.003, rel=0.15)


def test_a_surface_gives_way_to_the_mask_of_another_view() -> None:
    both = replace(seen(), frames=(seen(unmasked={"DiningTable-1"}).frames[0], seen().frames[0]))
    graph = graph_of(both)
    assert ("Mug-1", "on_top_of", "DiningTable-1") in facts(graph, "on_top_of")
    assert [n.id for n in graph.nodes if n.category == SURFACE] == []
