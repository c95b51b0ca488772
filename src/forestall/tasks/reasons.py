"""Which facts of a state are behind the truth of a formula.

Called by `causes`; calls planning's state. Definitions are followed down to values and relations.
"""

from __future__ import annotations

from dataclasses import dataclass

from forestall.domain.formula import And, Every, Fewer, Formula, Not, Or, Some, bind, normal
from forestall.domain.model import LOCATED
from forestall.domain.schema import PredicateKind
from forestall.planning.state import State
from forestall.types.facts import Literal

_DEEP = 20
"""How many definitions are followed one inside the other."""


def because(formula: Formula, state: State, instead: bool = True) -> set[Literal]:
    """Facts that are so and make a formula true; nothing where it is not true.

    Args:
        formula: in negation normal form (`normal`), without free variables.
        state: in which it is asked.
        instead: whether to tell, of what is not so, also what is so in its place.
    """
    return _Behind(state, instead).of(formula, 0)


def denied(fact: Literal) -> Literal | None:
    """The opposite of a fact; None for a state, which has several."""
    if fact.is_state:
        return None
    return Literal(fact.predicate, fact.args, "true" if fact.value == "false" else "false")


@dataclass(frozen=True, slots=True)
class _Behind:
    """See `because`."""

    state: State
    instead: bool

    def of(self, formula: Formula, deep: int) -> set[Literal]:
        state = self.state
        if deep > _DEEP or not state.true(formula):
            return set()
        if isinstance(formula, Literal):
            return self._literal(formula, deep)
        if isinstance(formula, And | Or):
            return {x for part in formula.parts for x in self.of(part, deep + 1)}
        if isinstance(formula, Some):
            several = state.bindings(formula.variables, formula.part, {})
            return {x for b in several for x in self.of(bind(formula.part, b), deep + 1)}
        if isinstance(formula, Every):
            return self._every(formula, deep)
        if isinstance(formula, Not) and isinstance(formula.part, Fewer):
            few = formula.part
            several = state.bindings((few.variable,), few.part, {})
            return {x for b in several for x in self.of(bind(few.part, b), deep + 1)}
        if isinstance(formula, Not) and isinstance(formula.part, Literal):
            return self._in_its_place(formula.part)
        return set()

    def _every(self, formula: Every, deep: int) -> set[Literal]:
        """Of all things nothing can be said; of all of a kind it can."""
        variable = formula.variables[0]
        if len(formula.variables) > 1 or variable.kind is None:
            return set()
        bound = [bind(formula.part, {variable.name: t}) for t in self.state.of_kind(variable.kind)]
        return {x for part in bound for x in self.of(part, deep + 1)}

    def _literal(self, fact: Literal, deep: int) -> set[Literal]:
        known = self.state.domain.predicates.get(fact.predicate)
        if fact.predicate == LOCATED:
            return {fact} if fact.value == "false" else set()
        if known is None or known.kind is PredicateKind.STATIC:
            return set()
        if known.kind is not PredicateKind.DERIVED:
            here = self._in_its_place(fact) if fact.value == "false" and self.instead else set()
            return {fact} | here
        if known.definition is None:
            return set()
        names = {p.name: a for p, a in zip(known.parameters, fact.args, strict=True)}
        meant = bind(normal(known.definition, fact.value == "true"), names)
        return self.of(meant, deep + 1)

    def _in_its_place(self, fact: Literal) -> set[Literal]:
        """What is so in the place of a fact that is not: another value, another place."""
        domain, name = self.state.domain, fact.args[0] if fact.args else ""
        if name and name not in self.state.kinds and name not in domain.robot.hands:
            return {Literal(LOCATED, (name,), "false")}
        known = domain.predicates[fact.predicate]
        if known.kind is PredicateKind.ATTRIBUTE:
            value = self.state.value(name, fact.predicate)
            return set() if value is None else {Literal(fact.predicate, (name,), value)}
        if known.group is None:
            return set()
        return {
            Literal(f[0], f[1:])
            for f in self.state.facts
            if f[1:2] == (name,) and domain.predicates[f[0]].group == known.group
        }
