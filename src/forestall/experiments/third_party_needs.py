"""Mined needs and effects against those that a household's own domain says: precision and recall.

Called by `bench third-party`; calls `learning` and the mining of the comparison. From ten
demonstrations of a skill a domain is learnt; its needs, the mined ones, those of them that are
likely, and its effects are compared with the skill's formulas. Facts are compared over the places
of the arguments, derived ones by what they say and not by their name. What never changes (that a
thing can be opened) is part of no scene here and is left out on both sides. A fact is right where
some demonstrated use needs it, and missing where every demonstrated use needs it, since what a
skill needs may differ between kinds of things.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import reduce
from typing import Any

import numpy as np

from forestall.comparison.needs import Needs
from forestall.comparison.preconditions import MiningConfig, needed
from forestall.domain.formula import TRUE, And, Every, Formula, Not, Or, normal, show
from forestall.domain.model import Domain
from forestall.domain.schema import Skill
from forestall.experiments.third_party import without
from forestall.learning.learn import learn
from forestall.seams.others import Foreign
from forestall.statistics.intervals import Metric, rate
from forestall.types.demonstration import Demonstration
from forestall.types.facts import GRIPPER, Literal, category_of
from forestall.types.foreign import ForeignRun
from forestall.types.plan import Subtask

ENOUGH = 10
"""Demonstrations of a skill."""

DRAWS = 5
"""How often they are drawn for each skill."""

SEED = 20_262
LIKELY_FROM = 0.9
"""Weight of a mined need that is more than a guess: nine demonstrations and a contrast."""

HELD, FREE = "in hand", "hand free"
LEARNT, MINED, LIKELY, EFFECTS = "needs, as learnt", "needs, mined", "needs, likely", "effects"

_VARIABLE = re.compile(r"\?\w+")

Fact = tuple[str, tuple[int, ...], str]
"""Predicate, places of its arguments among the skill's, value."""


@dataclass(frozen=True, slots=True)
class Compared:
    """One skill, ten demonstrations of it, and one thing that was mined from them.

    Args:
        skill: which.
        what: needs that were learnt, mined ones, likely ones, or effects.
        mined: what was found.
        right: those of them that some demonstrated use needs.
        true: what every demonstrated use needs.
        found: those of them that were found.
    """

    skill: str
    what: str
    mined: frozenset[Fact]
    right: frozenset[Fact]
    true: frozenset[Fact]
    found: frozenset[Fact]


@dataclass(frozen=True, slots=True)
class NeedsRow:
    """One line of the table.

    Args:
        domain: whose formulas are taken for true.
        what: needs that were learnt, mined ones, likely ones, or effects.
        precision: share of mined facts that are right.
        recall: share of true facts that were found.
        skills: how many skills had enough demonstrations.
    """

    domain: str
    what: str
    precision: Metric
    recall: Metric
    skills: int

    def to_json(self) -> dict[str, Any]:
        """Plain data."""
        return {
            "domain": self.domain,
            "what": self.what,
            "precision": self.precision.to_json(),
            "recall": self.recall.to_json(),
            "skills": self.skills,
        }


def compare(foreign: Foreign, runs: Sequence[ForeignRun]) -> dict[str, list[Compared]]:
    """Every skill with enough demonstrations, against each of the household's domains."""
    shown = [without(r, foreign.geometry).demonstration() for r in runs]
    mining = MiningConfig(exception=0.0) if foreign.exact else MiningConfig()
    truths = foreign.domains()
    skills = sorted({s.subtask.skill for d in shown for s in d.steps})
    found: dict[str, list[Compared]] = {name: [] for name in truths}
    for skill in skills:
        able = [d for d in shown if any(s.subtask.skill == skill for s in d.steps)]
        if len(able) < ENOUGH:
            continue
        random = np.random.default_rng([SEED, *skill.encode()])
        for _ in range(DRAWS):
            drawn = [able[i] for i in random.choice(len(able), ENOUGH, replace=False)]
            mined = _mined(skill, drawn, foreign.hands, mining)
            for name, domain in truths.items():
                if skill in domain.skills:
                    found[name] += _compared(skill, drawn, domain, mined)
    return found


