"""What the monitor answers: may the subtask start, and if not, what instead."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum
from typing import TYPE_CHECKING

from forestall.types.observation import Vec3
from forestall.types.plan import Plan, Subtask
from forestall.types.verdict import Diagnosis, Replan, Verdict

if TYPE_CHECKING:
    from forestall.types.episode import BoundaryRecord
    from forestall.types.runtime import BoundaryContext


class Outcome(Enum):
    """What the monitor says of a moment; only what was judged is said to proceed."""

    PROCEED = "proceed"
    LOOK = "look"  # once more, at `look_at`, and ask again
    REPLAN = "replan"  # the monitor follows a new plan from here; ask again for its first subtask
    HOLD = "hold"  # do not go on, see `hold` and `why`
    NOT_JUDGED = "not judged"  # nothing is known against it, and nothing for it


class Hold(Enum):
    """Why the robot should stay where it is."""

    STOPPED = "stopped safely"  # a fact must change and no plan changes it
    ALARM = "alarm without an answer"  # unexplained, or without a plan, or repaired too often
    SENSES = "senses not to be trusted"  # the observation cannot be what the robot sees
    INTERNAL = "something of ours failed"  # a part raised an error or did not answer in time
    TOO_MANY = "too many in a row"  # alarms, new plans, or subtasks that failed
    REPLAN_LIMIT = "replan limit"
    SUBTASK_LIMIT = "subtask limit"


@dataclass(frozen=True, slots=True)
class MonitorDecision:
    """The answer at one moment of a run.

    Args:
        outcome: what to do.
        may_start: whether the caller may go on with what comes next (before a subtask: send
            `command`): after "proceed", and after "not judged" where the policy says so.
        subtask: what it is about, grounded to instance names where they are known.
        command: the subtask to send to the robot, None at the end of a plan.
        verdict: what the detector said.
        diagnosis: what is wrong and what must change, on an alarm.
        replan: the attempt at a corrected plan, on an alarm.
        plan: the new plan that is followed from here on, for "replan".
        look_at: world points to look at, for "look"; empty: all around.
        hold: the kind of reason, for "hold".
        why: the reason in words.
        sentence: what the owner is told: what is, why it would fail, what is done; empty where a
            step simply goes on.
        seconds: compute time by phase.
        context: what was known; None where nothing was looked at.
        record: the record of this moment; None where nothing was looked at.
    """

    outcome: Outcome
    may_start: bool
    subtask: Subtask | None = None
    command: Subtask | None = None
    verdict: Verdict | None = None
    diagnosis: Diagnosis | None = None
    replan: Replan | None = None
    plan: Plan | None = None
    look_at: tuple[Vec3, ...] = ()
    hold: Hold | None = None
    why: str = ""
    sentence: str = ""
    seconds: tuple[tuple[str, float], ...] = ()
    context: BoundaryContext | None = None
    record: BoundaryRecord | None = None

    def __str__(self) -> str:
        """The answer in words: outcome, subtask, why; what to do instead on lines of their own."""
        about = "" if self.subtask is None else f" before {self.subtask}"
        known = self.diagnosis is not None and self.diagnosis.found
        cause = self.diagnosis.cause if self.diagnosis is not None and known else ""
        why = cause if self.outcome is Outcome.REPLAN else (self.why or cause)
        if self.outcome is Outcome.HOLD and self.hold is not None and not why:
            why = self.hold.value
        lines = [f"{self.outcome.value}{about}" + (f": {why}" if why else "")]
        if cause and cause not in why:
            lines.append(f"  cause: {cause}")
        if self.plan is not None:
            lines.append(f"  plan: {'; '.join(self.plan.texts())}")
        return "\n".join(lines)
