"""Every figure of an experiment with its title and what there is to see.

Called by `experiment_view.py`; calls `figure_data.py`, `figure_households.py` and the figures.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from forestall.report import figure_data as data
from forestall.report import figure_households as households
from forestall.report import figures, household_figures, run_figures

if TYPE_CHECKING:
    from forestall.statistics.rows import EpisodeRow


@dataclass(frozen=True, slots=True)
class FigureView:
    """One figure.

    Args:
        name: of its file, without ending.
        title: above it.
        caption: what there is to see.
        svg: the file; None where there is nothing to draw.
        missing: why there is nothing.
    """

    name: str
    title: str
    caption: str
    svg: bytes | None
    missing: str = ""


def household_figures_of(
    summary: Mapping[str, Any], names: Mapping[str, str]
) -> tuple[FigureView, ...]:
    """Figures in which the households stand side by side, also those without anything."""

    def name(of: str) -> str:
        return names.get(of, of)

    curves, risk = households.in_time(summary, name), households.risk(summary, name)
    learned, acted = households.demonstrations(summary, name), households.strategies(summary, name)
    return (
        FigureView(
            "households",
            "Success by strategy in each household",
            "On the cases that all of the strategies were run on, with the 95 % interval. What a "
            "strategy gains over “retry-once” is what it adds to a robot that merely tries again.",
            run_figures.dots(acted, "success") if acted else None,
            "there is no case that all strategies were run on",
        ),
        FigureView(
            "in-time",
            "Detection in time against false alarms",
            "Share of the failures that can be known before the harm is done with an alarm by "
            "then, against share of runs without a failure with any alarm, over all thresholds; "
            "marks are at the threshold in use. Bands are 95 % intervals over rooms and "
            "scenarios, at each place for itself.",
            household_figures.in_time(curves) if curves else None,
            "failing runs or runs without a failure lack",
        ),
        FigureView(
            "risk",
            "What is left to risk",
            "Share of all runs that fail and get no alarm in time, against false alarms per hour "
            "of robot time, as the threshold rises from left to right. A curve lower down buys "
            "more for as many false alarms. An alarm in time is taken to save a run.",
            household_figures.risk(risk) if risk else None,
            "runs without a failure lack",
        ),
        FigureView(
            "demonstrations",
            "What demonstrations are worth",
            "The area under the curve in time, and false alarms at boundaries at which the truth "
            "has nothing against going on, by number of demonstrations, with 95 % intervals.",
            household_figures.demonstrations(learned) if learned else None,
            "no judge was asked with several numbers of demonstrations",
        ),
    )


def figures_of(
    rows: Sequence[EpisodeRow], summary: Mapping[str, Any], names: Mapping[str, str]
) -> tuple[FigureView, ...]:
    """All figures, also those for which there is nothing."""

    def name(of: str) -> str:
        return names.get(of, of)

    no_watch = "no run was watched by detectors"
    return (
        _success(summary, name),
        _timelines(rows, name),
        _roc(summary, name, no_watch),
        _by_kind(summary, name, no_watch),
        _knowability(summary, name, no_watch),
        _scores(rows, summary, name, no_watch),
        _time(summary, name),
    )


def _success(summary: Mapping[str, Any], name: data.Names) -> FigureView:
    panels = data.success(summary, name)
    return FigureView(
        "success",
        "Success by strategy",
        "Share of runs that reached the goal under the strict check, with the exact 95 % interval. "
        "On the two failing sets further right is better; on undisturbed and harmless runs, what a "
        "strategy lies below “none” is the harm that its false alarms do. Hollow: the paper’s "
        "value, measured on other scenes.",
        run_figures.dots(panels, "success") if panels else None,
        "no strategy was run",
    )


def _timelines(rows: Sequence[EpisodeRow], name: data.Names) -> FigureView:
    found = data.timelines(rows, name)
    caption, svg = "", None
    if found is not None:
        row, lanes = found
        svg = run_figures.timelines(lanes)
        caption = (
            f"{row.task}, {row.scenario or 'undisturbed'}, seed {row.seed}: the same start under "
            "each strategy. One that acts ahead raises its alarm left of the cross; one that "
            "checks afterwards replans when the harm is done. The case is chosen to show that "
            "difference, so it says nothing of how often it occurs."
        )
    return FigureView(
        *("timelines", "One failure, every strategy", caption, svg),
        "no failing case was run under two strategies",
    )


def _roc(summary: Mapping[str, Any], name: data.Names, missing: str) -> FigureView:
    panels = data.roc(summary, name)
    return FigureView(
        "roc",
        "Detection against false alarms",
        "Share of failing runs with an alarm against share of undisturbed and harmless runs with "
        "one, over all thresholds. Filled marks: thresholds 0.90, 0.85 and 0.80, written out for "
        "the first detector. Hollow: detectors without a score. A curve near the dotted line is no "
        "better than chance; a detection rate alone, without its place from left to right, means "
        "little.",
        figures.roc(panels) if panels else None,
        missing if not summary.get("detectors") else "failing runs or runs without a failure lack",
    )


def _by_kind(summary: Mapping[str, Any], name: data.Names, missing: str) -> FigureView:
    kinds, series = data.by_kind(summary, name)
    return FigureView(
        "kinds",
        "Detection by kind of failure",
        "Share of runs of each kind (how many in brackets) with an alarm at threshold 0.90, with "
        "the exact 95 % interval; few runs make wide intervals. False alarms are not in this "
        "figure: compare rows, and see the figure above for columns.",
        figures.by_kind(kinds, series) if kinds and series else None,
        missing,
    )


def _knowability(summary: Mapping[str, Any], name: data.Names, missing: str) -> FigureView:
    groups = data.knowability(summary, name)
    return FigureView(
        "knowability",
        "When the alarm comes",
        "Failing runs by through what the failure can be known, at threshold 0.90. In time: from "
        "the moment at which it can be known until the step that does the harm. An alarm that came "
        "before anything was wrong counts as a detection in the paper’s rate and is luck.",
        figures.knowability(groups) if groups else None,
        missing,
    )


def _scores(
    rows: Sequence[EpisodeRow], summary: Mapping[str, Any], name: data.Names, missing: str
) -> FigureView:
    found = data.distributions(rows, summary, name)
    return FigureView(
        "scores",
        "How low scores fall",
        "The lowest score of each run, cumulated. A detector tells failing runs apart where the "
        "solid line runs left of the dashed ones; what lies left of the upright line raises an "
        "alarm at threshold 0.90. Scales differ between detectors.",
        figures.scores(found) if found else None,
        missing,
    )


def _time(summary: Mapping[str, Any], name: data.Names) -> FigureView:
    of, spent = data.time_spent(summary, name)
    return FigureView(
        "time",
        "Time",
        f"Mean seconds of a run on the {of} set, successful or not: what the robot took and what "
        "judging and planning took on this machine. A strategy that fails early is quick. Hollow: "
        "the paper’s total, with other scenes, durations and a remote language model.",
        run_figures.time_spent(spent) if spent else None,
        "no strategy was run",
    )
