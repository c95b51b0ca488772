"""Scores a finished run on the truth: the strict check over state and history, and REFLECT's own.

The success condition C_goal of the paper (Sec. 3, "Problem Formulation") asks for one binding of
the goal's variables under which every literal holds in the end and nothing that must never happen
has happened. What must never happen is looked up in what is spoiled, in the final state and in
every event, so that washing the pan afterwards does not help. Calls: benchmark → here → oracle.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import product

from forestall.errors import InputError
from forestall.interfaces import OracleView
from forestall.types.episode import Event
from forestall.types.facts import GRIPPER, Literal, Truth, category_of
from forestall.types.graph import SceneGraph
from forestall.types.task import Goal


@dataclass(frozen=True, slots=True)
class _History:
    """The final state with all that led to it."""

    graph: SceneGraph
    spoiled: frozenset[str]
    events: tuple[Event, ...]
    facts: tuple[Literal, ...]  # every fact that an event says became true

    @classmethod
    def of(cls, oracle: OracleView) -> _History:
        events = oracle.events()
        return cls(oracle.truth(), oracle.spoiled(), events, tuple(_facts(events)))

    def holds(self, literal: Literal) -> bool:
        """Whether a literal is true in the end."""
        if literal.predicate == "spoiled":
            wanted = literal.value == "true"
            return any(_means(literal.args[0], n) for n in self.spoiled) == wanted
        return self.graph.truth(literal) is Truth.TRUE

    def happened(self, literal: Literal) -> bool:
        """Whether a literal is true in the end or became true at any time."""
        return self.holds(literal) or any(
            f.predicate == literal.predicate
            and f.value == literal.value
            and len(f.args) == len(literal.args)
            and all(_means(a, b) for a, b in zip(literal.args, f.args, strict=True))
            for f in self.facts
        )

    def why(self, literal: Literal) -> str:
        """How a literal that does not hold looks instead."""
        if literal.predicate == "spoiled":
            return ""
        node = self.graph.get(literal.args[0]) if len(literal.args) == 1 else None
        value = None if node is None else node.state(literal.predicate)
        return "" if value is None else f": it is {value}"

    def cause(self, literal: Literal) -> str:
        """The words of the event behind something that must not have happened."""
        if literal.predicate != "spoiled":
            return ""
        texts = (
            e.text
            for e in self.events
            if e.kind == "spoiled" and any(_means(literal.args[0], o) for o in e.objects)
        )
        text = next(texts, "")
        return f": {text}" if text else ""


class TruthGoalChecker:
    """Implements `GoalChecker` on an environment's oracle."""

    def check(self, goal: Goal, oracle: OracleView) -> tuple[bool, bool | None, tuple[str, ...]]:
        """Strict success, weak success (None where the goal has no weaker check), failures.

        Failures are those of the binding that comes nearest to the goal.
        """
        history = _History.of(oracle)
        failures = _best(goal.variables, goal.literals, goal.never, history)
        weak = None if not goal.weak else not _best(goal.variables, goal.weak, (), history)
        return not failures, weak, failures


def _facts(events: Sequence[Event]) -> Iterator[Literal]:
    for event in events:
        if event.kind in ("state", "relation"):
            try:
                yield Literal.parse(event.text)
            except InputError:
                continue


def _means(name: str, instance: str) -> bool:
    """Whether a name in a goal, instance or category, can mean an instance."""
    return name in (instance, category_of(instance))


def _best(
    variables: Sequence[tuple[str, str]],
    literals: Sequence[Literal],
    never: Sequence[Literal],
    history: _History,
) -> tuple[str, ...]:
    """What fails under the best binding; empty where one binding fits.

    The best has the fewest failures and, among those, the fewest literals that do not hold: what
    was reached and spoiled tells more than what was never tried.
    """
    used = {a for literal in (*literals, *never) for a in literal.args}
    chosen = [(v, c) for v, c in variables if v in used]
    missing = tuple(f"there is no {c}" for _, c in chosen if not history.graph.of_category(c))
    best: tuple[int, int, tuple[str, ...]] | None = None
    for binding in _bindings(chosen, history.graph):
        unmet = tuple(
            f"{ground} does not hold in the end{history.why(ground)}"
            for ground in (literal.bind(binding) for literal in literals)
            if not history.holds(ground)
        )
        wrong = tuple(
            f"{ground} must never be{history.cause(ground)}"
            for ground in (literal.bind(binding) for literal in never)
            if history.happened(ground)
        )
        failures = (*missing, *unmet, *wrong)
        if best is None or (len(failures), len(unmet)) < best[:2]:
            best = (len(failures), len(unmet), failures)
        if not failures:
            break
    return ("no binding of the goal's variables is possible",) if best is None else best[2]


def _bindings(
    variables: Sequence[tuple[str, str]], graph: SceneGraph
) -> Iterator[Mapping[str, str]]:
    """Every binding to different instances; a category that is not there stands for itself."""
    choices = [[n.id for n in graph.of_category(c) if n.id != GRIPPER] or [c] for _, c in variables]
    for names in product(*choices):
        if len(set(names)) == len(names):
            yield {v: n for (v, _), n in zip(variables, names, strict=True)}


__all__ = ["TruthGoalChecker"]
