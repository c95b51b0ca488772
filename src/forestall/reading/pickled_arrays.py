"""Arrays of numbers as pickles have them, built from their bytes alone. Called by `pickles`.

What numpy's own functions would be called with is checked first: plain numbers, a shape that its
bytes fill. Objects, structures and shapes without bytes are refused.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from math import prod
from typing import Any, Literal

import numpy as np
import numpy.typing as npt

MOST_DIMENSIONS = 8

Order = Literal["<", ">", "="]

_MULTIARRAY = ("numpy.core.multiarray", "numpy._core.multiarray")
_NUMERIC = ("numpy.core.numeric", "numpy._core.numeric")
_ARRAY, _TYPE = "numpy.ndarray", "numpy.dtype"
_RECONSTRUCT = tuple(f"{m}._reconstruct" for m in _MULTIARRAY)
_SCALAR = tuple(f"{m}.scalar" for m in _MULTIARRAY)
_BUFFER = tuple(f"{m}._frombuffer" for m in _NUMERIC)

NAMES = frozenset((_ARRAY, _TYPE, *_RECONSTRUCT, *_SCALAR, *_BUFFER))
"""What an array of numbers is pickled with, by numpy 1 and by numpy 2."""

_NUMBERS = re.compile(r"[|<>=]?(b1|[iu][1248]|f(2|4|8)|\?)")


class PickledType:
    """A type of numbers, and the order of its bytes."""

    def __init__(self, text: Any) -> None:
        if not isinstance(text, str) or _NUMBERS.fullmatch(text) is None:
            raise ValueError(f"an array in it is of {text!r}, not of plain numbers")
        self._text = text.lstrip("|<>=")
        self._order: Order = "<" if text[0] == "<" else ">" if text[0] == ">" else "="

    def build(self, state: tuple[Any, ...]) -> None:
        """What a pickle says of it after it was made: the order of bytes, and no structure."""
        order = state[1] if len(state) > 4 else None
        if order not in ("<", ">", "|", "=") or any(s is not None for s in state[2:5]):
            raise ValueError("an array in it has a structure, it is not of plain numbers")
        self._order = "<" if order == "<" else ">" if order == ">" else "="

    @property
    def dtype(self) -> np.dtype[Any]:
        """As numpy has it."""
        return np.dtype(self._text).newbyteorder(self._order)


def fill(array: npt.NDArray[Any], state: tuple[Any, ...]) -> None:
    """Give an empty array what a pickle says of it: version, shape, type, columns first, bytes.

    Raises:
        ValueError: it has values already, or what is said does not fit.
    """
    if len(state) != 5 or array.size:
        raise ValueError("an array in it has no values, or gets them twice")
    _, shape, kind, columns, raw = state
    values = _filled(raw, kind, shape, "F" if columns else "C")
    columns_first = False  # numpy wants an integer there, its stub a truth value of its own
    said = (1, shape, values.dtype, columns_first, values.tobytes())
    array.__setstate__(said)  # type: ignore[arg-type]


def array_of(name: str, given: tuple[Any, ...]) -> Any:
    """What a call of one of `NAMES` gives, None for a name that makes nothing."""
    for names, make in _CALLS:
        if name in names:
            return make(given)
    return None


def _reconstructed(given: tuple[Any, ...]) -> npt.NDArray[Any]:
    if given[:2] != (_ARRAY, (0,)):
        raise ValueError("an array in it is made of what is no array")
    return np.zeros(0, np.uint8)


def _from_buffer(given: tuple[Any, ...]) -> npt.NDArray[Any]:
    if len(given) != 4:
        raise ValueError("an array in it has no values")
    raw, kind, shape, order = given
    return _filled(raw, kind, shape, "F" if order == "F" else "C")


def _number(given: tuple[Any, ...]) -> Any:
    if len(given) != 2:
        raise ValueError("a number in it has no value")
    return _filled(given[1], given[0], (), "C").item()


def _filled(raw: Any, kind: Any, shape: Any, order: str) -> npt.NDArray[Any]:
    if not isinstance(kind, PickledType):
        raise ValueError("an array in it has no type of numbers")
    if not isinstance(raw, bytes | bytearray):
        raise ValueError("the values of an array in it are objects, not bytes")
    if (
        not isinstance(shape, tuple)
        or len(shape) > MOST_DIMENSIONS
        or not all(type(n) is int and n >= 0 for n in shape)
    ):
        raise ValueError("an array in it has no shape")
    dtype = kind.dtype
    if prod(shape) * dtype.itemsize != len(raw):
        raise ValueError(
            f"an array in it needs {prod(shape) * dtype.itemsize} bytes for {shape} {dtype}, "
            f"there are {len(raw)}"
        )
    flat = np.frombuffer(raw, dtype).astype(dtype.newbyteorder("="), copy=False)
    return flat.reshape(shape, order="F" if order == "F" else "C")


_CALLS: tuple[tuple[tuple[str, ...], Callable[[tuple[Any, ...]], Any]], ...] = (
    (_RECONSTRUCT, _reconstructed),
    (_BUFFER, _from_buffer),
    (_SCALAR, _number),
    ((_TYPE,), lambda given: PickledType(given[0] if given else None)),
)
