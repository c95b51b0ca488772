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

from forestall.embeddings.sentence import SentenceEncoder
from forestall.errors import InputError, ModelFileError

WIDTH = 16


@pytest.fixture(autouse=True)
def no_network(monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(*_: Any) -> None:
        raise AssertionError("a connection was opened")

    monkeypatch.setattr(socket.socket, "connect", refuse)
    monkeypatch.delenv("FORESTALL_SENTENCE_MODEL", raising=False)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A sentence encoder of two layers whose weights are random."""
    torch = pytest.importorskip("torch")
    transformers = pytest.importorskip("transformers")
    library = pytest.importorskip("sentence_transformers")
    modules = pytest.importorskip("sentence_transformers.sentence_transformer.modules")
    torch.manual_seed(0)
    base = tmp_path_factory.mktemp("models")
    words = ["[PAD]", "[UNK]", "[CLS]", "[SEP]", "[MASK]", "a", "mug", "pan", "dirty", "open"]
    plain = base / "bert"
    transformers.BertModel(
        transformers.BertConfig(
            vocab_size=len(words),
            hidden_size=WIDTH,
            num_hidden_layers=2,
            num_attention_heads=2,
            intermediate_size=32,
            max_position_embeddings=24,
        )
    ).save_pretrained(plain)
    vocabulary = {word: i for i, word in enumerate(words)}
    transformers.BertTokenizer(vocab=vocabulary).save_pretrained(plain)
    path = base / "tiny-sentences"
    body = modules.Transformer(str(plain), max_seq_length=24)
    pool = modules.Pooling(WIDTH)
    library.SentenceTransformer(modules=[body, pool], device="cpu").save_pretrained(
        str(path), create_model_card=False
    )
    return path


@pytest.fixture(scope="module")
def sentences(folder: Path) -> SentenceEncoder:
    return SentenceEncoder(str(folder))


def test_texts_are_unit_rows(sentences: SentenceEncoder) -> None:
    texts = ["a mug", "a dirty pan", "a mug", "a dirty mug " * 40]
    rows = sentences.encode(texts)
    assert rows.shape == (4, WIDTH) and rows.dtype == np.float32
    assert np.allclose(np.linalg.norm(rows, axis=1), 1.0, atol=1e-5)
    assert np.array_equal(rows[0], rows[2])
    assert not np.allclose(rows[0], rows[1], atol=1e-3)
    assert sentences.encode([]).shape == (0, WIDTH)


def test_it_is_the_mean_of_the_last_layer(folder: Path, sentences: SentenceEncoder) -> None:
    torch = pytest.importorskip("torch")
    transformers = pytest.importorskip("transformers")
    model = transformers.AutoModel.from_pretrained(folder)
    tokenizer = transformers.AutoTokenizer.from_pretrained(folder)
    with torch.inference_mode():
        layer = model(**tokenizer("an open mug", return_tensors="pt")).last_hidden_state[0].numpy()
    expected = layer.mean(axis=0) / np.linalg.norm(layer.mean(axis=0))
    assert np.allclose(sentences.encode(["an open mug"])[0], expected, atol=1e-5)


def test_name_and_environment(
    sentences: SentenceEncoder, folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert sentences.name == "sentence:tiny-sentences"
    monkeypatch.setenv("FORESTALL_SENTENCE_MODEL", str(folder))
    assert SentenceEncoder().name == "sentence:tiny-sentences"


@pytest.mark.parametrize("text", ["", "—", " ?! "])
def test_texts_without_a_word_are_refused(sentences: SentenceEncoder, text: str) -> None:
    with pytest.raises(InputError, match="cannot read"):
        sentences.encode(["a mug", text])


def test_no_such_device(folder: Path) -> None:
    with pytest.raises(InputError, match="device 'abacus'"):
        SentenceEncoder(str(folder), device="abacus")


def test_damaged_and_wrong_models(folder: Path, tmp_path: Path) -> None:
    torn = shutil.copytree(folder, tmp_path / "torn")
    weights = torn / "model.safetensors"
    weights.write_bytes(weights.read_bytes()[:-50])
    with pytest.raises(ModelFileError, match="torn cannot be loaded"):
        SentenceEncoder(str(torn))
    weights.unlink()
    with pytest.raises(ModelFileError, match="torn cannot be loaded"):
        SentenceEncoder(str(torn))
    other = shutil.copytree(folder, tmp_path / "other")
    config = json.loads((other / "config.json").read_text())
    (other / "config.json").write_text(json.dumps({**config, "num_hidden_layers": 3}))
    with pytest.raises(ModelFileError, match="other lacks weights"):
        SentenceEncoder(str(other))
    with pytest.raises(ModelFileError, match="holds no sentence encoder"):
        SentenceEncoder(str(folder.parent / "bert"))


@pytest.mark.parametrize("missing", ["torch", "sentence_transformers"])
def test_missing_packages_name_the_extra(missing: str, monkeypatch: pytest.MonkeyPatch) -> None:
    for name in ("torch", "sentence_transformers"):
        monkeypatch.setitem(sys.modules, name, ModuleType(name))
    monkeypatch.setitem(sys.modules, missing, None)
    with pytest.raises(InputError, match=rf"{missing}.*pip install 'forestall\[text\]'"):
        SentenceEncoder()


def test_missing_weights_name_the_download(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def absent(name: str, *, local_files_only: bool) -> str:
        assert local_files_only
        raise FileNotFoundError(name)

    for name in ("torch", "sentence_transformers"):
        monkeypatch.setitem(sys.modules, name, ModuleType(name))
    hub = ModuleType("huggingface_hub")
    monkeypatch.setattr(hub, "snapshot_download", absent, raising=False)
    monkeypatch.setitem(sys.modules, "huggingface_hub", hub)
    with pytest.raises(ModelFileError) as error:
        SentenceEncoder()
    assert "snapshot_download('sentence-transformers/all-MiniLM-L6-v2'" in str(error.value)
    assert "FORESTALL_SENTENCE_MODEL" in str(error.value)
    with pytest.raises(ModelFileError, match="neither a folder nor a model name"):
        SentenceEncoder(str(tmp_path / "nowhere"))


def test_a_batch_holds_something() -> None:
    with pytest.raises(InputError, match="at least one text"):
        SentenceEncoder(batch=0)
