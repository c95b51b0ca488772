"""Two runs side by side: what they have in common, and what happened in each. Called by `pages.py`.

Moments are aligned by what was to be done, as the plans before and after an alarm are.
"""

from __future__ import annotations

import difflib
from collections.abc import Sequence
from dataclasses import dataclass
from urllib.parse import quote

from forestall.records.derived import Moment, alarms, in_words, moments, provenance_of, reasoning_s
from forestall.records.derived import replans as replans_of
from forestall.report.page_view import LOOKS
from forestall.report.story import story
from forestall.report.words import duration
from forestall.types.episode import EpisodeRecord, StoredObservation
from forestall.types.facts import category_of


@dataclass(frozen=True, slots=True)
class Cell:
    """A moment of one run.

    Args:
        number: of it on the page of the run.
        look: its class in the style sheet.
        sign: of what came of it.
        mark: the same in words.
        what: when and which subtask.
        said: what the owner was told, where there was an alarm.
        score: against what threshold; "" where nothing was compared.
        picture: name of what the robot saw, None where none was kept.
    """

    number: int
    look: str
    sign: str
    mark: str
    what: str
    said: str
    score: str
    picture: str | None


@dataclass(frozen=True, slots=True)
class Fact:
    """One line of the comparison."""

    name: str
    left: str
    right: str

    @property
    def differs(self) -> bool:
        """Whether the runs have not the same."""
        return self.left != self.right


@dataclass(frozen=True, slots=True)
class Sides:
    """Two runs.

    Args:
        records: of them.
        stories: a sentence for each.
        facts: what can be said of both.
        rows: moments, None where a run has nothing like that of the other.
    """

    records: tuple[EpisodeRecord, EpisodeRecord]
    stories: tuple[str, str]
    facts: tuple[Fact, ...]
    rows: tuple[tuple[Cell | None, Cell | None], ...]


def compare(left: EpisodeRecord, right: EpisodeRecord) -> Sides:
    """Everything that the page of two runs needs."""
    facts = zip(_facts(left), _facts(right), strict=True)
    return Sides(
        (left, right),
        (story(left), story(right)),
        tuple(Fact(name, mine, yours) for (name, mine), (_, yours) in facts),
        tuple(_rows(moments(left), moments(right))),
    )


def _facts(record: EpisodeRecord) -> list[tuple[str, str]]:
    perception = provenance_of(record, "perception")
    result = {True: "succeeded", False: "failed", None: "not scored"}
    return [
        ("task", record.task.name),
        ("scenario", record.scenario or "undisturbed"),
        ("strategy", record.strategy),
        ("seed", str(record.seed)),
        ("outcome", result[record.success]),
        ("end", record.end.value),
        ("alarms", str(len(alarms(record)))),
        ("new plans", str(replans_of(record))),
        ("subtasks executed", str(len(record.executed))),
        ("robot time", duration(record.simulated_s)),
        ("reasoning time", duration(reasoning_s(record.compute_s))),
        ("states from", str(perception.get("state_estimator") or "not recorded")),
    ]


def _rows(left: Sequence[Moment], right: Sequence[Moment]) -> list[tuple[Cell | None, Cell | None]]:
    mine, yours = ([_cell(k, m) for k, m in enumerate(x, 1)] for x in (left, right))
    matcher = difflib.SequenceMatcher(
        None, [_key(m) for m in left], [_key(m) for m in right], autojunk=False
    )
    rows: list[tuple[Cell | None, Cell | None]] = []
    for tag, a, b, c, d in matcher.get_opcodes():
        if tag == "equal":
            rows += zip(mine[a:b], yours[c:d], strict=True)
        else:
            rows += [(cell, None) for cell in mine[a:b]]
            rows += [(None, cell) for cell in yours[c:d]]
    return rows


def _key(moment: Moment) -> tuple[str, ...]:
    step = moment.subtask
    return (moment.when.value, step.skill, *map(category_of, step.args))


def _cell(number: int, moment: Moment) -> Cell:
    boundary = moment.boundary
    verdict = None if boundary is None else boundary.verdict
    seen = None if boundary is None else boundary.observation
    look, sign = LOOKS[moment.mark]
    picture = None
    if isinstance(seen, StoredObservation) and seen.frames:
        picture = seen.frames[-1].picture
    score = ""
    if verdict is not None and verdict.score is not None:
        score = f"{verdict.score:.3f} / {verdict.threshold:.2f}"
    return Cell(
        number=number,
        look=look,
        sign=sign,
        mark=moment.mark.value,
        what=f"{in_words(moment.when)} {moment.subtask}",
        said=boundary.sentence if boundary is not None and moment.alarm else "",
        score=score,
        picture=None if picture is None else quote(picture),
    )
