from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pytest

from forestall.domain.load import shipped
from forestall.errors import InputError, PerceptionError, UnknownNameError
from forestall.perception.finder import FinderConfig, FoundSegmenter
from forestall.perception.given import GivenStateEstimator
from forestall.perception.outlines import DepthOutliner
from forestall.perception.perceiver import GraphPerceiver
from forestall.types.grounding import Corners, GroundedBox
from forestall.types.observation import Frame, Mask, Rgb
from vision.shades import Shades

from .synthetic import Solid, at, looking, observed, picture

POSE = looking((0.0, -0.7, 1.65), (0.0, 0.3, 0.9))
COUNTER = Solid("CounterTop-1", (-1.0, 0.0, 0.86), (1.0, 0.6, 0.9))
PLATE = at("Plate-1", 0.1, 0.3, 0.9, (0.22, 0.22, 0.02), True)
MUG = at("Mug-1", -0.4, 0.3, 0.9, (0.08, 0.08, 0.1), True)
WORDS = ("counter", "mug", "plate")
HOUSEHOLD = shipped("household")


class Told:
    """Boxes that a test made up."""

    name = "told"
    vocabulary: Sequence[str] | None = None

    def __init__(self, *boxes: GroundedBox) -> None:
        self._boxes = boxes

    def find(self, pictures: Sequence[Rgb], phrases: Sequence[str]) -> list[list[GroundedBox]]:
        return [list(self._boxes) for _ in pictures]


class Whole:
    """Outlines a thing by its box."""

    name, exact = "whole boxes", True

    def outline(self, frame: Frame, boxes: Sequence[Corners]) -> list[Mask]:
        masks = []
        for left, top, right, bottom in boxes:
            mask = np.zeros(frame.depth_m.shape, dtype=np.bool_)
            mask[int(top) : int(bottom), int(left) : int(right)] = True
            masks.append(mask)
        return masks


def segmented(*boxes: GroundedBox, config: FinderConfig | None = None) -> list[tuple[str, float]]:
    segmenter = FoundSegmenter(Told(*boxes), Whole(), HOUSEHOLD, config)
    return [(d.category, d.score) for d in segmenter.segment(picture([COUNTER], POSE))]


def box(phrase: str, left: float, score: float, side: float = 40.0) -> GroundedBox:
    return GroundedBox(phrase, (left, 20.0, left + side, 20.0 + side), score)


def test_things_are_found_outlined_and_located() -> None:
    scene = observed([COUNTER, PLATE, MUG], POSE)
    finder = Shades(WORDS)
    perceiver = GraphPerceiver(
        FoundSegmenter(finder, DepthOutliner(), HOUSEHOLD), GivenStateEstimator({}), HOUSEHOLD
    )
    graph = perceiver.perceive(scene)
    assert {n.category for n in graph.nodes} >= {"CounterTop", "Plate", "Mug"}
    mug = next(n for n in graph.nodes if n.category == "Mug")
    assert mug.centroid_m is not None and mug.box_m is not None
    assert np.allclose(mug.centroid_m[:2], (-0.4, 0.3), atol=0.03)
    assert ("on_top_of", "Mug-1", "CounterTop-1") in {
        (r.predicate, r.subject, r.object) for r in graph.relations
    }
    assert perceiver.describe()["segmenter"] == "shades, outlined by depth"
    assert [(d.instance, d.outlined) for d in perceiver.named[0] if d.category == "Mug"] == [
        ("Mug-1", False)
    ]


def test_what_is_asked_for_are_the_words_of_the_domain() -> None:
    asked = FoundSegmenter(Told(), Whole(), HOUSEHOLD).phrases
    assert {"mug", "counter", "potato slice"} <= set(asked) and "coffee mug" not in asked
    assert len(asked) == len(set(asked))
    more = FoundSegmenter(Told(), Whole(), HOUSEHOLD, FinderConfig(synonyms=True)).phrases
    assert {*asked, "coffee mug"} <= set(more)
    few = FinderConfig(categories=("Mug", "Plate"), synonyms=True)
    assert set(FoundSegmenter(Told(), Whole(), HOUSEHOLD, few).phrases) == {
        "mug", "coffee mug", "tea mug", "beaker", "plate", "dinner plate", "dish",
    }  # fmt: skip
    with pytest.raises(UnknownNameError, match="did you mean Mug"):
        FoundSegmenter(Told(), Whole(), HOUSEHOLD, FinderConfig(categories=("Mugg",)))


