"""A domain from demonstrations alone: skills, what always held before, what always changed.

Called by assembly and the command line; calls `vocabulary` and `traces`. Needs are what held before
every demonstrated use of a skill, effects what was so after every one and changed at least once.
With few demonstrations that is more than what is needed, never less: a draft to be read and
corrected by hand (`forestall domain learn`).
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from forestall.domain.checks import check_domain
from forestall.domain.formula import Parameter
from forestall.domain.model import Domain
from forestall.domain.schema import (
    Effect,
    Need,
    Predicate,
    PredicateKind,
    Robot,
    Roles,
    Skill,
)
from forestall.errors import InputError
from forestall.learning.traces import Trace, traces
from forestall.learning.vocabulary import FIXED, HELD, TAKER, Vocabulary, vocabulary
from forestall.types.demonstration import Demonstration
from forestall.types.facts import Literal

_DERIVED = PredicateKind.DERIVED

FEW = 4
"""Fewer demonstrations of a skill than this are called few (the paper records four to a task)."""


@dataclass(frozen=True, slots=True)
class Learnt:
    """What demonstrations say of their own domain.

    Args:
        domain: skills, relations, attributes and categories that they use.
        demonstrations: how many there were.
        limits: what can therefore not be done, a sentence each.
    """

    domain: Domain
    demonstrations: int
    limits: tuple[str, ...]


def learn(
    demonstrations: Sequence[Demonstration],
    *,
    name: str = "learnt",
    hands: Sequence[str] | None = None,
) -> Learnt:
    """A domain from demonstrations alone.

    Args:
        demonstrations: successful runs; of each graph everything that was known counts.
        name: of the domain.
        hands: node ids of the robot's hands; by default the nodes that are called grippers.

    Raises:
        InputError: there is no step to learn from, or a skill has not always equally many
            arguments.
    """
    found = traces(demonstrations)
    if not found:
        raise InputError("there is nothing to learn from: no demonstration has a step")
    words = vocabulary(found, hands)
    by_skill: dict[str, list[Trace]] = {}
    for t in found:
        by_skill.setdefault(t.subtask.skill, []).append(t)
    predicates = words.predicates()
    skills = {s: _skill(s, of, words, predicates) for s, of in sorted(by_skill.items())}
    names = {n.category for t in found for g in (t.before, t.after) if g for n in g.nodes}
    names |= {c for t in found for c in t.categories()}
    names -= {n.category for t in found for n in t.before.nodes if n.id in words.hands}
    domain = Domain(
        name=name,
        categories=words.categories(names),
        predicates=predicates,
        skills=skills,
        statics={},
        tags=words.tags(),
        roles=Roles(
            holding=words.holding,
            vacant=words.vacant,
            hand_empty=words.hand_empty,
            fixture=FIXED,
            movable=HELD,
            vacatable=TAKER,
        ),
        robot=Robot(words.hands),
    )
    check_domain(domain)
    return Learnt(domain, len(demonstrations), _limits(by_skill, skills))


def _skill(
    name: str, found: Sequence[Trace], words: Vocabulary, predicates: Mapping[str, Predicate]
) -> Skill:
    arities = sorted({len(t.subtask.args) for t in found})
    if len(arities) > 1:
        shown = {len(t.subtask.args): str(t.subtask) for t in found}
        raise InputError(
            f"the skill {name} has not always equally many arguments: "
            + " and ".join(shown[n] for n in arities)
        )
    parameters = _parameters(found)
    variables = [p.name for p in parameters]
    before = [words.lifted(t.before, t.subtask, variables) for t in found]
    pairs = [
        (earlier, words.lifted(t.after, t.subtask, variables))
        for t, earlier in zip(found, before, strict=True)
        if t.after is not None
    ]
    effects = _effects(pairs, {n for n, p in predicates.items() if p.kind is _DERIVED})
    return Skill(
        name,
        parameters,
        needs=tuple(
            _need(x, predicates[x.predicate], found)
            for x in sorted(frozenset.intersection(*before))
        ),
        effects=(Effect(facts=effects),) if effects else (),
        family=name,
        words=name.replace("_", " "),
    )


def _parameters(found: Sequence[Trace]) -> tuple[Parameter, ...]:
    """Named after their category, where it was always one and is told apart by that."""
    columns = list(zip(*(t.categories() for t in found), strict=True))
    single = [c[0] if len(set(c)) == 1 else None for c in columns]
    parameters = []
    for position, kind in enumerate(single, 1):
        own = kind is not None and single.count(kind) == 1
        plain = re.sub(r"\W+", "_", kind or "").strip("_").lower()
        named = plain if own and re.fullmatch(r"[a-z_]\w*", plain) else f"argument_{position}"
        parameters.append(Parameter(f"?{named}", kind))
    return tuple(parameters)


def _effects(
    pairs: Sequence[tuple[frozenset[Literal], frozenset[Literal]]], derived: set[str]
) -> tuple[Literal, ...]:
    """What was so after every use and not before at least one; and the other way round."""
    if not pairs:
        return ()
    before_any = frozenset.union(*(b for b, _ in pairs))
    before_all = frozenset.intersection(*(b for b, _ in pairs))
    after_any = frozenset.union(*(a for _, a in pairs))
    after_all = frozenset.intersection(*(a for _, a in pairs))
    begun = {x for x in after_all - before_all if x.predicate not in derived}
    ended = {
        Literal(x.predicate, x.args, "false")
        for x in before_any - after_any
        if x.predicate not in derived and not x.is_state
    }
    return tuple(sorted(begun | ended))


def _need(literal: Literal, predicate: Predicate, found: Sequence[Trace]) -> Need:
    args = [a.replace("?", "{") + "}" if a.startswith("?") else a for a in literal.args]
    said = f"{args[0]} is not {literal.value}" if literal.is_state else predicate.opposite
    for position, name in enumerate(args):
        said = said.replace(f"{{{position}}}", name)
    runs, uses = len({t.demonstration for t in found}), len(found)
    often = "in the only demonstration there is" if runs == 1 else f"in all {runs} demonstrations"
    often += f" ({uses} uses)" if uses > runs else ""
    return Need(literal, f"{said}, unlike {often}", (literal,))


def _limits(by_skill: dict[str, list[Trace]], skills: dict[str, Skill]) -> tuple[str, ...]:
    found = [
        "what always held before a skill is taken for needed: what never varied may be a habit",
        "what can be shut is known only where a move of a thing showed it",
        "what happens by itself and what is dangerous is not known",
        "what is no argument of a subtask, and on or in what an argument lies, is not judged",
    ]
    for name, of in by_skill.items():
        runs = len({t.demonstration for t in of})
        if runs < FEW:
            many = "once" if runs == 1 else f"in {runs} demonstrations"
            found.append(f"{name} was shown only {many}: little tells what it needs")
        if all(t.after is None for t in of):
            found.append(
                f"what {name} does is not known, for nothing was seen after it: no plan can use it"
            )
        elif not skills[name].effects:
            found.append(f"{name} changed nothing that the graphs show: no plan can use it")
    return tuple(found)
