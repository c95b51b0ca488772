from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from forestall.errors import InputError
from forestall.seams import Finder
from forestall.types.observation import Rgb
from forestall.vision.grounding_dino import GroundingDinoFinder

from . import tiny

PHRASES = ["mug", "coffee machine", "plate"]


@pytest.fixture(scope="module")
def folder(checkpoint: Callable[[str], Path]) -> Path:
    return checkpoint("grounding_dino")


@pytest.fixture(scope="module")
def dino(folder: Path) -> GroundingDinoFinder:
    return GroundingDinoFinder(str(folder), least_score=0.0, batch=2)


def test_boxes_are_those_of_transformers(folder: Path, dino: GroundingDinoFinder, rgb: Rgb) -> None:
    torch, transformers = tiny.libraries()
    model = transformers.GroundingDinoForObjectDetection.from_pretrained(folder).eval()
    processor = transformers.GroundingDinoProcessor(
        transformers.GroundingDinoImageProcessorPil.from_pretrained(folder),
        transformers.BertTokenizer.from_pretrained(folder),
    )
    inputs = processor(images=[rgb], text=[PHRASES], return_tensors="pt")
    with torch.inference_mode():
        out = model(**inputs)
    expected = processor.post_process_grounded_object_detection(
        out, inputs["input_ids"], threshold=0.0, target_sizes=[rgb.shape[:2]]
    )[0]
    high, wide = rgb.shape[:2]
    limits = np.array([wide, high, wide, high])
    theirs = np.clip(expected["boxes"].numpy(), 0, limits)
    mine = dino.find([rgb], PHRASES)[0]
    assert len(mine) == len(theirs) == 20
    assert np.allclose([b.corners for b in mine], theirs, atol=1e-3)
    assert np.allclose([b.score for b in mine], expected["scores"].numpy(), atol=1e-5)
    assert {b.phrase for b in mine} <= set(PHRASES)


def test_a_box_is_called_what_its_tokens_say(dino: GroundingDinoFinder) -> None:
    prompt = dino._prompts(PHRASES)[0]
    names, lows, highs = zip(*prompt.spans, strict=True)
    assert names == tuple(PHRASES)
    assert all(low < high for low, high in zip(lows, highs, strict=True))
    logits = np.full((1, 64), -9.0, dtype=np.float32)
    logits[0, lows[1] : highs[1]] = 2.0
    logits[0, lows[2]] = 2.5
    box = dino._boxes(logits, np.array([[0.5, 0.5, 0.2, 0.2]], dtype=np.float32), prompt, (80, 48))
    assert [b.phrase for b in box] == ["coffee machine"]
    assert box[0].score == pytest.approx(1 / (1 + np.exp(-2.5)), abs=1e-5)


def test_many_phrases_go_in_several_prompts(dino: GroundingDinoFinder, rgb: Rgb) -> None:
    many = [f"{letter}{number} thing" for letter in "abcdefgh" for number in range(3)]
    prompts = dino._prompts(many)
    assert len(prompts) > 1
    assert [name for p in prompts for name, _, _ in p.spans] == many
    assert all(len(p.tokens) <= 64 for p in prompts)
    found = dino.find([rgb], many)[0]
    assert len(found) == 20 * len(prompts)


def test_answers_do_not_depend_on_the_batch(
    folder: Path, dino: GroundingDinoFinder, rgb: Rgb
) -> None:
    pictures = [rgb, rgb[:40], rgb[::-1].copy(), rgb[:, ::-1].copy()]
    alone = GroundingDinoFinder(str(folder), least_score=0.0, batch=1)
    together = dino.find(pictures, PHRASES)
    for mine, one in zip(together, pictures, strict=True):
        theirs = alone.find([one], PHRASES)[0]
        assert np.allclose([b.corners for b in mine], [b.corners for b in theirs], atol=1e-3)
    assert together[0] != together[3]


def test_unsure_boxes_are_left_out(folder: Path, dino: GroundingDinoFinder, rgb: Rgb) -> None:
    scores = sorted(b.score for b in dino.find([rgb], PHRASES)[0])
    finder: Finder = GroundingDinoFinder(str(folder), least_score=scores[5])
    assert sorted(b.score for b in finder.find([rgb], PHRASES)[0]) == scores[5:]
    assert scores[4] < scores[5]
    assert [list(found) for found in finder.find([rgb], [])] == [[]]
    assert finder.name == "grounding-dino:tiny-grounding_dino"


def test_a_phrase_that_is_too_long_is_named(dino: GroundingDinoFinder, rgb: Rgb) -> None:
    with pytest.raises(InputError, match="reads 62 at most"):
        dino.find([rgb], ["x" * 70])
