"""Image features from crops to nodes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import numpy.typing as npt
import pytest

from forestall.domain.load import shipped
from forestall.errors import PerceptionError
from forestall.perception.given import GivenStateEstimator
from forestall.perception.perceiver import GraphPerceiver
from forestall.perception.segmenters import InstanceSegmenter
from forestall.seams import ImageEncoder
from forestall.types.feature import quantised
from forestall.types.graph import Seen
from forestall.types.observation import Frame, Mask, Rgb
from forestall.types.plan import Subtask

from .synthetic import Solid, at, looking, observed

NEAR = looking((0.0, -0.7, 1.65), (0.0, 0.3, 0.9))
FAR = looking((0.0, -1.6, 1.65), (0.0, 0.3, 0.9))
AWAY = looking((0.0, -0.7, 1.65), (0.0, -3.0, 0.9))
FLOOR = Solid("Floor-1", (-4.0, -6.0, -0.02), (4.0, 4.0, 0.0))
COUNTER = Solid("CounterTop-1", (-1.0, 0.0, 0.86), (1.0, 0.6, 0.9))
MUG = at("Mug-1", 0.1, 0.3, 0.9, (0.085, 0.085, 0.10), True)
SCENE = [COUNTER, MUG]


class ColourAndSize:
    """Tells a crop by its mean colour and how many pixels it has."""

    name = "colour and size"

    def __init__(self) -> None:
        self.asked = 0

    def encode_crops(self, rgb: Rgb, masks: Sequence[Mask]) -> npt.NDArray[np.float32]:
        self.asked += len(masks)
        return np.stack([self._row(rgb[m]) for m in masks])

    def encode_image(self, rgb: Rgb) -> npt.NDArray[np.float32]:
        return self._row(rgb.reshape(-1, 3))

    def _row(self, pixels: Rgb) -> npt.NDArray[np.float32]:
        row = np.array([*pixels.mean(axis=0), 10 * np.sqrt(len(pixels)), 1.0], dtype=np.float32)
        return row / np.linalg.norm(row)


def perceiver(encoder: ImageEncoder | None) -> GraphPerceiver:
    return GraphPerceiver(
        InstanceSegmenter(), GivenStateEstimator({}), shipped("household"), image_encoder=encoder
    )


def feature_in(frame: Frame, name: str) -> bytes:
    mask = next(d.mask for d in InstanceSegmenter().segment(frame) if d.instance == name)
    return quantised(ColourAndSize().encode_crops(frame.rgb, [mask])[0])


def test_every_located_thing_has_the_feature_of_its_crop() -> None:
    eyes = perceiver(ColourAndSize())
    observation = observed(SCENE, NEAR)
    graph = eyes.perceive(observation)
    found = {n.id: n.feature for n in graph.nodes}
    frame = observation.frames[0]
    assert found == {
        "CounterTop-1": feature_in(frame, "CounterTop-1"),
        "Mug-1": feature_in(frame, "Mug-1"),
        "gripper": None,
    }
    assert found["Mug-1"] != found["CounterTop-1"]
    scoped = eyes.scope(graph, Subtask.parse("pick_up(Mug-1)")).get("Mug-1")
    assert scoped is not None and scoped.feature == found["Mug-1"]
    assert eyes.describe()["features"] == "colour and size"


def test_without_an_encoder_there_are_none_and_nothing_else_changes() -> None:
    observation = observed(SCENE, NEAR)
    bare = perceiver(None).perceive(observation)
    assert all(n.feature is None for n in bare.nodes)
    pictured = perceiver(ColourAndSize()).perceive(observation)
    assert replace(pictured, nodes=tuple(replace(n, feature=None) for n in pictured.nodes)) == bare
    assert "features" not in perceiver(None).describe()


@pytest.mark.parametrize("poses", [(NEAR, FAR), (FAR, NEAR)])
def test_the_largest_sighting_of_an_observation_counts(poses: tuple[np.ndarray, ...]) -> None:
    observation = observed(SCENE, *poses)
    near, far = (feature_in(observed(SCENE, p).frames[0], "Mug-1") for p in (NEAR, FAR))
    node = perceiver(ColourAndSize()).perceive(observation).get("Mug-1")
    assert near != far
    assert node is not None and node.feature == near


def test_the_newest_observation_counts_and_what_is_out_of_view_keeps_its_own() -> None:
    eyes = perceiver(ColourAndSize())
    eyes.perceive(observed(SCENE, NEAR))
    far = observed(SCENE, FAR, time_s=1.0)
    eyes.perceive(far)
    node = eyes.perceive(observed([*SCENE, FLOOR], AWAY, time_s=2.0)).get("Mug-1")
    assert node is not None and node.seen is Seen.REMEMBERED
    assert node.feature == feature_in(far.frames[0], "Mug-1")
    eyes.reset()
    assert eyes.perceive(observed([*SCENE, FLOOR], AWAY, time_s=3.0)).get("Mug-1") is None


def test_what_has_no_depth_is_not_encoded() -> None:
    encoder = ColourAndSize()
    observation = observed(SCENE, NEAR)
    frame = observation.frames[0]
    mug = next(d.mask for d in InstanceSegmenter().segment(frame) if d.instance == "Mug-1")
    depth = np.where(mug, np.float32(0), frame.depth_m)
    eyes = perceiver(encoder)
    graph = eyes.perceive(replace(observation, frames=(replace(frame, depth_m=depth),)))
    node = graph.get("Mug-1")
    assert node is not None and node.centroid_m is None and node.feature is None
    assert encoder.asked == 1
    blind = replace(frame, depth_m=np.zeros_like(depth), colour_only=True)
    eyes.perceive(replace(observation, frames=(blind,)))
    assert encoder.asked == 1


@pytest.mark.parametrize(
    ("answer", "says"),
    [
        (np.ones((1, 4), np.float32), r"shape \(1, 4\) for 2 masks"),
        (np.ones(2, np.float32), r"shape \(2,\) for 2 masks"),
        (np.full((2, 4), np.nan, np.float32), "finite numbers"),
        (np.zeros((2, 4), np.float32), "not all zero"),
    ],
)
def test_an_encoder_that_answers_wrongly_is_named(
    answer: npt.NDArray[np.float32], says: str
) -> None:
    class Broken(ColourAndSize):
        def encode_crops(self, rgb: Rgb, masks: Sequence[Mask]) -> npt.NDArray[np.float32]:
            return answer

    with pytest.raises(PerceptionError, match=f"image encoder 'colour and size'.*{says}"):
        perceiver(Broken()).perceive(observed(SCENE, NEAR))