def table(compared: Mapping[str, Sequence[Compared]]) -> list[NeedsRow]:
    """Precision and recall over all skills, with intervals drawn by skill."""
    rows = []
    for domain, several in compared.items():
        for what in (LEARNT, MINED, LIKELY, EFFECTS):
            own = [c for c in several if c.what == what]
            units = [c.skill for c in own]
            precision = rate([len(c.right) for c in own], [len(c.mined) for c in own], units)
            recall = rate([len(c.found) for c in own], [len(c.true) for c in own], units)
            rows.append(NeedsRow(domain, what, precision, recall, len(set(units))))
    return rows


# --- what was mined -------------------------------------------------------------------------------


def _mined(
    skill: str, shown: Sequence[Demonstration], hands: Sequence[str], mining: MiningConfig
) -> dict[str, frozenset[Fact]]:
    domain = learn(shown, hands=hands).domain
    schema, counts = domain.skills[skill], Needs.of(shown, domain)
    places = {p.name: i for i, p in enumerate(schema.parameters)}
    literals = [n.formula for n in schema.needs if isinstance(n.formula, Literal)]
    weighed: dict[Literal, float] = {}
    uses = [s.subtask for d in shown for s in d.steps if s.subtask.skill == skill]
    for subtask in {tuple(counts.kinds(u).values()): u for u in uses}.values():
        for p in needed(counts, subtask, None, None, mining):
            weighed[p.literal] = max(p.weight, weighed.get(p.literal, 0.0))
    likely = [x for x, w in weighed.items() if w >= LIKELY_FROM]
    effects = [f for e in schema.effects for f in e.facts]
    return {
        what: frozenset(_facts(several, places, domain))
        for what, several in (
            (LEARNT, literals),
            (MINED, weighed),
            (LIKELY, likely),
            (EFFECTS, effects),
        )
    }


def _facts(
    literals: Iterable[Literal], places: Mapping[str, int], domain: Domain
) -> Iterator[Fact]:
    """Facts about arguments alone; which hand it is makes no difference."""
    hands = {*domain.robot.hands, GRIPPER}
    for literal in literals:
        args = literal.args
        if literal.predicate == domain.roles.hand_empty:
            yield (FREE, (), literal.value)
        elif literal.predicate == domain.in_any_hand or (
            literal.predicate == domain.roles.holding and args[1] in hands
        ):
            if args[0] in places:
                yield (HELD, (places[args[0]],), literal.value)
        elif all(a in places for a in args):
            said = _said(literal.predicate, domain)
            yield (said, tuple(places[a] for a in args), literal.value)


def _said(predicate: str, domain: Domain) -> str:
    """What a predicate says, whatever it and its variables are called."""
    known = domain.derived.get(predicate)
    if known is None or known.definition is None:
        return predicate
    names = dict.fromkeys(_VARIABLE.findall(show(known.definition)))
    order = {name: f"?{i}" for i, name in enumerate(names)}
    return _VARIABLE.sub(lambda m: order[m[0]], show(known.definition))


# --- what is true ---------------------------------------------------------------------------------


def _compared(
    skill: str,
    shown: Sequence[Demonstration],
    domain: Domain,
    mined: Mapping[str, frozenset[Fact]],
) -> Iterator[Compared]:
    schema = domain.skills[skill]
    uses = [s.subtask for d in shown for s in d.steps if s.subtask.skill == skill]
    needs = [_needs(schema, use, domain) for use in dict.fromkeys(uses)]
    some, every = frozenset.union(*needs), frozenset.intersection(*needs)
    for what in (LEARNT, MINED, LIKELY):
        yield _one(skill, what, mined[what], some, every, domain)
    sure, maybe = _effects(schema, domain)
    yield _one(skill, EFFECTS, mined[EFFECTS], sure | maybe, sure, domain)


