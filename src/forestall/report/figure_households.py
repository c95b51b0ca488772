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


def in_time(summary: Summary, names: Names) -> tuple[Panel, ...]:
    """Detection in time against false alarms, with bands."""
    return _panels(summary, lambda content: _curves(content, names))


def risk(summary: Summary, names: Names) -> tuple[Panel, ...]:
    """Runs that fail without an alarm in time against alarms per hour."""

    def of(content: Summary) -> tuple[Banded, ...]:
        curves = _of_set(content)
        return tuple(
            Banded(
                names(judge),
                tuple(
                    (p["per_hour"], p["failed"], p["failed_low"], p["failed_high"])
                    for p in curves[judge]["risk"]
                    if p["per_hour"] is not None and p["failed"] is not None
                ),
                steps=True,
            )
            for judge in CHOSEN
            if curves.get(judge, {}).get("risk")
        )

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
            hit, false = (
                metrics[f"{m}{at}"]["value"] for m in ("in_time", "false_alarms_per_run_all")
            )
            mark = None if hit is None or false is None else (false, hit)
            points = tuple((p["at"], p["value"], p["low"], p["high"]) for p in band)
            area = metrics["auroc_in_time_all"]["value"]
            label = names(judge) + ("" if area is None else f"  (area {area:.2f})")
            found.append(Banded(label, points, True, mark))
    return tuple(found)


def _of_set(content: Summary) -> Mapping[str, Any]:
    found: Mapping[str, Any] = content.get("curves", {}).get(content.get("detection_set"), {})
    return found


def _by_count(
    points: Any, measure: str
) -> tuple[tuple[float, float, float | None, float | None], ...]:
    return tuple(
        (float(p["demonstrations"]), m["value"], m["low"], m["high"])
        for p in points
        if (m := p[measure])["value"] is not None
    )


def _estimate(metric: Mapping[str, Any] | None) -> Estimate:
    if metric is None:
        return Estimate(None)
    return Estimate(metric["value"], metric["low"], metric["high"], metric["n"])
