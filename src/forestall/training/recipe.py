"""Pictures → the folder of an encoder: train, export, fit how it is to be read.

Called by the command line; calls `fit.py` (PyTorch), then works on the exported towers only, so
that temperatures and thresholds belong to what is shipped. Needs the extra `[training]`.
"""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path

import numpy as np

from forestall.domain.model import Domain
from forestall.embeddings.twotower import (
    DESCRIPTION_NAME,
    Description,
    TwoTowerEncoder,
    checksums,
)
from forestall.errors import InputError
from forestall.files import replace_file
from forestall.training import shards
from forestall.training.examine import answers, large_only, logits, vectors
from forestall.training.fitting import fit_temperature, fit_threshold
from forestall.types.encoder import StateReading

Progress = Callable[[int, int, str], None]

NAME = "forestall two-tower 1"


@dataclass(frozen=True, slots=True)
class ReadingConfig:
    """How temperatures and thresholds are fitted on the development pictures.

    Args:
        target: balanced accuracy that each attribute's answers are to reach.
        least_area: mask pixels under which nothing is said.
        least_threshold: no threshold is lower than this.
    """

    target: float = 0.985
    least_area: int = 40
    least_threshold: float = 0.7


@dataclass(frozen=True, slots=True)
class Recipe:
    """Everything that a training depends on, the pictures apart."""

    seed: int = 0
    steps: int = 5000
    batch: int = 256
    reading: ReadingConfig = field(default_factory=ReadingConfig)


def train(
    pictures: Path, out: Path, domain: Domain, recipe: Recipe, progress: Progress
) -> Description:
    """Train on `pictures` and write image.onnx, text.onnx and encoder.json into `out`.

    Raises:
        InputError: PyTorch is not installed, or there is no number of steps or batch like that.
        FileFormatError: there are no pictures.
    """
    try:
        from forestall.training import fit, network
    except ImportError as error:
        raise InputError(
            f"training needs PyTorch, which cannot be imported ({error}): "
            "pip install 'forestall[training]'"
        ) from error
    config = fit.TrainConfig(seed=recipe.seed, steps=recipe.steps, batch=recipe.batch)
    crops = shards.read(pictures, "train")
    options = shards.options(pictures)
    towers, history = fit.train(crops, domain, config, progress)
    network.export(towers, out)
    made = {
        "crops": int((crops.category != "").sum()),
        "frames": int((crops.category == "").sum()),
        "pictures": options,
        **fit.facts(config, towers),
        "last losses": history[-1],
    }
    reading = StateReading(scale=float(towers.scale.detach()), threshold={"": 0.0}, least_area=0)
    description = Description(NAME, fit.known_words(domain), reading, made)
    write(out, description)
    return calibrate(pictures, out, domain, recipe.reading, progress)


def calibrate(
    pictures: Path, out: Path, domain: Domain, config: ReadingConfig, progress: Progress
) -> Description:
    """Fit temperature and threshold of each attribute on the development pictures and write them.

    The two numbers for attributes that were not trained on are those of all attributes together.
    """
    description = Description.read(out / DESCRIPTION_NAME)
    blank = StateReading(description.reading.scale, {"": 1.0}, {"": 0.0}, 0)
    write(out, replace(description, reading=blank))
    encoder = TwoTowerEncoder(out)
    crops = shards.read(pictures, "development")
    rows = vectors(encoder, crops, progress)
    found = large_only(answers(encoder, rows, crops, domain), config.least_area)
    plain = logits(encoder, found)
    temperature = fit_temperature(plain, found.truth, found.attribute)
    divisors = np.array([temperature[a] for a in found.attribute.tolist()])
    spread = plain / divisors[:, None]
    spread -= spread.max(axis=1, keepdims=True)
    weights = np.exp(spread) * (found.probability > 0)
    probability = weights / weights.sum(axis=1, keepdims=True)
    fitted = fit_threshold(probability, found.truth, config.target, found.attribute)
    threshold = {a: max(t.value, config.least_threshold) for a, t in fitted.items()}
    reading = StateReading(
        scale=description.reading.scale,
        temperature={"": max(temperature.values()), **temperature},
        threshold={"": max(threshold.values()), **threshold},
        least_area=config.least_area,
    )
    training = {**description.training, "reading": asdict(config)}
    description = replace(description, reading=reading, training=training)
    write(out, description)
    return description


def write(out: Path, description: Description) -> None:
    """Write encoder.json beside the towers that it describes, whole or not at all."""
    description = replace(description, sha256=checksums(out))
    text = json.dumps(description.as_json(), indent=1) + "\n"
    replace_file(out / DESCRIPTION_NAME, text.encode())
