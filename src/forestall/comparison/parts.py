"""Which things play the same part in a skill, and what can be said of them at all.

Called by preconditions; calls nothing but the domain and what was counted.
"""

from __future__ import annotations

from collections.abc import Iterator

from forestall.comparison.needs import Kinds, Needs, Slot, variables_of
from forestall.domain.formula import literals
from forestall.domain.model import Domain
from forestall.domain.schema import Category, PredicateKind, Skill
from forestall.types.facts import Literal
from forestall.types.plan import Subtask

_ALIKE = 0.5


def same_part(counts: Needs, subtask: Subtask, slot: Slot, own: Kinds, other: Kinds) -> bool:
    """Whether things of two kinds play the same part as what a fact of a skill is about.

    The domain says so: the skill's parameter takes one kind of thing, and both are of it; or they
    have as much in common (tags, attributes) as apart. Or the demonstrations do: both were seen as
    this very argument.
    """
    if own == other:
        return True
    if len(own) != len(other):
        return False
    domain = counts.domain
    family = domain.family(subtask)
    accepted = {p.name: p.kind for p in domain.skills[subtask.skill].parameters}
    for variable, one, two in zip(variables_of(slot), own, other, strict=True):
        kind = accepted.get(variable)
        taken = kind is not None and domain.is_a(one, kind) and domain.is_a(two, kind)
        shown = {one, two} <= counts.played.get((family, variable), set())
        if not (one == two or taken or shown or _alike(domain.find(one), domain.find(two))):
            return False
    return True


def _alike(one: Category | None, two: Category | None) -> bool:
    if one is None or two is None:
        return False
    first, second = {*one.tags, *one.attributes}, {*two.tags, *two.attributes}
    return len(first & second) >= _ALIKE * max(len(first | second), 1)


def applies(slot: Slot, kinds: Kinds, domain: Domain) -> bool:
    """Whether a fact can be said of things of these kinds: it is not false for want of sense."""
    predicate, args = slot
    known, roles = domain.predicates.get(predicate), domain.roles
    categories = [domain.find(k) for k in kinds]
    if known is None or any(c is None for c in categories):
        return False
    of = dict(zip(variables_of(slot), kinds, strict=True))
    if known.kind is PredicateKind.ATTRIBUTE:
        return all(c is not None and predicate in c.attributes for c in categories)
    wanted = {roles.vacant: roles.vacatable, roles.accessible: roles.movable}
    wanted[roles.holding] = roles.movable
    if predicate in wanted:
        return all(domain.is_a(k, wanted[predicate]) for k in kinds)
    if known.offered_by and len(args) > 1 and args[1] in of:
        return domain.is_a(of[args[1]], known.offered_by)
    typed = zip(known.parameters, args, strict=False)
    return all(a not in of or domain.is_a(of[a], p.kind) for p, a in typed)


def spoken_of(literal: Literal, skill: Skill) -> bool:
    """Whether a skill's schema says that a fact about an argument matters to it.

    Its needs and what they lack do, and so do the conditions of its effects.
    """
    return any(x.predicate == literal.predicate and x.args == literal.args for x in _said(skill))


def _said(skill: Skill) -> Iterator[Literal]:
    for need in skill.needs:
        yield from (x for x, _ in literals(need.formula))
        yield from need.lacking
    for effect in skill.effects:
        yield from (x for x, _ in literals(effect.condition))
