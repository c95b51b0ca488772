from __future__ import annotations

import json
import socket
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from forestall.embeddings.contrastive import shown
from forestall.embeddings.crops import crop
from forestall.embeddings.siglip import SiglipEncoder
from forestall.errors import InputError, ModelFileError
from vision import tiny

PIXELS, WIDTH, LENGTH = 32, 24, 16


@pytest.fixture(autouse=True)
def no_network(monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(*_: Any) -> None:
        raise AssertionError("a connection was opened")

    monkeypatch.setattr(socket.socket, "connect", refuse)
    monkeypatch.delenv("FORESTALL_SIGLIP", raising=False)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tiny.siglip(tmp_path_factory.mktemp("models") / "tiny-siglip")


def scene() -> tuple[np.ndarray, list[np.ndarray]]:
    rgb = np.random.default_rng(3).integers(0, 255, (60, 80, 3), dtype=np.uint8)
    masks = [np.zeros((60, 80), dtype=bool) for _ in range(2)]
    masks[0][5:25, 5:30] = True
    masks[1][30:55, 40:78] = True
    return rgb, masks


def test_the_model_is_computed_as_transformers_does(folder: Path) -> None:
    torch, transformers = tiny.libraries()
    siglip = SiglipEncoder(str(folder), batch=1)
    rgb, masks = scene()
    model = transformers.SiglipModel.from_pretrained(folder).eval()
    tokenizer = transformers.AutoTokenizer.from_pretrained(folder)
    processor = transformers.SiglipImageProcessorPil.from_pretrained(folder)
    texts = ["a mug", "a mug with coffee"]
    ids = tokenizer(texts, padding="max_length", max_length=LENGTH, return_tensors="pt").input_ids
    with torch.inference_mode():
        answer = model(
            input_ids=ids,
            **processor([shown(crop(rgb, m, PIXELS)) for m in masks], return_tensors="pt"),
        )
    logits = siglip.reading.scale * (siglip.encode_crops(rgb, masks) @ siglip.encode(texts).T)
    logits += model.logit_bias.detach().numpy()
    assert siglip.reading.scale == pytest.approx(np.exp(2.0), rel=1e-5)
    assert np.allclose(logits, answer.logits_per_image.numpy(), atol=1e-4)


def test_rows_are_unit_and_case_does_not_matter(folder: Path) -> None:
    siglip = SiglipEncoder(str(folder))
    rows = siglip.encode(["a mug", "A Mug", "an open microwave"])
    assert rows.shape == (3, WIDTH) and rows.dtype == np.float32
    assert np.allclose(np.linalg.norm(rows, axis=1), 1.0, atol=1e-5)
    assert np.array_equal(rows[0], rows[1]) and not np.allclose(rows[0], rows[2], atol=1e-3)
    assert siglip.encode_image(scene()[0]).shape == (WIDTH,)
    assert np.isfinite(siglip.encode(["a plate with a mug " * 20])).all()
    assert siglip.name == "siglip:tiny-siglip"
    with pytest.raises(InputError, match="cannot read"):
        siglip.encode(["кружка"])


def test_pictures_of_any_size_are_another_model(tmp_path: Path) -> None:
    tiny.libraries()
    (tmp_path / "naflex").mkdir()
    (tmp_path / "naflex" / "config.json").write_text(json.dumps({"model_type": "siglip2"}))
    with pytest.raises(ModelFileError, match="'siglip2' model and no SigLIP of a fixed picture"):
        SiglipEncoder(str(tmp_path / "naflex"))
