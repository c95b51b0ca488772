"""Of what type the parts of an observation are, whoever made them; called by `observation`."""

from __future__ import annotations

from collections.abc import Iterable
from numbers import Real
from typing import Any

import numpy as np

from forestall.errors import PerceptionError

MOST_NAME = 256
LARGEST_PICTURE = 20_000
"""Pixels of an edge."""


def check_array(what: str, value: Any, kinds: str) -> None:
    """A numpy array of values of some kinds, as `dtype.kind` names them.

    Raises:
        PerceptionError: it is something else.
    """
    if not isinstance(value, np.ndarray):
        raise PerceptionError(f"{what} must be a numpy array, got {_said(value)}")
    if value.dtype.kind not in kinds:
        raise PerceptionError(f"{what} must be an array of numbers, got {value.dtype}")


def check_number(what: str, value: Any) -> None:
    """A number; whether it can be is for the input gate to say.

    Raises:
        PerceptionError: it is something else, or too large to compute with.
    """
    if not isinstance(value, Real | np.number) or isinstance(value, bool):
        raise PerceptionError(f"{what} must be a number, got {_said(value)}")
    try:
        float(value)
    except OverflowError as error:
        raise PerceptionError(f"{what} is too large for a number") from error


def check_edge(what: str, value: Any) -> None:
    """A number of pixels.

    Raises:
        PerceptionError: it is none.
    """
    whole = isinstance(value, int | np.integer) and not isinstance(value, bool)
    if not whole or not 1 <= value <= LARGEST_PICTURE:
        raise PerceptionError(f"{what} must be 1 to {LARGEST_PICTURE} pixels, got {_said(value)}")


def check_point(what: str, value: Any) -> None:
    """Three numbers.

    Raises:
        PerceptionError: it is something else.
    """
    if not isinstance(value, tuple | list | np.ndarray) or len(value) != 3:
        raise PerceptionError(f"{what} must be three numbers, got {_said(value)}")
    for number in value:
        check_number(what, number)


def check_name(what: str, value: Any) -> None:
    """A text that names something and can be shown and stored.

    Raises:
        PerceptionError: it is something else.
    """
    fits = isinstance(value, str) and len(value.strip()) > 0 and len(value) <= MOST_NAME
    if not fits or any(c < " " or "\x7f" <= c < "\xa0" or "\ud800" <= c <= "\udfff" for c in value):
        raise PerceptionError(
            f"{what} must be a name of 1 to {MOST_NAME} characters that can be shown, "
            f"got {_said(value)}"
        )


def check_several(what: str, values: Any, kind: type) -> None:
    """A tuple or list of one type.

    Raises:
        PerceptionError: it is something else.
    """
    several: Iterable[Any] = values if isinstance(values, tuple | list) else (values,)
    wrong = [v for v in several if not isinstance(v, kind)]
    if wrong or not isinstance(values, tuple | list):
        found = _said(wrong[0] if wrong else values)
        raise PerceptionError(f"{what} must be {kind.__name__}s in a tuple, got {found}")


def _said(value: Any) -> str:
    if isinstance(value, np.ndarray):
        return f"an array {value.shape} {value.dtype}"
    text = repr(value) if isinstance(value, str | int | float | type(None)) else ""
    return text[:60] or f"a {type(value).__name__}"
