"""PDDL text of a ground problem, for other planners and for reading.

Called by tests and tools; calls `problem`. The text is sorted and never changes between runs:
plain ground STRIPS with conditional effects, every atom a predicate without parameters. A problem
with several goal alternatives reaches the atom `goal-reached` through one operator for each.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

from forestall.planning.problem import Operator, Problem

GOAL = "goal-reached"


@dataclass(frozen=True, slots=True)
class Pddl:
    """Domain and problem text, and what each action name stands for."""

    domain: str
    problem: str
    actions: dict[str, Operator]

    def read_plan(self, names: Iterable[str]) -> tuple[Operator, ...]:
        """The operators of a plan given as action names (those that reach a goal are left out)."""
        return tuple(self.actions[n.lower()] for n in names if n.lower() in self.actions)


def export(problem: Problem, name: str = "household") -> Pddl:
    """Write a problem as PDDL."""
    labels = _labels("_".join(atom) for atom in problem.atoms)
    actions = _labels("_".join((o.subtask.skill, *o.subtask.args)) for o in problem.operators)
    lines = [f"(define (domain {name})", "  (:requirements :strips :conditional-effects)"]
    lines.append("  (:predicates")
    lines += [f"    ({p})" for p in sorted([*labels, GOAL])]
    lines.append("  )")
    named = sorted(zip(actions, problem.operators, strict=True), key=lambda pair: pair[0])
    for label, operator in named:
        lines += _action(label, operator, labels)
    for k, goal in enumerate(problem.goals):
        lines += [
            f"  (:action reach-goal-{k + 1}",
            "    :parameters ()",
            f"    :precondition {_all(goal, labels)}",
            f"    :effect ({GOAL})",
            "  )",
        ]
    lines.append(")")
    facts = [f"    ({labels[b]})" for b in range(len(labels)) if problem.initial >> b & 1]
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


def _labels(names: Iterable[str]) -> list[str]:
    """Valid PDDL names, made unique where two are alike."""
    seen: dict[str, int] = {}
    labels = []
    for name in names:
        plain = "".join(c if c.isalnum() or c in "-_" else "-" for c in name).lower()
        seen[plain] = seen.get(plain, 0) + 1
        labels.append(plain if seen[plain] == 1 else f"{plain}--{seen[plain]}")
    return labels


def _atoms(mask: int, labels: list[str]) -> list[str]:
    return sorted(f"({labels[b]})" for b in range(len(labels)) if mask >> b & 1)


def _all(mask: int, labels: list[str]) -> str:
    return f"(and {' '.join(_atoms(mask, labels))})".replace("(and )", "(and)")


def _effect(add: int, delete: int, labels: list[str]) -> str:
    parts = _atoms(add, labels) + [f"(not {a})" for a in _atoms(delete, labels)]
    return f"(and {' '.join(parts)})"


def _action(label: str, operator: Operator, labels: list[str]) -> list[str]:
    effects = []
    for effect in operator.effects:
        if not (effect.add or effect.delete):
            continue
        text = _effect(effect.add, effect.delete, labels)
        if effect.condition:
            text = f"(when {_all(effect.condition, labels)} {text})"
        effects.append(f"      {text}")
    return [
        f"  (:action {label}",
        "    :parameters ()",
        f"    :precondition {_all(operator.condition, labels)}",
        "    :effect (and",
        *sorted(effects),
        "    )",
        "  )",
    ]
