"""Each detector says what it noticed of a mismatch, in what it sees and nothing else."""

from __future__ import annotations

from dataclasses import replace

from baseline_samples import MeanColour, Said, graph, node, observation, reference

from forestall.comparison.options import ScoreConfig
from forestall.comparison.score import BatchScorer
from forestall.detection.caption import CaptionDetector
from forestall.detection.image import ImageDetector
from forestall.detection.objects import ObjectCountDetector
from forestall.detection.scene_graph import DetectorConfig, SceneGraphDetector
from forestall.domain.load import shipped
from forestall.embeddings import HashedTextEncoder
from forestall.embeddings.views import view_of
from forestall.types.demonstration import View

DOMAIN, TEXTS = shipped("household"), HashedTextEncoder()
STRICT, LAX = DetectorConfig(1.0), DetectorConfig(0.0)


def test_the_captions_detector_tells_two_captions() -> None:
    then = reference("a", View(caption="A clean plate.", captioner="said"))
    detector = CaptionDetector(Said("A dirty plate.", "A dirty plate."), TEXTS, STRICT)
    seen, looked = graph("Mug-1"), observation()
    lines = detector.noticed(detector.judge(seen, looked, [then]), seen, looked)
    assert lines[:2] == ("now: A dirty plate.", "then: A clean plate.")
    assert "demonstration a" in lines[2] and "1.00 is asked for" in lines[2]


def test_the_image_detector_tells_the_nearest_picture_and_how_alike_it_is() -> None:
    encoder = MeanColour()
    red, green = observation((255, 0, 0)), observation((0, 255, 0))
    then = reference("a", view_of(red, graph("Mug-1"), encoder, None))
    detector = ImageDetector(encoder, STRICT)
    verdict = detector.judge(graph("Mug-1"), green, [then])
    (line,) = detector.noticed(verdict, graph("Mug-1"), green)
    assert "nearest picture" in line and "to 0.00; 1.00 is asked for" in line


def test_the_counting_detector_tells_two_lists() -> None:
    then = replace(reference("a", None), graph=graph("Mug-1"))
    detector = ObjectCountDetector(DOMAIN, STRICT)
    seen = graph("Mug-1", "Mug-2", "Bowl-1")
    assert detector.noticed(detector.judge(seen, None, [then]), seen, None) == (
        "now: 1 Bowl, 2 Mug",
        "then: 1 Mug",
    )


def test_the_scene_graph_tells_its_differences_and_nobody_tells_what_is_not_wrong() -> None:
    then = replace(reference("a", None), graph=graph(node("Mug-1", filled="empty")))
    seen = graph(node("Mug-1", filled="coffee"))
    scorer = BatchScorer(ScoreConfig(), TEXTS, DOMAIN)
    detector = SceneGraphDetector(scorer, STRICT)
    lines = detector.noticed(detector.judge(seen, None, [then]), seen, None)
    assert any("Mug-1" in x and "coffee" in x for x in lines)
    lax = SceneGraphDetector(scorer, LAX)
    assert lax.noticed(lax.judge(seen, None, [then]), seen, None) == ()
    few = ObjectCountDetector(DOMAIN, LAX)
    assert few.noticed(few.judge(seen, None, [then]), seen, None) == ()
