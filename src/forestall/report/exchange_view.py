"""Questions to a language model as the page shows them; called by `page_view.py`.

What a question repeats of the one before it is left out, and an answer is laid out a line for each
thing that it says; both stand in the record as they were sent and as they came.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from forestall.errors import ForestallError
from forestall.reading.documents import parse_json
from forestall.types.exchange import Exchange


@dataclass(frozen=True, slots=True)
class ExchangeView:
    """One question.

    Args:
        told: what the record has of it.
        number: among those of its boundary, from 1.
        follows: of the question that it goes on from, 0 where it begins anew.
        messages: (role, text), those that it adds to that one.
        answer: laid out; "" where none came.
    """

    told: Exchange
    number: int
    follows: int
    messages: tuple[tuple[str, str], ...]
    answer: str


def exchange_views(exchanges: Sequence[Exchange]) -> tuple[ExchangeView, ...]:
    """All of one boundary, in their order."""
    found = []
    for number, e in enumerate(exchanges, 1):
        before = exchanges[number - 2] if number > 1 else None
        follows, messages = 0, e.messages
        if before is not None and _goes_on(before, e):
            follows, messages = number - 1, e.messages[len(before.messages) :]
            if messages[0] == ("assistant", before.answer):
                messages = messages[1:]
        found.append(ExchangeView(e, number, follows, messages, laid_out(e.answer or "")))
    return tuple(found)


def laid_out(answer: str) -> str:
    """An answer in JSON with a line for each thing that it says, any other text as it is."""
    try:
        said = parse_json(answer)
    except ForestallError:
        return answer
    if not isinstance(said, Mapping):
        return answer
    return "\n".join(f"{key}: {_value(value)}" for key, value in said.items())


def _goes_on(before: Exchange, now: Exchange) -> bool:
    size = len(before.messages)
    return size < len(now.messages) and now.messages[:size] == before.messages


def _value(value: Any) -> str:
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, Mapping):
        return ", ".join(f"{k}: {_value(v)}" for k, v in value.items())
    if not isinstance(value, list | tuple):
        return " ".join(str(value).split())
    if any(isinstance(v, Mapping) for v in value):
        marks = (f"{n}." if _is_step(v) else "-" for n, v in enumerate(value, 1))
        return "".join(f"\n  {m} {_item(v)}" for m, v in zip(marks, value, strict=True))
    return "; ".join(map(_value, value)) or "none"


def _item(value: Any) -> str:
    """A step of a plan as it is written everywhere else, anything else as it is."""
    if not _is_step(value):
        return _value(value)
    return f"{_value(value['skill'])}({', '.join(map(_value, value['args']))})"


def _is_step(value: Any) -> bool:
    keys = value.keys() if isinstance(value, Mapping) else ()
    return set(keys) == {"skill", "args"} and isinstance(value["args"], list | tuple)
