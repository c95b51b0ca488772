"""Subtasks and plans: skills with arguments, in order. Which skills there are a domain says."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from forestall.errors import InputError
from forestall.types.facts import category_of

_TEXT = re.compile(r"\(?\s*([a-z][a-z0-9_]*)\s*[(,]([^()]*)\)")


@dataclass(frozen=True, slots=True, order=True)
class Subtask:
    """One skill with its arguments: category names ("Nut") or instance names ("Nut-1")."""

    skill: str
    args: tuple[str, ...]

    def __str__(self) -> str:
        return f"{self.skill}({', '.join(self.args)})"

    @classmethod
    def parse(cls, text: str) -> Subtask:
        """Read "screw(Nut, Bolt)" or "(screw, Nut, Bolt)".

        Raises:
            InputError: the text is no subtask.
        """
        match = _TEXT.fullmatch(text.strip()) if isinstance(text, str) else None
        if match is None:
            raise InputError(f"cannot read {text!r} as a subtask: write skill(Thing, Place)")
        return cls(match[1], tuple(a.strip() for a in match[2].split(",") if a.strip()))


def same_step(a: Subtask, b: Subtask) -> bool:
    """Whether two subtasks are the same up to naming an instance or only its category."""
    if a.skill != b.skill or len(a.args) != len(b.args):
        return False
    return all(
        x == y
        or (category_of(x) == category_of(y) and (x == category_of(x) or y == category_of(y)))
        for x, y in zip(a.args, b.args, strict=True)
    )


@dataclass(frozen=True, slots=True)
class Plan:
    """An ordered sequence of subtasks and the goal (in words) that it serves."""

    subtasks: tuple[Subtask, ...]
    goal: str = ""

    def __len__(self) -> int:
        return len(self.subtasks)

    def __iter__(self) -> Iterator[Subtask]:
        return iter(self.subtasks)

    def texts(self) -> list[str]:
        """Every subtask in its text form."""
        return [str(s) for s in self.subtasks]

    @classmethod
    def parse(cls, texts: Sequence[str], goal: str = "") -> Plan:
        """Read a plan from the text forms of its subtasks."""
        return cls(tuple(Subtask.parse(t) for t in texts), goal)
