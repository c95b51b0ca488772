"""The form of an answer: JSON schemas from their pieces, and a text read by what it should be.

Called by `answers` and `choices`; calls the readers of JSON. The properties of an object stand in
the order in which they are to be thought of, since endpoints have them written in that order.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from typing import Any, TypeVar

from forestall.errors import ForestallError
from forestall.reading.documents import parse_json
from forestall.reading.fields import Field

T = TypeVar("T")

_FENCE = re.compile(r"^\s*```(?:json)?\s*\n(.*?)\n?\s*```\s*$", re.DOTALL)


class Unfit(ForestallError):
    """An answer that cannot be taken; the text is what the model is told."""


def object_of(**properties: Any) -> dict[str, Any]:
    """The schema of an object that has just these properties."""
    return {
        "type": "object",
        "properties": properties,
        "required": list(properties),
        "additionalProperties": False,
    }


def list_of(items: dict[str, Any]) -> dict[str, Any]:
    """The schema of a list."""
    return {"type": "array", "items": items}


def text_of(description: str) -> dict[str, Any]:
    """The schema of a text."""
    return {"type": "string", "description": description}


def read_answer(answer: str, read: Callable[[Field], T]) -> T:
    """What a text in JSON says, also where it stands between fences.

    Raises:
        Unfit: it is no JSON, or not what was asked for; says what and where.
    """
    fenced = _FENCE.match(answer)
    try:
        return read(Field(parse_json(answer if fenced is None else fenced[1])))
    except Unfit:
        raise
    except ForestallError as error:
        raise Unfit(f"the answer cannot be read: {error}") from error
