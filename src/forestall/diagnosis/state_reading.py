"""States read off pictures by a vision-language model.

Called by the perceiver (`seams.StateEstimator`); calls a `LanguageModel`. It stands where the paper
asks CLIP (Sec. 3 "3D Scene Graph Construction": each object's crop against the states of its
category): every thing is cut out, what is not the thing is darkened, and one question with some
pictures is about the states that a camera can show of them. "Cannot tell" is an answer; no answer
at all is an error, and never a state. A model's own confidence is not calibrated: none is asked.
"""

from __future__ import annotations

import hashlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from forestall.domain.model import Domain
from forestall.embeddings.crops import crop
from forestall.errors import InputError, ObservationError
from forestall.llm.asking import answered
from forestall.llm.choices import Choices, chosen, states_schema
from forestall.llm.prompts import rendered
from forestall.perception.learned import unobscured
from forestall.records.pictures import encode_jpeg
from forestall.seams.language import LanguageModel
from forestall.supervision import deadline
from forestall.types.exchange import Request
from forestall.types.observation import Detection, Frame

_DIMMED = 0.45
"""Brightness of what is around a thing, against its own."""

_ANSWER_TOKENS = 40
"""For the states of one thing."""

States = Mapping[str, str | None]


@dataclass(frozen=True, slots=True)
class StateReadingConfig:
    """How a vision-language model is shown things.

    Args:
        least_area: mask pixels under which a thing is not shown, and its states are unobserved.
        things: at most so many pictures go with one question.
        pixels: edge of a picture.
        margin: edge of what a picture shows, as a multiple of the longer side of the thing.
        attempts: answers that are asked for, each with the reason why the last was not taken.

    Raises:
        InputError: a number that is out of range.
    """

    least_area: int = 200
    things: int = 12
    pixels: int = 224
    margin: float = 1.5
    attempts: int = 2

    def __post_init__(self) -> None:
        for name, least in (("least_area", 1), ("things", 1), ("pixels", 16), ("attempts", 1)):
            if getattr(self, name) < least:
                raise InputError(f"{name} is {getattr(self, name)}: at least {least} is needed")
        if not 1 <= self.margin <= 10:
            raise InputError(f"margin is {self.margin:g}: it must be from 1 to 10")


@dataclass(frozen=True, slots=True)
class _Shown:
    """A thing as it is shown: its place among the detections, its picture, what is asked of it."""

    place: int
    category: str
    jpeg: bytes

    @property
    def key(self) -> tuple[str, bytes]:
        """What its states depend on."""
        return self.category, hashlib.blake2b(self.jpeg, digest_size=16).digest()


class ModelStateEstimator:
    """Implements `StateEstimator`. The same picture of a thing is asked about once.

    Args:
        model: that is asked; it must be able to see.
        domain: which attributes a category has, and the phrases for their values.
        config: how things are shown.
    """

    def __init__(
        self, model: LanguageModel, domain: Domain, config: StateReadingConfig | None = None
    ) -> None:
        self._model, self._domain = model, domain
        self._config = config or StateReadingConfig()
        self._known: dict[tuple[str, bytes], States] = {}
        self.name = f"states by a language model ({model.name})"

    def estimate(self, frame: Frame, detections: Sequence[Detection]) -> Sequence[States]:
        """See the Protocol; a category that the domain lacks has no states.

        Raises:
            ObservationError: the model gives no answer that can be read; says why.
        """
        out: list[States] = [{} for _ in detections]
        shown = []
        for i, d in enumerate(detections):
            asked = self.asked(d.category)
            out[i] = dict.fromkeys(asked)
            if asked and np.count_nonzero(d.mask) >= self._config.least_area:
                category = self._domain[d.category].name
                shown.append(_Shown(i, category, self._picture(frame, d)))
        new = list({s.key: s for s in shown if s.key not in self._known}.values())
        for first in range(0, len(new), self._config.things):
            some = new[first : first + self._config.things]
            for thing, states in zip(some, self._answer(some), strict=True):
                self._known[thing.key] = unobscured(states, self._domain)
        for thing in shown:
            out[thing.place] = self._known[thing.key]
        return out

    def asked(self, category: str) -> Mapping[str, tuple[str, ...]]:
        """Attribute → values of what a picture can show of a category; {} for an unknown one."""
        if self._domain.find(category) is None:
            return {}
        return {
            a: self._domain.values(a)
            for a in self._domain[category].attributes
            if self._domain.attributes[a].camera
        }

    def request(self, things: Sequence[tuple[str, bytes]]) -> Request:
        """What is asked about some things: of each its category and its picture as JPEG."""
        domain = self._domain
        told = [
            (
                domain[category].spoken,
                [
                    (a, [(v, domain.phrases(category, a, v)[0]) for v in values])
                    for a, values in self.asked(category).items()
                ],
            )
            for category, _ in things
        ]
        return Request(
            "states",
            rendered("states", things=told),
            states_schema([self.asked(category) for category, _ in things]),
            images=tuple(jpeg for _, jpeg in things),
            max_tokens=100 + _ANSWER_TOKENS * len(things),
        )

    def _answer(self, things: Sequence[_Shown]) -> Choices:
        asked = [self.asked(t.category) for t in things]

        def read(answer: str) -> tuple[Choices, str]:
            return chosen(answer, asked), ""

        request = self.request([(t.category, t.jpeg) for t in things])
        found, exchanges = answered(self._model, request, read, self._config.attempts, deadline())
        if found is None:
            why = exchanges[-1].problem if exchanges else "it was not asked"
            raise ObservationError(f"{self._model.name} tells no states of what is seen: {why}")
        return found

    def _picture(self, frame: Frame, detection: Detection) -> bytes:
        cut = crop(frame.rgb, detection.mask, self._config.pixels, self._config.margin)
        bright = np.where(cut[..., 3:] > 127, 1.0, _DIMMED)
        return encode_jpeg(np.rint(cut[..., :3] * bright).astype(np.uint8))
