"""PDDL text of a ground problem, for other planners and for reading.

Called by tests and tools; calls `problem`. The text is sorted and never changes between runs:
ground, with conditional effects and negation, every fact a predicate without parameters, derived
facts as axioms. A process is an action of its own; no skill runs, and no goal is reached, while one
has something to do. Several goal alternatives are one action each that adds `goal-reached`.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from itertools import combinations
from math import comb

from forestall.errors import InputError
from forestall.planning.problem import Effect, Operator, Problem

GOAL = "goal-reached"
UNSETTLED = "unsettled"
MOST = 500
"""How many axioms one count may be expanded to."""


@dataclass(frozen=True, slots=True)
class Pddl:
    """Domain and problem text, and what each action name stands for."""

    domain: str
    problem: str
    actions: dict[str, Operator]

    def read_plan(self, names: Iterable[str]) -> tuple[Operator, ...]:
        """The operators of a plan given as action names, without processes and goals."""
        return tuple(self.actions[n.lower()] for n in names if n.lower() in self.actions)


def export(problem: Problem, name: str = "ground") -> Pddl:
    """Write a problem as PDDL.

    Raises:
        InputError: a count would need too many axioms.
    """
    return _Writer(problem).text(name)


class _Writer:
    def __init__(self, problem: Problem) -> None:
        self.problem = problem
        positive = [a for a in problem.atoms if a[0] != "not"]
        labels = dict(zip(positive, _labels("_".join(a) for a in positive), strict=True))
        self.labels = sorted(labels.values())
        self.facts = [
            f"(not ({labels[a[1:]]}))" if a[0] == "not" else f"({labels[a]})" for a in problem.atoms
        ]

    def text(self, name: str) -> Pddl:
        problem = self.problem
        operators = problem.operators
        actions = _labels("_".join((o.subtask.skill, *o.subtask.args)) for o in operators)
        named = sorted(zip(actions, operators, strict=True), key=lambda pair: pair[0])
        requirements = ":strips :conditional-effects :negative-preconditions :derived-predicates"
        lines = [f"(define (domain {name})", f"  (:requirements {requirements})", "  (:predicates"]
        lines += [f"    ({p})" for p in sorted([*self.labels, GOAL, UNSETTLED])]
        lines += ["  )", *sorted(self._axioms())]
        for label, operator in named:
            lines += self._action(label, operator.condition, operator.effects)
        happenings = [h for several in problem.processes for h in several]
        for k, happening in enumerate(happenings, 1):
            more = [f"({UNSETTLED})"]
            lines += self._action(f"process-{k}", happening.condition, happening.effects, more)
        for k, goal in enumerate(problem.goals, 1):
            settled = self._all(goal, [f"(not ({UNSETTLED}))"])
            lines += _lines(f"reach-goal-{k}", settled, [f"({GOAL})"])
        lines.append(")")
        facts = [f"    {self.facts[b]}" for b in range(problem.base) if problem.initial >> b & 1]
        text = [
            f"(define (problem {name}-problem)",
            f"  (:domain {name})",
            "  (:init",
            *sorted(facts),
            "  )",
            f"  (:goal ({GOAL}))",
            ")",
        ]
        return Pddl("\n".join(lines) + "\n", "\n".join(text) + "\n", dict(named))

    def _axioms(self) -> list[str]:
        found = []
        for rule in (r for s in self.problem.strata for r in s.rules):
            head, body = self._names(rule.head)[0], self._names(rule.body)
            size = rule.least or len(body)
            if comb(len(body), size) > MOST:
                raise InputError(
                    f"at least {size} of {len(body)} facts cannot be written as PDDL: "
                    f"more than {MOST} axioms"
                )
            for some in combinations(body, size):
                found.append(f"  (:derived {head} {_and(some)})")
        for happening in (h for several in self.problem.processes for h in several):
            for effect in happening.effects:
                condition = self._names(happening.condition | effect.condition)
                news = [_opposite(f) for f in self._names(effect.add)]
                news += self._names(effect.delete & ~effect.add)
                found += [f"  (:derived ({UNSETTLED}) {_and([*condition, n])})" for n in news]
        return found

    def _action(
        self, label: str, condition: int, effects: Sequence[Effect], more: Sequence[str] = ()
    ) -> list[str]:
        parts = []
        for effect in effects:
            changes = self._names(effect.add)
            changes += [_opposite(f) for f in self._names(effect.delete & ~effect.add)]
            text = _and(changes)
            if effect.condition:
                text = f"(when {self._all(effect.condition)} {text})"
            parts.append(text)
        return _lines(label, self._all(condition, more or [f"(not ({UNSETTLED}))"]), parts)

    def _names(self, mask: int) -> list[str]:
        found = []
        while mask:
            bit = mask & -mask
            found.append(self.facts[bit.bit_length() - 1])
            mask ^= bit
        return sorted(found)

    def _all(self, mask: int, more: Sequence[str] = ()) -> str:
        return _and([*self._names(mask), *more])


def _and(parts: Iterable[str]) -> str:
    return f"(and {' '.join(parts)})".replace("(and )", "(and)")


def _opposite(fact: str) -> str:
    return fact[5:-1] if fact.startswith("(not ") else f"(not {fact})"


def _lines(label: str, condition: str, effects: Iterable[str]) -> list[str]:
    return [
        f"  (:action {label}",
        "    :parameters ()",
        f"    :precondition {condition}",
        "    :effect (and",
        *sorted(f"      {e}" for e in effects),
        "    )",
        "  )",
    ]


def _labels(names: Iterable[str]) -> list[str]:
    """Valid PDDL names, made unique where two are alike."""
    seen: dict[str, int] = {}
    labels = []
    for name in names:
        plain = "".join(c if c.isalnum() or c in "-_" else "-" for c in name).lower()
        seen[plain] = seen.get(plain, 0) + 1
        labels.append(plain if seen[plain] == 1 else f"{plain}--{seen[plain]}")
    return labels
