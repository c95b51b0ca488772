"""What the figures of both households show, taken from an experiment's summary.

Calls: `experiment_view.py` → here; gives the plain values that `household_figures.py` draws. Every
panel is of one household; what the summary does not hold is left out.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from forestall.report.figure_data import Names, Summary
from forestall.report.figure_values import Banded, Dot, Estimate

PANELS = ("kind", "honest")
CHOSEN = (
    *("scene-graph", "plan-check", "preconditions", "scene-graph or plan-check"),
    *("scene-graph, whole scene", "plan-check, wrong"),
)
"""Judges whose curves are shown, as far as they are there."""

STRATEGIES = (
    *("none", "retry-once", "post-hoc", "online", "online-scene", "plan-check", "proactive"),
)
LEARNING = ("scene-graph", "preconditions")

Panel = tuple[str, tuple[Banded, ...]]
Point = tuple[float, float, float | None, float | None]


def in_time(summary: Summary, names: Names) -> tuple[Panel, ...]:
    """Detection in time against false alarms, with bands."""
    return _panels(summary, lambda content: _curves(content, names))


def risk(summary: Summary, names: Names) -> tuple[Panel, ...]:
    """Runs that fail without an alarm in time against alarms per hour."""

    def of(content: Summary) -> tuple[Banded, ...]:
        curves, found = _of_set(content), []
        for judge in CHOSEN:
            points = [p for p in curves.get(judge, {}).get("risk", ()) if _measured(p)]
            line = tuple(
                (p["per_hour"], p["failed"], p["failed_low"], p["failed_high"]) for p in points
            )
            if line:
                at = 0.9 if judge.startswith(CHOSEN[0]) else 0.5
                raised = [k for k, p in enumerate(points) if p["score"] is None or p["score"] < at]
                found.append(_shown(names(judge), line, line[raised[-1]], _single(content, judge)))
        return tuple(found)

    return _panels(summary, of)


def demonstrations(
    summary: Summary, names: Names
) -> tuple[tuple[str, str, tuple[Banded, ...]], ...]:
    """(title, what, lines) by number of demonstrations: area in time, and false alarms."""
    found = []
    measures = (
        ("auroc_in_time", "area under the curve, in time"),
        ("false_alarms_per_boundary", "false alarms per faultless boundary"),
    )
    for profile in PANELS:
        curves = summary.get("profiles", {}).get(profile, {}).get("demonstrations", {})
        for measure, words in measures:
            lines = tuple(
                Banded(names(judge), points)
                for judge in LEARNING
                if len(points := _by_count(curves.get(judge, ()), measure)) > 1
            )
            if lines:
                found.append((profile, words, lines))
    return tuple(found)


def strategies(summary: Summary, names: Names) -> tuple[tuple[str, tuple[Dot, ...]], ...]:
    """Success by strategy on the cases that all of them were run on, one panel a household."""
    contents = summary.get("profiles", {})
    shared = {p: contents[p]["shared"] for p in PANELS if p in contents}
    shared = {p: s for p, s in shared.items() if s["cases"]}
    known = {name for s in shared.values() for name in s["strategies"]}
    simple = [s for s in STRATEGIES if s in known]
    models = [
        f"{s}, {model} model"
        for s in ("plan-check", "proactive")
        for model in ("coarse", "wrong")
        if f"{s}, {model} model" in known
    ]
    return tuple(
        (
            f"{profile}, {found['cases']} cases",
            tuple(
                Dot(names(s), _estimate(found["strategies"].get(s, {}).get("success")))
                for s in (*simple, *models)
            ),
        )
        for profile, found in shared.items()
    )


def _panels(summary: Summary, of: Any) -> tuple[Panel, ...]:
    contents = summary.get("profiles", {})
    made = [(p, of(contents[p])) for p in PANELS if p in contents]
    return tuple((profile, lines) for profile, lines in made if lines)


def _curves(content: Summary, names: Names) -> tuple[Banded, ...]:
    found, curves = [], _of_set(content)
    for judge in CHOSEN:
        if band := curves.get(judge, {}).get("band"):
            metrics = content["detectors"][judge]
            at = "@0.90" if "in_time@0.90" in metrics else ""
            hit, false = (metrics[f"{m}{at}"] for m in ("in_time", "false_alarms_per_run_all"))
            area = metrics["auroc_in_time_all"]["value"]
            label = names(judge) + ("" if area is None else f"  (area {area:.2f})")
            if hit["value"] is None or false["value"] is None:
                continue
            points = tuple((p["at"], p["value"], p["low"], p["high"]) for p in band)
            mark = (false["value"], hit["value"], hit["low"], hit["high"])
            found.append(_shown(label, points, mark, _single(content, judge)))
    return tuple(found)


def _shown(label: str, points: tuple[Point, ...], mark: Point, single: bool) -> Banded:
    """A line with the threshold in use, or that alone where a judge says yes or no."""
    x, y, low, high = mark
    if not single:
        return Banded(label, points, steps=True, mark=(x, y))
    span = None if low is None or high is None else (low, high)
    return Banded(label, (), mark=(x, y), span=span)


def _single(content: Summary, judge: str) -> bool:
    return "in_time@0.90" not in content["detectors"][judge]


def _measured(point: Mapping[str, Any]) -> bool:
    return point["per_hour"] is not None and point["failed"] is not None


def _of_set(content: Summary) -> Mapping[str, Any]:
    found: Mapping[str, Any] = content.get("curves", {}).get(content.get("detection_set"), {})
    return found


def _by_count(points: Any, measure: str) -> tuple[Point, ...]:
    return tuple(
        (float(p["demonstrations"]), m["value"], m["low"], m["high"])
        for p in points
        if (m := p[measure])["value"] is not None
    )


def _estimate(metric: Mapping[str, Any] | None) -> Estimate:
    if metric is None:
        return Estimate(None)
    return Estimate(metric["value"], metric["low"], metric["high"], metric["n"])
