"""What happens by itself: processes run after every skill, to a fixpoint.

Called by `execute`, and by `validate` on a state that was just observed; calls `state`.
"""

from __future__ import annotations

from collections.abc import Iterable

from forestall.domain.formula import TRUE, Formula, literals
from forestall.domain.model import Domain
from forestall.domain.schema import Effect
from forestall.errors import DomainError
from forestall.planning.state import State
from forestall.types.facts import Literal

ROUNDS = 50
"""More rounds than any chain of processes that ends by itself takes."""


def settle(state: State) -> None:
    """Let every process work until nothing changes; only what has changed since is looked at.

    Raises:
        DomainError: the processes never come to an end.
    """
    domain = state.domain
    watched = watched_by(domain)
    changed = set(state.changed)
    state.changed.clear()
    for _ in range(ROUNDS):
        again: set[str] = set()
        for process, about in zip(domain.processes, watched, strict=True):
            if not changed.isdisjoint(about) or not again.isdisjoint(about):
                for binding in list(state.bindings(process.parameters, process.condition, {})):
                    change(state, process.effects, binding)
                again |= state.changed
                state.changed.clear()
        if not again:
            return
        changed = again
    names = ", ".join(p.name for p in state.domain.processes)
    raise DomainError(f"the processes of {state.domain.name} never settle here ({names})")


def watched_by(domain: Domain) -> list[frozenset[str]]:
    """For each process the predicates on which its condition and those of its effects depend."""
    found = domain.__dict__.get("_watched")
    if found is None:
        found = [
            _predicates(domain, [p.condition, *(e.condition for e in p.effects)])
            for p in domain.processes
        ]
        domain.__dict__["_watched"] = found
    return found


def _predicates(domain: Domain, formulas: list[Formula]) -> frozenset[str]:
    names: set[str] = set()
    waiting = list(formulas)
    while waiting:
        for literal, _ in literals(waiting.pop()):
            if literal.predicate not in names:
                names.add(literal.predicate)
                known = domain.derived.get(literal.predicate)
                if known is not None and known.definition is not None:
                    waiting.append(known.definition)
    return frozenset(names)


def change(state: State, effects: Iterable[Effect], names: dict[str, str]) -> None:
    """Let effects happen; every condition is judged on the state before any of them."""
    add: list[Literal] = []
    copies: list[tuple[str, str, str]] = []
    gone: list[str] = []
    for effect in effects:
        if effect.variables and effect.condition == TRUE and not (effect.copies or effect.gone):
            ended = [f for f in effect.facts if f.value == "false"]
            if len(ended) == len(effect.facts):
                for fact in ended:
                    add += state.matching(fact.bind(names))
                continue
        if effect.variables:
            found = list(state.bindings(effect.variables, effect.condition, names))
        else:
            found = [names] if state.true(effect.condition, names) else []
        for binding in found:
            add += [f.bind(binding) for f in effect.facts]
            gone += [binding[g] for g in effect.gone]
            for copy in effect.copies:
                source, target = binding[copy.source], binding[copy.target]
                value = state.value(source, copy.attribute)
                if value is None and (target, copy.attribute) in state.values:
                    value = state.domain.values(copy.attribute)[0]
                if value is not None:
                    copies.append((target, copy.attribute, value))
    _carry_out(state, add, copies, gone)


def _carry_out(
    state: State,
    add: Iterable[Literal],
    copies: Iterable[tuple[str, str, str]],
    gone: Iterable[str],
) -> None:
    attributes = state.domain.attributes
    for name in gone:
        if name in state.kinds:
            state.take_away(name)
    for fact in (f for f in add if f.value == "false"):
        state.remove((fact.predicate, *fact.args))
    for target, attribute, value in copies:
        state.set_value(target, attribute, value)
    for fact in (f for f in add if f.value != "false"):
        if fact.predicate in attributes:
            state.set_value(fact.args[0], fact.predicate, fact.value)
        elif not any(a.startswith("?") for a in fact.args):
            state.add((fact.predicate, *fact.args))
