"""Subtasks and plans: verbs of the skill set with typed arguments."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from forestall.errors import InputError
from forestall.types.facts import category_of

SKILLS: dict[str, tuple[str, ...]] = {
    "navigate_to_obj": ("target",),
    "pick_up": ("object",),
    "put_on": ("object", "target"),
    "put_in": ("object", "target"),
    "open_obj": ("target",),
    "close_obj": ("target",),
    "toggle_on": ("target",),
    "toggle_off": ("target",),
    "slice_obj": ("object",),
    "crack_obj": ("object",),
    "pour": ("object", "target"),
}
"""Skill name → the roles of its arguments; lifted literals use "?object" and "?target"."""

_TEXT = re.compile(r"^\s*\(?\s*([a-z_]+)\s*[(,]\s*([^()]*?)\s*\)\s*$")


@dataclass(frozen=True, slots=True, order=True)
class Subtask:
    """One skill with its arguments: category names ("Mug") or instance names ("Mug-1")."""

    skill: str
    args: tuple[str, ...]

    def __str__(self) -> str:
        return f"{self.skill}({', '.join(self.args)})"

    @classmethod
    def parse(cls, text: str) -> Subtask:
        """Read "put_in(Plate, Microwave)" or "(put_in, Plate, Microwave)".

        Raises:
            InputError: the text is no subtask.
        """
        match = _TEXT.match(text)
        if match is None:
            raise InputError(f"cannot read {text!r} as a subtask: write put_in(Plate, Microwave)")
        return cls(match[1], tuple(a.strip() for a in match[2].split(",") if a.strip()))

    def roles(self) -> dict[str, str]:
        """Variable → argument, e.g. {"?object": "Plate-1", "?target": "Microwave-1"}."""
        return {f"?{r}": a for r, a in zip(SKILLS[self.skill], self.args, strict=True)}

    def words(self) -> str:
        """The subtask as a phrase: "put in Plate Microwave"."""
        return " ".join((self.skill.removesuffix("_obj").replace("_", " "), *self.args))


def same_step(a: Subtask, b: Subtask) -> bool:
    """Whether two subtasks are the same up to naming an instance or only its category."""
    return a.skill == b.skill and all(
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
