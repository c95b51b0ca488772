"""Executes one subtask on a symbolic state, by the domain's schemas and by nothing else.

Called by the validator, the planner's last check, the replanner, symbolic worlds; calls `state` and
`settle`. The rules are data: what a skill needs, in which order it is judged, and what it does.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass

from forestall.domain.evaluate import solutions
from forestall.domain.formula import Every, Fewer, Formula, Not, Or, Some, bind, free, normal
from forestall.domain.model import LOCATED
from forestall.domain.schema import Choice, Effect, Need, Skill
from forestall.domain.view import TRUE
from forestall.errors import InputError
from forestall.planning.settle import change, settle
from forestall.planning.state import State
from forestall.types.facts import Literal, by_number, is_instance
from forestall.types.plan import Subtask

_PLACEHOLDER = re.compile(r"\{(\??\w+)(\.category)?\}")


@dataclass(frozen=True, slots=True)
class Refusal:
    """Why a subtask cannot run, in words, and the facts that it lacks."""

    reason: str
    lacking: tuple[Literal, ...] = ()


class _RefusedError(Exception):
    """Carries a refusal out of a skill."""

    def __init__(self, reason: str, *lacking: Literal) -> None:
        super().__init__(reason)
        self.refusal = Refusal(reason, lacking)


def apply(state: State, subtask: Subtask) -> State | Refusal:
    """Execute one subtask, processes included.

    Arguments may be category names; see `resolve`.
    """
    done = perform(state, subtask)
    return done if isinstance(done, Refusal) else done[0]


def perform(state: State, subtask: Subtask) -> tuple[State, tuple[str, ...]] | Refusal:
    """Execute one subtask, and say which instances its arguments meant."""
    return state.follow(subtask, lambda: _performed(state, subtask))


def _performed(state: State, subtask: Subtask) -> tuple[State, tuple[str, ...]] | Refusal:
    after = state.copy()
    try:
        args = _resolved(after, subtask)
        _run(after, after.domain.skill(subtask.skill), args)
    except _RefusedError as refused:
        return refused.refusal
    settle(after)
    return after, args


def resolve(state: State, subtask: Subtask) -> tuple[str, ...] | Refusal:
    """The instances that the arguments of a subtask mean in a state.

    An instance means itself. A category means the instance in the hand where the skill takes its
    argument from there, else the one of which the fewest of the skill's needs fail, in the order
    of the needs; of equals the lowest number.
    """
    try:
        return _resolved(state.copy(), subtask)
    except _RefusedError as refused:
        return refused.refusal


def products(state: State, category: str, count: int) -> tuple[str, ...]:
    """Names of things that a skill makes: the lowest numbers that are free."""
    names: list[str] = []
    number = 1
    while len(names) < count:
        if f"{category}-{number}" not in state.kinds:
            names.append(f"{category}-{number}")
        number += 1
    return tuple(names)


def _resolved(state: State, subtask: Subtask) -> tuple[str, ...]:
    try:
        state.domain.check(subtask)
    except InputError as error:
        raise _RefusedError(str(error)) from error
    skill = state.domain.skill(subtask.skill)
    names: dict[str, str] = {}
    for parameter, raw in zip(skill.parameters, subtask.args, strict=True):
        names[parameter.name] = _meant(state, skill, parameter.name, raw, names)
    return tuple(names.values())


def _meant(state: State, skill: Skill, variable: str, raw: str, names: Mapping[str, str]) -> str:
    name = state.domain.canonical(raw)
    if name in state.kinds or raw in state.domain.robot.hands:
        return name
    if state.domain.find(name) is None:
        raise _RefusedError(f"there is no object called {raw!r}")
    found = () if is_instance(name) else state.instances(name)
    found = found or _stand_in(state, name) or _expected_inside(state, name)
    if not found:
        raise _RefusedError(
            f"no {name} has been seen: its place is not known", Literal(LOCATED, (name,))
        )
    held = {h for _, h in state.in_hands()}
    if variable == skill.hand or (skill.hand is None and len(found) == len(held & set(found))):
        in_hand = [x for x in found if x in held]
        if in_hand:
            return in_hand[0]
    if skill.hand is not None and variable != skill.hand:
        found = tuple(x for x in found if x not in held) or found
    if len(found) == 1:
        return found[0]
    free = state.asked.schemas.free
    own = [n.formula for n in skill.needs if free(n.formula) <= {variable, *names}]
    own = [f for f in own if variable in free(f)]

    def ease(thing: str) -> tuple[list[bool], tuple[str, int]]:
        binding = {**names, variable: thing}
        return [not state.true(f, binding) for f in own], by_number(thing)

    return min(found, key=ease)


def _stand_in(state: State, name: str) -> tuple[str, ...]:
    """What a thing of which none was seen is a handle of: a burner for its knob."""
    domain = state.domain
    category = domain[name].name
    number = name.removeprefix(category)
    for predicate in domain.predicates.values():
        if predicate.paired == "same number":
            for first, second in sorted(domain.statics.get(predicate.name, ())):
                if first == category and not state.instances(category):
                    return state.matches(second + number)
    return ()


def _expected_inside(state: State, name: str) -> tuple[str, ...]:
    """A thing that was never seen, believed in an open container whose inside was not observed."""
    domain = state.domain
    category, roles = domain[name], domain.roles
    if roles.movable not in category.tags:
        return ()
    for container in sorted(state.hidden, key=by_number):
        taken = roles.accepts is None or domain.static(roles.accepts, container, category.name)
        if taken and not state.says(roles.shut, container):
            thing = name if is_instance(name) else f"{name}-1"
            relation = domain.containing[0]
            state.create(thing, category.name)
            state.add((relation, thing, container))
            believed = {Literal(relation, (thing, container))}
            gone = {Literal(roles.vacant, (container,))} if roles.vacant else set()
            state.assumed = (state.assumed - gone) | believed
            return (thing,)
    return ()


def _run(state: State, skill: Skill, args: tuple[str, ...]) -> None:
    names = {p.name: a for p, a in zip(skill.parameters, args, strict=True)}
    for parameter in skill.parameters:
        if not state.domain.is_a(state.category(names[parameter.name]), parameter.kind):
            raise _RefusedError(f"{names[parameter.name]} is no {parameter.kind}")
    made = _made(state, skill, names)
    for choice in skill.choices:
        _choose(state, choice, names, made)
    if skill.done_when is not None and state.true(skill.done_when, names):
        return
    for need in skill.needs:
        if not state.true(need.formula, names):
            raise _refused(state, need, names)
    for variable, pieces in made.items():
        source = names[next(m.source for m in skill.makes if m.variable == variable)]
        for piece in pieces:
            state.create(piece, state.category(piece))
            for attribute in state.domain.lasting:
                value = state.value(source, attribute)
                if value is not None:
                    state.set_value(piece, attribute, value)
    change(state, _spread(skill.effects, made), names)
    at = skill.at
    if at in made:
        state.at = made[at][0]
    elif at is not None and at in names:
        state.at = names[at]


def _made(state: State, skill: Skill, names: Mapping[str, str]) -> dict[str, tuple[str, ...]]:
    """Variable → names of the things that the skill makes."""
    made: dict[str, tuple[str, ...]] = {}
    for make in skill.makes:
        source = state.category(names[make.source])
        kinds = [b for a, b in sorted(state.domain.statics.get(make.by, ())) if a == source]
        if kinds:
            count = make.count if isinstance(make.count, int) else None
            count = count if count is not None else state.domain.number(source, str(make.count))
            made[make.variable] = products(state, kinds[0], 1 if count is None else count)
    return made


def _choose(
    state: State, choice: Choice, names: dict[str, str], made: Mapping[str, tuple[str, ...]]
) -> None:
    variable = choice.variable
    known = {**names, **{v: pieces[0] for v, pieces in made.items()}}
    if not state.true(choice.only_if, known):
        return
    for formula in choice.among:
        several = [b[variable.name] for b in state.bindings((variable,), formula, known)]
        fitting = [x for x in several if state.true(choice.such_that, {**known, variable.name: x})]
        found = sorted(fitting, key=by_number)
        if found:
            names[variable.name] = found[0]
            return
    if choice.sentence:
        raise _RefusedError(said(state, choice.sentence, names, {}))


def _spread(effects: Iterable[Effect], made: Mapping[str, tuple[str, ...]]) -> Iterable[Effect]:
    """Effects on made things once for each of them."""
    for effect in effects:
        used = [v for v in made if mentions(effect, v)]
        if not used:
            yield effect
            continue
        for piece in made[used[0]]:
            binding = {used[0]: piece}
            yield Effect(
                effect.variables,
                bind(effect.condition, binding),
                tuple(f.bind(binding) for f in effect.facts),
                effect.copies,
                tuple(binding.get(g, g) for g in effect.gone),
            )


def mentions(effect: Effect, variable: str) -> bool:
    """Whether an effect speaks of what a variable stands for."""
    return (
        variable in free(effect.condition)
        or any(variable in f.args for f in effect.facts)
        or variable in effect.gone
    )


def _refused(state: State, need: Need, names: Mapping[str, str]) -> _RefusedError:
    found = _witness(state, need, names)
    binding = {**names, **found}
    lacking = [x.bind(binding) for x in need.lacking]
    lacking = [x for x in lacking if not any(a.startswith("?") for a in x.args)]
    sentence = need.sentence or f"{{what}} does not hold ({_plain(need.formula, binding)})"
    return _RefusedError(said(state, sentence, names, found), *lacking)


def _plain(formula: Formula, names: Mapping[str, str]) -> str:
    from forestall.domain.formula import show

    return show(bind(formula, names))


def said(state: State, sentence: str, names: Mapping[str, str], found: Mapping[str, str]) -> str:
    """A sentence of the domain about the things that its variables stand for."""

    def word(match: re.Match[str]) -> str:
        name = match[1]
        if name == "hand":
            return f"it holds {state.held}" if state.held else "it is empty"
        if name == "what":
            return "what the skill needs"
        value = found.get(name) or names.get(f"?{name}") or names.get(name) or "something"
        return state.category(value) if match[2] else value

    return _PLACEHOLDER.sub(word, sentence)


def _witness(state: State, need: Need, names: Mapping[str, str]) -> dict[str, str]:
    """What stands in the way: for what a need's quantifier fails, and all contents in one word."""
    if need.find is not None:
        return _first(state, need.find, names)
    for part in _parts(need.formula):
        if isinstance(part, Fewer):
            several = [
                b[part.variable.name]
                for b, t in solutions((part.variable,), part.part, state, names)
                if t == TRUE
            ]
            return {"contents": ", ".join(sorted(several, key=by_number))}
        denied = part.part if isinstance(part, Not) else None
        if isinstance(part, Every):
            denied = Some(part.variables, normal(part.part, False))
        if isinstance(denied, Some):
            return _first(state, denied, names)
    return {}


def _parts(formula: Formula) -> Iterable[Formula]:
    if isinstance(formula, Or):
        for part in formula.parts:
            yield from _parts(part)
    else:
        yield formula


def _first(state: State, formula: Some, names: Mapping[str, str]) -> dict[str, str]:
    found = [
        {v.name: b[v.name] for v in formula.variables}
        for b, t in solutions(formula.variables, formula.part, state, names)
        if t == TRUE
    ]
    return min(found, key=lambda b: sorted(map(by_number, b.values())), default={})
