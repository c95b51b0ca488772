"""Detection and false alarms against what a sensor gets wrong: `forestall bench robustness`.

A case of the experiment runner: watched runs of failing cases and undisturbed ones, each through a
perfect sensor and through one with a single error, at several strengths. Nobody steps in, so that
every sensor looks at the same scenes. Called by the command line; calls `conduct` for the runs, and
statistics and report for what people look at.
"""

from __future__ import annotations

import json
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from forestall.domain.model import Domain
from forestall.errors import FileFormatError, InputError, UnknownNameError
from forestall.experiments.folder import episodes_in
from forestall.experiments.runs import PROFILES, Choice, Run, in_turn, runs_for
from forestall.files import make_folder, replace_file
from forestall.report.robustness_figure import Line, Panel, robustness_figure
from forestall.statistics.cases import Case
from forestall.statistics.cells import Table, share
from forestall.statistics.intervals import NOTHING, Metric
from forestall.statistics.judges import PRIMARY
from forestall.statistics.metrics import at_thresholds, detection_rates
from forestall.statistics.rows import KIND, PERFECT, EpisodeRow
from forestall.statistics.watches import ALL, PAPER_SET, WATCH, Watches
from forestall.tasks.files import task_names

EXPERIMENT_KIND = "robustness"

SETS = (PAPER_SET, "undisturbed")
"""Where detection is counted, and false alarms."""

LIMIT = 10
"""Cases of each set when nothing is said."""

SUMMARY, TABLE, FIGURE = "summary.json", "robustness", "robustness.svg"

DETECTED, ANY_ALARM = "in_time", "fdr"
RUNS, BOUNDARIES = "false_alarms_per_run_undisturbed", "false_alarms_per_boundary_undisturbed"

_COLUMNS = (
    ("detected in time", DETECTED),
    ("failing runs with any alarm", ANY_ALARM),
    ("undisturbed runs with an alarm", RUNS),
    ("their boundaries with an alarm", BOUNDARIES),
)


@dataclass(frozen=True, slots=True)
class Disturbance:
    """One error at several strengths.

    Args:
        name: of it.
        sensors: what a run says of its sensor, at each strength.
        strengths: how people read them.
    """

    name: str
    sensors: tuple[str, ...]
    strengths: tuple[str, ...]

    @classmethod
    def of(cls, name: str, sensor: str, values: Sequence[float], said: str) -> Disturbance:
        """With a value in the place of {} in what is said of the sensor, and in words."""
        return cls(
            name,
            tuple(sensor.format(v) for v in values),
            tuple(said.format(f"{100 * v:g} %" if "share" in said else f"{v:g}") for v in values),
        )


DISTURBANCES = (
    Disturbance("camera", ("realsense", "kinect", "tof"), ("realsense", "kinect", "tof")),
    Disturbance.of("depth", "depth_noise={0}", (0.003, 0.006, 0.012), "{0} m at 1 m"),
    Disturbance.of("pose", "pose_cm={0},pose_deg={0}", (0.5, 1, 2), "{0} cm and degrees"),
    Disturbance.of("outline", "outline_px={0}", (1, 2, 4), "{0} px"),
    Disturbance.of("missed", "missed={0}", (0.05, 0.1, 0.25), "share {0}"),
    Disturbance.of("mislabelled", "mislabelled={0}", (0.02, 0.05, 0.1), "share {0}"),
    Disturbance("identities", ("identities=false",), ("none",)),
    Disturbance.of("small", "least_px={0}", (100, 300, 600), "under {0} px unseen"),
    Disturbance("realistic", ("realistic",), ("all of it",)),
)
"""Each alone, and the profile that has all of them."""


@dataclass(frozen=True, slots=True)
class Robustness:
    """Which episodes are wanted.

    Args:
        split: "development" or "test".
        limit: cases of each set, from all tasks in turn.
        disturbances: names; all by default.
        profile: of the household.
        tasks: only cases of these; all by default.
    """

    split: str = "development"
    limit: int = LIMIT
    disturbances: tuple[str, ...] = ()
    profile: str = KIND
    tasks: tuple[str, ...] = ()

    def chosen(self) -> tuple[Disturbance, ...]:
        """The disturbances that are wanted.

        Raises:
            UnknownNameError: no such disturbance.
        """
        known = {d.name: d for d in DISTURBANCES}
        for name in self.disturbances:
            if name not in known:
                raise UnknownNameError("disturbance", name, known)
        return tuple(d for d in DISTURBANCES if d.name in (self.disturbances or known))

    def runs(self) -> tuple[Run, ...]:
        """Every case through a perfect sensor, then through each other.

        Raises:
            InputError: a limit below 1.
            UnknownNameError: no such disturbance, profile, split or task.
        """
        if self.limit < 1:
            raise InputError(f"--limit {self.limit}: at least 1 case of each set is needed")
        for task in self.tasks:
            if task not in task_names():
                raise UnknownNameError("task", task, task_names())
        if self.profile not in PROFILES:
            raise UnknownNameError("profile of the household", self.profile, PROFILES)
        sensors = (PERFECT, *(s for d in self.chosen() for s in d.sensors))
        choice = Choice(
            "proactive", self.split, sets=SETS, strategies=(WATCH,), profiles=(self.profile,)
        )
        of_set: dict[str, dict[Case, Run]] = {}
        for run in runs_for(choice):
            if run.case.task in (self.tasks or task_names()):
                of_set.setdefault(run.case.set, {})[run.case] = run
        plain = [of[case] for of in of_set.values() for case in in_turn(list(of), self.limit)]
        return tuple(replace(run, sensor=sensor) for run in plain for sensor in sensors)

    def about(self, domain: Domain | None = None) -> dict[str, Any]:
        """What all its episodes have in common, with others of the same folder."""
        return {"split": self.split, "profile": self.profile}


