"""A repair that can wait: what only a later step minds is put right once the hands are empty.

Called by the replanner; calls the planner's model. With something in the hand a repair begins by
putting it down and ends by taking it up again. If the plan empties the hands by itself before the
first step that would not work, the steps until then are done first, and both are saved.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence

from forestall.planning.state import State
from forestall.planning.validate import run
from forestall.types.facts import Literal
from forestall.types.plan import Subtask


def first_empty(
    state: State, rest: Sequence[Subtask], due: Subtask | None, wanted: Collection[Literal]
) -> tuple[int, State] | None:
    """How many steps are done before the hands are empty, and the state then; None: nothing waits.

    Args:
        state: now.
        rest: what is left of the plan.
        due: its step that would be refused, where somebody says so.
        wanted: what must change. If that is more than this step lacks, it may be for a step before.
    """
    if due is None or due not in rest or _empty(state):
        return None
    last = rest.index(due)
    trace = run(state, rest[: last + 1])
    if trace.refusal is None or trace.step != last or not set(wanted) <= set(trace.refusal.lacking):
        return None
    return next(((k, s) for k, s in enumerate(trace.states) if _empty(s)), None)


def _empty(state: State) -> bool:
    return not any(state.in_hands())
