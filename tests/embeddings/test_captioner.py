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

from forestall.embeddings.captioner import BlipCaptioner
from forestall.errors import InputError, ModelFileError
from forestall.seams import Captioner
from forestall.types.graph import ObjectNode, SceneGraph
from forestall.types.observation import Frame, GripperState, Intrinsics, Observation

PIXELS = 32
WORDS = ("a", "mug", "on", "the", "table", "kitchen", "plate", "with", "sink", "open")


@pytest.fixture(autouse=True)
def no_network(monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(*_: Any) -> None:
        raise AssertionError("a connection was opened")

    monkeypatch.setattr(socket.socket, "connect", refuse)
    monkeypatch.delenv("FORESTALL_BLIP", raising=False)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A BLIP of two layers whose weights are random."""
    torch = pytest.importorskip("torch")
    transformers = pytest.importorskip("transformers")
    torch.manual_seed(0)
    entries = ["[PAD]", "[UNK]", "[CLS]", "[SEP]", "[MASK]", "[DEC]", *WORDS]
    tower = {
        "hidden_size": 32,
        "intermediate_size": 64,
        "num_hidden_layers": 2,
        "num_attention_heads": 2,
        "initializer_range": 0.6,
    }
    config = transformers.BlipConfig(
        text_config={
            **tower,
            "vocab_size": len(entries),
            "encoder_hidden_size": 32,
            "max_position_embeddings": 64,
            "bos_token_id": entries.index("[DEC]"),
            "sep_token_id": entries.index("[SEP]"),
            "eos_token_id": entries.index("[SEP]"),
            "pad_token_id": 0,
        },
        vision_config={**tower, "image_size": PIXELS, "patch_size": 8},
        projection_dim=24,
    )
    path = tmp_path_factory.mktemp("models") / "tiny-blip"
    transformers.BlipForConditionalGeneration(config).save_pretrained(path)
    vocabulary = {entry: i for i, entry in enumerate(entries)}
    tokenizer = transformers.BertTokenizer(vocab=vocabulary, bos_token="[DEC]")
    tokenizer.save_pretrained(path)
    size = {"height": PIXELS, "width": PIXELS}
    transformers.BlipImageProcessorPil(size=size).save_pretrained(path)
    return path


@pytest.fixture(scope="module")
def blip(folder: Path) -> BlipCaptioner:
    return BlipCaptioner(str(folder), most_tokens=8)


def frame(seed: int) -> Frame:
    rgb = np.random.default_rng(seed).integers(0, 255, (40, 50, 3), dtype=np.uint8)
    camera = Intrinsics.from_vertical_fov(50, 40, 60.0)
    return Frame(rgb, np.zeros((40, 50), np.float32), camera, np.eye(4))


def observation(*seeds: int) -> Observation:
    return Observation(tuple(frame(s) for s in seeds), GripperState(None, (0.0, 0.0, 0.0)), 0.0)


NOTHING = SceneGraph(())


def test_the_last_picture_is_described_in_words(blip: BlipCaptioner) -> None:
    captioner: Captioner = blip
    texts = [captioner.caption(observation(seed), NOTHING) for seed in range(5)]
    assert all(set(t.split()) <= set(WORDS) for t in texts)
    assert len(set(texts)) > 1
    assert captioner.caption(observation(2, 4), NOTHING) == texts[4]
    things = SceneGraph((ObjectNode("Mug-1", "Mug"),))
    assert captioner.caption(observation(4), things) == texts[4]


def test_the_caption_is_computed_as_transformers_does(folder: Path) -> None:
    torch = pytest.importorskip("torch")
    transformers = pytest.importorskip("transformers")
    model = transformers.BlipForConditionalGeneration.from_pretrained(folder).eval()
    processor = transformers.BlipProcessor.from_pretrained(folder)
    mine = BlipCaptioner(str(folder), beams=1, most_tokens=6)
    for seed in range(2):
        inputs = processor(images=Image.fromarray(frame(seed).rgb), return_tensors="pt")
        with torch.inference_mode():
            out = model.generate(**inputs, max_new_tokens=6, do_sample=False, num_beams=1)
        expected = processor.decode(out[0], skip_special_tokens=True).strip()
        assert mine.caption(observation(seed), NOTHING) == expected


def test_name(blip: BlipCaptioner, folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    assert blip.name == "blip:tiny-blip"
    monkeypatch.setenv("FORESTALL_BLIP", str(folder))
    assert BlipCaptioner().name == "blip:tiny-blip"


def test_no_such_device(folder: Path) -> None:
    with pytest.raises(InputError, match="device 'abacus'"):
        BlipCaptioner(str(folder), device="abacus")


def test_damaged_and_wrong_models(folder: Path, tmp_path: Path) -> None:
    torn = shutil.copytree(folder, tmp_path / "torn")
    weights = torn / "model.safetensors"
    weights.write_bytes(weights.read_bytes()[:-50])
    with pytest.raises(ModelFileError, match="torn cannot be loaded"):
        BlipCaptioner(str(torn))
    other = shutil.copytree(folder, tmp_path / "other")
    config = json.loads((other / "config.json").read_text())
    (other / "config.json").write_text(json.dumps({"model_type": "bert"}))
    with pytest.raises(ModelFileError, match="holds a 'bert' model and no BLIP"):
        BlipCaptioner(str(other))
    config["vision_config"]["num_hidden_layers"] = 3
    (other / "config.json").write_text(json.dumps(config))
    with pytest.raises(ModelFileError, match="lacks weights"):
        BlipCaptioner(str(other))


@pytest.mark.parametrize("missing", ["torch", "transformers"])
def test_missing_packages_name_the_extra(missing: str, monkeypatch: pytest.MonkeyPatch) -> None:
    for name in ("torch", "transformers"):
        monkeypatch.setitem(sys.modules, name, ModuleType(name))
    monkeypatch.setitem(sys.modules, missing, None)
    with pytest.raises(InputError, match=rf"{missing}.*pip install 'forestall\[vision\]'"):
        BlipCaptioner()


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
        BlipCaptioner()
    assert "snapshot_download('Salesforce/blip-image-captioning-base'" in str(error.value)
    assert "FORESTALL_BLIP" in str(error.value)


@pytest.mark.parametrize("option", ["beams", "most_tokens"])
def test_at_least_one(option: str) -> None:
    with pytest.raises(InputError, match="at least 1"):
        BlipCaptioner(**{option: 0})  # type: ignore[arg-type]
