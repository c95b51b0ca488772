"""Which parts of a skill's needs tell something before anything is grounded.

Called by `ground`, `choices` and `possible`; calls nothing but the formulas.
"""

from __future__ import annotations

from collections.abc import Iterable

from forestall.domain.formula import And, Formula, Not, Some, free, literals, normal
from forestall.domain.model import FACING, Domain
from forestall.domain.schema import Effect, PredicateKind, Skill
from forestall.types.facts import Literal


def simple_needs(domain: Domain, skill: Skill) -> Formula:
    """What tells at once whether a skill can ever run: the positive and the unchanging needs."""
    parts = [p for n in skill.needs for p in conjuncts(normal(n.formula))]
    own = {p.name for p in skill.parameters}
    return And(tuple(p for p in parts if free(p) <= own and _simple(domain, p)))


def plain_parts(domain: Domain, formula: Formula) -> And:
    """The parts of a conjunction that never change; the same object for the same formula."""
    found = domain.__dict__.setdefault("_plain_parts", {}).get(id(formula))
    if found is None or found[0] is not formula:
        parts = tuple(p for p in conjuncts(normal(formula)) if _unchanging(domain, p))
        found = domain.__dict__["_plain_parts"][id(formula)] = (formula, And(parts))
    return found[1]  # type: ignore[no-any-return]


def _unchanging(domain: Domain, formula: Formula) -> bool:
    if not isinstance(formula, Literal) or formula.predicate == FACING:
        return False
    known = domain.predicates.get(formula.predicate)
    return known is None or known.kind is PredicateKind.STATIC


def conjuncts(formula: Formula) -> tuple[Formula, ...]:
    """The parts of a conjunction."""
    if isinstance(formula, And):
        return tuple(c for p in formula.parts for c in conjuncts(p))
    return (formula,)


def _simple(domain: Domain, formula: Formula) -> bool:
    """Whether a need tells at once whether a skill can ever run."""
    if isinstance(formula, Literal):
        known = domain.predicates.get(formula.predicate)
        if known is None:
            return formula.predicate != FACING
        if known.kind in (PredicateKind.STATIC, PredicateKind.ATTRIBUTE):
            return True
        return known.kind is PredicateKind.RELATION and formula.value != "false"
    if isinstance(formula, Some | Not):
        return False
    parts = getattr(formula, "parts", None)
    return parts is not None and all(_simple(domain, p) for p in parts)


def adds_relation(domain: Domain, effect: Effect) -> bool:
    """Whether an effect brings a relation about."""
    return any(f.predicate in domain.relations and f.value == "true" for f in effect.facts)


def asks_relation(domain: Domain, formula: Formula) -> bool:
    """Whether a formula speaks of a relation."""
    return any(
        x.predicate in domain.relations or x.predicate in domain.derived
        for x, _ in literals(formula)
    )


def asks(formulas: Iterable[Formula], predicate: str) -> bool:
    """Whether formulas speak of a predicate."""
    return any(x.predicate == predicate for f in formulas for x, _ in literals(f))
