"""A question asked until its answer can be taken, a bounded number of times.

Called by reasoner, replanner, expectations and locator; calls the model that it is given. Whoever
asks says how an answer is read, and the reason why one is not taken goes back to the model.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import TypeVar

from forestall.deadline import Deadline
from forestall.llm.forms import Unfit
from forestall.llm.prompts import fragment
from forestall.seams.language import LanguageModel
from forestall.types.exchange import Exchange, Request

T = TypeVar("T")


def answered(
    model: LanguageModel,
    request: Request,
    read: Callable[[str], tuple[T, str]],
    attempts: int,
    until: Deadline | None = None,
) -> tuple[T | None, tuple[Exchange, ...]]:
    """Ask until an answer can be read.

    Args:
        model: that is asked.
        request: the question.
        read: an answer → what it says, and what of it was left out; raises `Unfit` with the reason
            why it cannot be taken.
        attempts: answers that are asked for.
        until: when there is no time left.

    Returns:
        What it says, None where no answer could be taken; and every question.
    """
    exchanges: list[Exchange] = []
    for _ in range(attempts):
        asked = model.ask(request, until)
        if asked.problem or asked.answer is None:
            return None, (*exchanges, asked)
        try:
            value, note = read(asked.answer)
        except Unfit as error:
            exchanges.append(replace(asked, problem=str(error)))
            again = fragment("correction", reason=str(error))
            more = (("assistant", asked.answer), ("user", again))
            request = replace(request, messages=(*request.messages, *more))
            continue
        return value, (*exchanges, replace(asked, note=note))
    return None, tuple(exchanges)
