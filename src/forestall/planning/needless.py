"""Pairs of steps that a plan could do without: done, and undone again, and nothing in between asks.

Called by the replanner and by whoever judges plans; calls the validator's executor. Two steps are
needless together if the plan runs without them and ends in the same state, and leaves nothing in a
dangerous state meanwhile: what is turned off before a detour and on again after it stays.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from itertools import pairwise

from forestall.planning.state import State
from forestall.planning.validate import Trace, run
from forestall.types.plan import Subtask

Accepts = Callable[[tuple[Subtask, ...], int], bool]
"""Another plan, and how many of its first steps are the repair's own → whether it will do."""


def needless_pairs(state: State, steps: Sequence[Subtask]) -> tuple[tuple[int, int], ...]:
    """Every needless pair of a plan by the places of its steps, the first ones first.

    Pairs are looked for one by one: of three steps of which any two could go, three pairs are said.
    A step that changes nothing and drives nowhere makes a pair with itself. A plan that does not
    run has none.
    """
    whole = run(state, steps)
    if whole.refusal is not None:
        return ()
    return tuple(pair for pair in _candidates(whole) if _needless(whole, steps, pair))


def without(state: State, steps: Sequence[Subtask], pair: tuple[int, int]) -> tuple[int, ...]:
    """The places of the steps that stay: all but two, and but drives that only led to them."""
    left: list[int] = []
    gap = False
    for k, step in enumerate(steps):
        if k in pair:
            gap = True
            continue
        if gap and left and state.domain.drives(step) and state.domain.drives(steps[left[-1]]):
            left.pop()
        left.append(k)
        gap = False
    if gap and left and state.domain.drives(steps[left[-1]]):
        left.pop()
    return tuple(left)


def pruned(
    state: State, steps: Sequence[Subtask], own: int, accepts: Accepts
) -> tuple[Subtask, ...]:
    """A plan without the needless pairs that somebody accepts it without.

    Args:
        state: that it starts from.
        steps: of the plan, which runs.
        own: how many at its beginning are the repair; the others are what is left of an old plan.
        accepts: says whether a shorter plan will do.
    """
    left = tuple(steps)
    while True:
        whole = run(state, left)
        if whole.refusal is not None:
            return left
        for pair in _candidates(whole):
            if _needless(whole, left, pair):
                kept = without(state, left, pair)
                shorter = tuple(left[k] for k in kept)
                free = sum(k < own for k in kept)
                if accepts(shorter, free):
                    left, own = shorter, free
                    break
        else:
            return left


def content(state: State) -> frozenset[tuple[str, ...]]:
    """Everything that holds; where the robot stands apart."""

    def found() -> frozenset[tuple[str, ...]]:
        values = ((*key, value) for key, value in state.values.items())
        lost = ((name,) for name in state.lost)
        return frozenset((*values, *state.facts, *state.kinds.items(), *lost))

    return state.follow("content", found)


def unsafe(state: State) -> frozenset[tuple[str, ...]]:
    """What must never be so and is, whenever that is judged."""

    def found() -> frozenset[tuple[str, ...]]:
        return frozenset(
            (rule.name, *sorted(names.values()))
            for rule in state.domain.safety
            for names in state.bindings(rule.variables, rule.never, {})
        )

    return state.follow("unsafe", found)


def _candidates(whole: Trace) -> list[tuple[int, int]]:
    """Two steps of which the second undoes something of the first, the nearest ones first."""
    contents = [content(s) for s in whole.states]
    added = [b - a for a, b in pairwise(contents)]
    ended = [a - b for a, b in pairwise(contents)]
    acting = [k for k, s in enumerate(whole.meant) if not whole.states[0].domain.drives(s)]
    idle = [(k, k) for k in acting if not added[k] and not ended[k]]
    pairs = [
        (i, j)
        for i in acting
        for j in acting
        if i < j and (added[i] & ended[j] or ended[i] & added[j])
    ]
    return idle + sorted(pairs, key=lambda pair: (pair[1] - pair[0], pair))


def _needless(whole: Trace, steps: Sequence[Subtask], pair: tuple[int, int]) -> bool:
    kept = without(whole.states[0], steps, pair)
    trace = run(whole.states[0], [steps[k] for k in kept])
    if trace.refusal is not None or content(whole.final) != content(trace.final):
        return False
    after = zip(kept, trace.states[1:], strict=True)
    return all(unsafe(shorter) <= unsafe(whole.states[k + 1]) for k, shorter in after)
