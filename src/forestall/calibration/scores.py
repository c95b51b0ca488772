"""What judges said at the boundaries of good runs, as one extreme for each run and column.

Made by assembly from a memory, or read from a file; used by `fitted`. Calls `conformal`.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from enum import Enum

import numpy as np
import numpy.typing as npt

from forestall.calibration.conformal import extreme
from forestall.errors import InputError


class Parts(Enum):
    """How the boundaries of a run are told apart, each part with a line of its own."""

    NONE = "none"
    UNDO = "undo"  # before what can be undone, and before what cannot
    SKILL = "skill"


REVERSIBLE, IRREVERSIBLE = "reversible", "irreversible"

EVERY = ""
"""The part of a column that is all of a run."""


@dataclass(frozen=True, slots=True)
class JudgedBoundary:
    """What one judge said at one boundary of a good run.

    Args:
        judge: its name.
        skill: of the subtask before which it judged.
        score: how well the scene fits, None where nothing was judged; of a judge that says yes or
            no 1 and 0.
        asked: whether it asked for another look, which nobody could give it here.
    """

    judge: str
    skill: str
    score: float | None
    asked: bool = False


@dataclass(frozen=True, slots=True)
class JudgedRun:
    """One good run: the unit that is exchanged."""

    run: str
    task: str
    boundaries: tuple[JudgedBoundary, ...]


@dataclass(frozen=True, slots=True)
class Column:
    """One judge on one part of a run.

    Args:
        judge: its name.
        part: `EVERY`, `REVERSIBLE` or `IRREVERSIBLE`, or a skill.
        share: of the budget; the shares of all columns add up to 1.
    """

    judge: str
    part: str = EVERY
    share: float = 1.0

    def __str__(self) -> str:
        return f"{self.judge}, {self.part}" if self.part else self.judge


@dataclass(frozen=True, slots=True)
class Scores:
    """The extremes of good runs.

    Args:
        columns: judges and parts.
        runs: their names, each once.
        tasks: of the runs.
        extremes: a row for each run, a number for each column; inf: nothing was judged.

    Raises:
        InputError: no column, rows of another length, or a run that is there twice.
    """

    columns: tuple[Column, ...]
    runs: tuple[str, ...]
    tasks: tuple[str, ...]
    extremes: tuple[tuple[float, ...], ...]

    def __post_init__(self) -> None:
        if not self.columns:
            raise InputError("a calibration needs one judge at least")
        if not len(self.runs) == len(self.tasks) == len(self.extremes):
            raise InputError("a calibration has one task and one row of scores for each run")
        if any(len(row) != len(self.columns) for row in self.extremes):
            raise InputError(f"each run needs {len(self.columns)} scores, one for each column")
        if len(set(self.runs)) != len(self.runs):
            raise InputError("a run counts once in a calibration, and one is there twice")
        if any(not c.share > 0 for c in self.columns):
            raise InputError("every share of the budget is above 0")

    @property
    def judges(self) -> tuple[str, ...]:
        """Names in the order of the columns."""
        return tuple(dict.fromkeys(c.judge for c in self.columns))

    def matrix(self, task: str | None = None) -> npt.NDArray[np.float64]:
        """(n, c) extremes of the runs of a task, of all runs where it is None."""
        rows = [
            row
            for row, own in zip(self.extremes, self.tasks, strict=True)
            if task is None or own == task
        ]
        return np.array(rows, dtype=np.float64).reshape(len(rows), len(self.columns))

    def undivided(self) -> Scores:
        """The same with one column for each judge; its share is that of all its parts."""
        places = {j: [i for i, c in enumerate(self.columns) if c.judge == j] for j in self.judges}
        columns = tuple(
            Column(j, EVERY, sum(self.columns[i].share for i in own)) for j, own in places.items()
        )
        rows = tuple(
            tuple(min(row[i] for i in own) for own in places.values()) for row in self.extremes
        )
        return Scores(columns, self.runs, self.tasks, rows)


def scores_of(
    runs: Sequence[JudgedRun],
    parts: Parts = Parts.NONE,
    irreversible: Iterable[str] = (),
    share: float = 2 / 3,
) -> Scores:
    """Extremes of judged runs; the budget is the same for each judge.

    Args:
        runs: good ones.
        parts: how boundaries are told apart; skills have equal shares.
        irreversible: skills that cannot be undone, for `Parts.UNDO`.
        share: of a judge's budget that is spent before these: the larger, the sooner it alarms
            there and the later elsewhere.

    Raises:
        InputError: no run, or a share that is not between 0 and 1.
    """
    if not 0 < share < 1:
        raise InputError(f"the share {share} before what cannot be undone is not between 0 and 1")
    boundaries = [b for run in runs for b in run.boundaries]
    judges = tuple(dict.fromkeys(b.judge for b in boundaries))
    if not judges:
        raise InputError("no run was judged, so there is nothing to calibrate with")
    final = frozenset(irreversible)
    if parts is Parts.SKILL:
        skills = sorted({b.skill for b in boundaries})
        shares = {s: 1 / len(skills) for s in skills}
    elif parts is Parts.UNDO:
        there = {part_of(b.skill, parts, final) for b in boundaries}
        both = {REVERSIBLE: 1 - share, IRREVERSIBLE: share}
        shares = {p: s for p, s in both.items() if p in there}
    else:
        shares = {EVERY: 1.0}
    spent = sum(shares.values()) * len(judges)
    columns = tuple(Column(j, p, s / spent) for j in judges for p, s in shares.items())
    rows = tuple(
        tuple(
            extreme(
                b.score
                for b in run.boundaries
                if b.judge == c.judge and part_of(b.skill, parts, final) == c.part
            )
            for c in columns
        )
        for run in runs
    )
    return Scores(columns, tuple(r.run for r in runs), tuple(r.task for r in runs), rows)


def part_of(skill: str, parts: Parts, irreversible: Iterable[str]) -> str:
    """The part of a run that the boundary before a skill belongs to."""
    if parts is Parts.SKILL:
        return skill
    if parts is Parts.UNDO:
        return IRREVERSIBLE if skill in irreversible else REVERSIBLE
    return EVERY
