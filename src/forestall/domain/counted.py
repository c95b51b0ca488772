"""Whose contents the needs of a subtask ask for, and the conditions of its effects.

Called by the scope of a scene graph, which keeps such contents even where a thing holds many
things by nature; reads formulas alone, no scene. What the categories of the arguments decide by
themselves asks for nothing: a count up to a capacity does not where the category has none.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import NamedTuple

from forestall.domain.formula import And, Every, Fewer, Formula, Not, Or, Some
from forestall.domain.model import SAME_CATEGORY, Domain
from forestall.domain.schema import Predicate, PredicateKind
from forestall.types.facts import Literal, category_of
from forestall.types.plan import Subtask

_KEPT = 512
"""Of how many subtasks a domain remembers the answer."""


def counted(subtask: Subtask, domain: Domain) -> frozenset[str]:
    """Arguments whose contents decide whether a subtask can start, or what it does.

    None of a skill that the domain does not know, and of a subtask that it refuses whatever the
    state is.
    """
    known: dict[Subtask, frozenset[str]] = domain.__dict__.setdefault("_counted", {})
    found = known.get(subtask)
    if found is None:
        if len(known) >= _KEPT:
            known.clear()
        found = known[subtask] = _counted(subtask, domain)
    return found


def _counted(subtask: Subtask, domain: Domain) -> frozenset[str]:
    skill = domain.skills.get(subtask.skill)
    if skill is None or len(skill.parameters) != len(subtask.args):
        return frozenset()
    names = _Names(dict(domain.bound(subtask)), domain)
    needs = [_look(n.formula, names) for n in skill.needs]
    kinds = zip(skill.parameters, subtask.args, strict=True)
    if any(n.truth is False for n in needs) or not all(domain.is_a(a, p.kind) for p, a in kinds):
        return frozenset()
    effects = [
        _look(e.condition, names.without(v.name for v in e.variables)) for e in skill.effects
    ]
    return frozenset().union(*(f.asked for f in (*needs, *effects)))


class _Found(NamedTuple):
    """What the categories alone say of a formula: its truth if any, else what it asks for."""

    truth: bool | None
    asked: frozenset[str] = frozenset()


class _Names(NamedTuple):
    """What the variables of a formula stand for.

    Args:
        bound: variable → argument; what a quantifier binds is not in it.
        domain: that the formula is of.
        open: derived predicates that are being looked into.
    """

    bound: Mapping[str, str]
    domain: Domain
    open: frozenset[str] = frozenset()

    def without(self, variables: Iterable[str]) -> _Names:
        """Within a quantifier."""
        own = set(variables)
        return self._replace(bound={k: v for k, v in self.bound.items() if k not in own})

    def category(self, name: str) -> str | None:
        """The category of what a name stands for; None: a variable that stands for anything."""
        thing = self.bound.get(name, name)
        if thing.startswith("?"):
            return None
        constants = dict(self.domain.constants)
        return constants.get(thing) or category_of(self.domain.canonical(thing))


def _look(formula: Formula, names: _Names) -> _Found:
    if isinstance(formula, Literal):
        return _literal(formula, names)
    if isinstance(formula, Not):
        truth, asked = _look(formula.part, names)
        return _Found(None if truth is None else not truth, asked)
    if isinstance(formula, And | Or):
        return _joined([_look(p, names) for p in formula.parts], isinstance(formula, And))
    if isinstance(formula, Fewer):
        category = names.category(formula.of)
        counts = isinstance(formula.bound, str) and category is not None
        if counts and names.domain.number(str(category), str(formula.bound)) is None:
            return _Found(True)
        inner = _look(formula.part, names.without([formula.variable.name]))
        return _Found(True) if inner.truth is False else _Found(None, inner.asked)
    inner = _look(formula.part, names.without(v.name for v in formula.variables))
    idle = isinstance(formula, Every)
    assert isinstance(formula, Some | Every)
    return inner if inner.truth is idle else _Found(None, inner.asked)


def _joined(parts: list[_Found], every: bool) -> _Found:
    """All of several parts, or any of them."""
    if any(p.truth is (not every) for p in parts):
        return _Found(not every)
    if all(p.truth is every for p in parts):
        return _Found(every)
    return _Found(None, frozenset().union(*(p.asked for p in parts)))


def _literal(literal: Literal, names: _Names) -> _Found:
    domain = names.domain
    known = domain.predicates.get(literal.predicate)
    categories = [names.category(a) for a in literal.args]
    if known is not None and known.kind is PredicateKind.DERIVED:
        found = _defined(known, literal, names)
    elif known is None or known.kind is PredicateKind.STATIC:
        found = _Found(_by_category(literal.predicate, known, categories, domain))
    elif literal.predicate in domain.containing and categories[0] is None:
        holder = names.bound.get(literal.args[1], literal.args[1])
        return _Found(None, frozenset() if categories[1] is None else frozenset((holder,)))
    else:
        return _Found(None)
    if literal.value == "false" and found.truth is not None:
        return _Found(not found.truth)
    return found


def _defined(known: Predicate, literal: Literal, names: _Names) -> _Found:
    if known.name in names.open or known.definition is None:
        return _Found(None)
    bound = {
        p.name: names.bound.get(a, a)
        for p, a in zip(known.parameters, literal.args, strict=True)
        if not names.bound.get(a, a).startswith("?")
    }
    return _look(known.definition, _Names(bound, names.domain, names.open | {known.name}))


def _by_category(
    predicate: str, known: Predicate | None, categories: list[str | None], domain: Domain
) -> bool | None:
    if None in categories:
        return None
    told = tuple(c for c in categories if c is not None)
    if known is not None:
        holds = told in domain.statics.get(predicate, frozenset())
        return None if holds and known.paired else holds
    if predicate == SAME_CATEGORY:
        return told[0] == told[1]
    return predicate in domain.kinds(told[0]) if domain.known_kind(predicate) else None
