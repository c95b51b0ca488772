"""A repair that can wait: what only a later step minds is put right once the hands are empty.

Called by the replanner; calls the planner's model. With something in the hand a repair begins by
putting it down and ends by taking it up again. If the plan empties the hands by itself before the
first step that would not work, the steps until then are done first, and both are saved.
"""

from __future__ import annotations

from collections.abc import Sequence

from forestall.planning.state import State
from forestall.planning.validate import run
from forestall.types.plan import Subtask
from forestall.types.verdict import Diagnosis


def first_empty(
    state: State, rest: Sequence[Subtask], diagnosis: Diagnosis
) -> tuple[int, State] | None:
    """How many steps are done before the hands are empty, and the state then; None: nothing waits.

    Args:
        state: now.
        rest: what is left of the plan.
        diagnosis: says which step would be refused; where it names none, nothing waits.
    """
    due = diagnosis.step
    if due is None or not diagnosis.refusal or due not in rest or _empty(state):
        return None
    before = rest[: rest.index(due)]
    states = run(state, before).states
    return next(((k, s) for k, s in enumerate(states) if _empty(s)), None)


def _empty(state: State) -> bool:
    return not any(state.in_hands())
