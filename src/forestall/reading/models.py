"""Plain values as pydantic models; what does not fit is one sentence with its place.

Called by the readers whose formats are pydantic models; calls nothing.
"""

from __future__ import annotations

from typing import Any, TypeVar

from pydantic import BaseModel, TypeAdapter, ValidationError

from forestall.errors import FileFormatError

M = TypeVar("M")
B = TypeVar("B", bound=BaseModel)


def validated(model: type[B], data: Any, source: str) -> B:
    """A model from plain values.

    Args:
        model: what they should be.
        data: from `documents`.
        source: of them in errors: a file, or a file and a line.

    Raises:
        FileFormatError: they are not; says where and what was found there.
    """
    try:
        return model.model_validate(data)
    except ValidationError as error:
        raise FileFormatError(f"{source}: {sentence(error)}") from error


def validated_json(adapter: TypeAdapter[M], text: str | bytes) -> M:
    """What a JSON text says, every type as it is declared: no "3" for 3.

    Raises:
        FileFormatError: it does not fit; says where.
    """
    try:
        return adapter.validate_json(text, strict=True)
    except ValidationError as error:
        raise FileFormatError(sentence(error)) from error


def sentence(error: ValidationError) -> str:
    """The first faults that pydantic found, in one line."""
    told = []
    for fault in error.errors(include_url=False)[:3]:
        place = ".".join(map(str, fault["loc"])) or "the document"
        value = "" if fault["type"] in ("missing", "extra_forbidden") else found(fault["input"])
        told.append(f"{place}: {fault['msg']}{value}")
    more = error.error_count() - len(told)
    return "; ".join(told) + (f"; and {more} more" if more else "")


def found(value: Any) -> str:
    """What was there instead, shortened, for the end of a sentence."""
    text = repr(value)
    return f", got {text if len(text) <= 60 else text[:57] + '...'}"
