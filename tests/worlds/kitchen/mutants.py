"""Domains from which one rule is missing, and whether recorded steps notice it.

Used by `covering_search`, `mutate_domain` and `test_domain_covers`; calls the executor. A mutant is
killed by a step after which its belief is another one than that of the whole domain, which the
kitchen agrees with.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

from covering_play import Step, belief, unsettled

from forestall.domain.formula import (
    TRUE,
    And,
    Every,
    Fewer,
    Formula,
    Not,
    Or,
    Some,
    normal,
    show,
)
from forestall.domain.model import Domain
from forestall.domain.schema import Choice, Effect, Make, Process, Skill
from forestall.errors import ForestallError
from forestall.planning.execute import Refusal, apply
from forestall.planning.settle import settle
from forestall.planning.state import State


@dataclass(frozen=True)
class Mutant:
    """A domain without one rule.

    Args:
        name: what is missing.
        domain: the rest.
        kind: "need", "effect" and "process" where all of one is missing, else "part".
        skill: the only skill that it can change, if there is one.
        later: whether it shows only in what is done later.
        settling: whether it changes nothing but what happens by itself.
    """

    name: str
    domain: Domain
    kind: str = "part"
    skill: str | None = None
    later: bool = False
    settling: bool = False

    def __str__(self) -> str:
        return self.name


def kills(mutant: Mutant, steps: Sequence[Step]) -> int:
    """The number of the first step that shows a mutant, 0 where none does."""
    if mutant.later:
        return _kills_later(mutant, steps)
    for number, step in enumerate(steps, 1):
        if mutant.skill in (None, step.subtask.skill) and _shows(mutant, step):
            return number
    return 0


def _shows(mutant: Mutant, step: Step) -> bool:
    """Whether one step from the true state leads elsewhere."""
    try:
        if mutant.settling:
            if isinstance(step.middle, Refusal):
                return False
            after: State | Refusal = step.middle.copy()
        else:
            before = step.before.copy()
            before.domain = mutant.domain
            after = unsettled(before, step.subtask)
        if isinstance(after, Refusal) or isinstance(step.middle, Refusal):
            return isinstance(after, Refusal) != isinstance(step.middle, Refusal)
        if mutant.skill is not None and _same(after, step.middle):
            return False
        after.domain = mutant.domain
        settle(after)
    except (ForestallError, RecursionError):
        return True
    return not _same(after, step.after) and belief(after) != step.truth


def _same(state: State, other: State | Refusal) -> bool:
    assert isinstance(other, State)
    return (state.values, state.facts) == (other.values, other.facts)


def _kills_later(mutant: Mutant, steps: Sequence[Step]) -> int:
    if not steps:
        return 0
    state = steps[0].before.copy()
    state.domain = mutant.domain
    for number, step in enumerate(steps, 1):
        after = apply(state, step.subtask)
        if isinstance(after, Refusal) != step.refused:
            return number
        state = state if isinstance(after, Refusal) else after
        if belief(state) != step.truth:
            return number
    return 0


# --- formulas -------------------------------------------------------------------------------------


def lessened(formula: Formula) -> Iterator[tuple[str, Formula]]:
    """A formula without one of its parts, and which part it is."""
    yield from _lessened(normal(formula))


def _lessened(formula: Formula) -> Iterator[tuple[str, Formula]]:
    if isinstance(formula, And | Or):
        kind = type(formula)
        for i, part in enumerate(formula.parts):
            rest = (*formula.parts[:i], *formula.parts[i + 1 :])
            yield f"[{show(part)}]", kind(rest)
            for what, less in _lessened(part):
                yield what, kind((*formula.parts[:i], less, *formula.parts[i + 1 :]))
    elif isinstance(formula, Not):
        for what, less in _lessened(formula.part):
            yield what, Not(less)
    elif isinstance(formula, Some | Every):
        for i, variable in enumerate(formula.variables):
            if variable.kind is not None:
                free = replace(variable, kind=None)
                several = (*formula.variables[:i], free, *formula.variables[i + 1 :])
                yield f"kind of {variable}", type(formula)(several, formula.part)
        for what, less in _lessened(formula.part):
            yield what, type(formula)(formula.variables, less)
    elif isinstance(formula, Fewer):
        for what, less in _lessened(formula.part):
            yield what, replace(formula, part=less)


# --- domains --------------------------------------------------------------------------------------


def mutants(domain: Domain) -> Iterator[Mutant]:
    """The domain without each rule of its skills, processes and definitions, one at a time."""
    for skill in domain.skills.values():
        for name, kind, less, later in _of_skill(skill):
            skills = {**domain.skills, skill.name: less}
            label = f"{skill.name}: {name}"
            yield Mutant(label, replace(domain, skills=skills), kind, skill.name, later)
    for i, process in enumerate(domain.processes):
        rest = (*domain.processes[:i], *domain.processes[i + 1 :])
        whole = replace(domain, processes=rest)
        yield Mutant(f"process {process.name}", whole, "process", settling=True)
        for name, kind, slack in _of_process(process):
            several = (*domain.processes[:i], slack, *domain.processes[i + 1 :])
            label = f"process {process.name}: {name}"
            yield Mutant(label, replace(domain, processes=several), kind, settling=True)
    for predicate in domain.derived.values():
        assert predicate.definition is not None
        for what, definition in lessened(predicate.definition):
            predicates = {
                **domain.predicates, predicate.name: replace(predicate, definition=definition)
            }  # fmt: skip
            yield Mutant(f"{predicate.name}: {what}", replace(domain, predicates=predicates))
    for predicate in domain.predicates.values():
        for name, value in (("group", None), ("paired", ""), ("lasting", False)):
            if getattr(predicate, name) != value:
                less_known = replace(predicate, **{name: value})  # type: ignore[arg-type]
                predicates = {**domain.predicates, predicate.name: less_known}
                yield Mutant(f"{predicate.name}: {name}", replace(domain, predicates=predicates))


def _of_skill(skill: Skill) -> Iterator[tuple[str, str, Skill, bool]]:
    for i, need in enumerate(skill.needs):
        others = (*skill.needs[:i], *skill.needs[i + 1 :])
        name = f"need {i + 1} [{show(need.formula)}]"
        yield name, "need", replace(skill, needs=others), False
        for what, formula in lessened(need.formula):
            less = replace(need, formula=formula)
            several = (*skill.needs[:i], less, *skill.needs[i + 1 :])
            yield f"need {i + 1}: {what}", "part", replace(skill, needs=several), False
    for name, kind, effects in _effects(skill.effects):
        yield name, kind, replace(skill, effects=effects), False
    for i, choice in enumerate(skill.choices):
        for what, less_choice in _choices(choice):
            choices = (*skill.choices[:i], less_choice, *skill.choices[i + 1 :])
            facing = choice.variable.name == skill.at
            yield f"choice {what}", "part", replace(skill, choices=choices), facing
    if skill.done_when is not None:
        yield "done_when", "part", replace(skill, done_when=None), False
        for what, formula in lessened(skill.done_when):
            yield f"done_when: {what}", "part", replace(skill, done_when=formula), False
    for i, make in enumerate(skill.makes):
        if make.count != 1:
            one: Make = replace(make, count=1)
            several_makes = (*skill.makes[:i], one, *skill.makes[i + 1 :])
            yield f"count of {make.variable}", "part", replace(skill, makes=several_makes), False
    if skill.at is not None:
        yield "at", "part", replace(skill, at=None), True


def _choices(choice: Choice) -> Iterator[tuple[str, Choice]]:
    name = choice.variable.name
    for i, formula in enumerate(choice.among):
        others = (*choice.among[:i], *choice.among[i + 1 :])
        yield f"{name} among [{show(formula)}]", replace(choice, among=others)
        for what, less in lessened(formula):
            several = (*choice.among[:i], less, *choice.among[i + 1 :])
            yield f"{name} among {i + 1}: {what}", replace(choice, among=several)
    for field in ("such_that", "only_if"):
        formula = getattr(choice, field)
        if formula != TRUE:
            yield f"{name} {field}", replace(choice, **{field: TRUE})  # type: ignore[arg-type]
        for what, less in lessened(formula):
            yield f"{name} {field}: {what}", replace(choice, **{field: less})  # type: ignore[arg-type]


def _of_process(process: Process) -> Iterator[tuple[str, str, Process]]:
    for what, formula in lessened(process.condition):
        yield f"when {what}", "part", replace(process, condition=formula)
    for i, parameter in enumerate(process.parameters):
        if parameter.kind is not None:
            free = replace(parameter, kind=None)
            several = (*process.parameters[:i], free, *process.parameters[i + 1 :])
            yield f"kind of {parameter}", "part", replace(process, parameters=several)
    for name, kind, effects in _effects(process.effects):
        yield name, kind, replace(process, effects=effects)


def _effects(effects: tuple[Effect, ...]) -> Iterator[tuple[str, str, tuple[Effect, ...]]]:
    for i, effect in enumerate(effects):
        label = f"effect {i + 1}"
        yield label, "effect", (*effects[:i], *effects[i + 1 :])
        for what, less in _of_effect(effect):
            yield f"{label}: {what}", "part", (*effects[:i], less, *effects[i + 1 :])


def _of_effect(effect: Effect) -> Iterator[tuple[str, Effect]]:
    if effect.condition != TRUE:
        yield f"when [{show(effect.condition)}]", replace(effect, condition=TRUE)
    for what, formula in lessened(effect.condition):
        yield f"when {what}", replace(effect, condition=formula)
    for i, variable in enumerate(effect.variables):
        if variable.kind is not None:
            free = replace(variable, kind=None)
            several = (*effect.variables[:i], free, *effect.variables[i + 1 :])
            yield f"kind of {variable}", replace(effect, variables=several)
    for field in ("facts", "copies", "gone"):
        parts = getattr(effect, field)
        if len(effect.facts) + len(effect.copies) + len(effect.gone) > 1:
            for i, part in enumerate(parts):
                others = (*parts[:i], *parts[i + 1 :])
                yield f"{part}", replace(effect, **{field: others})  # type: ignore[arg-type]
