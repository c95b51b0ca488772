"""Steps that the robot has refused, or that came to nothing time and again: not tried once more.

Called by `planner` and `replanning`; calls `execute` and `driving`.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Iterator

from forestall.planning.drafts import Draft
from forestall.planning.driving import landmark_of
from forestall.planning.execute import Refusal, perform
from forestall.planning.state import State
from forestall.types.plan import Subtask, same_step


def is_refused(steps: Iterable[Subtask], refused: Collection[Subtask]) -> Subtask | None:
    """The first step that was refused; a category in one of them stands for all of its things."""
    if not refused:
        return None
    return next((s for s in steps if any(same_step(s, one) for one in refused)), None)


def denial(step: Subtask, vain: Collection[Subtask]) -> str:
    """Why a step is not tried again.

    Args:
        step: that was refused.
        vain: of those that are refused, what the robot does not refuse and has tried in vain.
    """
    if is_refused((step,), vain):
        return f"{step} was tried time and again and came to nothing"
    return f"the robot has refused {step}, and nothing about it has changed"


def unexplained(state: State, refused: Iterable[Subtask]) -> frozenset[Subtask]:
    """Refused steps of which a state does not say why.

    Where one of its own needs about the arguments fails, the step may be tried once that holds. Of
    the others nothing says what would have to change, and they would be refused again.
    """
    found = set()
    for step in refused:
        done = perform(state, step)
        if not isinstance(done, Refusal) or not any(
            set(x.args) & set(step.args) for x in done.lacking
        ):
            found.add(step)
    return frozenset(found)


def no_other(state: State, refused: Iterable[Subtask], vain: Collection[Subtask]) -> Iterator[str]:
    """For each refused step a sentence that names the things of which there is only the one."""
    for step in sorted(refused):
        kinds = [state.kinds[a] for a in step.args if a in state.kinds]
        alone = list(dict.fromkeys(k for k in kinds if len(state.instances(k)) == 1))
        other = f"there is no other {' and no other '.join(alone)}" if alone else "no other will do"
        how = "came to nothing" if is_refused((step,), vain) else "was refused"
        yield f"{step} {how}, and {other}"


def barred_by(state: State, refused: frozenset[Subtask]) -> Callable[[Draft], bool] | None:
    """Whether a ground skill is refused, or the drive to where it is done; None: nothing is."""
    if not refused:
        return None
    driving = state.domain.driving()

    def barred(draft: Draft) -> bool:
        if is_refused((draft.subtask,), refused):
            return True
        subject = draft.over or next(reversed(draft.subtask.args), None)
        if driving is None or subject is None:
            return False
        held = {h for _, h in state.in_hands()}
        place = landmark_of(state, subject) if subject in state.kinds else subject
        if subject in held:
            return False
        return is_refused((Subtask(driving.name, (place,)),), refused) is not None

    return barred
