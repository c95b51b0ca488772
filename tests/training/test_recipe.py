"""From pictures to an encoder, on pictures that the test paints: needs PyTorch."""

import json
from pathlib import Path

import numpy as np
import pytest

from forestall.domain.load import shipped
from forestall.embeddings.crops import INPUT_PIXELS
from forestall.embeddings.twotower import DESCRIPTION_NAME, TwoTowerEncoder
from forestall.errors import FileFormatError, InputError
from forestall.training import shards
from forestall.training.examine import answers, vectors
from forestall.training.measure import measure
from forestall.training.questions import ATTRIBUTES
from forestall.training.recipe import Recipe, train

COLOURS = {("Fridge", 0): (200, 30, 30), ("Fridge", 1): (30, 30, 200), ("Apple", 0): (30, 200, 30)}
"""Category and whether it is open → the colour in which the test paints it."""


def paint(folder: Path, split: str, count: int) -> None:
    """Closed fridges are red, open ones blue, apples green."""
    rng = np.random.default_rng([len(split), count])
    order = list(ATTRIBUTES)
    pixels, category, values, frame = [], [], [], []
    for i in range(count):
        (name, value), colour = list(COLOURS.items())[i % len(COLOURS)]
        square = np.full((shards.STORED_PIXELS, shards.STORED_PIXELS, 4), 90, dtype=np.uint8)
        square[..., 3] = 0
        square[20:60, 20:60, :3] = np.clip(np.add(colour, rng.integers(-25, 25, 3)), 0, 255)
        square[20:60, 20:60, 3] = 255
        row = [-1] * len(order)
        row[order.index("open" if name == "Fridge" else "sliced")] = value
        pixels.append(square)
        category.append(name)
        values.append(row)
        frame.append(i // 3)
        if i % 3 == 2:
            pixels.append(square)
            category.append("")
            values.append([-1] * len(order))
            frame.append(i // 3)
    (folder / split).mkdir(parents=True)
    np.savez(
        folder / split / "000000.npz",
        pixels=np.stack(pixels),
        category=np.array(category),
        values=np.array(values, dtype=np.int8),
        area=np.full(len(pixels), 900, dtype=np.int32),
        frame=np.array(frame, dtype=np.int32),
        held=np.zeros(len(pixels), dtype=bool),
        seen=np.full(len(pixels), ""),
    )
    (folder / shards.OPTIONS_NAME).write_text(json.dumps({"painted": True}), encoding="utf-8")


@pytest.fixture(scope="module")
def trained(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Path]:
    pytest.importorskip("torch")
    pytest.importorskip("onnx")
    folder = tmp_path_factory.mktemp("encoder")
    paint(folder / "pictures", "train", 90)
    paint(folder / "pictures", "development", 60)
    told: list[tuple[int, int, str]] = []
    with pytest.warns():  # PyTorch's exporter says that it is an old one
        train(
            folder / "pictures",
            folder / "model",
            shipped("household"),
            Recipe(seed=3, steps=25, batch=24),
            lambda done, total, what: told.append((done, total, what)),
        )
    assert any(what.startswith("state") for _, _, what in told)
    return folder / "pictures", folder / "model"


def test_what_was_painted_is_told_apart(trained: tuple[Path, Path]) -> None:
    pictures, model = trained
    encoder = TwoTowerEncoder(model)
    crops = shards.read(pictures, "development")
    rows = vectors(encoder, crops)
    assert np.allclose(np.linalg.norm(rows, axis=1), 1, atol=1e-4)
    found = measure(answers(encoder, rows, crops, shipped("household")))
    opened = next(g for g in found.attributes if g.attribute == "open")
    assert opened.figures.accuracy.value == 1.0
    assert opened.figures.n == 40


def test_the_description_says_how_it_was_made(trained: tuple[Path, Path]) -> None:
    _, model = trained
    data = json.loads((model / DESCRIPTION_NAME).read_text(encoding="utf-8"))
    assert data["training"]["seed"] == 3 and data["training"]["steps"] == 25
    assert data["training"]["crops"] == 90 and data["training"]["frames"] == 30
    assert data["training"]["pictures"] == {"painted": True}
    assert {"", "open", "sliced"} == set(data["reading"]["temperature"])
    assert "microwave" in data["known"]
    assert sum((model / f"{t}.onnx").stat().st_size for t in ("image", "text")) < 10e6


def test_the_same_seed_trains_the_same(trained: tuple[Path, Path], tmp_path: Path) -> None:
    import torch

    from forestall.training.fit import TrainConfig
    from forestall.training.fit import train as fit

    pictures, _ = trained
    crops = shards.read(pictures, "train")
    config = TrainConfig(seed=5, steps=2, batch=12)
    one, _ = fit(crops, shipped("household"), config, lambda *_: None)
    other, _ = fit(crops, shipped("household"), config, lambda *_: None)
    pairs = zip(one.state_dict().values(), other.state_dict().values(), strict=True)
    assert all(torch.equal(a, b) for a, b in pairs)


def test_too_small_a_batch_is_refused() -> None:
    pytest.importorskip("torch")
    from forestall.training.fit import TrainConfig

    with pytest.raises(InputError, match="batches of at least 8"):
        TrainConfig(batch=4)


def test_augmented_crops_keep_their_range() -> None:
    torch = pytest.importorskip("torch")
    from forestall.training.augment import augment

    stored = torch.randint(0, 256, (40, 80, 80, 4), dtype=torch.uint8)
    stored[..., 3] = 255 * (stored[..., 3] > 127)
    found = augment(stored, torch.Generator().manual_seed(0))
    assert found.shape == (40, 4, INPUT_PIXELS, INPUT_PIXELS)
    assert float(found.min()) >= 0 and float(found.max()) <= 255.01
    again = augment(stored, torch.Generator().manual_seed(0))
    assert torch.equal(found, again)


def test_without_pictures_there_is_a_clear_error(tmp_path: Path) -> None:
    with pytest.raises(FileFormatError, match="forestall encoder pictures"):
        shards.read(tmp_path, "train")
