"""States read off the pixels: each object's crop against phrases, the most fitting one wins.

Called by the perceiver; calls `kind.py`, and an image-text encoder that is handed in. This is the
paper's way of reading states (Sec. 3 "3D Scene Graph Construction": CLIP on the crop against a list
of states for each category), with a calibrated confidence, and silence where that is too small: an
object that is too far away, too hidden, or fits two phrases about as well is *unobserved*, never
guessed; so is everything in a picture unlike those that the encoder was made for.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from forestall.domain.model import Domain
from forestall.errors import InputError
from forestall.perception.kind import of_its_kind
from forestall.seams.perceiving import ImageTextEncoder
from forestall.types.observation import Detection, Frame

Floats = npt.NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class Question:
    """One attribute of a category: its values, and a unit vector of the phrases for each."""

    attribute: str
    values: tuple[str, ...]
    vectors: npt.NDArray[np.float32]


class LearnedStateEstimator:
    """Argmax over phrases with a confidence (implements `ConfidentStateEstimator`).

    What an encoder says that nobody has calibrated counts as just sure enough to be told, so that
    it does not outweigh what was read before or what a skill should have made of it.

    Args:
        encoder: embeds crops and phrases, and says how its cosines are to be read.
        domain: which attributes a category has, and the phrases for their values.

    Raises:
        InputError: a phrase that the encoder cannot read.
    """

    def __init__(self, encoder: ImageTextEncoder, domain: Domain) -> None:
        self._encoder = encoder
        self._domain = domain
        self._questions: dict[str, tuple[Question, ...]] = {}
        self.name = f"learned states ({encoder.name})"

    def estimate(
        self, frame: Frame, detections: Sequence[Detection]
    ) -> Sequence[Mapping[str, str | None]]:
        """See the Protocol; a category that the domain lacks has no states.

        Of a picture unlike those that the encoder was made for nothing is told.
        """
        return [states for states, _ in self.estimate_with_confidence(frame, detections)]

    def estimate_with_confidence(
        self, frame: Frame, detections: Sequence[Detection]
    ) -> Sequence[tuple[Mapping[str, str | None], Mapping[str, float]]]:
        """See `ConfidentStateEstimator`."""
        asked = [
            (i, self.questions(d.category))
            for i, d in enumerate(detections)
            if self._domain.find(d.category) is not None
        ]
        asked = [(i, questions) for i, questions in asked if questions]
        least = self._encoder.reading.least_area
        kind = asked and of_its_kind(frame.rgb, self._encoder.reading.most_rough)
        large = [(i, q) for i, q in asked if kind and np.count_nonzero(detections[i].mask) >= least]
        rows = self._encoder.encode_crops(frame.rgb, [detections[i].mask for i, _ in large])
        out: list[tuple[Mapping[str, str | None], Mapping[str, float]]] = [({}, {})] * len(
            detections
        )
        for i, questions in asked:
            out[i] = {q.attribute: None for q in questions}, {}
        for (i, questions), row in zip(large, rows, strict=True):
            out[i] = self._answers(questions, row)
        return out

    def questions(self, category: str) -> tuple[Question, ...]:
        """What can be asked of a category.

        Raises:
            InputError: a phrase that the encoder cannot read.
        """
        name = self._domain[category].name
        found = self._questions.get(name)
        if found is None:
            found = tuple(
                Question(a, self._domain.values(a), self._vectors(name, a))
                for a in self._domain[name].attributes
                if self._domain.attributes[a].camera
            )
            self._questions[name] = found
        return found

    def probabilities(self, question: Question, rows: npt.NDArray[np.float32]) -> Floats:
        """(n, values) confidence in each value of a question for (n, d) crops."""
        reading = self._encoder.reading
        logits = rows.astype(np.float64) @ question.vectors.T.astype(np.float64)
        logits *= reading.scale / reading.divisor(question.attribute)
        logits -= logits.max(axis=1, keepdims=True)
        weights = np.exp(logits)
        shares: Floats = weights / weights.sum(axis=1, keepdims=True)
        return shares

    def _answers(
        self, questions: Sequence[Question], row: npt.NDArray[np.float32]
    ) -> tuple[Mapping[str, str | None], Mapping[str, float]]:
        found: dict[str, str | None] = {}
        sure: dict[str, float] = {}
        reading = self._encoder.reading
        for question in questions:
            confidence = self.probabilities(question, row[None])[0]
            best = int(confidence.argmax())
            score, enough = float(confidence[best]), reading.least_confidence(question.attribute)
            found[question.attribute] = question.values[best] if score >= enough else None
            sure[question.attribute] = score if reading.calibrated else min(score, enough)
        return unobscured(found, self._domain), sure

    def _vectors(self, category: str, attribute: str) -> npt.NDArray[np.float32]:
        rows = []
        for value in self._domain.values(attribute):
            phrases = self._domain.phrases(category, attribute, value)
            try:
                mean = self._encoder.encode(phrases).mean(axis=0)
            except InputError as error:
                raise InputError(
                    f"phrases for {attribute}={value} of {category}: {error}"
                ) from error
            rows.append(mean / np.linalg.norm(mean))
        return np.stack(rows)


def unobscured(states: Mapping[str, str | None], domain: Domain) -> Mapping[str, str | None]:
    """States without those that another one keeps a camera from telling (of what is broken)."""
    for attribute, value in states.items():
        if value is not None and domain.attributes[attribute].obscures == value:
            return {a: value if a == attribute else None for a in states}
    return states
