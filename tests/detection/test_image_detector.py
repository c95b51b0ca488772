from __future__ import annotations

import pytest
from baseline_samples import MeanColour, graph, observation, reference

from forestall.detection.image import ImageDetector
from forestall.detection.scene_graph import DetectorConfig
from forestall.embeddings.views import image_feature, view_of
from forestall.errors import InputError
from forestall.seams import Detector
from forestall.types.demonstration import View
from forestall.types.verdict import Calibration, Decision

RED, GREEN, ORANGE = (200, 0, 0), (0, 200, 0), (200, 100, 0)
ENCODER = MeanColour()


def seen(*colours: tuple[int, int, int]) -> View:
    return view_of(observation(*colours), graph("Mug-1"), ENCODER, None)


def test_the_best_picture_counts() -> None:
    detector: Detector = ImageDetector(ENCODER)
    references = [reference("green", seen(GREEN)), reference("orange", seen(ORANGE))]
    verdict = detector.judge(graph("Mug-1"), observation(RED), references)
    assert verdict.score == pytest.approx(2 / 5**0.5, abs=0.01)
    assert verdict.nearest is references[1]
    assert verdict.decision is Decision.REPLAN
    assert (verdict.detector, verdict.threshold) == ("image", 0.9)
    assert verdict.calibration is Calibration.FIXED
    assert verdict.references == 2
    assert (verdict.parts, verdict.discrepancies, verdict.matches) == (None, (), ())
    verdict = ImageDetector(ENCODER, DetectorConfig(0.85)).judge(
        graph("Mug-1"), observation(RED), references
    )
    assert verdict.decision is Decision.PROCEED


def test_the_same_picture_fits() -> None:
    verdict = ImageDetector(ENCODER, DetectorConfig(1.0)).judge(
        graph(), observation(ORANGE), [reference("same", seen(ORANGE))]
    )
    assert (verdict.score, verdict.decision) == (1.0, Decision.PROCEED)


def test_the_last_frame_stands_for_an_observation() -> None:
    assert image_feature(ENCODER, observation(GREEN, RED)) == seen(RED).image
    assert image_feature(ENCODER, observation(RED, GREEN)) == seen(GREEN).image


@pytest.mark.parametrize("view", [None, View(caption="A mug.", captioner="said")])
def test_without_a_picture_nothing_is_judged(view: View | None) -> None:
    verdict = ImageDetector(ENCODER).judge(graph("Mug-1"), observation(RED), [reference("d", view)])
    assert (verdict.score, verdict.decision) == (None, Decision.PROCEED)
    assert verdict.calibration is Calibration.UNCALIBRATED
    assert verdict.note == "nothing to compare with: no reference keeps its picture"
    kept = reference("kept", seen(RED))
    verdict = ImageDetector(ENCODER).judge(
        graph("Mug-1"), observation(RED), [reference("d", view), kept]
    )
    assert verdict.nearest is kept
    assert verdict.note == "compared with 1 of 2 demonstrations"


def test_no_reference() -> None:
    verdict = ImageDetector(ENCODER).judge(graph("Mug-1"), observation(RED), [])
    assert (verdict.score, verdict.decision) == (None, Decision.PROCEED)
    assert "no reference was found" in verdict.note


def test_pictures_of_another_encoder_are_refused() -> None:
    other = View(image=seen(RED).image, encoder="clip:base")
    with pytest.raises(InputError, match="demonstration d comes from clip:base, this run's from m"):
        ImageDetector(ENCODER).judge(graph(), observation(RED), [reference("d", other)])
    longer = View(image=b"\x7f\x01\x01\x01", encoder="mean-colour")
    with pytest.raises(InputError, match="has 4 components, this run's 3"):
        ImageDetector(ENCODER).judge(graph(), observation(RED), [reference("d", longer)])
