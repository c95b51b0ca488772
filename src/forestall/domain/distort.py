"""Domains that say less than they should, or something wrong: models as people write them.

Called by the command line and by whoever asks what a judgement is worth whose model is not exact;
calls `load` and `toml_out`. It changes what skills need and do and what happens by itself, and
leaves categories, predicates and words alone, so that whatever speaks of the domain still can.

exact   nothing is changed.
coarse  what plain operators can say: a skill needs single facts about what it names, and prefers
        nothing; what it does depends on nothing that changes, unless it has several values to
        choose from; what happens only in some states and cannot be undone is not known.
wrong   one in ten skills and processes, at least one, says one thing wrong: a need or an effect is
        missing, a need is one of another skill, or a value is another one.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from enum import Enum

import numpy as np

from forestall.domain.checks import check_domain
from forestall.domain.formula import TRUE, And, Formula, Not, free, literals, show
from forestall.domain.load import read_domain
from forestall.domain.model import FACING, LOCATED, Domain
from forestall.domain.schema import Copy, Effect, Need, PredicateKind, Process, Skill
from forestall.domain.toml_out import domain_toml
from forestall.errors import InputError
from forestall.types.facts import Literal

SHARE = 0.1
"""Which part of the skills and processes a wrong domain has wrong."""


class Distortion(Enum):
    """How far a domain is from its original."""

    EXACT = "exact"
    COARSE = "coarse"
    WRONG = "wrong"


@dataclass(frozen=True, slots=True)
class Distorted:
    """A domain, and in sentences what of it differs from the original."""

    domain: Domain
    changes: tuple[str, ...]


Schema = Skill | Process


def distorted(
    domain: Domain, kind: Distortion | str, seed: int = 0, share: float = SHARE
) -> Distorted:
    """A domain that says less than another one, or something wrong.

    Args:
        domain: the original; it has skills or processes.
        kind: how far the result is from it.
        seed: of what is wrong; the same each time.
        share: which part of the skills and processes is wrong, at least one of them.

    Returns:
        A domain of the same name that passes every check, and its changes.

    Raises:
        InputError: no such kind, a seed or share that is none, or nothing can be wrong.
    """
    kinds = {k.value: k for k in Distortion}
    wanted = kind.value if isinstance(kind, Distortion) else kind
    if wanted not in kinds:
        raise InputError(f"kind {wanted!r}: choose one of {', '.join(kinds)}")
    if seed < 0:
        raise InputError(f"seed {seed} is negative; seeds are 0, 1, 2, ...")
    if not 0.0 < share <= 1.0:
        raise InputError(f"share {share}: give a number above 0, at most 1")
    if kinds[wanted] is Distortion.EXACT:
        return Distorted(domain, ())
    if kinds[wanted] is Distortion.COARSE:
        changed = _coarse(domain)
    else:
        changed = _wrong(domain, np.random.default_rng([seed]), share)
    text = domain_toml(changed.domain)
    return Distorted(read_domain(text, f"{domain.name}, {wanted}"), changed.changes)


def _schemas(domain: Domain) -> list[Schema]:
    return [*domain.skills.values(), *domain.processes]


def _with(domain: Domain, name: str, new: Schema | None) -> Domain:
    """The domain with another schema of a name, or without it."""
    if name in domain.skills:
        assert isinstance(new, Skill), "a skill stays a skill"
        return replace(domain, skills={**domain.skills, name: new})
    kept = tuple(new if p.name == name else p for p in domain.processes)
    return replace(domain, processes=tuple(p for p in kept if isinstance(p, Process)))


def _passes(domain: Domain) -> bool:
    try:
        check_domain(domain)
    except InputError:
        return False
    return True


# --- coarse -------------------------------------------------------------------------------------


def _coarse(domain: Domain) -> Distorted:
    changes: list[str] = []
    for schema in _schemas(domain):
        new, said = _coarser(domain, schema)
        changed = _with(domain, schema.name, new)
        if said and _passes(changed):
            domain, changes = changed, [*changes, *said]
    return Distorted(domain, tuple(changes))


def _coarser(domain: Domain, schema: Schema) -> tuple[Schema, list[str]]:
    effects: list[Effect] = []
    said: list[str] = []
    for effect in schema.effects:
        kept, told = _plain_effect(domain, schema, effect)
        effects += [] if kept is None else [kept]
        said += told
    said = list(dict.fromkeys(said))
    if isinstance(schema, Process):
        return replace(schema, effects=tuple(effects)), said
    needs = tuple(n for n in schema.needs if _single(n.formula))
    left_out = [n for n in schema.needs if n not in needs]
    said = [*(f"{schema.name} no longer needs {show(n.formula)}" for n in left_out), *said]
    said += [f"{schema.name} no longer prefers {show(p)}" for p in schema.prefers]
    return replace(schema, needs=needs, prefers=(), effects=tuple(effects)), said


def _single(formula: Formula) -> bool:
    return isinstance(formula.part if isinstance(formula, Not) else formula, Literal)


def _plain_effect(
    domain: Domain, schema: Schema, effect: Effect
) -> tuple[Effect | None, list[str]]:
    """An effect without what cannot be undone, on conditions that never change."""
    name, meant = schema.name, isinstance(schema, Skill) and effect.condition == TRUE
    past = [f for f in effect.facts if f.predicate in domain.histories and not meant]
    facts = tuple(f for f in effect.facts if f not in past)
    said = [f"{name} no longer makes it so that {f}" for f in past]
    if not (facts or effect.copies or effect.gone):
        return None, said
    condition = effect.condition
    if not effect.variables and not _one_of_several(schema, effect):
        parts = condition.parts if isinstance(condition, And) else (condition,)
        fixed = tuple(p for p in parts if not _changes(domain, p))
        condition = fixed[0] if len(fixed) == 1 else And(fixed)
        if fixed != parts:
            done = _done(replace(effect, facts=facts))
            said.append(f"{name} makes it so that {done}, whether or not {show(effect.condition)}")
    return replace(effect, condition=condition, facts=facts), said


def _one_of_several(schema: Schema, effect: Effect) -> bool:
    """Whether a schema has another effect that gives something that this one sets another value."""
    others = [f for e in schema.effects if e is not effect for f in e.facts]
    return any(
        (f.predicate, f.args) == (o.predicate, o.args) and f.value != o.value
        for f in effect.facts
        for o in others
    )


def _changes(domain: Domain, formula: Formula) -> bool:
    """Whether a formula speaks of anything that is not always so."""
    for literal, _ in literals(formula):
        predicate = domain.predicates.get(literal.predicate)
        if literal.predicate in (FACING, LOCATED):
            return True
        if predicate is not None and predicate.kind is not PredicateKind.STATIC:
            return True
    return False


def _done(effect: Effect) -> str:
    facts = [str(f) for f in effect.facts] + [_copied(c) for c in effect.copies]
    return " and ".join([*facts, *(f"gone({g})" for g in effect.gone)])


def _copied(copy: Copy) -> str:
    return f"{copy.attribute}({copy.target}) = {copy.attribute}({copy.source})"


# --- wrong --------------------------------------------------------------------------------------


def _wrong(domain: Domain, rng: np.random.Generator, share: float) -> Distorted:
    schemas = _schemas(domain)
    left = max(1, round(share * len(schemas)))
    changes: list[str] = []
    for k in rng.permutation(len(schemas)).tolist():
        options = list(_misstatements(domain, schemas[k]))
        for o in rng.permutation(len(options)).tolist():
            new, said = options[o]
            changed = _with(domain, schemas[k].name, new)
            if _passes(changed):
                domain, left = changed, left - 1
                changes.append(said)
                break
        if not left:
            return Distorted(domain, tuple(changes))
    if changes:
        return Distorted(domain, tuple(changes))
    raise InputError(f"domain {domain.name}: no skill and no process in it can be misstated")


def _misstatements(domain: Domain, schema: Schema) -> Iterator[tuple[Schema | None, str]]:
    """Every single thing that a schema can have wrong, with a sentence; None: it is not there."""
    name = schema.name
    for k, effect in enumerate(schema.effects):
        for other, said in _other_effects(domain, effect):
            effects = (*schema.effects[:k], *other, *schema.effects[k + 1 :])
            yield replace(schema, effects=effects), f"{name} {said}"
    if isinstance(schema, Process):
        yield None, f"{name} never happens"
        for condition, said in _other_conditions(domain, schema.condition):
            yield replace(schema, condition=condition), f"{name} {said}"
        return
    for k, need in enumerate(schema.needs):
        rest = (*schema.needs[:k], *schema.needs[k + 1 :])
        yield replace(schema, needs=rest), f"{name} does not need {show(need.formula)}"
        for formula in _other_values(domain, need.formula):
            needs = (*schema.needs[:k], _said(formula), *schema.needs[k + 1 :])
            told = f"{name} needs {show(formula)}, not {show(need.formula)}"
            yield replace(schema, needs=needs), told
    for need in _needs_of_others(domain, schema):
        yield replace(schema, needs=(*schema.needs, need)), f"{name} needs {show(need.formula)}"


def _other_effects(domain: Domain, effect: Effect) -> Iterator[tuple[tuple[Effect, ...], str]]:
    for fact in effect.facts:
        kept = tuple(f for f in effect.facts if f != fact)
        left = replace(effect, facts=kept)
        several = kept or effect.copies or effect.gone
        yield (left,) if several else (), f"does not make it so that {fact}"
        for other in _other_values(domain, fact):
            assert isinstance(other, Literal)
            facts = tuple(other if f == fact else f for f in effect.facts)
            yield (replace(effect, facts=facts),), f"makes it so that {other}, not {fact}"
    for copy in effect.copies:
        kept_copies = tuple(c for c in effect.copies if c != copy)
        left = replace(effect, copies=kept_copies)
        several = effect.facts or kept_copies or effect.gone
        yield (left,) if several else (), f"does not make it so that {_copied(copy)}"


def _other_conditions(domain: Domain, condition: Formula) -> Iterator[tuple[Formula, str]]:
    parts = condition.parts if isinstance(condition, And) else (condition,)
    for k, part in enumerate(parts):
        if len(parts) > 1 and _changes(domain, part):
            rest = (*parts[:k], *parts[k + 1 :])
            yield rest[0] if len(rest) == 1 else And(rest), f"happens also where not {show(part)}"
        for other in _other_values(domain, part):
            changed = (*parts[:k], other, *parts[k + 1 :])
            told = f"happens where {show(other)}, not where {show(part)}"
            yield changed[0] if len(changed) == 1 else And(changed), told


def _other_values(domain: Domain, formula: Formula) -> Iterator[Formula]:
    """The same fact about an attribute with its other values."""
    fact = formula.part if isinstance(formula, Not) else formula
    if not isinstance(fact, Literal) or fact.predicate not in domain.attributes:
        return
    for value in domain.values(fact.predicate):
        if value != fact.value:
            other = replace(fact, value=value)
            yield Not(other) if isinstance(formula, Not) else other


def _needs_of_others(domain: Domain, skill: Skill) -> Iterator[Need]:
    """Needs of other skills that can be said of this one's arguments."""
    own = {n.formula for n in skill.needs}
    names = {p.name for p in skill.parameters}
    seen: set[Formula] = set()
    for need in _all_needs(domain.skills.values()):
        new = need.formula not in own | seen and need.formula != TRUE
        if new and _changes(domain, need.formula) and free(need.formula) <= names:
            seen.add(need.formula)
            yield _said(need.formula)


def _all_needs(skills: Iterable[Skill]) -> Iterator[Need]:
    for skill in skills:
        yield from skill.needs


def _said(formula: Formula) -> Need:
    return Need(formula, f"{show(formula)} does not hold")
