"""Which skills can bring about what nobody can put right again, by the domain's own schemas.

Called by calibration (a tighter line before these); calls nothing but the schemas.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator

from forestall.domain.formula import literals
from forestall.domain.model import Domain
from forestall.domain.schema import Effect, PredicateKind, Skill
from forestall.types.facts import Literal


def irreversible_skills(domain: Domain) -> tuple[str, ...]:
    """Skills after which something may have happened for good, sorted.

    Those that make things or take them away; that leave a history fact; that give an attribute a
    value which no skill takes from it; or that set a state on which a process waits that does one
    of these. Conditions of an effect are not judged: what may happen counts.
    """
    return tuple(sorted(s.name for s in domain.skills.values() if _is_irreversible(domain, s)))


def _is_irreversible(domain: Domain, skill: Skill) -> bool:
    if skill.makes or _for_good(domain, skill.effects):
        return True
    started = {f.predicate + "=" + f.value for f in _facts(skill.effects) if f.is_state}
    return any(
        _for_good(domain, process.effects)
        and any(x.predicate + "=" + x.value in started for x, _ in literals(process.condition))
        for process in domain.processes
    )


def _for_good(domain: Domain, effects: Iterable[Effect]) -> bool:
    effects = tuple(effects)
    return any(e.gone for e in effects) or any(
        _leaves_history(domain, f) or (f.is_state and not _replaced(domain, f))
        for f in _facts(effects)
    )


def _leaves_history(domain: Domain, fact: Literal) -> bool:
    found = domain.predicates.get(fact.predicate)
    return found is not None and found.kind is PredicateKind.HISTORY and fact.value != "false"


def _replaced(domain: Domain, fact: Literal) -> bool:
    """Whether some skill gives the attribute another value, or a thing that has one."""
    return any(
        f.predicate == fact.predicate and f.value != fact.value
        for skill in domain.skills.values()
        for f in _facts(skill.effects)
    ) or any(
        copy.attribute == fact.predicate
        for skill in domain.skills.values()
        for e in skill.effects
        for copy in e.copies
    )


def _facts(effects: Iterable[Effect]) -> Iterator[Literal]:
    for effect in effects:
        yield from effect.facts
