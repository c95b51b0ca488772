"""What was asked of a language model ⇄ plain data; and what all of it took.

Called by `verdicts.py`, by the record and by the page; the keys are described in
`docs/record-format.md`.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any

from forestall.reading.fields import Field
from forestall.types.episode import BoundaryRecord
from forestall.types.exchange import Exchange

KEY = "exchanges"


def exchanges_json(exchanges: Sequence[Exchange]) -> dict[str, Any]:
    """An entry for a record, none where no model was asked."""
    return {KEY: [exchange_json(e) for e in exchanges]} if exchanges else {}


def exchange_json(exchange: Exchange) -> dict[str, Any]:
    """One question and what came of it."""
    e = exchange
    return {
        "purpose": e.purpose,
        "model": e.model,
        "key": e.key,
        "messages": [list(m) for m in e.messages],
        "answer": e.answer,
        "problem": e.problem,
        "note": e.note,
        "images": e.images,
        "prompt_tokens": e.prompt_tokens,
        "answer_tokens": e.answer_tokens,
        "cost": e.cost,
        "seconds": e.seconds,
        "tries": e.tries,
    }


def exchanges_from(field: Field) -> tuple[Exchange, ...]:
    """Read what `exchanges_json` added to an entry."""
    return field.optional(KEY, lambda f: f.tuple_of(_exchange)) or ()


def _exchange(field: Field) -> Exchange:
    return Exchange(
        purpose=field["purpose"].text(),
        model=field["model"].text(),
        key=field["key"].text(),
        messages=field["messages"].tuple_of(_message),
        answer=field.maybe("answer", Field.text),
        problem=field["problem"].text(),
        note=field["note"].text(),
        images=field["images"].whole(),
        prompt_tokens=field.maybe("prompt_tokens", Field.whole),
        answer_tokens=field.maybe("answer_tokens", Field.whole),
        cost=field.maybe("cost", Field.number),
        seconds=field["seconds"].number(),
        tries=field["tries"].whole(),
    )


def _message(field: Field) -> tuple[str, str]:
    both = field.tuple_of(Field.text)
    if len(both) != 2:
        field.fail("a role and a text")
    return (both[0], both[1])


@dataclass(frozen=True, slots=True)
class Taken:
    """What the questions of a run took; None where one of them does not say."""

    asked: int
    accepted: int
    prompt_tokens: int | None
    answer_tokens: int | None
    cost: float | None
    seconds: float


def exchanges_of(boundary: BoundaryRecord) -> tuple[Exchange, ...]:
    """Every question at a boundary, in its order."""
    told = (boundary.verdict, *boundary.watched, boundary.diagnosis, boundary.replan)
    return tuple(dict.fromkeys(e for said in told if said is not None for e in said.exchanges))


def taken(exchanges: Iterable[Exchange]) -> Taken:
    """All of them together."""
    found = list(exchanges)
    tokens = [(e.prompt_tokens, e.answer_tokens) for e in found]
    costs = [e.cost for e in found]
    known = [c for c in costs if c is not None]
    return Taken(
        len(found),
        sum(not e.problem for e in found),
        _sum([p for p, _ in tokens]),
        _sum([a for _, a in tokens]),
        sum(known) if len(known) == len(costs) else None,
        sum(e.seconds for e in found),
    )


def _sum(numbers: Sequence[int | None]) -> int | None:
    known = [n for n in numbers if n is not None]
    return sum(known) if len(known) == len(numbers) else None
