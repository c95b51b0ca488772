"""When a run that nobody interrupts is lost, and when that does harm: the truth, for scoring.

Called by the experiments with a record and the trace of the truth beside it.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any

from forestall.tasks.faults import ExecutionFault
from forestall.tasks.truth import TrueMoment, TruthTrace
from forestall.types.episode import BoundaryRecord, EpisodeRecord, ExecutedRecord, SkillStatus
from forestall.types.facts import category_of
from forestall.types.plan import Subtask
from forestall.types.runtime import When


@dataclass(frozen=True, slots=True)
class Loss:
    """When a run is lost.

    Args:
        known: index of the first boundary from which on the truth says to the end that what is left
            will not do, but not before what the scenario says, where its fault is what fails; one
            past the last, where it showed only after the last step.
        effect: index of the first subtask from `known` on that was refused or failed, or of the
            first that did what must never happen, whichever comes first; one past the last, where
            there is neither. It is before `known` where a slip does the harm at once: that cannot
            be foreseen.
        at: position in the trace's moments at which the truth says it first, their number for after
            the last step; `causes.causes` asks for it.
    """

    known: int
    effect: int
    at: int


def losses(
    trace: TruthTrace,
    record: EpisodeRecord,
    faults: Iterable[Any] = (),
    said: tuple[int | None, int | None] = (None, None),
) -> Loss | None:
    """When a run was lost, None where it succeeded.

    Args:
        trace: of this run.
        record: of a run in which nothing was replanned, scored.
        faults: of its scenario; none where that is harmless.
        said: when it can be known and does harm as the scenario says (`Scenario.moments`).
    """
    if record.success:
        return None
    boundaries, end, faults = record.boundaries, _end(record), tuple(faults)
    moments = trace.moments[: len(boundaries)]
    at = len(moments)
    while at > 0 and not moments[at - 1].reachable:
        at -= 1
    index = _index(boundaries[at]) if at < len(moments) else end
    own = at == 0 or (at <= len(boundaries) and _disturbed(boundaries[at - 1], faults))
    if own and said[0] is not None:
        slip = _slip(at, min(x for x in said if x is not None), moments, record)
        own = slip is None
        index = max(index, said[0]) if slip is None else slip
    effect = _effect(trace, record, index, end)
    return Loss(index, min(effect, said[1]) if own and said[1] is not None else effect, at)


def _slip(at: int, until: int, moments: Sequence[TrueMoment], record: EpisodeRecord) -> int | None:
    """Where a run that a scenario's fault has lost is lost by something else before that shows.

    A subtask failed, or was refused after what lacks had become something else; None where nothing
    went wrong before `until`.
    """
    boundaries, wrong = record.boundaries, _wrong(record)
    first = next((e for e in wrong if e.index < until), None)
    if first is None:
        return None
    if first.outcome.status is SkillStatus.FAILED:
        return first.index + 1
    changed = [
        here
        for position in range(at + 1, len(moments))
        if moments[position].lacking != moments[position - 1].lacking
        and (here := _index(boundaries[position])) <= first.index
    ]
    return changed[-1] if changed else None


def _wrong(record: EpisodeRecord) -> list[ExecutedRecord]:
    """Subtasks that were refused or failed."""
    return [e for e in record.executed if e.outcome.status is not SkillStatus.SUCCEEDED]


def _disturbed(before: BoundaryRecord, faults: Sequence[Any]) -> bool:
    """Whether a fault of the scenario is one of the subtask that was judged then."""
    steps = [f.step for f in faults if isinstance(f, ExecutionFault) and f.step]
    return any(_means(Subtask.parse(s), before.subtask) for s in steps)


def _means(named: Subtask, step: Subtask) -> bool:
    pairs = zip(named.args, step.args, strict=False)
    return named.skill == step.skill and all(a in (b, category_of(b)) for a, b in pairs)


def _effect(trace: TruthTrace, record: EpisodeRecord, known: int, end: int) -> int:
    wrong = [e.index for e in _wrong(record) if e.index >= known]
    return min((*wrong, *_harm(trace, record)), default=end)


def _harm(trace: TruthTrace, record: EpisodeRecord) -> Iterator[int]:
    """The subtasks during which something irreversible happened; 0 for what was so at first."""
    events = [(e.time_s, e.text) for e in record.events]
    for harm in record.harmed:
        number = events.index(harm) if harm in events else -1
        before = zip(trace.left, record.boundaries, strict=False)
        yield max((_index(b) for left, b in before if left.events <= number), default=0)


def _end(record: EpisodeRecord) -> int:
    """One past the last subtask that was executed or judged."""
    return max((b.index + 1 for b in record.boundaries if b.when is When.BEFORE), default=0)


def _index(boundary: BoundaryRecord) -> int:
    """The position of the subtask that comes next."""
    return boundary.index + (boundary.when is When.AFTER)
