"""Writes a state and a goal as a problem of the PDDL domain that `pddl_out` writes.

Called by cross-checks with other planners; calls `pddl_out` and `pddl_write`. The text is sorted
and never changes between runs.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator

from forestall.domain.evaluate import evaluate, solutions, static_holds
from forestall.domain.formula import And, Formula, Parameter, literals
from forestall.domain.model import FACING, LOCATED, SAME_CATEGORY
from forestall.domain.pddl_out import able_skills, safe, section, used_of
from forestall.domain.pddl_variants import BEFORE
from forestall.domain.pddl_write import Writer
from forestall.domain.schema import PredicateKind, Skill
from forestall.domain.view import TRUE as HOLDS
from forestall.domain.view import View
from forestall.errors import UnknownNameError
from forestall.types.facts import Literal, by_number


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
    skills = able_skills(domain, without_makers)
    constants = dict(domain.constants)
    things = sorted(view.things(), key=by_number)
    for literal, _ in literals(goal):
        for arg in literal.args:
            if not arg.startswith("?") and arg not in (*things, *constants, *writer.hands):
                raise UnknownNameError(f"thing in the goal {literal}", arg, things)
    wanted = And((goal, *rules)) if (rules := safe(domain, ("leaving", ""))) else goal
    lines = [
        f"(define (problem {writer.name(name)})",
        f"  (:domain {writer.name(domain.name)})",
        *section(":objects", [f"{writer.name(t)} - {writer.name(view.category(t))}"
                               for t in things if t not in constants]),
        *section(":init", sorted({*_facts(view, writer, things, skills)})),
        f"  (:goal {writer.formula(wanted)})",
        ")",
    ]  # fmt: skip
    return "\n".join(lines) + "\n"


def _facts(view: View, writer: Writer, things: list[str], skills: list[Skill]) -> Iterator[str]:
    domain = view.domain
    used, numbers = used_of(writer, domain, skills)
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
