"""Values that may be anything: each knows its place, every error names it.

Used by the readers of graphs, records and memories; calls nothing. What is wrong is a
`FileFormatError` such as "boundaries[3].verdict.score: a number is expected, got 'high'".
"""

from __future__ import annotations

import re
from collections.abc import Callable, Collection
from dataclasses import dataclass
from enum import Enum
from math import isfinite
from typing import Any, NoReturn, TypeVar

from forestall.errors import FileFormatError, ForestallError, UnknownNameError

T = TypeVar("T")
E = TypeVar("E", bound=Enum)

_THREE = [float] * 3
_CONTROL = re.compile(r"[\x00-\x1f\x7f-\x9f]")

MOST_NAME = 256
"""How many characters a name may have."""


@dataclass(frozen=True, slots=True)
class Field:
    """One value of a JSON document, and where it stands."""

    value: Any
    place: str = ""

    def fail(self, expected: str) -> NoReturn:
        """Say what was expected here.

        Raises:
            FileFormatError: always.
        """
        found = repr(self.value)
        found = found if len(found) <= 60 else f"{found[:57]}..."
        raise FileFormatError(f"{self._name()}: {expected} is expected, got {found}")

    def __getitem__(self, key: str) -> Field:
        found = self.find(key)
        if found is None:
            raise FileFormatError(f"{self._name()} lacks {key!r}")
        return found

    def find(self, key: str) -> Field | None:
        """The value under a key, None where the key is not there."""
        if not isinstance(self.value, dict):
            self.fail("an object")
        if key not in self.value:
            return None
        return Field(self.value[key], f"{self.place}.{key}" if self.place else key)

    def only(self, known: Collection[str], kind: str = "entry") -> Field:
        """Itself, an object without any key but these.

        Raises:
            FileFormatError: another key, with the nearest one that is known.
        """
        if not isinstance(self.value, dict):
            self.fail("an object")
        for key in self.value:
            if key not in known:
                error = UnknownNameError(kind, str(key), known)
                raise FileFormatError(f"{self.place}: {error}" if self.place else str(error))
        return self

    def maybe(self, key: str, read: Callable[[Field], T]) -> T | None:
        """What is under a key, None where that is null."""
        field = self[key]
        return None if field.value is None else read(field)

    def optional(self, key: str, read: Callable[[Field], T]) -> T | None:
        """What is under a key, None where that is null or not there."""
        field = self.find(key)
        return None if field is None or field.value is None else read(field)

    def items(self) -> list[Field]:
        """The elements of a list."""
        if not isinstance(self.value, list | tuple):
            self.fail("a list")
        return [Field(v, f"{self.place}[{i}]") for i, v in enumerate(self.value)]

    def tuple_of(self, read: Callable[[Field], T]) -> tuple[T, ...]:
        """Every element of a list, read."""
        return tuple(read(f) for f in self.items())

    def at_most(self, most: int, read: Callable[[Field], T]) -> tuple[T, ...]:
        """Every element of a list that may have so many."""
        if isinstance(self.value, list | tuple) and len(self.value) > most:
            raise FileFormatError(f"{self._name()}: at most {most} are read, got {len(self.value)}")
        return self.tuple_of(read)

    def pairs(self, read: Callable[[Field], T]) -> tuple[tuple[str, T], ...]:
        """Every entry of an object, in order."""
        if not isinstance(self.value, dict):
            self.fail("an object")
        return tuple((k, read(Field(v, f"{self.place}.{k}"))) for k, v in self.value.items())

    def text(self) -> str:
        """A text."""
        if not isinstance(self.value, str):
            self.fail("a text")
        return self.value

    def name(self) -> str:
        """A text that names something; a whole number is taken as its digits."""
        if isinstance(self.value, int) and not isinstance(self.value, bool):
            return str(self.value)
        if not isinstance(self.value, str) or not _shows(self.value):
            self.fail(f"a name of 1 to {MOST_NAME} characters that can be shown")
        return self.value

    def flag(self) -> bool:
        """True or false."""
        if not isinstance(self.value, bool):
            self.fail("true or false")
        return self.value

    def whole(self) -> int:
        """A whole number from 0 on."""
        if isinstance(self.value, bool) or not isinstance(self.value, int) or self.value < 0:
            self.fail("a whole number from 0 on")
        return self.value

    def number(self) -> float:
        """A finite number."""
        if isinstance(self.value, bool) or not isinstance(self.value, int | float):
            self.fail("a number")
        try:
            number = float(self.value)
        except OverflowError:
            self.fail("a number")
        if not isfinite(number):
            self.fail("a finite number")
        return number

    def vector(self) -> tuple[float, float, float]:
        """Three numbers."""
        value = self.value
        if type(value) is list and [type(v) for v in value] == _THREE and isfinite(sum(value)):
            return (value[0], value[1], value[2])  # the same, faster: memories have thousands
        numbers = self.tuple_of(Field.number)
        if len(numbers) != 3:
            self.fail("three numbers")
        return (numbers[0], numbers[1], numbers[2])

    def triple(self) -> tuple[str, str, str]:
        """Three names, as a relation has them."""
        names = self.tuple_of(Field.name)
        if len(names) != 3:
            self.fail("subject, predicate and object")
        return (names[0], names[1], names[2])

    def member(self, kind: type[E]) -> E:
        """A member of an enumeration, by its value."""
        try:
            return kind(self.text())
        except ValueError:
            self.fail(f"one of {', '.join(repr(m.value) for m in kind)}")

    def parsed(self, parse: Callable[[Any], T]) -> T:
        """What a parser of ours makes of the value; its complaint gets the place."""
        try:
            return parse(self.value)
        except ForestallError as error:
            raise FileFormatError(f"{self._name()}: {error}") from error
        except (ValueError, TypeError, AttributeError, LookupError, ArithmeticError) as error:
            raise FileFormatError(f"{self._name()} cannot be read: {error}") from error

    def _name(self) -> str:
        return self.place or "the document"


def _shows(name: str) -> bool:
    if not 0 < len(name) <= MOST_NAME:
        return False
    return name.isprintable() or _CONTROL.search(name) is None
