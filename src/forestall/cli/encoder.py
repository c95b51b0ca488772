"""`forestall encoder`: make the pictures, train the image-text encoder on them, measure it."""

from __future__ import annotations

import json
import os
from pathlib import Path

from cyclopts import App

from forestall.cli.flags import Flag, Json

PICTURES = Path("runs/encoder/pictures")

encoder = App(name="encoder", help="Make, train and measure the image-text encoder.")


@encoder.command
def pictures(
    *,
    out: Path = PICTURES,
    train: int = 1060,
    development: int = 100,
    test: int = 160,
    unseen: int = 60,
    jobs: int | None = None,
    quiet: Flag = False,
) -> int:
    """Draw seeded scenes in every state and keep crops of what is in them; goes on after a kill.

    Args:
        out: folder of the pictures; what is in it already is not made again.
        train: scenes to train on.
        development: scenes to fit temperatures and thresholds on.
        test: scenes that figures come from.
        unseen: scenes with things that are not trained on.
        jobs: how many processes; all cores by default.
        quiet: no progress on standard error.
    """
    from forestall.cli.progress import bar
    from forestall.errors import InputError
    from forestall.training.shards import PictureConfig, make

    if jobs is not None and jobs < 1:
        raise InputError(f"--jobs {jobs}: at least 1 is needed")
    config = PictureConfig(train, development, test, unseen)
    with bar("drawing", quiet=quiet) as feed:
        make(out, config, jobs or os.cpu_count() or 1, feed)
    print(out)
    return 0


@encoder.command(name="train")
def train_(
    *,
    pictures: Path = PICTURES,
    out: Path = Path("runs/encoder/model"),
    steps: int = 5000,
    batch: int = 256,
    seed: int = 0,
    quiet: Flag = False,
) -> int:
    """Train both towers, export them to ONNX, fit temperatures and thresholds.

    Args:
        pictures: folder made by `forestall encoder pictures`.
        out: folder of the encoder: image.onnx, text.onnx, encoder.json.
        steps: batches to train on.
        batch: crops in each.
        seed: of everything that is drawn.
        quiet: no progress on standard error.
    """
    from forestall.cli.progress import bar
    from forestall.domain.load import shipped
    from forestall.training.recipe import Recipe, train

    with bar("training", quiet=quiet) as feed:
        train(pictures, out, shipped("household"), Recipe(seed, steps, batch), feed)
    print(out)
    return 0


@encoder.command(name="test")
def test_(
    *,
    pictures: Path = PICTURES,
    model: Path | None = None,
    out: Path = Path("runs/encoder/test"),
    split: str = "test",
    as_json: Json = False,
    quiet: Flag = False,
) -> int:
    """Measure an encoder on pictures that it was not trained on; tables and a page.

    Args:
        pictures: folder made by `forestall encoder pictures`.
        model: folder of the encoder; the shipped one by default.
        out: folder for the tables and the page.
        split: test, or development.
        as_json: print JSON.
        quiet: no progress on standard error.
    """
    from forestall.cli.progress import bar
    from forestall.training.report import examine

    with bar("measuring", quiet=quiet or as_json) as feed:
        data, page = examine(pictures, model, out, split, feed)
    if as_json:
        print(json.dumps(data, indent=2))
        return 0
    print((out / "measurement.md").read_text(encoding="utf-8"))
    print(page)
    return 0
