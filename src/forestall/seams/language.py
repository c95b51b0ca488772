"""What answers questions in words."""

from __future__ import annotations

from typing import Protocol

from forestall.deadline import Deadline
from forestall.types.exchange import Exchange, Request


class LanguageModel(Protocol):
    """Answers questions in words, in a form that is asked for."""

    name: str

    def ask(self, request: Request, deadline: Deadline | None = None) -> Exchange:
        """What came of a question, in time: an answer, or a problem that says why there is none."""
