"""Literals: facts about named things, and their three truth values.

A literal is a variable (a predicate over names) with a value. State literals use the attribute as
predicate and one of its values: `torque(Nut-1)=tight`. Relations and derived predicates have the
values `true` and `false`: `near(Nut-1, Tray-1)`, `not near(Nut-1, Tray-1)`. Arguments are instance
names ("Nut-1"), category names ("Nut") or variables ("?thing"). Which predicates there are is the
domain's affair.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from enum import Enum
from functools import lru_cache
from typing import NamedTuple

from forestall.errors import InputError

GRIPPER = "gripper"
"""Node id of the hand of a robot that has one; a domain may name other hands."""


class Change(NamedTuple):
    """A state of a thing that something may have changed: from a value to another.

    Of what may be no more the attribute is "located"; of what was put in or on another thing, it is
    the relation, and the value after is that thing.
    """

    thing: str
    attribute: str
    before: str
    after: str


class Truth(Enum):
    """A fact is true, false, or could not be observed."""

    TRUE = "true"
    FALSE = "false"
    UNOBSERVED = "unobserved"


_TEXT = re.compile(r"(not\s+)?([a-z_][a-z0-9_]*)\s*\(([^()]*)\)(?:\s*=\s*([A-Za-z_]\w*))?")


@dataclass(frozen=True, slots=True, order=True)
class Literal:
    """One fact: `predicate(args)=value`."""

    predicate: str
    args: tuple[str, ...]
    value: str = "true"

    def __str__(self) -> str:
        body = f"{self.predicate}({', '.join(self.args)})"
        if self.value == "true":
            return body
        if self.value == "false":
            return f"not {body}"
        return f"{body}={self.value}"

    @property
    def is_state(self) -> bool:
        """Whether it gives an attribute a value; relations are true or false."""
        return self.value not in ("true", "false")

    @classmethod
    def parse(cls, text: str) -> Literal:
        """Read the text form.

        Raises:
            InputError: the text is not `predicate(a, b)`, `not predicate(a)` or `attribute(a)=v`.
        """
        match = _TEXT.fullmatch(text.strip())
        if match is None or (match[1] and match[4]):
            raise InputError(
                f"cannot read {text!r} as a fact: write attribute(Thing)=value, "
                "predicate(A, B) or not predicate(A, B)"
            )
        args = tuple(a.strip() for a in match[3].split(",")) if match[3].strip() else ()
        if any(not a for a in args):
            raise InputError(f"cannot read {text!r} as a fact: an argument is empty")
        return cls(match[2], args, "false" if match[1] else (match[4] or "true"))

    def bind(self, names: Mapping[str, str]) -> Literal:
        """Replace arguments that are keys of `names`."""
        return Literal(self.predicate, tuple(names.get(a, a) for a in self.args), self.value)


@lru_cache(maxsize=4096)
def category_of(name: str) -> str:
    """The category part of an instance name: "Tray-4" → "Tray"."""
    head, _, tail = name.rpartition("-")
    return head if head and tail.isdecimal() else name


def is_instance(name: str) -> bool:
    """Whether a name carries an instance number."""
    return category_of(name) != name


def number_of(name: str) -> int:
    """The instance number of a name, 1 where it carries none."""
    return int(name.rpartition("-")[2]) if is_instance(name) else 1


@lru_cache(maxsize=4096)
def by_number(name: str) -> tuple[str, int]:
    """Sort key: category first, then number ("Mug-2" before "Mug-10")."""
    return category_of(name), number_of(name)
