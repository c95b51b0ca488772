from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from forestall.errors import InputError
from forestall.types.observation import Frame
from forestall.vision.sam import SamOutliner

from . import tiny

BOXES = [(3.0, 4.0, 30.0, 40.0), (50.0, 10.0, 70.0, 30.0), (0.0, 0.0, 80.0, 48.0)]


@pytest.fixture(scope="module")
def sam(checkpoint: Callable[[str], Path]) -> Path:
    return checkpoint("sam")


@pytest.fixture(scope="module")
def sam2(checkpoint: Callable[[str], Path]) -> Path:
    return checkpoint("sam2")


def test_masks_of_sam_are_those_of_transformers(sam: Path, frame: Frame) -> None:
    torch, transformers = tiny.libraries()
    model = transformers.SamModel.from_pretrained(sam).eval()
    processor = transformers.SamProcessor(transformers.SamImageProcessorPil.from_pretrained(sam))
    inputs = processor(
        images=frame.rgb, input_boxes=[[list(b) for b in BOXES]], return_tensors="pt"
    )
    with torch.inference_mode():
        out = model(
            pixel_values=inputs["pixel_values"],
            input_boxes=inputs["input_boxes"].float(),
            multimask_output=False,
        )
    expected = processor.post_process_masks(
        out.pred_masks, inputs["original_sizes"], inputs["reshaped_input_sizes"]
    )[0]
    mine = SamOutliner(str(sam)).outline(frame, BOXES)
    assert [m.shape for m in mine] == [(48, 80)] * 3 and mine[0].dtype == np.bool_
    for mask, theirs in zip(mine, expected[:, 0].numpy(), strict=True):
        assert np.mean(mask != theirs) < 0.02  # they round the box to whole pixels
    assert any(m.any() for m in mine)


def test_masks_of_sam2_are_the_models_own(sam2: Path, frame: Frame) -> None:
    torch, transformers = tiny.libraries()
    outliner = SamOutliner(str(sam2))
    assert outliner.name == "sam2:tiny-sam2" and outliner.exact
    mine = outliner.outline(frame, BOXES)
    model = transformers.Sam2Model.from_pretrained(sam2).eval()
    pixels, shown = outliner._pixels(frame.rgb)
    assert pixels.shape == (1, 3, tiny.PIXELS, tiny.PIXELS) and shown == (64, 64)
    scale = np.array([64 / 80, 64 / 48] * 2)
    boxes = torch.tensor((np.array(BOXES) * scale)[None], dtype=torch.float32)
    with torch.inference_mode():
        out = model(
            pixel_values=torch.from_numpy(pixels), input_boxes=boxes, multimask_output=False
        )
        logits = torch.nn.functional.interpolate(out.pred_masks[0], (48, 80), mode="bilinear")
    for mask, theirs in zip(mine, (logits[:, 0] > 0).numpy(), strict=True):
        assert np.array_equal(mask, theirs)


def test_masks_do_not_depend_on_the_batch(sam: Path, sam2: Path, frame: Frame) -> None:
    for folder in (sam, sam2):
        at_once = SamOutliner(str(folder)).outline(frame, BOXES)
        one_by_one = SamOutliner(str(folder), batch=1).outline(frame, BOXES)
        for a, b in zip(at_once, one_by_one, strict=True):
            assert np.mean(a != b) < 0.005
        assert SamOutliner(str(folder)).outline(frame, []) == []


def test_published_weights_of_the_video_model_are_read(sam2: Path, frame: Frame) -> None:
    config = sam2 / "config.json"
    text = config.read_text()
    config.write_text(text.replace('"model_type": "sam2"', '"model_type": "sam2_video"'))
    try:
        outliner = SamOutliner(str(sam2))
    finally:
        config.write_text(text)
    assert outliner.name == "sam2:tiny-sam2"
    assert len(outliner.outline(frame, BOXES)) == 3


def test_a_batch_holds_something() -> None:
    with pytest.raises(InputError, match="at least one box"):
        SamOutliner(batch=0)
