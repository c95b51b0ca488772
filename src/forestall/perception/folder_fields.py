"""Fields of a stored observation that say what they want, and words that are nearly known ones.

Called by `folder.py`; calls nothing but the domain.
"""

from __future__ import annotations

import difflib
from typing import Annotated, Any

from pydantic import BeforeValidator
from pydantic_core import PydanticCustomError

from forestall.domain.model import Domain

_SLIP = 0.75
_CORNER, _SIDE = 3, 4

_Row = tuple[float, float, float, float]


def _place(given: Any) -> Any:
    if isinstance(given, list | tuple) and len(given) == _CORNER:
        return given
    raise PydanticCustomError("place", "a place is wanted, three numbers [x, y, z] in metres")


def _matrix(given: Any) -> Any:
    rows = given if isinstance(given, list | tuple) else ()
    sides = [len(row) if isinstance(row, list | tuple) else 0 for row in rows]
    if sides == [_SIDE] * _SIDE:
        return given
    said = "this is no list of rows"
    if rows and all(sides):
        lengths = " or ".join(map(str, sorted(set(sides))))
        said = f"this has {len(rows)} rows of {lengths}"
    raise PydanticCustomError(
        "matrix",
        "a 4 x 4 matrix is wanted, 4 rows of 4 numbers, the last of them [0, 0, 0, 1]; {said}",
        {"said": said},
    )


Place = Annotated[tuple[float, float, float], BeforeValidator(_place)]
"""Three numbers."""

Pose = Annotated[tuple[_Row, _Row, _Row, _Row], BeforeValidator(_matrix)]
"""Four rows of four numbers."""


def nearest(said: str, domain: Domain) -> str:
    """The categories that a word is nearly one of, "" where none is: "Vial", "Cup or Mug"."""
    words = {
        word.casefold(): c.name
        for c in domain.categories.values()
        for word in (c.spoken, *c.synonyms, *c.aliases, c.name)
    }
    near = difflib.get_close_matches(said.casefold(), words, 3, _SLIP)
    return " or ".join(dict.fromkeys(words[word] for word in near))
