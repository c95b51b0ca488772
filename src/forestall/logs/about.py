"""What a log says of its run as a whole, and what follows from how its subtasks ended.

Called by the readers; calls nothing.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence

from forestall.domain.model import Domain
from forestall.errors import FileFormatError
from forestall.logs.layout import Step
from forestall.logs.moments import Moment
from forestall.types.episode import SkillStatus
from forestall.types.plan import Plan
from forestall.types.recorded import Look, RecordedRun

PARTS: Mapping[str, str] = {"states": "learned"}
"""A log says where things are and not in which states: these are read off its pictures."""

_GOAL_MISSED = "the goal was missed"


def recorded(
    name: str,
    about: Mapping[str, str],
    steps: Sequence[Step],
    moments: Sequence[Moment],
    domain: Domain,
    looks: Callable[[], Iterator[Look]],
    notes: Sequence[str],
) -> RecordedRun:
    """A run of a log.

    Args:
        name: of the log, where it says no other.
        about: name, task, scene, goal, success ("true", "false", "null") and why, as far as told.
        steps: that were carried out.
        moments: its looks.
        domain: whose words they have to be in.
        looks: opens the log anew.
        notes: what could not be read of it.

    Raises:
        FileFormatError: no subtask, one that the domain does not have, a run that neither failed
            nor went as planned, or a good one whose end nobody saw.
    """
    if not steps:
        raise FileFormatError(
            "it says nowhere when a subtask begins: give a topic, a column or a CSV file (--steps)"
        )
    plan = Plan(tuple(s.subtask for s in steps), about.get("goal", ""))
    domain.check_plan(plan)
    success = about.get("success", "null")
    failed = next((n for n, s in enumerate(steps) if s.status is not SkillStatus.SUCCEEDED), None)
    why, kind = about.get("why", ""), ""
    if failed is not None:
        if success == "true":
            raise FileFormatError(
                f"step {failed + 1} was {steps[failed].status.value} and the task succeeded all "
                "the same: it is neither a demonstration nor a failing run"
            )
        why, kind = why or steps[failed].reason, steps[failed].status.value
    elif success == "false":
        failed, why, kind = len(steps) - 1, why or _GOAL_MISSED, _GOAL_MISSED
    if failed is None and moments[-1].at_ns is None:
        raise FileFormatError(f"nobody looked after the last subtask, {steps[-1].subtask}")
    notes = list(notes)
    if (own := about.get("domain", domain.name)) != domain.name:
        notes.append(f"it was written in the domain {own} and is read in {domain.name}")
    begins_s = 0 if failed is None else round((steps[failed].begins_ns - _first(moments)) / 1e9)
    return RecordedRun(
        about.get("name") or name,
        about.get("task", ""),
        about.get("scene", ""),
        plan,
        looks,
        failed,
        (begins_s, begins_s),
        kind,
        why,
        tuple(notes),
    )


def _first(moments: Sequence[Moment]) -> int:
    return next((m.at_ns for m in moments if m.at_ns is not None), 0)
