"""Writes any domain as a lifted PDDL domain; `pddl_state` writes problems of it.

Called by the command line and by cross-checks with other planners; calls `pddl_write` and
`pddl_variants`. The text is sorted and never changes between runs. Categories are types; tags are
types where they are categories too, and predicates that never change otherwise. What a skill deals
with without naming it becomes a further parameter. Words, preferences, phrases and durations have
no place in PDDL. What happens by itself, and skills that make things or take them away, cannot be
said: they are refused unless the caller says that they are to be left out.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from forestall.domain.formula import (
    And,
    Every,
    Formula,
    Not,
    Parameter,
    bind,
)
from forestall.domain.model import FACING, LOCATED, SAME, SAME_CATEGORY, Domain
from forestall.domain.pddl_problem import types_of
from forestall.domain.pddl_text import ROOT
from forestall.domain.pddl_variants import BEFORE, Variant, variants
from forestall.domain.pddl_write import THING, Writer
from forestall.domain.schema import PredicateKind, Skill
from forestall.errors import DomainError
from forestall.types.facts import Literal

HAND = "hand"


@dataclass(frozen=True, slots=True)
class Action:
    """What an action of the text stands for: the skill, and how many of its first arguments."""

    skill: str
    arguments: int


@dataclass(frozen=True, slots=True)
class PddlDomain:
    """The text of a domain.

    Args:
        text: of the file.
        actions: action name → what it stands for.
    """

    text: str
    actions: dict[str, Action]


def domain_pddl(
    domain: Domain, *, without_processes: bool = False, without_makers: bool = False
) -> PddlDomain:
    """A domain as PDDL.

    Args:
        domain: any domain.
        without_processes: leave out what happens by itself.
        without_makers: leave out skills that make things or take them away.

    Raises:
        DomainError: something in it cannot be said in PDDL.
    """
    if domain.processes and not without_processes:
        names = ", ".join(p.name for p in domain.processes)
        raise DomainError(
            f"{domain.name}: what happens by itself cannot be said in PDDL ({names}): "
            "export without processes to leave it out"
        )
    writer = Writer(domain)
    skills = able_skills(domain, without_makers)
    each = [(s, v) for s in skills for v in variants(s)]
    actions: dict[str, Action] = {}
    blocks: list[str] = []
    used, numbers = used_of(writer, domain, skills)
    for skill, variant in sorted(each, key=lambda x: writer.name(x[1].name)):
        if variant.name != skill.name and not variant.effects:
            continue  # without the thing that it deals with it does nothing
        name = writer.name(variant.name)
        actions[name] = Action(skill.name, len(skill.parameters))
        blocks.append(_action(writer, name, skill, variant, FACING in used))
    lines = [f"(define (domain {writer.name(domain.name)})"]
    derived = sorted(domain.derived)
    needed = [":adl", *([":derived-predicates"] if derived else []), ":typing"]
    lines.append(f"  (:requirements {' '.join(needed)})")
    lines += _types(writer)
    lines += section(":constants", [f"{writer.name(n)} - {writer.name(c)}"
                                     for n, c in sorted(domain.constants)]
                      + [f"{writer.name(h)} - {HAND}" for h in sorted(writer.hands)])  # fmt: skip
    ordered = any(s.choices for s in skills)
    lines += section(":predicates", sorted(_predicates(writer, used, numbers, ordered)))
    lines += [f"  {writer.derived(name)}" for name in derived]
    return PddlDomain("\n".join((*lines, *blocks, ")")) + "\n", actions)


def able_skills(domain: Domain, without_makers: bool) -> list[Skill]:
    """The robot's skills that PDDL can say.

    Raises:
        DomainError: one makes things or takes them away, and is not to be left out.
    """
    able = domain.robot.skills or tuple(domain.skills)
    found = [domain.skills[s] for s in able]
    makers = [s for s in found if s.makes or any(e.gone for e in s.effects)]
    if makers and not without_makers:
        names = ", ".join(s.name for s in makers)
        raise DomainError(
            f"{domain.name}: PDDL has no things that come or go ({names}): "
            "export without makers to leave these skills out"
        )
    return [s for s in found if s not in makers]


def _types(writer: Writer) -> list[str]:
    domain = writer.domain
    parents = types_of(domain).parents
    entries = []
    names = {THING: "a type of its own", HAND: "a type of its own"} if writer.hands else {}
    for name in sorted(domain.categories):
        spelt = writer.name(name)
        if names.setdefault(spelt, name) != name:
            raise DomainError(f"{names[spelt]} and {name} are the same name in PDDL: {spelt}")
        if name != ROOT:
            above = parents[name]
            entries.append(f"{spelt} - {writer.top if above == ROOT else writer.name(above)}")
    if writer.hands:
        entries += [f"{THING} - {ROOT}", f"{HAND} - {ROOT}"]
    return section(":types", sorted(entries))


def _predicates(
    writer: Writer, used: frozenset[str], numbers: frozenset[str], ordered: bool
) -> Iterator[str]:
    domain = writer.domain
    for p in domain.predicates.values():
        several = writer.parameters(p.parameters, ROOT)
        if p.kind is PredicateKind.ATTRIBUTE:
            names = [writer.value_name(p.name, v) for v in p.values]
            yield from (f"({name} ?thing)" for name in names if name)
            yield f"(has_{p.name} ?thing)"
        else:
            name = writer.opposite(p.name) if p.name in writer.inverted else writer.name(p.name)
            yield f"({' '.join((name, several)).strip()})"
    yield from (f"({writer.name(t)} ?thing)" for t in domain.tags if not writer.is_type(t))
    yield from (f"({n}_{m} ?thing)" for n in numbers for m in writer.numbers(n))
    yield from (f"({b} ?thing)" for b in (LOCATED, FACING) if b in used)
    if SAME_CATEGORY in used:
        yield f"({SAME_CATEGORY} ?thing ?other)"
    if ordered:
        yield f"({BEFORE} ?thing ?other)"


def _action(writer: Writer, name: str, skill: Skill, variant: Variant, facing: bool) -> str:
    tags = writer.tags_of(variant.parameters)
    rules = (*safe(writer.domain, ("",)), *_safe_before(writer.domain, skill))
    needs = (*tags, *variant.needs, *rules)
    kinds = {p.name: p.kind for p in variant.parameters}
    effects = writer.effects(variant.effects, kinds)
    names = {p.name for p in variant.parameters}
    if facing and skill.at in names:
        effects.append(f"(forall (?other) (when (not (= ?other {skill.at})) "
                       f"(not ({FACING} ?other))))")  # fmt: skip
        effects.append(f"({FACING} {skill.at})")
    lines = [
        f"  (:action {name}",
        f"    :parameters ({writer.parameters(variant.parameters)})",
        *_joined(":precondition", [writer.formula(f) for f in needs]),
        *_joined(":effect", effects),
    ]
    return "\n".join(lines) + ")"


def _joined(key: str, texts: list[str]) -> list[str]:
    if len(texts) == 1:
        return [f"    {key} {texts[0]}"]
    if not texts:
        return [f"    {key} ()"]
    return [f"    {key} (and", *(f"      {t}" for t in texts[:-1]), f"      {texts[-1]})"]


def section(key: str, entries: list[str]) -> list[str]:
    """A section of a file, line by line; nothing for one without entries."""
    if not entries:
        return []
    return [f"  ({key}", *(f"    {e}" for e in entries), "  )"]


def safe(domain: Domain, when: tuple[str, ...]) -> list[Formula]:
    """That what must never be so at these moments is not so."""
    return [
        Every(rule.variables, Not(rule.never)) if rule.variables else Not(rule.never)
        for rule in domain.safety
        if rule.when in when
    ]


def _safe_before(domain: Domain, skill: Skill) -> Iterator[Formula]:
    """What must not be so before a skill, of its own things where a rule names them."""
    for rule in domain.safety:
        if rule.when != skill.name:
            continue
        if rule.after:
            raise DomainError(
                f"{domain.name}: what must not be so after a skill cannot be said in PDDL "
                f"(safety rule {rule.name})"
            )
        own = {v.name: f"{v.name}_of_the_rule" for v in rule.variables if rule.args}
        variables = tuple(Parameter(own.get(v.name, v.name), v.kind) for v in rule.variables)
        named = zip(rule.args or (), skill.roles, strict=False)
        these = tuple(Literal(SAME, (own.get(a, a), f"?{role}")) for a, role in named)
        harm = And((*these, bind(rule.never, own))) if these else bind(rule.never, own)
        yield Every(variables, Not(harm)) if variables else Not(harm)


def used_of(
    writer: Writer, domain: Domain, skills: list[Skill]
) -> tuple[frozenset[str], frozenset[str]]:
    """Predicates and numbers that a domain speaks of, with these of its skills."""
    formulas: list[Formula] = [p.definition for p in domain.derived.values() if p.definition]
    for skill in skills:
        formulas += [n.formula for n in skill.needs]
        formulas += [e.condition for e in skill.effects]
        formulas += [] if skill.done_when is None else [skill.done_when]
        for choice in skill.choices:
            formulas += [*choice.among, choice.such_that, choice.only_if]
    formulas += [rule.never for rule in domain.safety]
    return writer.used(formulas)
