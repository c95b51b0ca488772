"""A run in one sentence: what went wrong, when that was seen, how it ended.

Called by the page of a run and by the view; calls `records/derived.py`. Only what the record says.
"""

from __future__ import annotations

import re
from collections.abc import Sequence

from forestall.records.beside import ALONE
from forestall.records.derived import Alarm, alarms, done_before, in_words
from forestall.report.words import duration
from forestall.types.episode import STORED, EpisodeEnd, EpisodeRecord, SkillStatus
from forestall.types.runtime import When

_ENDS = re.compile(r"(?<=[.!?])\s+(?=[A-Z\d])")
_MOST_WORDS = 400


def story(record: EpisodeRecord, others: Sequence[EpisodeRecord] = ()) -> str:
    """One sentence about a run, finished or not, and one about the same start without a monitor.

    Args:
        record: of the run.
        others: of the same start under other strategies; the first is told of.
    """
    found = alarms(record)
    if not record.boundaries and not record.executed:
        begun = "The run ended before its first subtask"
    else:
        begun = _seen(record, found) if found else _unseen(record)
    told = [f"{begun}; {_end(record)}.", *(_otherwise(record, other) for other in others[:1])]
    return " ".join(told)


def _otherwise(record: EpisodeRecord, other: EpisodeRecord) -> str:
    """How the same start ended under another strategy."""
    how = "without a monitor" if other.strategy == ALONE else f"with the strategy {other.strategy}"
    sooner = record.simulated_s - other.simulated_s
    than = ""
    if record.success and other.success and abs(sooner) >= 0.05:
        than = f", {duration(abs(sooner))} {'sooner' if sooner > 0 else 'later'}"
    return f"Run once more {how}, {_end(other)}{than}."


def _seen(record: EpisodeRecord, found: Sequence[Alarm]) -> str:
    """The alarm that mattered: the first that changed the plan, else the first of all."""
    alarm = next((a for a in found if a.replanned), found[0])
    boundary = record.boundaries[alarm.position]
    first = _ENDS.split(alarm.sentence or alarm.cause, maxsplit=1)[0].rstrip(".")
    said = first if len(first) <= _MOST_WORDS else f"{first[: _MOST_WORDS - 1]}…"
    moment = in_words(alarm.when)
    step = len(done_before(record, boundary)) + (alarm.when is When.BEFORE)
    place = f"{moment[0].upper()}{moment[1:]} step {step}, {alarm.subtask}"
    if alarm.replanned and record.scenario == STORED:
        came = "a corrected plan is proposed"
    elif alarm.replanned:
        came = "a new plan took the place of the old one"
    elif alarm.outcome is not None:
        came = f"the plan stayed ({alarm.outcome.value})"
    else:
        came = "the run went on with its plan"
    more = len(found) - 1
    others = f", {more} more alarm{'s' * (more != 1)} came" if more else ""
    return f"{place}, after {duration(boundary.time_s)}, the alarm was “{said}”: {came}{others}"


def _unseen(record: EpisodeRecord) -> str:
    judged = any(b.verdict is not None for b in record.boundaries)
    nobody = "No alarm was raised" if judged else "Nobody judged the scene"
    broke = next(
        (e for e in record.executed if e.outcome.status is not SkillStatus.SUCCEEDED), None
    )
    if broke is None:
        count = len(record.executed)
        return f"{nobody} in {count} subtask{'s' * (count != 1)}, and none of them failed"
    why = f" ({broke.outcome.reason})" if broke.outcome.reason else ""
    verb = "was refused" if broke.outcome.status is SkillStatus.REFUSED else "failed"
    return f"{nobody}, and {broke.subtask} {verb}{why}"


def _end(record: EpisodeRecord) -> str:
    count = len(record.executed)
    if record.scenario == STORED:
        scenes = len(record.boundaries)
        return f"{scenes} stored scene{'s' * (scenes != 1)} judged, and nothing was carried out"
    if record.end is EpisodeEnd.UNFINISHED:
        return f"the record breaks off after {count} subtask{'s' * (count != 1)}"
    if record.trouble is not None:
        return f"the end was “{record.end.value}”: {record.trouble.text.rstrip('.')}"
    if record.success is None:
        return f"the end was “{record.end.value}”, and nobody scored it"
    when = f"after {duration(record.simulated_s)} of robot time"
    if record.success:
        return f"the task succeeded {when}"
    why = [words for _, words in record.harmed] or list(record.failures)
    told = f": {why[0].rstrip('.')}" if why else ""
    more = f", and {len(why) - 1} more" if len(why) > 1 else ""
    return f"the task failed {when}{told}{more}"
