"""`bench detection --data`: the judges on runs that somebody else recorded.

Called by the command line; calls `assembly.recorded`, the judges and the table of `third_party`.
Each run is judged by each judge alone with the other good runs of its task, and with those of a
memory where one is given. Nothing stops at an alarm. A failure in what was carried out (a drop, a
skill that did nothing) shows only before the step after it, so that alarms are counted until the
step that the label names, until the one after it, and in the whole run.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import groupby
from typing import Any

from forestall.assembly.recorded import Opened, SeenRun
from forestall.domain.model import Domain
from forestall.errors import InputError, UnknownNameError
from forestall.experiments.conduct import Progress
from forestall.experiments.third_party import panel_of, said_of
from forestall.experiments.third_party_rows import Judged, Knowledge, Row, rows
from forestall.statistics.intervals import Metric
from forestall.strategies.judges import Judge
from forestall.tasks.files import load_task
from forestall.types.demonstration import Demonstration
from forestall.types.recorded import ReadReport
from forestall.types.task import Goal

OWN, WITH_MEMORY = "its task", "its task and the memory"


@dataclass(frozen=True, slots=True)
class JudgedRun:
    """What the judges said of a run, and at which step it failed (from 0, None: it did not)."""

    judged: Judged
    fails: int | None

    def until(self, more: int | None) -> Judged:
        """What was said until so many steps after the failing one; None: all of it."""
        if self.fails is None or more is None:
            return self.judged
        return replace(self.judged, said=self.judged.said[: self.fails + more + 1])


@dataclass(frozen=True, slots=True)
class Line:
    """One judge: alarms in good runs, and in failing ones by when."""

    judge: str
    false_alarms: Metric
    at_step: Metric
    by_next: Metric
    ever: Metric

    def to_json(self) -> dict[str, Any]:
        """Plain data."""
        return {
            "judge": self.judge,
            "false_alarms": self.false_alarms.to_json(),
            "by_the_failing_step": self.at_step.to_json(),
            "by_the_step_after": self.by_next.to_json(),
            "in_the_whole_run": self.ever.to_json(),
        }


def judge_recorded(
    opened: Opened,
    memory: Sequence[Demonstration],
    report: ReadReport,
    reading: Progress,
    judging: Progress,
) -> list[JudgedRun]:
    """Judge every run of a data set; the graphs of one task are in memory at a time.

    Args:
        opened: the data set.
        memory: further demonstrations, used for the tasks that they are of.
        report: told what of it could be read.
        reading: told how far reading is.
        judging: told how far judging is.

    Raises:
        InputError: nothing of it could be read.
    """
    found: list[JudgedRun] = []
    seen = opened.seen(report, reading)
    for task, several in groupby(seen, lambda s: s.run.task):
        runs = list(several)
        given = [d for d in memory if d.task == task]
        goal = _goal(task, opened.domain)
        known = Knowledge(opened.domain.name, WITH_MEMORY if memory else OWN)
        shared: dict[str, Judge] | None = None
        for each in runs:
            run = each.run
            judging(len(found), len(opened.data), run.name)
            if each.good or shared is None:
                panel = panel_of([*_shown(runs, each), *given], opened.domain)
                shared = shared if each.good else panel
            else:
                panel = shared
            said = said_of(run, panel, opened.domain.skills, ahead=True, goal=goal)
            judged = Judged(run.name, run.program, run.change, known, said)
            found.append(JudgedRun(judged, each.recorded.fails))
    if not found:
        why = f": {report.unread[0].name}: {report.unread[0].why}" if report.unread else ""
        raise InputError(f"no run of {opened.data.name} can be judged{why}")
    return found


def lines_of(judged: Sequence[JudgedRun]) -> list[Line]:
    """The table: shares with 95 % intervals, those of failing runs drawn by task.

    Of one task alone its runs are taken for independent.
    """
    tables: list[list[Row]] = [
        rows(_in_units([j.until(more) for j in judged])) for more in (0, 1, None)
    ]
    return [
        Line(at.judge, at.false_alarms, at.detected, after.detected, ever.detected)
        for at, after, ever in zip(*tables, strict=True)
    ]


def _in_units(judged: Sequence[Judged]) -> list[Judged]:
    """Runs with what they are drawn by as their program."""
    several = len({j.program for j in judged if j.change}) > 1
    return [replace(j, program=j.program if several else j.run) for j in judged]


def _shown(runs: Sequence[SeenRun], judged: SeenRun) -> list[Demonstration]:
    """The good runs of a task without the one that is judged."""
    return [s.run.demonstration() for s in runs if s.good and s is not judged]


def _goal(task: str, domain: Domain) -> Goal:
    """That of a shipped task of the name; else the plan is only to run."""
    try:
        return load_task(task, domain).task.goal
    except UnknownNameError:
        return Goal(task)
