"""A ground planning problem: atoms as bits of an int, operators with conditional effects.

Made by `translate`, read by `heuristic`, `search` and `pddl`; calls nothing.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from forestall.types.plan import Subtask

Atom = tuple[str, ...]
"""A ground fact, e.g. ("at", "Mug-1", "inside", "Sink-1"); ("not", *atom) is its complement."""


@dataclass(frozen=True, slots=True)
class Effect:
    """Where `condition` holds before the operator, `add` and `delete` happen (add wins)."""

    condition: int
    add: int
    delete: int


@dataclass(frozen=True, slots=True)
class Operator:
    """One ground skill: runs where `condition` holds; every effect is judged on the state before.

    The first effect is the unconditional one. `over` is the vessel that an egg is cracked over,
    which the subtask itself does not name.
    """

    subtask: Subtask
    condition: int
    effects: tuple[Effect, ...]
    over: str | None = None

    def apply(self, state: int) -> int:
        """The state after the operator, which must be applicable."""
        add = delete = 0
        for effect in self.effects:
            if effect.condition & state == effect.condition:
                add |= effect.add
                delete |= effect.delete
        return (state & ~delete) | add


@dataclass(frozen=True, slots=True)
class Problem:
    """Atoms by bit, the first state, operators, and goals of which any one suffices."""

    atoms: tuple[Atom, ...]
    initial: int
    goals: tuple[int, ...]
    operators: tuple[Operator, ...]

    def reached(self, state: int) -> bool:
        """Whether some goal holds."""
        return any(goal & state == goal for goal in self.goals)

    def names(self, mask: int) -> Iterator[Atom]:
        """The atoms of a mask in bit order."""
        for bit, atom in enumerate(self.atoms):
            if mask >> bit & 1:
                yield atom
