"""Which parts of a skill's needs tell something before anything is grounded.

Called by `ground`, `choices`, `possible` and `planner`; calls nothing but the formulas.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator

from forestall.domain.formula import And, Formula, Not, Some, free, literals, normal
from forestall.domain.model import FACING, Domain
from forestall.domain.schema import Effect, PredicateKind, Process, Skill
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


def useful(domain: Domain, goal: Iterable[Formula]) -> frozenset[str]:
    """Skills on which a goal can depend at all, by the predicates that they change and ask for."""
    relevant: set[str] = set()
    waiting = [p for f in goal for p in _predicates(domain, f)]
    schemas: list[Skill | Process] = [*domain.skills.values(), *domain.processes]
    found: list[Skill | Process] = []
    while True:
        while waiting:
            name = waiting.pop()
            if name not in relevant:
                relevant.add(name)
                known = domain.predicates.get(name)
                if known is not None and known.definition is not None:
                    waiting += _predicates(domain, known.definition)
        for schema in schemas:
            if schema not in found and _changed(domain, schema) & relevant:
                found.append(schema)
                waiting += [p for f in _asked(schema) for p in _predicates(domain, f)]
        if not waiting:
            return frozenset(s.name for s in found if isinstance(s, Skill))


def _predicates(domain: Domain, formula: Formula) -> list[str]:
    return [x.predicate for x, _ in literals(formula) if x.predicate in domain.predicates]


def _changed(domain: Domain, schema: Skill | Process) -> set[str]:
    """Predicates that can change: those named, others of their groups, all where things come or go.

    What makes a thing or takes one away changes whatever can be said of it.
    """
    if any(e.gone for e in schema.effects) or (isinstance(schema, Skill) and schema.makes):
        return set(domain.predicates)
    named = {f.predicate for e in schema.effects for f in e.facts}
    named |= {c.attribute for e in schema.effects for c in e.copies}
    groups = {domain.predicates[n].group for n in named} - {None}
    return named | {p.name for p in domain.predicates.values() if p.group in groups}


def _asked(schema: Skill | Process) -> Iterator[Formula]:
    """Everything that is asked before a schema changes something."""
    for effect in schema.effects:
        yield effect.condition
        yield from (Literal(c.attribute, (c.source,), "") for c in effect.copies)
    if isinstance(schema, Process):
        yield schema.condition
        return
    yield from (n.formula for n in schema.needs)
    yield from schema.prefers
    if schema.done_when is not None:
        yield schema.done_when
    for choice in schema.choices:
        yield from (*choice.among, choice.such_that, choice.only_if)
