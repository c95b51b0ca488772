"""Steps that the robot has refused: what is not tried again.

Called by `planner` and `replanning`; calls `execute` and `driving`.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable

from forestall.planning.drafts import Draft
from forestall.planning.driving import landmark_of
from forestall.planning.execute import Refusal, perform
from forestall.planning.state import State
from forestall.types.plan import Subtask, same_step


def is_refused(step: Subtask, refused: Iterable[Subtask]) -> bool:
    """Whether a step is one of those; a category in one of them stands for all of its things."""
    return any(same_step(step, one) for one in refused)


def unexplained(state: State, refused: Iterable[Subtask]) -> frozenset[Subtask]:
    """Refused steps that a state allows.

    What the state itself forbids may be tried once that has changed; of what it allows nothing
    says what would have to change, and nothing is the same way only better.
    """
    return frozenset(s for s in refused if not isinstance(perform(state, s), Refusal))


def barred_by(state: State, refused: frozenset[Subtask]) -> Callable[[Draft], bool] | None:
    """Whether a ground skill is refused, or the drive to where it is done; None: nothing is."""
    if not refused:
        return None
    driving = state.domain.driving()

    def barred(draft: Draft) -> bool:
        if is_refused(draft.subtask, refused):
            return True
        subject = draft.over or next(reversed(draft.subtask.args), None)
        if driving is None or subject is None:
            return False
        held = {h for _, h in state.in_hands()}
        place = landmark_of(state, subject) if subject in state.kinds else subject
        return subject not in held and is_refused(Subtask(driving.name, (place,)), refused)

    return barred


__all__ = ["barred_by", "is_refused", "unexplained"]
