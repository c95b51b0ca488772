"""What happens by itself: processes run after every skill, to a fixpoint.

Called by `execute`, and by `validate` on a state that was just observed; calls `state`.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping

from forestall.domain.evaluate import TRUE, evaluate, solutions
from forestall.domain.model import Effect
from forestall.errors import DomainError
from forestall.planning.state import State
from forestall.types.facts import Literal

ROUNDS = 50
"""More rounds than any chain of processes that ends by itself takes."""


def settle(state: State) -> None:
    """Let every process work until nothing changes.

    Raises:
        DomainError: the processes never come to an end.
    """
    for _ in range(ROUNDS):
        before = dict(state.values), set(state.facts)
        for process in state.domain.processes:
            found = [
                b
                for b, t in solutions(process.parameters, process.condition, state, {})
                if t == TRUE
            ]
            for binding in found:
                change(state, process.effects, binding)
        if (state.values, state.facts) == before:
            return
    names = ", ".join(p.name for p in state.domain.processes)
    raise DomainError(f"the processes of {state.domain.name} never settle here ({names})")


def change(state: State, effects: Iterable[Effect], names: Mapping[str, str]) -> None:
    """Let effects happen; every condition is judged on the state before any of them."""
    add: list[Literal] = []
    copies: list[tuple[str, str, str]] = []
    gone: list[str] = []
    for effect in effects:
        if not effect.variables:
            found = [names] if evaluate(effect.condition, state, names) == TRUE else []
        else:
            solved = solutions(effect.variables, effect.condition, state, names)
            found = [{**names, **b} for b, t in solved if t == TRUE]
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
