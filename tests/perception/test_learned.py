"""The learned estimator with an encoder whose vectors the tests choose."""

from collections.abc import Sequence

import numpy as np
import pytest

from forestall.domain.load import shipped
from forestall.errors import InputError
from forestall.perception.learned import LearnedStateEstimator
from forestall.types.encoder import StateReading
from forestall.types.observation import Detection, Frame, Intrinsics


class ColourEncoder:
    """Texts by the words of WORDS in them; crops by the mean red, green, blue under the mask."""

    name = "colours"
    asked = 0

    def __init__(self, reading: StateReading) -> None:
        self.reading = reading

    def encode(self, texts: Sequence[str]) -> np.ndarray:
        rows = []
        for text in texts:
            if not text.isascii():
                raise InputError(f"cannot read {text!r}")
            row = np.full(3, 0.01)
            row += [
                any(w in text for w in ("open", "inside")),
                any(w in text for w in ("closed", "shut")),
                0,
            ]
            rows.append(row / np.linalg.norm(row))
        return np.array(rows, dtype=np.float32)

    def encode_crops(self, rgb: np.ndarray, masks: Sequence[np.ndarray]) -> np.ndarray:
        self.asked += len(masks)
        rows = [rgb[m].mean(axis=0) + 1e-3 for m in masks]
        return np.array([r / np.linalg.norm(r) for r in rows], dtype=np.float32).reshape(-1, 3)

    def encode_image(self, rgb: np.ndarray) -> np.ndarray:
        raise NotImplementedError


READING = StateReading(scale=10.0, temperature={"": 1.0}, threshold={"": 0.9}, least_area=30)


def look(colour: tuple[int, int, int], size: int = 40) -> tuple[Frame, np.ndarray]:
    rgb = np.zeros((48, 64, 3), dtype=np.uint8)
    mask = np.zeros((48, 64), dtype=bool)
    edge = int(size**0.5)
    mask[:edge, :edge] = True
    rgb[mask] = colour
    depth = np.ones((48, 64), dtype=np.float32)
    intrinsics = Intrinsics.from_vertical_fov(64, 48, 60.0)
    return Frame(rgb, depth, intrinsics, np.eye(4)), mask


@pytest.mark.parametrize(
    ("colour", "said"),
    [((200, 0, 0), "open"), ((0, 200, 0), "closed"), ((200, 190, 0), None)],
)
def test_the_most_fitting_phrase_wins_unless_two_fit(
    colour: tuple[int, int, int], said: str | None
) -> None:
    estimator = LearnedStateEstimator(ColourEncoder(READING), shipped("household"))
    frame, mask = look(colour)
    assert estimator.estimate(frame, [Detection("Fridge", mask, "Fridge-1")]) == [{"open": said}]


def test_a_small_or_empty_mask_is_unobserved_and_not_encoded() -> None:
    encoder = ColourEncoder(READING)
    estimator = LearnedStateEstimator(encoder, shipped("household"))
    frame, mask = look((200, 0, 0), size=1)
    empty = np.zeros_like(mask)
    found = estimator.estimate(frame, [Detection("Fridge", mask), Detection("Drawer", empty)])
    assert found == [{"open": None}, {"open": None}]
    assert encoder.asked == 0


def test_what_has_no_attributes_or_no_category_says_nothing() -> None:
    encoder = ColourEncoder(READING)
    estimator = LearnedStateEstimator(encoder, shipped("household"))
    frame, mask = look((200, 0, 0))
    found = estimator.estimate(frame, [Detection("Floor", mask), Detection("Unicorn", mask)])
    assert found == [{}, {}]
    assert encoder.asked == 0


def test_no_camera_sees_temperature() -> None:
    estimator = LearnedStateEstimator(ColourEncoder(READING), shipped("household"))
    assert "temperature" not in {q.attribute for q in estimator.questions("Mug")}


def test_nothing_else_is_said_of_what_is_broken() -> None:
    class Shards(ColourEncoder):
        def encode(self, texts: Sequence[str]) -> np.ndarray:
            rows = [
                [1.0, 0.01, 0.0] if "broken" in t or "shards" in t or "clean" in t else [0.0, 1, 0]
                for t in texts
            ]
            return np.array(rows, dtype=np.float32)

    vocabulary = shipped("household")
    values = [vocabulary.phrases("Plate", "broken", v) for v in ("intact", "broken")]
    assert not any("broken" in t.split() for t in values[0])
    estimator = LearnedStateEstimator(Shards(READING), vocabulary)
    frame, mask = look((200, 0, 0))
    assert estimator.estimate(frame, [Detection("Plate", mask)]) == [
        {"dirty": None, "broken": "broken"}
    ]


def test_a_phrase_that_cannot_be_read_is_named() -> None:
    class Strict(ColourEncoder):
        def encode(self, texts: Sequence[str]) -> np.ndarray:
            raise InputError("cannot read 'x'")

    estimator = LearnedStateEstimator(Strict(READING), shipped("household"))
    frame, mask = look((200, 0, 0))
    with pytest.raises(InputError, match=r"open=closed of Fridge.*cannot read"):
        estimator.estimate(frame, [Detection("Fridge", mask)])


def test_a_reading_refuses_what_cannot_be_divided_by() -> None:
    with pytest.raises(InputError, match="above 0"):
        StateReading(scale=0.0)
    with pytest.raises(InputError, match="above 0"):
        StateReading(temperature={"open": 0.0})


@pytest.mark.parametrize(("temperature", "sure"), [({"": 1.0}, 0.99), ({}, 0.9)])
def test_what_nobody_has_calibrated_is_just_sure_enough(
    temperature: dict[str, float], sure: float
) -> None:
    reading = StateReading(10.0, temperature, {"": 0.9}, least_area=30)
    estimator = LearnedStateEstimator(ColourEncoder(reading), shipped("household"))
    frame, mask = look((200, 0, 0))
    [(states, told)] = estimator.estimate_with_confidence(
        frame, [Detection("Fridge", mask, "Fridge-1")]
    )
    assert states == {"open": "open"}
    assert told["open"] == pytest.approx(sure, abs=0.01)