def _one(
    skill: str,
    what: str,
    mined: frozenset[Fact],
    some: frozenset[Fact],
    every: frozenset[Fact],
    domain: Domain,
) -> Compared:
    right = frozenset(m for m in mined if any(_says(m, t, domain) for t in some))
    found = frozenset(t for t in every if any(_says(m, t, domain) for m in mined))
    return Compared(skill, what, mined, right, every, found)


def _says(mined: Fact, true: Fact, domain: Domain) -> bool:
    """Whether a fact is another, or gives an attribute another value than it must not have."""
    if mined == true:
        return True
    name, places, value = true
    if not value.startswith("not ") or mined[:2] != (name, places):
        return False
    return name in domain.attributes and mined[2] != value.removeprefix("not ")


def _needs(schema: Skill, use: Subtask, domain: Domain) -> frozenset[Fact]:
    """Facts without which a use of a skill is refused."""
    names = dict(zip((p.name for p in schema.parameters), use.args, strict=True))
    places = {p.name: i for i, p in enumerate(schema.parameters)}
    whole = And(tuple(n.formula for n in schema.needs))
    ways = [w for w in _ways(normal(whole), names, domain) if w is not None]
    facts = [frozenset(_true(way, places, domain)) for way in ways]
    return reduce(frozenset.intersection, facts) if facts else frozenset()


_Way = frozenset[Literal | Formula]


def _ways(formula: Formula, names: Mapping[str, str], domain: Domain) -> list[_Way]:
    """The ways in which a formula can hold, each a set of facts; what never changes is settled."""
    if isinstance(formula, And):
        found: list[_Way] = [frozenset()]
        for part in formula.parts:
            found = [a | b for a in found for b in _ways(part, names, domain)]
        return found
    if isinstance(formula, Or):
        return [w for part in formula.parts for w in _ways(part, names, domain)]
    literal = formula.part if isinstance(formula, Not) else formula
    if isinstance(literal, Literal) and literal.predicate not in domain.predicates:
        own = [names.get(a, a) for a in literal.args]
        holds = literal.predicate in domain.kinds(domain.canonical(category_of(own[0])))
        denied = isinstance(formula, Not) or literal.value == "false"
        return [frozenset()] if holds is not denied else []
    return [frozenset({formula})]


def _true(way: _Way, places: Mapping[str, int], domain: Domain) -> Iterator[Fact]:
    for part in way:
        if isinstance(part, Literal):
            yield from _facts([part], places, domain)
        elif isinstance(part, Not) and isinstance(part.part, Literal):
            inner = part.part
            place = tuple(places[a] for a in inner.args)
            yield (inner.predicate, place, f"not {inner.value}")
        elif _is_free_hand(part, domain):
            yield (FREE, (), "true")
        else:
            yield (show(part), (), "true")


def _is_free_hand(part: Formula, domain: Domain) -> bool:
    """Whether it says that one of the hands holds nothing."""
    inner = part.part if isinstance(part, Every) else None
    return isinstance(inner, Literal) and inner.predicate == domain.roles.holding


def _effects(schema: Skill, domain: Domain) -> tuple[frozenset[Fact], frozenset[Fact]]:
    """What a skill always does to its arguments, and what it does under a condition."""
    places = {p.name: i for i, p in enumerate(schema.parameters)}
    sure: set[Fact] = set()
    maybe: set[Fact] = set()
    for effect in schema.effects:
        if effect.variables:
            continue
        found = set(_facts(effect.facts, places, domain))
        (sure if effect.condition == TRUE else maybe).update(found)
    sure |= {f for f in maybe if f[0] == HELD}  # one hand or the other
    return frozenset(sure), frozenset(maybe)
