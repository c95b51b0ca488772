"""Asks an encoder about stored pictures: the answers that `measure.py` counts.

Called by `recipe.py` (development pictures: temperatures and thresholds) and by the command line
(test pictures: the figures); calls the learned state estimator exactly as a run does.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import numpy.typing as npt

from forestall.domain.model import Domain
from forestall.embeddings.crops import INPUT_PIXELS
from forestall.embeddings.twotower import TwoTowerEncoder
from forestall.errors import InputError
from forestall.perception.learned import LearnedStateEstimator, Question
from forestall.training.measure import Answers
from forestall.training.shards import Crops

Vectors = npt.NDArray[np.float32]
Progress = Callable[[int, int, str], None]

BATCH = 256


def vectors(encoder: TwoTowerEncoder, crops: Crops, progress: Progress | None = None) -> Vectors:
    """Unit rows of stored crops: their middle, which is what the encoder is given in a run."""
    edge = (crops.pixels.shape[1] - INPUT_PIXELS) // 2
    inner = crops.pixels[:, edge : edge + INPUT_PIXELS, edge : edge + INPUT_PIXELS]
    found = []
    for start in range(0, len(inner), BATCH):
        found.append(encoder.encode_pixels(inner[start : start + BATCH]))
        if progress is not None:
            progress(min(start + BATCH, len(inner)), len(inner), "encoding")
    return np.concatenate(found)


def answers(encoder: TwoTowerEncoder, rows: Vectors, crops: Crops, domain: Domain) -> Answers:
    """One answer for each crop and each of its states that are known.

    The rules are those of `LearnedStateEstimator`: nothing is said of what is too small or fits two
    values, and nothing else of what is read as broken.
    """
    estimator = LearnedStateEstimator(encoder, domain)
    order = list(domain.attributes)
    parts: list[Answers] = []
    for category in sorted({c for c in crops.category.tolist() if c}):
        here = np.flatnonzero(crops.category == category)
        large = crops.area[here] >= encoder.reading.least_area
        broken = np.zeros(len(here), dtype=bool)
        for question in sorted(
            estimator.questions(category), key=lambda q: q.attribute != "broken"
        ):
            truth = crops.values[here, order.index(question.attribute)]
            known = truth >= 0
            if not known.any():
                continue
            confidence = estimator.probabilities(question, rows[here])
            sure = confidence.max(axis=1) >= encoder.reading.least_confidence(question.attribute)
            said = sure & large & ~broken
            if question.attribute == "broken":
                broken = sure & (confidence.argmax(axis=1) == question.values.index("broken"))
            parts.append(_part(category, question, truth, confidence, said, crops, here, known))
    return _joined(parts)


def logits(encoder: TwoTowerEncoder, found: Answers) -> npt.NDArray[np.float64]:
    """What a softmax with temperature 1 would have been given, up to a constant in each row."""
    divisors = np.array([encoder.reading.divisor(a) for a in found.attribute.tolist()])
    floor = np.maximum(found.probability.astype(np.float64), 1e-30)
    return np.asarray(np.log(floor) * divisors[:, None])


def large_only(found: Answers, least: int) -> Answers:
    """The answers about crops of at least so many mask pixels."""
    keep = found.area >= least
    names = Answers.__dataclass_fields__
    return replace(found, **{name: getattr(found, name)[keep] for name in names})


def _part(
    category: str,
    question: Question,
    truth: npt.NDArray[np.int8],
    confidence: npt.NDArray[np.float64],
    said: npt.NDArray[np.bool_],
    crops: Crops,
    here: npt.NDArray[np.int64],
    known: npt.NDArray[np.bool_],
) -> Answers:
    n = int(known.sum())
    return Answers(
        category=np.full(n, category),
        attribute=np.full(n, question.attribute),
        truth=truth[known].astype(np.int64),
        probability=confidence[known],
        answered=said[known],
        area=crops.area[here][known],
        crop=here[known],
    )


def _joined(parts: list[Answers]) -> Answers:
    if not parts:
        raise InputError("there is nothing to ask: no crop with a state that is known")
    most = max(p.probability.shape[1] for p in parts)
    padded = [np.pad(p.probability, ((0, 0), (0, most - p.probability.shape[1]))) for p in parts]
    joined = {
        name: np.concatenate([getattr(p, name) for p in parts])
        for name in Answers.__dataclass_fields__
        if name != "probability"
    }
    return Answers(probability=np.concatenate(padded), **joined)
