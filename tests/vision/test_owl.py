from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from forestall.types.observation import Rgb
from forestall.vision.owl import Owlv2Finder

from . import tiny

PHRASES = ["mug", "apple", "plate"]


@pytest.fixture(scope="module")
def folder(checkpoint: Callable[[str], Path]) -> Path:
    return checkpoint("owlv2")


@pytest.fixture(scope="module")
def owl(folder: Path) -> Owlv2Finder:
    return Owlv2Finder(str(folder), least_score=0.0, batch=2)


def test_boxes_are_those_of_transformers(folder: Path, owl: Owlv2Finder, rgb: Rgb) -> None:
    torch, transformers = tiny.libraries()
    model = transformers.Owlv2ForObjectDetection.from_pretrained(folder).eval()
    processor = transformers.Owlv2Processor(
        transformers.Owlv2ImageProcessorPil.from_pretrained(folder),
        transformers.CLIPTokenizer.from_pretrained(folder),
    )
    asked = ["a photo of a mug", "a photo of an apple", "a photo of a plate"]
    inputs = processor(
        text=[asked],
        images=[rgb],
        return_tensors="pt",
        padding="max_length",
        max_length=32,
        truncation=True,
    )
    with torch.inference_mode():
        out = model(**inputs)
    expected = processor.post_process_grounded_object_detection(
        out, threshold=0.0, target_sizes=[rgb.shape[:2]], text_labels=[PHRASES]
    )[0]
    high, wide = rgb.shape[:2]
    theirs = []
    for corners, score, phrase in zip(
        expected["boxes"].tolist(),
        expected["scores"].tolist(),
        expected["text_labels"],
        strict=True,
    ):
        left, top, right, bottom = np.clip(corners, 0, [wide, high, wide, high])
        if left < right and top < bottom:
            theirs.append((phrase, score, (left, top, right, bottom)))
    mine = owl.find([rgb], PHRASES)[0]
    assert theirs
    assert [b.phrase for b in mine] == [phrase for phrase, _, _ in theirs]
    assert np.allclose([b.score for b in mine], [score for _, score, _ in theirs], atol=1e-5)
    assert np.allclose([b.corners for b in mine], [c for _, _, c in theirs], atol=1e-3)


def test_answers_do_not_depend_on_the_batch(folder: Path, owl: Owlv2Finder, rgb: Rgb) -> None:
    pictures = [rgb, rgb[:, :30], rgb[::-1].copy()]
    alone = Owlv2Finder(str(folder), least_score=0.0, batch=1)
    for mine, one in zip(owl.find(pictures, PHRASES), pictures, strict=True):
        theirs = alone.find([one], PHRASES)[0]
        assert [b.phrase for b in mine] == [b.phrase for b in theirs]
        assert np.allclose([b.corners for b in mine], [b.corners for b in theirs], atol=1e-3)
        assert all(b.corners[2] <= one.shape[1] and b.corners[3] <= one.shape[0] for b in mine)


def test_nothing_asked_and_nothing_sure(folder: Path, owl: Owlv2Finder, rgb: Rgb) -> None:
    assert owl.find([rgb, rgb], []) == [[], []]
    assert owl.find([], PHRASES) == []
    assert owl.name == "owlv2:tiny-owlv2"
