"""What follows from an EpisodeRecord and is not in it: alarms, timeline, plans before and after.

Pure functions over `types/`; the JSON record and the page both ask here, so that they agree.
"""

from __future__ import annotations

import difflib
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from enum import Enum
from typing import Any

from forestall.types.decision import Outcome
from forestall.types.episode import (
    BoundaryRecord,
    EpisodeRecord,
    ExecutedRecord,
    SkillStatus,
)
from forestall.types.facts import category_of
from forestall.types.plan import Plan, Subtask, same_step
from forestall.types.runtime import BoundaryContext, When
from forestall.types.verdict import Decision, Replan, ReplanOutcome

SIMULATOR_PHASES = frozenset({"act", "observe"})
"""Measured phases in which the simulator moves and draws; on a robot they are its own time."""

NOTHING_FOUND = "nothing was found that must change"


class Mark(Enum):
    """What came of one moment of the run."""

    PROCEEDED = "proceeded"
    REPLANNED = "alarm, replanned"
    DISMISSED = "alarm, dismissed"
    UNSOLVED = "alarm, no new plan"
    REFUSED = "refused"
    FAILED = "failed"
    LOOKED = "looked again"
    STOPPED = "stopped"
    UNJUDGED = "not judged"


@dataclass(frozen=True, slots=True)
class Alarm:
    """A verdict that asked for replanning, and what came of it."""

    position: int  # of its boundary in the record
    index: int  # of its boundary
    subtask: Subtask
    score: float | None
    threshold: float
    cause: str
    must_change: tuple[str, ...]
    culprits: tuple[str, ...]
    replanned: bool
    outcome: ReplanOutcome | None
    when: When = When.BEFORE  # of the subtask
    sentence: str = ""  # what the owner is told


@dataclass(frozen=True, slots=True)
class Moment:
    """A boundary, the subtask that was executed after it, or both.

    A boundary after a subtask, or at the end of the plan, is a moment of its own. `before` is the
    plan for the rest of the task when the boundary came, this subtask first where it is still to be
    done; `after` is the plan that replaced it, None where it stayed.
    """

    position: int | None  # of the boundary in the record
    boundary: BoundaryRecord | None
    executed: ExecutedRecord | None
    before: tuple[Subtask, ...]
    after: tuple[Subtask, ...] | None
    mark: Mark

    @property
    def subtask(self) -> Subtask:
        """What was about to be done, or was done."""
        if self.boundary is not None:
            return self.boundary.subtask
        assert self.executed is not None
        return self.executed.subtask

    @property
    def when(self) -> When:
        """Whether the subtask was about to be done, had been done, or was the plan's last."""
        return When.BEFORE if self.boundary is None else self.boundary.when

    @property
    def alarm(self) -> bool:
        """Whether the detector asked for replanning here."""
        return self.boundary is not None and is_alarm(self.boundary)


class RowKind(Enum):
    """One line of the comparison of two plans."""

    DONE = "done"
    KEPT = "kept"
    REMOVED = "removed"
    INSERTED = "inserted"


@dataclass(frozen=True, slots=True)
class PlanRow:
    """One aligned line of the plan before and the plan after."""

    kind: RowKind
    before: Subtask | None
    after: Subtask | None
    status: SkillStatus | None = None  # of a step that was already done
    seconds: float | None = None  # of the robot's clock that it took


def is_alarm(boundary: BoundaryRecord) -> bool:
    """An alarm is a verdict that asks for replanning, whatever is found afterwards."""
    return boundary.verdict is not None and boundary.verdict.decision is Decision.REPLAN


def new_plan(replan: Replan | None) -> Plan | None:
    """The plan that an attempt put in the place of the old one, None where it did not."""
    if replan is None or replan.outcome is not ReplanOutcome.SOLVED:
        return None
    return replan.plan


def left_at(context: BoundaryContext) -> tuple[Subtask, ...]:
    """The plan for the rest of the task when a boundary came; what is just done is not in it."""
    return context.remaining()[context.when is When.AFTER :]


