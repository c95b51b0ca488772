from __future__ import annotations

import numpy as np
import pytest
from baseline_samples import Said, graph, node, observation, reference

from forestall.detection.caption import CaptionDetector
from forestall.detection.scene_graph import DetectorConfig
from forestall.domain.load import shipped
from forestall.embeddings import HashedTextEncoder
from forestall.embeddings.captions import ListingCaptioner
from forestall.embeddings.twotower import TwoTowerEncoder
from forestall.embeddings.views import caption_rows, view_of
from forestall.errors import InputError
from forestall.seams import Detector
from forestall.types.demonstration import View
from forestall.types.graph import Relation
from forestall.types.verdict import Decision

TEXTS = HashedTextEncoder()


def said(text: str) -> View:
    return View(caption=text, captioner="said")


def test_the_best_caption_counts() -> None:
    detector: Detector = CaptionDetector(Said("A clean plate."), TEXTS)
    references = [reference("a", said("A red sofa.")), reference("b", said("a clean plate"))]
    verdict = detector.judge(graph("Mug-1"), observation(), references)
    assert verdict.nearest is references[1]
    assert verdict.score == pytest.approx(1.0, abs=0.02)
    assert (verdict.detector, verdict.decision) == ("caption", Decision.PROCEED)


def test_another_caption_is_flagged_below_the_threshold() -> None:
    references = [reference("a", said("A clean plate. An open microwave."))]
    scores = {}
    for threshold, decision in ((0.9, Decision.REPLAN), (0.1, Decision.PROCEED)):
        detector = CaptionDetector(
            Said("A dirty plate. An open microwave."), TEXTS, DetectorConfig(threshold)
        )
        verdict = detector.judge(graph("Mug-1"), observation(), references)
        assert verdict.decision is decision
        scores[threshold] = verdict.score
    assert scores[0.9] is not None and 0.5 < scores[0.9] < 0.9


def test_relations_do_not_show_in_a_listing() -> None:
    captioner = ListingCaptioner(shipped("household"))
    apart = graph(node("Mug-1", filled="empty"), "Pot-1")
    links = (Relation("Pot-1", "blocking", "Mug-1"),)
    blocked = graph(node("Mug-1", filled="empty"), "Pot-1", links=links)
    expected = reference("a", view_of(observation(), apart, None, captioner))
    detector = CaptionDetector(captioner, TEXTS)
    verdict = detector.judge(blocked, observation(), [expected])
    assert (verdict.score, verdict.decision) == (1.0, Decision.PROCEED)
    filled = graph(node("Mug-1", filled="coffee"), "Pot-1")
    verdict = detector.judge(filled, observation(), [expected])
    assert verdict.decision is Decision.REPLAN


def test_nothing_said_is_like_nothing() -> None:
    verdict = CaptionDetector(Said(""), TEXTS).judge(
        graph(), observation(), [reference("a", said("A mug.")), reference("b", said(""))]
    )
    assert (verdict.score, verdict.decision) == (0.0, Decision.REPLAN)
    verdict = CaptionDetector(Said(""), TEXTS).judge(
        graph(), observation(), [reference("b", said(""))]
    )
    assert (verdict.score, verdict.decision) == (None, Decision.PROCEED)
    assert verdict.note == "nothing to compare with: nothing is said of either side"


def test_without_a_caption_nothing_is_judged() -> None:
    verdict = CaptionDetector(Said(), TEXTS).judge(graph(), observation(), [reference("a")])
    assert (verdict.score, verdict.decision) == (None, Decision.PROCEED)
    assert verdict.note == "nothing to compare with: no reference keeps a caption"


def test_captions_of_another_captioner_are_refused() -> None:
    other = View(caption="A mug.", captioner="blip:base")
    with pytest.raises(InputError, match="caption of demonstration a comes from blip:base"):
        CaptionDetector(Said("A mug."), TEXTS).judge(
            graph(), observation(), [reference("a", other)]
        )


def test_of_a_long_caption_every_sentence_counts() -> None:
    encoder = TwoTowerEncoder()
    start = "A clean plate. An open microwave. A whole potato. A faucet that is off. "
    one, other, again = caption_rows(
        encoder, [start + "A dirty pan.", start + "A closed laptop.", start + "A dirty pan."]
    )
    assert np.linalg.norm(one) == pytest.approx(1.0, abs=1e-5)
    assert one @ again == pytest.approx(1.0, abs=1e-5)
    assert one @ other < 0.99


def test_one_sentence_is_embedded_as_it_stands() -> None:
    row = caption_rows(TEXTS, ["a mug next to a sink"])[0]
    assert np.allclose(row, TEXTS.encode(["a mug next to a sink"])[0], atol=1e-6)
