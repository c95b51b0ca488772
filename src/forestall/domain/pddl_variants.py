"""What a skill deals with without naming it, as a further parameter of its action in PDDL.

Called by `pddl_out`; calls `pddl_write`. Of several things the first in the order `BEFORE` is dealt
with, and where there is none, a variant of the action does without.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from forestall.domain.formula import And, Every, Formula, Not, Or, Parameter, Some, bind
from forestall.domain.pddl_write import without
from forestall.domain.schema import Choice, Effect, Skill
from forestall.types.facts import Literal

BEFORE = "before"
"""Predicate of the order of things, which decides what a skill deals with of several."""


@dataclass(frozen=True, slots=True)
class Variant:
    """A skill with a decision about what it deals with."""

    name: str
    parameters: tuple[Parameter, ...]
    needs: tuple[Formula, ...]
    effects: tuple[Effect, ...]


def variants(skill: Skill) -> Iterator[Variant]:
    """The actions that stand for a skill, one for each way of having its choices."""
    needs = tuple(n.formula for n in skill.needs)
    if skill.done_when is not None:  # a step that changes nothing is no step of a plan
        needs = (Not(skill.done_when), *needs)
    start = Variant(skill.name, skill.parameters, needs, skill.effects)
    found = [start]
    for choice in skill.choices:
        found = [v for f in found for v in _decided(f, choice)]
    yield from found


def _decided(variant: Variant, choice: Choice) -> Iterator[Variant]:
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
    yield Variant(
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
    yield Variant(
        f"{variant.name}__no_{name.removeprefix('?')}",
        variant.parameters,
        (idle, *(without(n, name) for n in variant.needs)),
        tuple(effects),
    )
