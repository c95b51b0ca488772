"""States of things as a model that sees chooses them: the schema of its answer, and the reading.

Called by `diagnosis.state_reading`; calls `forms`.
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence

from forestall.llm.forms import Unfit, object_of, read_answer
from forestall.reading.fields import Field

CANNOT_TELL = "cannot tell"
"""What is said of a state that a picture does not show."""

Asked = Sequence[Mapping[str, Sequence[str]]]
"""Of each picture attribute → the values that it may have."""

Choices = tuple[dict[str, str | None], ...]
"""Of each picture attribute → value, None: it cannot be told."""


def states_schema(asked: Asked) -> str:
    """The schema of the states of some things, one for each picture, counted from 1."""
    pictures = {
        _name(n): object_of(
            **{a: {"type": "string", "enum": [*v, CANNOT_TELL]} for a, v in attributes.items()}
        )
        for n, attributes in enumerate(asked, 1)
    }
    return json.dumps(object_of(**pictures))


def chosen(answer: str, asked: Asked) -> Choices:
    """What a model says of each picture.

    Raises:
        Unfit: a picture or an attribute is missing, or a value is none of those that there are.
    """

    def read(field: Field) -> Choices:
        return tuple(
            {a: _value(field[_name(n)][a], values) for a, values in attributes.items()}
            for n, attributes in enumerate(asked, 1)
        )

    return read_answer(answer, read)


def _name(number: int) -> str:
    return f"picture_{number}"


def _value(field: Field, values: Sequence[str]) -> str | None:
    said = field.text()
    if said == CANNOT_TELL:
        return None
    if said not in values:
        told = ", ".join(map(repr, (*values, CANNOT_TELL)))
        raise Unfit(f"{field.place} is {said!r}: it must be one of {told}")
    return said