@dataclass(frozen=True, slots=True)
class Point:
    """One strength of one disturbance, what a judge does with it, and how many runs broke off."""

    disturbance: str
    strength: str
    rates: dict[str, Metric]
    broken: int

    def to_json(self) -> dict[str, Any]:
        """Plain data."""
        rates = {name: metric.to_json() for name, metric in self.rates.items()}
        said = {"disturbance": self.disturbance, "strength": self.strength}
        return {**said, "rates": rates, "broken": self.broken}


def points(rows: Iterable[EpisodeRow], judge: str = PRIMARY) -> list[Point]:
    """What a judge does through each sensor that rows are of, the perfect one first.

    Raises:
        InputError: nobody of that name watched.
    """
    of_sensor: dict[str, list[EpisodeRow]] = {}
    for row in rows:
        of_sensor.setdefault(row.sensor, []).append(row)
    watched = {sensor: Watches.of(own) for sensor, own in of_sensor.items()}
    names = {name for of in watched.values() for name in of.names}
    if judge not in names:
        raise UnknownNameError("judge", judge, sorted(names))
    said = [(PERFECT, "nothing wrong", PERFECT)]
    said += [
        (d.name, strength, sensor)
        for d in DISTURBANCES
        for sensor, strength in zip(d.sensors, d.strengths, strict=True)
    ]
    return [
        Point(name, strength, _rates(watched[sensor], judge), _broken(watched[sensor]))
        for name, strength, sensor in said
        if sensor in watched
    ]


def _rates(of: Watches, judge: str) -> dict[str, Metric]:
    if judge not in of.names:
        return {name: NOTHING for _, name in _COLUMNS}
    found = detection_rates(at_thresholds(of, judge), of.of_set(ALL))
    return {name: found[name] for _, name in _COLUMNS}


def _broken(of: Watches) -> int:
    """Runs that did not come to their end: nothing was judged from there on."""
    return sum(bool(row.error) for row in of.rows)


def table(found: Sequence[Point], judge: str, about: str) -> Table:
    """Every strength of every disturbance, a line each."""
    rows = [
        (
            *(p.disturbance, p.strength),
            *(share(p.rates[n].to_json()) for _, n in _COLUMNS),
            str(p.broken),
        )
        for p in found
    ]
    header = ("disturbance", "strength", *(title for title, _ in _COLUMNS), "broke off")
    return Table(TABLE, f"Robustness of {judge}: {about}", header, tuple(rows))


def figure(found: Sequence[Point]) -> bytes:
    """Detection and false alarms over the strengths of each disturbance."""
    perfect = [p for p in found if p.disturbance == PERFECT]
    panels = []
    for name in dict.fromkeys(p.disturbance for p in found if p.disturbance != PERFECT):
        shown = [*perfect, *(p for p in found if p.disturbance == name)]
        ticks = tuple("0" if p.disturbance == PERFECT else p.strength for p in shown)
        lines = [
            Line(title, tuple((m.value, m.low, m.high) for m in (p.rates[key] for p in shown)))
            for title, key in (_COLUMNS[0], _COLUMNS[2])
        ]
        panels.append(Panel(name, ticks, tuple(lines)))
    return robustness_figure(panels)


def present(path: Path, judge: str = PRIMARY) -> Table:
    """Write summary, table and figure into a folder of results; nothing is run.

    Raises:
        FileFormatError: the folder holds no episode of this kind.
        InputError: nobody of that name watched.
    """
    folder = episodes_in(path, EXPERIMENT_KIND)
    about = folder.about()
    rows = [r for r in folder.rows().values() if r.strategy == WATCH]
    if not rows:
        raise FileFormatError(f"{path} holds no finished episode yet")
    found = points(rows, judge)
    made = table(found, judge, f"{about['split']} split, {about['profile']} household")
    data = {"judge": judge, **about, "points": [p.to_json() for p in found]}
    make_folder(path)
    replace_file(path / SUMMARY, (json.dumps(data, indent=1) + "\n").encode())
    replace_file(path / f"{TABLE}.md", made.markdown().encode())
    replace_file(path / f"{TABLE}.csv", made.csv().encode())
    replace_file(path / FIGURE, figure(found))
    return made


def without_sensor(kinds: Iterable[str]) -> None:
    """See that nothing is said of the sensor, which the experiment chooses.

    Raises:
        InputError: it is.
    """
    if "sensor" in kinds:
        raise InputError("bench robustness chooses the sensor of each run by itself: leave it out")
