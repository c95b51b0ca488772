"""Measures an encoder on held-out pictures and writes the tables and the page.

Called by the command line; calls `examine.py`, `measure.py`, `words.py`, `zero_shot.py`, `page.py`.
"""

from __future__ import annotations

import json
import time
from collections.abc import Callable
from dataclasses import asdict
from pathlib import Path
from statistics import median
from typing import Any

import numpy as np

from forestall.domain.load import load_domain
from forestall.embeddings.crops import INPUT_PIXELS, crops
from forestall.embeddings.twotower import TOWERS, TwoTowerEncoder, shipped
from forestall.files import replace_file
from forestall.training import shards, words, zero_shot
from forestall.training.examine import Vectors, answers, vectors
from forestall.training.measure import measure
from forestall.training.measure_tables import Condition, as_json, write_tables
from forestall.training.page import Synonym, write_page

Progress = Callable[[int, int, str], None]

MASKS = 20
"""Objects in the frame that is timed."""


def examine(
    pictures: Path, model: Path | None, out: Path, split: str, progress: Progress
) -> tuple[dict[str, Any], Path]:
    """Every figure of an encoder; returns them and the path of the page.

    Raises:
        FileFormatError: there are no pictures.
        ModelFileError: the encoder cannot be read.
    """
    encoder = TwoTowerEncoder(model)
    everything = shards.read(pictures, split)
    all_rows = vectors(encoder, everything, progress)
    drawn = everything.seen == ""
    there, rows = everything.where(drawn), all_rows[drawn]
    said = answers(encoder, rows, there, load_domain("household"))
    found = measure(said)
    harder = conditions(encoder, all_rows, everything)
    questions = zero_shot.new_questions(encoder, rows, there)
    things = []
    if (pictures / "unseen").is_dir():
        others = shards.read(pictures, "unseen")
        things = zero_shot.new_things(encoder, vectors(encoder, others, progress), others)
    near = [
        Synonym(p.word.word, p.nearest, p.word.category, p.similarity, p.right, p.word.group)
        for p in words.nearest(encoder, words.word_list(), load_domain("household"))
    ]
    named = category_accuracy(encoder, rows, there)
    took_ms = frame_ms(encoder)
    size = sum(((model or shipped()) / f"{t}.onnx").stat().st_size for t in TOWERS)
    data: dict[str, Any] = {
        "encoder": encoder.name,
        "split": split,
        "size_bytes": size,
        "frame_ms": took_ms,
        "category_accuracy": named,
        "states": as_json(found),
        "conditions": [asdict(c) for c in harder],
        "unseen things": [asdict(z) for z in things],
        "unseen questions": [asdict(z) for z in questions],
        "words": [asdict(w) for w in near],
    }
    write_tables(found, harder, out)
    replace_file(out / "encoder.json", (json.dumps(data, indent=2) + "\n").encode())
    facts = {
        "encoder": encoder.name,
        "pictures": f"{split}: {len(there.frame)} crops of {int(there.frame[-1]) + 1} frames",
        "category named rightly (of all)": f"{100 * named:.1f} %",
        f"crops of one frame ({MASKS} objects)": f"{took_ms:.1f} ms",
        "size": f"{size / 1e6:.2f} MB",
        "nothing is said below": f"{encoder.reading.least_area} mask pixels",
    }
    edge = (there.pixels.shape[1] - INPUT_PIXELS) // 2
    inner = there.pixels[:, edge : edge + INPUT_PIXELS, edge : edge + INPUT_PIXELS]
    page = write_page(found, inner, said, out / "index.html", facts, near, [*things, *questions])
    return data, page


def conditions(
    encoder: TwoTowerEncoder, rows: Vectors, crops: shards.Crops
) -> tuple[Condition, ...]:
    """How states are read of what is held, and of the same things through worse eyes.

    What is seen through a sensor is to be held against the row "as drawn" of the same pictures.
    """
    drawn = crops.seen == ""
    again = np.isin(crops.frame, np.unique(crops.frame[~drawn]))
    parts = {
        "in the hand": drawn & crops.held,
        "as drawn, of the pictures below": drawn & again,
        **{name: crops.seen == name for name in shards.SENSED},
    }
    domain = load_domain("household")
    return tuple(
        Condition(name, measure(answers(encoder, rows[some], crops.where(some), domain)).overall)
        for name, some in parts.items()
        if (crops.values[some] >= 0).any()
    )


def category_accuracy(encoder: TwoTowerEncoder, rows: Vectors, there: shards.Crops) -> float:
    """Share of the crops whose nearest category name is theirs."""
    domain = load_domain("household")
    names = sorted(domain.categories)
    texts = encoder.encode([f"a {domain[n].words}" for n in names])
    objects = there.category != ""
    nearest = np.array(names)[(rows[objects] @ texts.T).argmax(axis=1)]
    return float(np.mean(nearest == there.category[objects]))


def frame_ms(encoder: TwoTowerEncoder, repeat: int = 15) -> float:
    """Median milliseconds for all crops of a 640 × 480 frame with 20 objects of usual sizes."""
    rng = np.random.default_rng(0)
    rgb = rng.integers(0, 255, (480, 640, 3), dtype=np.uint8)
    masks = []
    for size in np.geomspace(12, 300, MASKS):
        mask = np.zeros((480, 640), dtype=bool)
        x, y = int(rng.integers(0, 640 - size)), int(rng.integers(0, 480 - size))
        mask[y : y + int(size), x : x + int(size)] = True
        masks.append(mask)
    encoder.encode_pixels(crops(rgb, masks))
    times = []
    for _ in range(repeat):
        start = time.perf_counter()
        encoder.encode_pixels(crops(rgb, masks))
        times.append(1000 * (time.perf_counter() - start))
    return median(times)