def cause_of(boundary: BoundaryRecord) -> str:
    """The cause of an alarm in words; says so where nothing was found that must change."""
    diagnosis = boundary.diagnosis
    if diagnosis is None:
        note = "" if boundary.verdict is None else boundary.verdict.note
        return f"no diagnosis was made: {note}" if note else "no diagnosis was made"
    if diagnosis.found or "nothing was found" in diagnosis.cause.lower():
        return diagnosis.cause
    return f"{NOTHING_FOUND}: {diagnosis.cause}" if diagnosis.cause else NOTHING_FOUND


def outcome_of(boundary: BoundaryRecord) -> ReplanOutcome | None:
    """How the replanning after an alarm ended, None where none was tried."""
    if boundary.replan is not None:
        return boundary.replan.outcome
    if boundary.diagnosis is not None and not boundary.diagnosis.found:
        return ReplanOutcome.NOTHING_TO_CHANGE
    return None


def alarms(record: EpisodeRecord) -> tuple[Alarm, ...]:
    """Every alarm of a run in order."""
    return tuple(
        alarm
        for position, boundary in enumerate(record.boundaries)
        if (alarm := alarm_at(position, boundary, adopted(boundary, record.executed))) is not None
    )


def alarm_at(position: int, boundary: BoundaryRecord, plan: Plan | None) -> Alarm | None:
    """The alarm of one boundary, None where there was none; `plan` is what it led to."""
    verdict, diagnosis = boundary.verdict, boundary.diagnosis
    if verdict is None or not is_alarm(boundary):
        return None
    return Alarm(
        position=position,
        index=boundary.index,
        subtask=boundary.subtask,
        score=verdict.score,
        threshold=verdict.threshold,
        cause=cause_of(boundary),
        must_change=() if diagnosis is None else tuple(map(str, diagnosis.must_change)),
        culprits=() if diagnosis is None else diagnosis.culprits,
        replanned=plan is not None,
        outcome=outcome_of(boundary),
        when=boundary.when,
        sentence=boundary.sentence,
    )


def adopted(boundary: BoundaryRecord, executed: Sequence[ExecutedRecord]) -> Plan | None:
    """The plan that the run went on with, None where it kept the old one.

    A run whose number of plans is used up executes the subtask of the boundary all the same.
    """
    kept = boundary.when is When.BEFORE and any(
        e.index == boundary.index and e.subtask == boundary.subtask for e in executed
    )
    return None if kept else new_plan(boundary.replan)


def replans(record: EpisodeRecord) -> int:
    """How many plans were replaced during the run."""
    return sum(adopted(b, record.executed) is not None for b in record.boundaries)


def moments(record: EpisodeRecord) -> tuple[Moment, ...]:
    """The run as a sequence of moments, in order.

    Several boundaries may share one index: a second look, a new plan whose first step is judged
    again, and what was seen after the subtask. The executed subtask belongs to the last of those
    before it, if it is the one that was judged.
    """
    executed = {e.index: e for e in record.executed}
    of_index: dict[int, list[int]] = {}
    for position, boundary in enumerate(record.boundaries):
        of_index.setdefault(boundary.index, []).append(position)
    plan, adopted_at = record.initial_plan.subtasks, 0
    result: list[Moment] = []
    for index in sorted(executed.keys() | of_index.keys()):
        positions = of_index.get(index, [])
        done = executed.get(index)
        starts = [p for p in positions if record.boundaries[p].when is not When.AFTER]
        for position in positions:
            boundary = record.boundaries[position]
            reached = index + (boundary.when is When.AFTER)
            before = plan[_progress(record, adopted_at, reached) :]
            after = adopted(boundary, record.executed)
            if after is not None:
                plan, adopted_at = after.subtasks, reached
            elif boundary.outcome is Outcome.REPLAN:  # proposed, and the old plan went on
                after = new_plan(boundary.replan)
            mine = done if position in starts[-1:] else None
            if mine is not None and not same_step(mine.subtask, boundary.subtask):
                mine = None
            result.append(
                Moment(
                    position,
                    boundary,
                    mine,
                    before,
                    None if after is None else after.subtasks,
                    _mark(boundary, mine, after),
                )
            )
            if mine is not None:
                done = None
        if done is not None:
            before = plan[_progress(record, adopted_at, index) :]
            result.append(Moment(None, None, done, before, None, _mark(None, done, None)))
    return tuple(result)


