from __future__ import annotations

import json
import shutil
import socket
import sys
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest
from PIL import Image

from forestall.embeddings.clip import ClipEncoder
from forestall.embeddings.contrastive import shown
from forestall.embeddings.crops import crop
from forestall.errors import InputError, ModelFileError

PIXELS = 32
WIDTH = 24


@pytest.fixture(autouse=True)
def no_network(monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(*_: Any) -> None:
        raise AssertionError("a connection was opened")

    monkeypatch.setattr(socket.socket, "connect", refuse)
    monkeypatch.delenv("FORESTALL_CLIP", raising=False)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A CLIP of two layers whose weights are random."""
    torch = pytest.importorskip("torch")
    transformers = pytest.importorskip("transformers")
    torch.manual_seed(0)
    letters = "abcdefghijklmnopqrstuvwxyz0123456789"
    entries = [*letters, *(f"{c}</w>" for c in letters), "<|startoftext|>", "<|endoftext|>"]
    tower = {
        "hidden_size": 32,
        "intermediate_size": 64,
        "num_hidden_layers": 2,
        "num_attention_heads": 2,
        "initializer_factor": 8.0,
    }
    config = transformers.CLIPConfig(
        text_config={
            **tower,
            "vocab_size": len(entries),
            "max_position_embeddings": 40,
            "bos_token_id": len(entries) - 2,
            "eos_token_id": len(entries) - 1,
            "pad_token_id": len(entries) - 1,
        },
        vision_config={**tower, "image_size": PIXELS, "patch_size": 8},
        projection_dim=WIDTH,
    )
    path = tmp_path_factory.mktemp("models") / "tiny-clip"
    transformers.CLIPModel(config).save_pretrained(path)
    vocabulary = {entry: i for i, entry in enumerate(entries)}
    transformers.CLIPTokenizer(vocab=vocabulary, merges=[]).save_pretrained(path)
    size = {"height": PIXELS, "width": PIXELS}
    transformers.CLIPImageProcessorPil(
        size={"shortest_edge": PIXELS}, crop_size=size
    ).save_pretrained(path)
    return path


@pytest.fixture(scope="module")
def clip(folder: Path) -> ClipEncoder:
    return ClipEncoder(str(folder), batch=2)


def scene() -> tuple[np.ndarray, list[np.ndarray]]:
    rgb = np.random.default_rng(3).integers(0, 255, (60, 80, 3), dtype=np.uint8)
    masks = [np.zeros((60, 80), dtype=bool) for _ in range(3)]
    masks[0][5:25, 5:30] = True
    masks[1][30:55, 40:78] = True
    masks[2][10:14, 60:63] = True
    return rgb, masks


def test_texts_are_unit_rows(clip: ClipEncoder) -> None:
    texts = ["an open microwave", "a mug", "a mug filled with coffee", "a mug"]
    rows = clip.encode(texts)
    assert rows.shape == (4, WIDTH) and rows.dtype == np.float32
    assert np.allclose(np.linalg.norm(rows, axis=1), 1.0, atol=1e-5)
    assert np.array_equal(rows[1], rows[3])
    assert not np.allclose(rows[0], rows[1], atol=1e-3)
    assert clip.encode([]).shape == (0, WIDTH)


def test_rows_do_not_depend_on_the_batch(folder: Path, clip: ClipEncoder) -> None:
    rgb, masks = scene()
    texts = ["a mug", "a very dirty frying pan", "tv"]
    other = ClipEncoder(str(folder), batch=32)
    assert np.allclose(clip.encode(texts), other.encode(texts), atol=1e-5)
    assert np.allclose(clip.encode_crops(rgb, masks), other.encode_crops(rgb, masks), atol=1e-5)


def test_the_model_is_computed_as_transformers_does(folder: Path, clip: ClipEncoder) -> None:
    torch = pytest.importorskip("torch")
    transformers = pytest.importorskip("transformers")
    rgb, masks = scene()
    model = transformers.CLIPModel.from_pretrained(folder)
    tokenizer = transformers.CLIPTokenizer.from_pretrained(folder)
    processor = transformers.CLIPImageProcessorPil.from_pretrained(folder)
    with torch.inference_mode():
        answer = model(
            **tokenizer(["a mug", "a tv that is on"], padding=True, return_tensors="pt"),
            **processor([shown(crop(rgb, m, PIXELS)) for m in masks], return_tensors="pt"),
        )
    logits = clip.encode_crops(rgb, masks) @ clip.encode(["a mug", "a tv that is on"]).T
    logits = clip.reading.scale * logits
    assert np.allclose(logits, answer.logits_per_image.numpy(), atol=1e-4)


def test_long_texts_are_cut_off(clip: ClipEncoder) -> None:
    row = clip.encode(["a plate on a table " * 40])
    assert np.isfinite(row).all()


def test_crops_differ_and_frames_are_whole(clip: ClipEncoder) -> None:
    rgb, masks = scene()
    rows = clip.encode_crops(rgb, masks)
    assert rows.shape == (3, WIDTH) and rows.dtype == np.float32
    assert np.allclose(np.linalg.norm(rows, axis=1), 1.0, atol=1e-5)
    assert not np.allclose(rows[0], rows[1], atol=1e-3)
    assert clip.encode_crops(rgb, []).shape == (0, WIDTH)
    edge = rgb.copy()
    edge[:, 76:] = 255
    frame = clip.encode_image(rgb)
    assert frame.shape == (WIDTH,) and np.linalg.norm(frame) == pytest.approx(1.0, abs=1e-5)
    assert not np.allclose(frame, clip.encode_image(edge), atol=1e-4)


def test_an_empty_mask_gives_a_row(clip: ClipEncoder) -> None:
    rgb, masks = scene()
    assert np.isfinite(clip.encode_crops(rgb, [np.zeros_like(masks[0])])).all()


def test_only_what_lies_around_is_blurred() -> None:
    rgb, masks = scene()
    cut = crop(rgb, masks[1], 112)
    picture = np.asarray(shown(cut)).astype(int)
    inside, outside = cut[..., 3] == 255, cut[..., 3] == 0
    assert inside.any() and outside.any()
    assert np.array_equal(picture[inside], cut[..., :3][inside])
    sharp = np.asarray(Image.fromarray(cut[..., :3])).astype(int)
    assert picture[outside].std() < 0.5 * sharp[outside].std()


def test_reading_and_name(clip: ClipEncoder, folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    assert clip.name == "clip:tiny-clip"
    assert clip.reading.scale == pytest.approx(np.exp(2.6592), rel=1e-4)
    monkeypatch.setenv("FORESTALL_CLIP", str(folder))
    assert ClipEncoder().name == "clip:tiny-clip"


@pytest.mark.parametrize("text", ["", "—", "кружка"])
def test_unreadable_texts_are_refused(clip: ClipEncoder, text: str) -> None:
    assert not clip.readable(text)
    with pytest.raises(InputError, match="cannot read"):
        clip.encode(["a mug", text])


def test_no_such_device(folder: Path) -> None:
    with pytest.raises(InputError, match="device 'abacus'"):
        ClipEncoder(str(folder), device="abacus")


def test_damaged_and_wrong_models(folder: Path, tmp_path: Path) -> None:
    torn = shutil.copytree(folder, tmp_path / "torn")
    weights = torn / "model.safetensors"
    weights.write_bytes(weights.read_bytes()[:-50])
    with pytest.raises(ModelFileError, match="torn cannot be loaded"):
        ClipEncoder(str(torn))
    weights.unlink()
    with pytest.raises(ModelFileError, match="torn cannot be loaded"):
        ClipEncoder(str(torn))
    other = shutil.copytree(folder, tmp_path / "other")
    config = json.loads((other / "config.json").read_text())
    (other / "config.json").write_text(json.dumps({"model_type": "bert"}))
    with pytest.raises(ModelFileError, match="holds a 'bert' model and no CLIP"):
        ClipEncoder(str(other))
    config["vision_config"]["num_hidden_layers"] = 3
    (other / "config.json").write_text(json.dumps(config))
    with pytest.raises(ModelFileError, match="lacks weights"):
        ClipEncoder(str(other))


def test_a_downloaded_model_is_found(
    folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    hub = pytest.importorskip("huggingface_hub")
    monkeypatch.setattr(hub.constants, "HF_HUB_CACHE", str(tmp_path))
    with pytest.raises(ModelFileError, match=r"snapshot_download\('some-one/tiny-clip'"):
        ClipEncoder("some-one/tiny-clip")
    cached = tmp_path / "models--some-one--tiny-clip"
    shutil.copytree(folder, cached / "snapshots" / ("0" * 40))
    (cached / "refs").mkdir()
    (cached / "refs" / "main").write_text("0" * 40)
    assert ClipEncoder("some-one/tiny-clip").name == "clip:some-one/tiny-clip"


@pytest.mark.parametrize("missing", ["torch", "transformers"])
def test_missing_packages_name_the_extra(missing: str, monkeypatch: pytest.MonkeyPatch) -> None:
    for name in ("torch", "transformers"):
        monkeypatch.setitem(sys.modules, name, ModuleType(name))
    monkeypatch.setitem(sys.modules, missing, None)
    with pytest.raises(InputError, match=rf"{missing}.*pip install 'forestall\[vision\]'"):
        ClipEncoder()


def test_missing_weights_name_the_download(monkeypatch: pytest.MonkeyPatch) -> None:
    def absent(name: str, *, local_files_only: bool) -> str:
        assert local_files_only
        raise FileNotFoundError(name)

    for name in ("torch", "transformers"):
        monkeypatch.setitem(sys.modules, name, ModuleType(name))
    hub = ModuleType("huggingface_hub")
    monkeypatch.setattr(hub, "snapshot_download", absent, raising=False)
    monkeypatch.setitem(sys.modules, "huggingface_hub", hub)
    with pytest.raises(ModelFileError) as error:
        ClipEncoder()
    assert "snapshot_download('openai/clip-vit-base-patch32'" in str(error.value)
    assert "FORESTALL_CLIP" in str(error.value)


def test_a_batch_holds_something() -> None:
    with pytest.raises(InputError, match="at least one picture"):
        ClipEncoder(batch=0)
