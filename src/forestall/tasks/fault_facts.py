"""What a scenario's faults make so, as facts. Called by `causes`; reads the faults' tables.

Plan faults change no fact, and a thing on an open support is in nobody's way. That a skill does
something else than it says is seen in what came otherwise than expected.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from itertools import product
from typing import Any

from forestall.domain.model import LOCATED, Domain
from forestall.planning.state import State
from forestall.tasks.faults import (
    InsertStep,
    Meanwhile,
    ReplaceArgument,
    ReplacePlan,
    WrongObject,
    WrongReceptacle,
)
from forestall.tasks.scene_faults import AddObject, MoveObject, RemoveObject, SetState
from forestall.types.facts import Literal, category_of
from forestall.types.plan import Subtask


def fault_facts(
    faults: Iterable[Any], domain: Domain, states: Sequence[State], named: Iterable[Any] = ()
) -> tuple[Literal, ...]:
    """What the faults make so.

    Args:
        faults: of a scenario.
        domain: what names mean.
        states: in which a fact about categories may hold, that of the start first; it is told of
            the instances for which it does, and as it is written where it does in none.
        named: further faults of the scenario; a thing that is added for one of them is no cause.
    """
    several = tuple(faults)
    needed = {domain.canonical(category_of(n)) for f in (*several, *named) for n in _named(f)}
    found: list[Literal] = []
    for fault in several:
        if isinstance(fault, AddObject) and domain.canonical(fault.category) in needed:
            continue  # it is there for another fault to be possible
        for choices in _facts(fault, domain):
            found += _grounded(choices, states)
    return tuple(dict.fromkeys(found))


def _named(fault: Any) -> Iterator[str]:
    """What another fault needs to be there: what it moves, or what is taken for the right thing."""
    if isinstance(fault, Meanwhile) and fault.place is not None:
        yield fault.object
    elif isinstance(fault, WrongObject | WrongReceptacle):
        yield fault.acts_on
    elif isinstance(fault, ReplaceArgument):
        yield fault.by
    steps = [fault.step] if isinstance(fault, InsertStep) else []
    for step in fault.plan if isinstance(fault, ReplacePlan) else steps:
        yield from Subtask.parse(step).args


def _facts(fault: Any, domain: Domain) -> Iterator[list[Literal]]:
    """Facts; of each the ways in which it may be so."""
    if isinstance(fault, AddObject):
        name = fault.id or fault.category
        if fault.in_front_of is not None and domain.roles.blocking is not None:
            yield [Literal(domain.roles.blocking, (name, fault.in_front_of))]
        elif any(not domain.is_open_support(p) for p in fault.places):
            yield _in(name, fault.places, domain)
    elif isinstance(fault, SetState):
        yield [Literal(fault.attribute, (fault.object,), fault.value)]
    elif isinstance(fault, MoveObject):
        if any(not domain.is_open_support(p) for p in fault.places):
            yield _in(fault.object, fault.places, domain)
    elif isinstance(fault, RemoveObject):
        yield [Literal(LOCATED, (fault.object,), "false")]
    elif isinstance(fault, Meanwhile):
        if fault.attribute is not None:
            yield [Literal(fault.attribute, (fault.object,), fault.value or "")]
        elif fault.place is not None:
            yield _in(fault.object, (fault.place,), domain)


def _in(name: str, places: Iterable[str], domain: Domain) -> list[Literal]:
    found = []
    for place in places:
        held = place in domain.robot.hands
        relation = domain.roles.holding if held else domain.offers(place)
        if relation is not None:
            found.append(Literal(relation, (name, place)))
    return found


def _grounded(choices: Sequence[Literal], states: Sequence[State]) -> list[Literal]:
    for state in states:
        held = [g for fact in choices for g in _instances(fact, state) if state.holds(g)]
        if held:
            return held
    return list(choices[:1])


def _instances(fact: Literal, state: State) -> Iterator[Literal]:
    hands = state.domain.robot.hands
    names = [(a,) if a in hands else state.matches(a) or (a,) for a in fact.args]
    return (Literal(fact.predicate, n, fact.value) for n in product(*names))
