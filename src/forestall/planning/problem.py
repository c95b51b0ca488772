"""A ground planning problem: facts as bits of an int, operators, processes and derived facts.

Made by `ground`, read by `heuristic`, `search` and `pddl`; calls nothing. A state is an int over
the base facts; `close` adds the complements and the derived facts that conditions ask for.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from copy import copy
from dataclasses import dataclass

from forestall.types.plan import Subtask

Atom = tuple[str, ...]
"""A ground fact, e.g. ("seated_in", "Peg-1", "Hole-1") or ("dirt", "Peg-1", "clean");
("not", *atom) is its complement, ("aux", n) an auxiliary fact that rules derive."""

ROUNDS = 50


@dataclass(frozen=True, slots=True)
class Effect:
    """Where `condition` holds before, `add` and `delete` (base facts) happen; add wins."""

    condition: int
    add: int
    delete: int


@dataclass(frozen=True, slots=True)
class Operator:
    """One ground skill: runs where `condition` holds; effects are judged on the state before.

    `over` is what the robot must face for it, which the subtask itself does not name; `makes` are
    the things that it makes.
    """

    subtask: Subtask
    condition: int
    effects: tuple[Effect, ...]
    over: str | None = None
    makes: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class Happening:
    """One ground instance of a process."""

    condition: int
    effects: tuple[Effect, ...]


@dataclass(frozen=True, slots=True)
class Rule:
    """A derived fact holds where its body does: all of it, or at least so many facts of it."""

    head: int
    body: int
    least: int = 0


@dataclass(frozen=True, slots=True)
class Stratum:
    """Rules that are run to a fixpoint together, and then the complements of what they derive."""

    rules: tuple[Rule, ...]
    complements: tuple[tuple[int, int], ...] = ()


class Problem:
    """Facts by bit, the first state, operators, and goals of which any one suffices.

    Args:
        atoms: name of every bit: base facts, then as many complements, then derived facts.
        initial: the first state, base facts only.
        goals: masks over all bits.
        operators: the skills.
        processes: instances of each process, in the order of the domain.
        strata: how derived facts are computed.
        negated: base facts whose complement something asks for.
        triggers: base facts on which processes depend.
        bounded: whether something that may be needed was left out (things made again and again).
    """

    def __init__(
        self,
        atoms: tuple[Atom, ...],
        initial: int,
        goals: tuple[int, ...],
        operators: tuple[Operator, ...],
        processes: tuple[tuple[Happening, ...], ...] = (),
        strata: tuple[Stratum, ...] = (),
        negated: int = 0,
        triggers: int = 0,
        depends: int = 0,
        base: int = 0,
        bounded: bool = False,
    ) -> None:
        self.atoms, self.initial, self.goals = atoms, initial, goals
        self.operators, self.processes, self.strata = operators, processes, strata
        self.negated, self.triggers, self.base, self.bounded = negated, triggers, base, bounded
        self._depends = depends
        self._derived: dict[int, int] = {}

    def posed(self, initial: int, goals: tuple[int, ...], operators: Sequence[int]) -> Problem:
        """The same problem from another state, for other goals, with some of its operators."""
        other = copy(self)
        other.initial, other.goals = initial, goals
        other.operators = tuple(self.operators[i] for i in operators)
        return other

    def close(self, state: int) -> int:
        """The state with complements and derived facts."""
        full = state | ((self.negated & ~state) << self.base)
        if not self.strata:
            return full
        key = state & self._depends
        derived = self._derived.get(key)
        if derived is None:
            before = full
            for stratum in self.strata:
                full = _derive(stratum, full)
            derived = full ^ before
            self._derived[key] = derived
        return full | derived

    def apply(self, state: int, operator: Operator) -> int:
        """The state after an applicable operator and after what then happens by itself."""
        after = _carried(state, self.close(state), operator.effects)
        if (state ^ after) & self.triggers:
            return self.settle(after)
        return after

    def settle(self, state: int) -> int:
        """The state after everything that happens by itself."""
        for _ in range(ROUNDS):
            before = state
            for instances in self.processes:
                full = self.close(state)
                ready = [i for i in instances if i.condition & full == i.condition]
                for instance in ready:
                    state = _carried(state, full, instance.effects)
                    full = self.close(state)
            if state == before:
                break
        return state

    def reached(self, state: int) -> bool:
        """Whether some goal holds."""
        full = self.close(state)
        return any(goal & full == goal for goal in self.goals)

    def works(self, operators: Sequence[Operator]) -> bool:
        """Whether operators run one after the other and reach a goal."""
        state = self.initial
        for operator in operators:
            if operator.condition & ~self.close(state):
                return False
            state = self.apply(state, operator)
        return self.reached(state)

    def full_add(self, effect: Effect) -> int:
        """What an effect makes true, complements included."""
        gone = effect.delete & ~effect.add & self.negated
        return effect.add | (gone << self.base)

    def names(self, mask: int) -> Iterator[Atom]:
        """The atoms of a mask in bit order."""
        while mask:
            bit = mask & -mask
            yield self.atoms[bit.bit_length() - 1]
            mask ^= bit


def _carried(state: int, full: int, effects: tuple[Effect, ...]) -> int:
    add = delete = 0
    for effect in effects:
        if effect.condition & full == effect.condition:
            add |= effect.add
            delete |= effect.delete
    return (state & ~delete) | add


def _derive(stratum: Stratum, full: int) -> int:
    waiting = stratum.rules
    progress = True
    while progress and waiting:
        progress, later = False, []
        for rule in waiting:
            if rule.head & full:
                continue
            met = (
                (rule.body & full).bit_count() >= rule.least
                if rule.least
                else rule.body & full == rule.body
            )
            if met:
                full |= rule.head
                progress = True
            else:
                later.append(rule)
        waiting = tuple(later)
    for head, complement in stratum.complements:
        if not head & full:
            full |= complement
    return full
