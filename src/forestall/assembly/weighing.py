"""A learnt domain whose needs are weighed: what is as likely a habit can be left out.

Called by the command line and experiments; calls the mining of the comparison. A learnt domain has
everything for a need that always held before a skill. That is safe and too much: whoever checks a
plan by it refuses wherever somebody else has other habits.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

from forestall.comparison.needs import needs_of
from forestall.comparison.preconditions import MiningConfig, needed
from forestall.comparison.tally import VARIED
from forestall.domain.formula import And, Formula, Not, Some
from forestall.domain.model import Domain
from forestall.types.demonstration import Demonstration
from forestall.types.facts import Literal

Weights = Mapping[str, Mapping[Literal, float]]
"""Skill → fact over its arguments → how likely it is a need and no habit."""


def weights(
    domain: Domain, shown: Sequence[Demonstration], mining: MiningConfig | None = None
) -> Weights:
    """How much the needs of a learnt domain weigh in the demonstrations that it was learnt from.

    A fact that weighs differently for different kinds of things counts with the most.
    """
    counts = needs_of(shown, domain)
    found: dict[str, dict[Literal, float]] = {name: {} for name in domain.skills}
    alike = {
        (s.subtask.skill, *counts.kinds(s.subtask).values()): s.subtask
        for d in shown
        for s in d.steps
    }
    for subtask in alike.values():
        of = found[subtask.skill]
        for p in needed(counts, subtask, None, None, mining):
            of[p.literal] = max(p.weight, of.get(p.literal, 0.0))
    return found


def likely(domain: Domain, weighed: Weights, least: float) -> Domain:
    """A learnt domain with the needs that weigh at least so much."""
    skills = {
        name: replace(
            skill,
            needs=tuple(
                n
                for n in skill.needs
                if isinstance(n.formula, Literal) and weighed[name].get(n.formula, 0.0) >= least
            ),
        )
        for name, skill in domain.skills.items()
    }
    return replace(domain, skills=skills)


def plainer(domain: Domain, weighed: Weights) -> Domain:
    """A learnt domain that a plan of somebody else can be checked by.

    Only what varied at other times is needed (`comparison.tally.VARIED`), of any kinds of things
    whatever a skill was shown with, and never that nothing is related to a thing, but for a free
    hand.
    """
    lacks = {
        name
        for name, predicate in domain.derived.items()
        if name != domain.roles.hand_empty and _is_lack(predicate.definition)
    }
    positive = {
        skill: {x: w for x, w in of.items() if x.predicate not in lacks}
        for skill, of in weighed.items()
    }
    found = likely(domain, positive, VARIED)
    skills = {
        name: replace(s, parameters=tuple(replace(p, kind=None) for p in s.parameters))
        for name, s in found.skills.items()
    }
    return replace(found, skills=skills)


def _is_lack(definition: Formula | None) -> bool:
    """Whether a fact is that nothing has some relations to a thing."""
    parts = definition.parts if isinstance(definition, And) else (definition,)
    return all(
        isinstance(p, Not) and isinstance(p.part, Some) and isinstance(p.part.part, Literal)
        for p in parts
    )
