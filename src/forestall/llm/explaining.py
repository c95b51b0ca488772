"""What one detector noticed as an explanation for people: by templates, or by a language model.

The paper compares explanations of four detectors, each written from what that detector sees (Sec.
4, "Analysis of Anticipatory Failure Reasoning"): the lines come from the detector's own `noticed`,
and the same writer makes the sentence of all of them.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Protocol

from forestall.deadline import Deadline
from forestall.llm import words
from forestall.llm.answers import explanation_schema, sentence_of
from forestall.llm.forms import Unfit
from forestall.llm.prompts import rendered
from forestall.seams.language import LanguageModel
from forestall.types.exchange import Exchange, Request
from forestall.types.plan import Subtask

NOTHING = "nothing was noticed"
_TOLD = 3


class Writer(Protocol):
    """Makes one sentence of what a detector noticed."""

    name: str

    def write(
        self, subtask: Subtask, detector: str, lines: Sequence[str]
    ) -> tuple[str, tuple[Exchange, ...]]:
        """The sentence, and what was asked for it."""


class TemplateWriter:
    """Strings the lines together (implements `Writer`)."""

    name = "templates"

    def write(
        self, subtask: Subtask, detector: str, lines: Sequence[str]
    ) -> tuple[str, tuple[Exchange, ...]]:
        """Names at most three of the lines."""
        if not lines:
            return f"Before {subtask} {NOTHING}.", ()
        more = len(lines) - _TOLD
        told = [*lines[:_TOLD], *([f"{more} more"] if more > 0 else [])]
        return f"Before {subtask}: {'; '.join(told)}.", ()


class ModelWriter:
    """Asks a language model (implements `Writer`); where it does not answer, templates write.

    Args:
        model: that is asked.
        deadline: of one question; the model's own time limit by default.
    """

    name = "model"

    def __init__(self, model: LanguageModel, deadline: Deadline | None = None) -> None:
        self._model, self._deadline = model, deadline

    def write(
        self, subtask: Subtask, detector: str, lines: Sequence[str]
    ) -> tuple[str, tuple[Exchange, ...]]:
        """One question for one sentence; nothing is asked where nothing was noticed."""
        if not lines:
            return TemplateWriter().write(subtask, detector, lines)
        asked = self._model.ask(self.request(subtask, detector, lines), self._deadline)
        if not asked.problem and asked.answer is not None:
            try:
                return sentence_of(asked.answer), (asked,)
            except Unfit as error:
                asked = replace(asked, problem=str(error))
        return TemplateWriter().write(subtask, detector, lines)[0], (asked,)

    def request(self, subtask: Subtask, detector: str, lines: Sequence[str]) -> Request:
        """What is asked."""
        messages = rendered(
            "explaining", step=words.step(subtask), detector=detector, lines=list(lines)
        )
        return Request("explaining", messages, explanation_schema(), max_tokens=200)
