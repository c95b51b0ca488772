"""Pairs of steps that a plan could do without: done, and undone again, and nothing in between asks.

Called by the replanner and by whoever judges plans; calls the validator's executor. Two steps are
needless together if the plan runs without them and ends in the same state, and leaves nothing in a
dangerous state meanwhile: what is turned off before a detour and on again after it stays.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

from forestall.planning.state import State
from forestall.planning.validate import Trace, run
from forestall.types.plan import Subtask

Accepts = Callable[[tuple[Subtask, ...], int], bool]
"""A shorter plan, and how many of its first steps are free to go → whether it will do."""


def needless_pairs(state: State, steps: Sequence[Subtask]) -> tuple[tuple[int, int], ...]:
    """Every needless pair of a plan by the places of its steps, the first ones first.

    Pairs are looked for one by one: of three steps of which any two could go, three pairs are said.
    A plan that does not run has none.
    """
    whole = run(state, steps)
    if whole.refusal is not None:
        return ()
    return tuple(pair for pair in _candidates(state, steps) if _needless(whole, steps, pair))


def without(state: State, steps: Sequence[Subtask], pair: tuple[int, int]) -> tuple[int, ...]:
    """The places of the steps that stay: all but two, and but drives that only led to them."""
    left: list[int] = []
    gap = False
    for k, step in enumerate(steps):
        if k in pair:
            gap = True
            continue
        if gap and left and _drives(state, step) and _drives(state, steps[left[-1]]):
            left.pop()
        left.append(k)
        gap = False
    if gap and left and _drives(state, steps[left[-1]]):
        left.pop()
    return tuple(left)


def pruned(
    state: State, steps: Sequence[Subtask], own: int, accepts: Accepts
) -> tuple[Subtask, ...]:
    """A plan without the needless pairs that somebody accepts it without.

    Args:
        state: that it starts from.
        steps: of the plan, which runs.
        own: how many at its beginning are free to go; a pair has one of them at least.
        accepts: says whether a shorter plan will do.
    """
    left = tuple(steps)
    while True:
        whole = run(state, left)
        if whole.refusal is not None:
            return left
        for pair in _candidates(state, left):
            if pair[0] < own and _needless(whole, left, pair):
                kept = without(state, left, pair)
                shorter = tuple(left[k] for k in kept)
                free = sum(k < own for k in kept)
                if accepts(shorter, free):
                    left, own = shorter, free
                    break
        else:
            return left


def _candidates(state: State, steps: Sequence[Subtask]) -> list[tuple[int, int]]:
    """Two steps of different skills about one thing, the nearest ones first."""
    acting = [k for k, s in enumerate(steps) if s.args and not _drives(state, s)]
    pairs = [
        (i, j)
        for i in acting
        for j in acting
        if i < j and steps[i].skill != steps[j].skill and _one_thing(state, steps[i], steps[j])
    ]
    return sorted(pairs, key=lambda pair: (pair[1] - pair[0], pair))


def _one_thing(state: State, one: Subtask, other: Subtask) -> bool:
    mine, theirs = set(state.matches(one.args[0])), set(state.matches(other.args[0]))
    return one.args[0] == other.args[0] or bool(mine & theirs)


def _needless(whole: Trace, steps: Sequence[Subtask], pair: tuple[int, int]) -> bool:
    first, second = pair
    before, done, undone = (_content(whole.states[k]) for k in (first, first + 1, second + 1))
    if not (done - before) - undone and not (before - done) & undone:
        return False
    kept = without(whole.states[0], steps, pair)
    trace = run(whole.states[0], [steps[k] for k in kept])
    if trace.refusal is not None or _content(whole.final) != _content(trace.final):
        return False
    after = zip(kept, trace.states[1:], strict=True)
    return all(_unsafe(shorter) <= _unsafe(whole.states[k + 1]) for k, shorter in after)


def _content(state: State) -> frozenset[tuple[str, ...]]:
    """Everything that holds; where the robot stands apart."""
    values = ((*key, value) for key, value in state.values.items())
    lost = ((name,) for name in state.lost)
    return frozenset((*values, *state.facts, *state.kinds.items(), *lost))


def _unsafe(state: State) -> frozenset[tuple[str, ...]]:
    """What must never be so and is, whenever that is judged."""
    return frozenset(
        (rule.name, *sorted(names.values()))
        for rule in state.domain.safety
        for names in state.bindings(rule.variables, rule.never, {})
    )


def _drives(state: State, step: Subtask) -> bool:
    skill = state.domain.skills.get(step.skill)
    return skill is not None and skill.drives
