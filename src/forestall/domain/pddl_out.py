"""Writes any domain as a lifted PDDL domain, and a state and a goal as a problem of it.

Called by the command line and by cross-checks with other planners; calls `pddl_write`. The text is
sorted and never changes between runs. Categories are types; tags are types where they are
categories too, and predicates that never change otherwise. What a skill deals with without naming
it becomes a further parameter. Words, preferences, phrases and durations have no place in PDDL.
What happens by itself, and skills that make things or take them away, cannot be said: they are
refused unless the caller says that they are to be left out.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass

from forestall.domain.evaluate import evaluate, solutions, static_holds
from forestall.domain.formula import (
    And,
    Every,
    Formula,
    Not,
    Or,
    Parameter,
    Some,
    bind,
    literals,
)
from forestall.domain.model import FACING, LOCATED, SAME, SAME_CATEGORY, Domain
from forestall.domain.pddl_problem import types_of
from forestall.domain.pddl_text import ROOT
from forestall.domain.pddl_write import THING, Writer, without
from forestall.domain.schema import Choice, Effect, PredicateKind, Skill
from forestall.domain.view import TRUE as HOLDS
from forestall.domain.view import View
from forestall.errors import DomainError, UnknownNameError
from forestall.types.facts import Literal, by_number

HAND = "hand"
BEFORE = "before"
"""Predicate of the order of things, which decides what a skill deals with of several."""


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


@dataclass(frozen=True, slots=True)
class _Variant:
    """A skill with a decision about what it deals with."""

    name: str
    parameters: tuple[Parameter, ...]
    needs: tuple[Formula, ...]
    effects: tuple[Effect, ...]


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
    skills = _skills(domain, without_makers)
    variants = [(s, v) for s in skills for v in _variants(s)]
    actions: dict[str, Action] = {}
    blocks: list[str] = []
    used, numbers = _used(writer, domain, skills)
    for skill, variant in sorted(variants, key=lambda x: writer.name(x[1].name)):
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
    lines += _section(":constants", [f"{writer.name(n)} - {writer.name(c)}"
                                     for n, c in sorted(domain.constants)]
                      + [f"{writer.name(h)} - {HAND}" for h in sorted(writer.hands)])  # fmt: skip
    ordered = any(s.choices for s in skills)
    lines += _section(":predicates", sorted(_predicates(writer, used, numbers, ordered)))
    lines += [f"  {writer.derived(name)}" for name in derived]
    return PddlDomain("\n".join((*lines, *blocks, ")")) + "\n", actions)


def problem_pddl(
    view: View, goal: Formula, name: str = "problem", *, without_makers: bool = False
) -> str:
    """A state and a goal as a problem of the domain that `domain_pddl` writes.

    What must hold when the robot leaves is a part of the goal.

    Args:
        view: what holds at first; what is unobserved counts as false.
        goal: what must hold in the end, over names of things.
        name: of the problem.
        without_makers: as the domain was written.

    Raises:
        InputError: the goal speaks of a thing that is not there.
    """
    domain = view.domain
    writer = Writer(domain)
    skills = _skills(domain, without_makers)
    constants = dict(domain.constants)
    things = sorted(view.things(), key=by_number)
    for literal, _ in literals(goal):
        for arg in literal.args:
            if not arg.startswith("?") and arg not in (*things, *constants, *writer.hands):
                raise UnknownNameError(f"thing in the goal {literal}", arg, things)
    wanted = And((goal, *rules)) if (rules := _safe(domain, ("leaving", ""))) else goal
    lines = [
        f"(define (problem {writer.name(name)})",
        f"  (:domain {writer.name(domain.name)})",
        *_section(":objects", [f"{writer.name(t)} - {writer.name(view.category(t))}"
                               for t in things if t not in constants]),
        *_section(":init", sorted({*_facts(view, writer, things, skills)})),
        f"  (:goal {writer.formula(wanted)})",
        ")",
    ]  # fmt: skip
    return "\n".join(lines) + "\n"


# --- the domain -----------------------------------------------------------------------------------


def _skills(domain: Domain, without_makers: bool) -> list[Skill]:
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
    return _section(":types", sorted(entries))


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


def _action(writer: Writer, name: str, skill: Skill, variant: _Variant, facing: bool) -> str:
    tags = writer.tags_of(variant.parameters)
    rules = (*_safe(writer.domain, ("",)), *_safe_before(writer.domain, skill))
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


def _section(key: str, entries: list[str]) -> list[str]:
    if not entries:
        return []
    return [f"  ({key}", *(f"    {e}" for e in entries), "  )"]


def _safe(domain: Domain, when: tuple[str, ...]) -> list[Formula]:
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


def _used(
    writer: Writer, domain: Domain, skills: list[Skill]
) -> tuple[frozenset[str], frozenset[str]]:
    formulas: list[Formula] = [p.definition for p in domain.derived.values() if p.definition]
    for skill in skills:
        formulas += [n.formula for n in skill.needs]
        formulas += [e.condition for e in skill.effects]
        formulas += [] if skill.done_when is None else [skill.done_when]
        for choice in skill.choices:
            formulas += [*choice.among, choice.such_that, choice.only_if]
    formulas += [rule.never for rule in domain.safety]
    return writer.used(formulas)


# --- what skills deal with and do not name --------------------------------------------------------


def _variants(skill: Skill) -> Iterator[_Variant]:
    needs = tuple(n.formula for n in skill.needs)
    if skill.done_when is not None:  # a step that changes nothing is no step of a plan
        needs = (Not(skill.done_when), *needs)
    start = _Variant(skill.name, skill.parameters, needs, skill.effects)
    found = [start]
    for choice in skill.choices:
        found = [v for f in found for v in _decided(f, choice)]
    yield from found


def _decided(variant: _Variant, choice: Choice) -> Iterator[_Variant]:
    """The variant with the thing that is chosen as a parameter, and the one without a thing."""
    name = choice.variable.name
    fitting = [And((a, choice.such_that)) for a in choice.among]
    none = [Not(Some((choice.variable,), f)) for f in fitting]
    other = Parameter(f"{name}_other", choice.variable.kind)
    options: list[Formula] = []
    for number, formula in enumerate(fitting):
        later = Or(
            (
                Not(bind(formula, {name: other.name})),
                Literal("same", (other.name, name)),
                Literal(BEFORE, (name, other.name)),
            )
        )
        options.append(And((formula, *none[:number], Every((other,), later))))
    yield _Variant(
        variant.name,
        (*variant.parameters, choice.variable),
        (choice.only_if, Or(tuple(options)), *variant.needs),
        variant.effects,
    )
    idle: Formula = Not(choice.only_if)
    if not choice.sentence:
        idle = Or((idle, And(tuple(none))))
    effects = []
    for e in variant.effects:
        facts = tuple(f for f in e.facts if name not in f.args)
        copies = tuple(c for c in e.copies if name not in (c.target, c.source))
        if facts or copies:
            effects.append(Effect(e.variables, without(e.condition, name), facts, copies))
    yield _Variant(
        f"{variant.name}__no_{name.removeprefix('?')}",
        variant.parameters,
        (idle, *(without(n, name) for n in variant.needs)),
        tuple(effects),
    )


# --- the problem ----------------------------------------------------------------------------------


def _facts(view: View, writer: Writer, things: list[str], skills: list[Skill]) -> Iterator[str]:
    domain = view.domain
    used, numbers = _used(writer, domain, skills)
    for p in domain.predicates.values():
        if p.kind is PredicateKind.ATTRIBUTE:
            yield from _values(view, writer, p.name, things)
        elif p.kind is PredicateKind.STATIC:
            yield from _static(view, writer, p.name)
        elif p.kind is not PredicateKind.DERIVED:
            yield from _relations(view, writer, p.name, len(p.parameters))
    for thing in things:
        yield from _about(view, writer, thing, used, numbers)
    if SAME_CATEGORY in used:
        yield from _pairs(SAME_CATEGORY, writer, (
            (a, b) for a in things for b in things if view.category(a) == view.category(b)
        ))  # fmt: skip
    if any(s.choices for s in skills):
        pairs = ((a, b) for i, a in enumerate(things) for b in things[i + 1 :])
        yield from _pairs(BEFORE, writer, pairs)


def _about(
    view: View, writer: Writer, thing: str, used: frozenset[str], numbers: frozenset[str]
) -> Iterator[str]:
    domain = view.domain
    kinds = domain.kinds(view.category(thing))
    named = writer.name(thing)
    for tag in domain.tags:
        if tag in kinds and not writer.is_type(tag):
            yield f"({writer.name(tag)} {named})"
    for number in numbers:
        value = domain.number(view.category(thing), number)
        if value is not None:
            yield f"({number}_{value} {named})"
    for built_in in (LOCATED, FACING):
        if built_in in used and view.fact(built_in, (thing,)) == HOLDS:
            yield f"({built_in} {named})"


def _pairs(name: str, writer: Writer, pairs: Iterable[tuple[str, ...]]) -> Iterator[str]:
    return (f"({' '.join((name, *map(writer.name, p)))})" for p in pairs)


def _values(view: View, writer: Writer, attribute: str, things: list[str]) -> Iterator[str]:
    for thing in things:
        if attribute in view.domain.categories[view.category(thing)].attributes:
            yield f"(has_{attribute} {writer.name(thing)})"
        value = view.value(thing, attribute)
        name = "" if value is None else writer.value_name(attribute, value)
        if name:
            yield f"({name} {writer.name(thing)})"


def _static(view: View, writer: Writer, name: str) -> Iterator[str]:
    for first, second in sorted(view.domain.statics.get(name, ())):
        for a in view.of_kind(first):
            for b in view.of_kind(second):
                if static_holds(view, name, (a, b)):
                    yield f"({writer.name(name)} {writer.name(a)} {writer.name(b)})"


def _relations(view: View, writer: Writer, name: str, arity: int) -> Iterator[str]:
    several = tuple(Parameter(f"?{i}") for i in range(arity))
    fact = Literal(name, tuple(p.name for p in several))
    if not several:
        if evaluate(fact, view, {}) == HOLDS:
            yield f"({writer.name(name)})"
        return
    found = (b for b, truth in solutions(several, fact, view, {}) if truth == HOLDS)
    yield from _pairs(writer.name(name), writer, (tuple(b[v.name] for v in several) for b in found))
