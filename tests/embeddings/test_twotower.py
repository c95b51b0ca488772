"""The encoder that is shipped, and files that cannot be used."""

import json
import shutil
from pathlib import Path

import numpy as np
import pytest

from forestall.domain.load import load_domain
from forestall.embeddings.twotower import (
    DESCRIPTION_NAME,
    Description,
    TwoTowerEncoder,
    checksums,
    shipped,
)
from forestall.errors import InputError, ModelFileError


@pytest.fixture(scope="module")
def encoder() -> TwoTowerEncoder:
    return TwoTowerEncoder()


@pytest.fixture
def copy(tmp_path: Path) -> Path:
    return Path(shutil.copytree(shipped(), tmp_path / "encoder"))


def unchecked(folder: Path) -> None:
    """As an encoder whose description was written without checksums."""
    path = folder / DESCRIPTION_NAME
    path.write_text(json.dumps(json.loads(path.read_text()) | {"sha256": {}}))


def test_the_shipped_towers_have_their_checksums(copy: Path) -> None:
    description = Description.read(shipped() / DESCRIPTION_NAME)
    assert description.sha256 == checksums(shipped())
    path = copy / "text.onnx"
    data = bytearray(path.read_bytes())
    data[len(data) // 2] ^= 1
    path.write_bytes(data)
    with pytest.raises(ModelFileError, match=r"text\.onnx is damaged \(its SHA-256"):
        TwoTowerEncoder(copy)


def test_it_is_small_enough_to_ship() -> None:
    assert sum(p.stat().st_size for p in shipped().iterdir()) < 10_000_000


def test_rows_are_of_unit_length_and_the_same_every_time(encoder: TwoTowerEncoder) -> None:
    rng = np.random.default_rng(0)
    rgb = rng.integers(0, 255, (480, 640, 3), dtype=np.uint8)
    masks = [rng.random((480, 640)) < 0.001 * k for k in range(1, 4)]
    rows = encoder.encode_crops(rgb, masks)
    assert rows.dtype == np.float32
    assert np.allclose(np.linalg.norm(rows, axis=1), 1, atol=1e-5)
    assert np.array_equal(rows, encoder.encode_crops(rgb, masks))
    assert np.array_equal(TwoTowerEncoder().encode_crops(rgb.copy(), masks), rows)
    assert encoder.encode_image(rgb).shape == rows[0].shape
    assert encoder.encode_crops(rgb, []).shape == (0, rows.shape[1])
    assert encoder.encode([]).shape == (0, rows.shape[1])


def test_texts_that_say_the_same_are_near(encoder: TwoTowerEncoder) -> None:
    said = ["pick up Mug", "grasp the coffee mug", "pick up Plate", "open the fridge"]
    rows = encoder.encode(said)
    cosines = rows @ rows[0]
    assert cosines[1] > cosines[2] and cosines[1] > cosines[3]


def test_values_of_an_attribute_are_told_apart(encoder: TwoTowerEncoder) -> None:
    domain = load_domain("household")
    for category, attribute in (("Microwave", "open"), ("Mug", "filled"), ("Plate", "dirty")):
        texts = [domain.phrases(category, attribute, v)[0] for v in domain.values(attribute)]
        rows = encoder.encode(texts)
        cosines = rows @ rows.T - 2 * np.eye(len(rows))
        assert cosines.max() < 0.8, (texts, cosines)


@pytest.mark.parametrize("text", ["開いた電子レンジ", "", "—", "открытая дверь"])
def test_another_script_is_refused(encoder: TwoTowerEncoder, text: str) -> None:
    with pytest.raises(InputError, match="Latin letters only"):
        encoder.encode(["a mug", text])


def test_crops_of_another_shape_are_refused(encoder: TwoTowerEncoder) -> None:
    with pytest.raises(InputError, match=r"must be \(n, 64, 64, 4\)"):
        encoder.encode_pixels(np.zeros((1, 32, 32, 4), dtype=np.uint8))


def test_a_missing_folder_is_named(tmp_path: Path) -> None:
    with pytest.raises(ModelFileError, match=r"there is no encoder at .*nowhere.*reinstall"):
        TwoTowerEncoder(tmp_path / "nowhere")


@pytest.mark.parametrize("name", ["image.onnx", "text.onnx", DESCRIPTION_NAME])
def test_a_missing_file_is_named(copy: Path, name: str) -> None:
    (copy / name).unlink()
    with pytest.raises(ModelFileError, match=f"no encoder at .*{name}"):
        TwoTowerEncoder(copy)


@pytest.mark.parametrize("kept", [0, 100, 100_000])
def test_a_damaged_tower_is_named(copy: Path, kept: int) -> None:
    unchecked(copy)
    path = copy / "image.onnx"
    path.write_bytes(path.read_bytes()[:kept] + b"damage")
    with pytest.raises(ModelFileError, match=r"image\.onnx is damaged"):
        TwoTowerEncoder(copy)


def test_an_empty_tower_is_named(copy: Path) -> None:
    unchecked(copy)
    (copy / "image.onnx").write_bytes(b"")
    with pytest.raises(ModelFileError, match=r"image\.onnx is damaged"):
        TwoTowerEncoder(copy)


def test_towers_that_were_swapped_are_named(copy: Path) -> None:
    unchecked(copy)
    shutil.copy(copy / "text.onnx", copy / "image.onnx")
    with pytest.raises(ModelFileError, match=r"image\.onnx is no image tower"):
        TwoTowerEncoder(copy)


def test_an_operator_that_this_onnxruntime_lacks_is_named(copy: Path) -> None:
    unchecked(copy)
    path = copy / "image.onnx"
    data = path.read_bytes()
    assert data.count(b"Relu") > 1
    path.write_bytes(data.replace(b"\x04Relu", b"\x04Rxlu"))
    with pytest.raises(ModelFileError, match=r"cannot run .*image.onnx.*Rxlu.*--upgrade"):
        TwoTowerEncoder(copy)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"format": 99}, "has format 99"),
        ({"reading": {"scale": "large"}}, "cannot be read"),
        ({"reading": {"scale": -1.0}}, "above 0"),
        ({"known": None}, "cannot be read"),
    ],
)
def test_a_description_that_does_not_fit_is_named(
    copy: Path, change: dict[str, object], message: str
) -> None:
    path = copy / DESCRIPTION_NAME
    path.write_text(json.dumps(json.loads(path.read_text()) | change))
    with pytest.raises(ModelFileError, match=message):
        TwoTowerEncoder(copy)


def test_without_onnxruntime_there_is_a_clear_error(monkeypatch: pytest.MonkeyPatch) -> None:
    import sys

    monkeypatch.setitem(sys.modules, "onnxruntime", None)
    with pytest.raises(ModelFileError, match=r"forestall\[perception\]"):
        TwoTowerEncoder()
