"""A calibration: for each task the thresholds that keep all judges together to one level per run.

Made by assembly and by `file`; asked by detectors through `JudgeThresholds`. Calls `joint`. What a
task's own runs are too few for is taken from all runs, undivided before divided by task; what these
are too few for is uncalibrated, and every answer says which of them it is.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

from forestall.calibration import conformal, joint
from forestall.calibration.conformal import NOT_JUDGED
from forestall.calibration.scores import Column, Parts, Scores, part_of
from forestall.errors import InputError, UnknownNameError
from forestall.types.verdict import Calibration, Threshold

LEVEL = 0.05
"""Bound on false alarms per run where nobody says another one."""


@dataclass(frozen=True, slots=True)
class Line:
    """Where one column of a fit draws the line.

    Args:
        column: judge and part.
        threshold: scores below are alarms; None: none could be.
        judged: runs in which the column has a score.
        smallest: the smallest level at which this column could raise an alarm.
        extremes: of all runs of the group, for p-values.
    """

    column: Column
    threshold: float | None
    judged: int
    smallest: float
    extremes: tuple[float, ...]


@dataclass(frozen=True, slots=True)
class Fit:
    """The thresholds of one group of runs.

    Args:
        task: the group, None for all runs.
        divided: whether the parts of a run have lines of their own.
        runs: how many there are.
        level: the bound on false alarms per run, over all lines together.
        lines: for each column.
    """

    task: str | None
    divided: bool
    runs: int
    level: float
    lines: tuple[Line, ...]

    @property
    def usable(self) -> bool:
        """Whether every column in which anything was judged could raise an alarm."""
        judged = [line for line in self.lines if line.judged]
        return bool(judged) and all(line.threshold is not None for line in judged)

    @property
    def smallest(self) -> float:
        """The smallest level that these runs allow with every column at work."""
        return max((line.smallest for line in self.lines if line.judged), default=1.0)

    def needed(self, level: float) -> int:
        """How many runs a level needs so that every column can work, all judges together."""
        shares = [line.column.share for line in self.lines if line.judged]
        if not shares:
            return conformal.runs_needed(level)
        least = min(shares)
        return conformal.runs_needed(level, sum(int(s / least + 1e-9) for s in shares))

    def line(self, judge: str, part: str) -> Line | None:
        """The line of a judge before a part of a run; None where no good run has such a part."""
        wanted = part if self.divided else ""
        own = (x for x in self.lines if (x.column.judge, x.column.part) == (judge, wanted))
        found = next(own, None)
        return found if found is not None and found.judged else None

    def __str__(self) -> str:
        of = "all tasks" if self.task is None else f"the task {self.task}"
        return f"{self.runs} good run{'' if self.runs == 1 else 's'} of {of}"


@dataclass(frozen=True)
class CalibrationTable:
    """Extremes of good runs, and what they were made with.

    Args:
        scores: of the good runs.
        level: the bound on false alarms per run, over all judges together.
        parts: how the boundaries of a run are told apart.
        irreversible: skills that count as such.
        by_task: whether each task has thresholds of its own where its runs suffice.
        options: judge → its options as plain data, with those of what finds its references.
        memory: digest of what the demonstrations that were compared with show, and who saw it.
        demonstrations: how many these are.
        held_out: whether the runs were compared with other demonstrations; else each with all but
            itself.
        looks: judge → in how many runs it asked for another look, which counts as no alarm.

    Raises:
        InputError: a level that is not between 0 and 1.
    """

    scores: Scores
    level: float = LEVEL
    parts: Parts = Parts.NONE
    irreversible: tuple[str, ...] = ()
    by_task: bool = True
    options: Mapping[str, Mapping[str, Any]] = field(default_factory=dict)
    memory: str = ""
    demonstrations: int = 0
    held_out: bool = False
    looks: Mapping[str, int] = field(default_factory=dict)

    def __post_init__(self) -> None:
        conformal.checked_level(self.level)

    @cached_property
    def _undivided(self) -> Scores:
        return self.scores.undivided()

    @cached_property
    def _fits(self) -> dict[tuple[str | None, bool], Fit]:
        return {}

    def fit_of(self, task: str | None, divided: bool) -> Fit:
        """The thresholds of one group, whether or not its runs suffice."""
        key = (task, divided)
        if key not in self._fits:
            self._fits[key] = _fit(
                self.scores if divided else self._undivided, task, divided, self.level
            )
        return self._fits[key]

    def fit(self, task: str | None) -> Fit:
        """The thresholds that serve a task: its own, those of all tasks, or the last, unusable."""
        divided = self.parts is not Parts.NONE
        groups = [task] if self.by_task and task in self.scores.tasks else []
        tried = [
            self.fit_of(group, lines)
            for group in (*groups, None)
            for lines in ((True, False) if divided else (False,))
        ]
        return next((fit for fit in tried if fit.usable), tried[-1])

    def of(self, judge: str, task: str | None) -> JudgeThresholds:
        """What a judge asks in a run of a task; None: of no task that is known.

        Raises:
            UnknownNameError: the judge was not calibrated.
        """
        if judge not in self.scores.judges:
            raise UnknownNameError("judge of the calibration", judge, self.scores.judges)
        return JudgeThresholds(self, judge, self.fit(task))


@dataclass(frozen=True, slots=True)
class JudgeThresholds:
    """The thresholds of one judge in one run."""

    table: CalibrationTable
    judge: str
    fit: Fit

    def threshold(self, skill: str, own: float) -> Threshold:
        """Where the judge draws the line before a skill.

        Args:
            skill: of the subtask that is judged.
            own: its threshold where there is no other.
        """
        level = f"{self.table.level:g} false alarms per run"
        line = self._line(skill)
        if line is None:
            why = f"no good run has {self.judge} judged before {skill}"
            return Threshold(own, Calibration.UNCALIBRATED, f"uncalibrated: {why}")
        if not self.fit.usable or line.threshold is None:
            more = max(1, self.fit.needed(self.table.level) - self.fit.runs)
            why = f"{self.fit} bound nothing at {level}; {more} more are needed"
            return Threshold(own, Calibration.UNCALIBRATED, f"uncalibrated: {why}")
        return Threshold(line.threshold, Calibration.CALIBRATED, f"at most {level} by {self.fit}")

    def p_value(self, skill: str, score: float) -> float | None:
        """How rare a score this low is in good runs, anywhere in such a part of one."""
        line = self._line(skill)
        return None if line is None else conformal.p_value(line.extremes, score)

    def _line(self, skill: str) -> Line | None:
        return self.fit.line(self.judge, part_of(skill, self.table.parts, self.table.irreversible))


def _fit(scores: Scores, task: str | None, divided: bool, level: float) -> Fit:
    extremes = scores.matrix(task)
    shares = [c.share for c in scores.columns]
    if not len(extremes):
        raise InputError(f"no good run of {task or 'any task'} to calibrate with")
    found = joint.thresholds(extremes, shares, level)
    lines = tuple(
        Line(
            column,
            found[i],
            int((extremes[:, i] < NOT_JUDGED).sum()),
            joint.smallest_level(extremes, shares, i),
            tuple(extremes[:, i].tolist()),
        )
        for i, column in enumerate(scores.columns)
    )
    return Fit(task, divided, len(extremes), level, lines)