def _progress(record: EpisodeRecord, adopted_at: int, index: int) -> int:
    """How many subtasks were executed since a plan was adopted."""
    return sum(adopted_at <= e.index < index for e in record.executed)


def _mark(
    boundary: BoundaryRecord | None, executed: ExecutedRecord | None, after: Plan | None
) -> Mark:
    if after is not None:
        return Mark.REPLANNED
    if executed is not None and executed.outcome.status is SkillStatus.REFUSED:
        return Mark.REFUSED
    if executed is not None and executed.outcome.status is SkillStatus.FAILED:
        return Mark.FAILED
    verdict = None if boundary is None else boundary.verdict
    if verdict is None:
        return Mark.UNJUDGED
    if verdict.decision is Decision.REPLAN:
        assert boundary is not None
        diagnosis = boundary.diagnosis
        found = diagnosis is not None and diagnosis.found
        dismissed = not found or outcome_of(boundary) is ReplanOutcome.NOTHING_TO_CHANGE
        return Mark.DISMISSED if dismissed else Mark.UNSOLVED
    if verdict.decision is Decision.LOOK_AGAIN:
        return Mark.LOOKED
    return Mark.STOPPED if verdict.decision is Decision.STOP else Mark.PROCEEDED


def plan_rows(
    done: Sequence[ExecutedRecord], before: Sequence[Subtask], after: Sequence[Subtask]
) -> tuple[PlanRow, ...]:
    """Plan before and plan after, line by line: what was done, kept, removed, inserted."""
    rows = [
        PlanRow(RowKind.DONE, e.subtask, e.subtask, e.outcome.status, e.outcome.duration_s)
        for e in done
    ]
    left, right = [_key(s) for s in before], [_key(s) for s in after]
    matcher = difflib.SequenceMatcher(None, left, right, autojunk=False)
    for tag, a, b, c, d in matcher.get_opcodes():
        if tag == "equal":
            rows += [
                PlanRow(RowKind.KEPT, x, y) for x, y in zip(before[a:b], after[c:d], strict=True)
            ]
        else:
            rows += [PlanRow(RowKind.REMOVED, x, None) for x in before[a:b]]
            rows += [PlanRow(RowKind.INSERTED, None, y) for y in after[c:d]]
    return tuple(rows)


def _key(subtask: Subtask) -> tuple[str, ...]:
    return (subtask.skill, *map(category_of, subtask.args))


def done_before(record: EpisodeRecord, boundary: BoundaryRecord) -> tuple[ExecutedRecord, ...]:
    """What had been executed when a boundary came."""
    reached = boundary.index + (boundary.when is When.AFTER)
    return tuple(e for e in sorted(record.executed, key=lambda e: e.index) if e.index < reached)


def in_words(when: When) -> str:
    """How a moment is said before the name of its subtask: "after insert(Peg, Hole)"."""
    return "at the end, after" if when is When.END else when.value


def provenance_of(record: EpisodeRecord, name: str) -> Mapping[str, Any]:
    """One mapping of the provenance ("perception", "memory", "versions"); empty where absent."""
    value = dict(record.provenance).get(name)
    if isinstance(value, Mapping):
        return {str(k): v for k, v in value.items()}
    if isinstance(value, tuple | list) and all(
        isinstance(v, tuple | list) and len(v) == 2 for v in value
    ):
        return {str(k): v for k, v in value}
    return {} if value is None else {name: value}


def reasoning_s(phases: Iterable[tuple[str, float]]) -> float:
    """Measured time that a robot would spend, too: all phases but those of the simulator."""
    return sum(seconds for name, seconds in phases if name not in SIMULATOR_PHASES)