def test_a_detector_of_fixed_classes_is_asked_for_what_it_knows() -> None:
    closed = Shades(("dining table", "cup", "person"), closed=True)
    segmenter = FoundSegmenter(closed, Whole(), HOUSEHOLD)
    assert segmenter.phrases == ("dining table", "cup", "person")
    found = segmenter.segment(picture([COUNTER, PLATE, MUG], POSE))
    assert {d.category for d in found} == {"DiningTable", "Cup", "person"}
    only = FoundSegmenter(closed, Whole(), HOUSEHOLD, FinderConfig(categories=("Cup",)))
    assert only.phrases == ("cup",)
    with pytest.raises(UnknownNameError, match="class of the finder 'Mug'"):
        FoundSegmenter(closed, Whole(), HOUSEHOLD, FinderConfig(categories=("Mug",)))


def test_boxes_of_one_thing_become_one() -> None:
    near = [box("mug", 20, 0.5), box("mug", 24, 0.9), box("mug", 120, 0.4)]
    assert segmented(*near) == [("Mug", 0.9), ("Mug", 0.4)]
    assert segmented(box("mug", 20, 0.5), box("cup", 22, 0.7)) == [("Cup", 0.7)]
    assert segmented(box("plate", 20, 0.5, 60), box("potato", 30, 0.4)) == [
        ("Plate", 0.5),
        ("Potato", 0.4),
    ]
    loose = FinderConfig(same_overlap=1.0, other_overlap=1.0)
    assert len(segmented(*near, config=loose)) == 3


def test_specks_are_left_out() -> None:
    assert segmented(box("mug", 20, 0.5, 4)) == []
    assert segmented(box("mug", 20, 0.5, 4), config=FinderConfig(min_pixels=5)) == [("Mug", 0.5)]


def test_a_scene_in_which_nothing_is_found_is_no_empty_scene() -> None:
    segmenter = FoundSegmenter(Shades(WORDS), DepthOutliner(), HOUSEHOLD)
    perceiver = GraphPerceiver(segmenter, GivenStateEstimator({}), HOUSEHOLD)
    known = perceiver.perceive(observed([COUNTER, PLATE, MUG], POSE))
    away = looking((0.0, -0.7, 1.65), (0.0, -3.3, 0.9))
    wall = Solid("Wall-1", (-4.0, -3.2, 0.0), (4.0, -3.0, 2.5))
    blind = FoundSegmenter(Shades(()), DepthOutliner(), HOUSEHOLD)
    with pytest.raises(PerceptionError, match=r"'shades' found none of .* \d+ in all\) in 1 pict"):
        blind.segment_all([picture([wall], away)])
    frames = observed([COUNTER, PLATE, MUG], POSE, away).frames
    assert [len(found) for found in segmenter.segment_all(frames)] == [3, 0]
    perceiver = GraphPerceiver(blind, GivenStateEstimator({}), HOUSEHOLD)
    with pytest.raises(PerceptionError, match="found none of"):
        perceiver.perceive(observed([COUNTER, PLATE, MUG], POSE))
    assert len(known.nodes) >= 3 and blind.segment(frames[0]) == []


def test_all_pictures_of_an_observation_are_asked_for_at_once() -> None:
    finder = Shades(WORDS)
    segmenter = FoundSegmenter(finder, DepthOutliner(), HOUSEHOLD)
    other = looking((0.5, -0.7, 1.65), (0.0, 0.3, 0.9))
    GraphPerceiver(segmenter, GivenStateEstimator({}), HOUSEHOLD).perceive(
        observed([COUNTER, PLATE, MUG], POSE, other)
    )
    assert len(finder.asked) == 1


def test_without_depth_a_mask_is_the_box() -> None:
    frame = picture([COUNTER, PLATE], POSE)
    blind = Frame(frame.rgb, np.zeros_like(frame.depth_m), frame.intrinsics, POSE, colour_only=True)
    mask = DepthOutliner().outline(blind, [(10.0, 20.0, 30.0, 50.0)])[0]
    assert mask.sum() == 20 * 30 and mask[20:50, 10:30].all()


@pytest.mark.parametrize("option", ["same_overlap", "other_overlap"])
def test_options_that_cannot_be(option: str) -> None:
    with pytest.raises(InputError, match=f"{option} is above 0"):
        FinderConfig(**{option: 0.0})  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("corners", "score", "why"),
    [
        ((5.0, 0.0, 5.0, 4.0), 0.5, "two sides"),
        ((0.0, float("nan"), 5.0, 4.0), 0.5, "two sides"),
        ((0.0, 0.0, 5.0, 4.0), 1.5, "0 to 1"),
    ],
)
def test_boxes_that_cannot_be(corners: Corners, score: float, why: str) -> None:
    with pytest.raises(PerceptionError, match=why):
        GroundedBox("mug", corners, score)
