"""What every judge of the watched runs of one profile is worth, by name.

Calls: `profile` → here → `metrics`, `sweep`, `curves`.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from typing import Any

import numpy as np

from forestall.statistics.curves import risk, roc, roc_band
from forestall.statistics.intervals import Metric, Ratio, measured
from forestall.statistics.judges import (
    PRIMARY,
    Together,
    demonstrations_of,
    is_variant,
    suffixes,
    thresholds_of,
    together,
)
from forestall.statistics.metrics import (
    Alarms,
    asked_together,
    at_thresholds,
    by_rule,
    confirmed,
    point_metrics,
    trivial,
)
from forestall.statistics.rows import PLAIN
from forestall.statistics.sweep import NEGATIVES, Line, sweep_metrics
from forestall.statistics.watches import ALL, Watches

Metrics = dict[str, Metric]


def judgements(of: Watches, failing: str) -> dict[str, Metrics]:
    """Judges, two together, with reasoning, and trivial ones on failing runs of a set, or `ALL`."""
    found: dict[str, Metrics] = {}
    for name in of.names:
        negatives = (ALL,) if is_variant(name) else NEGATIVES
        metrics = sweep_metrics(Line.by(of, name), failing, negatives)
        for suffix, thresholds in _suffixes(name).items():
            point = point_metrics(at_thresholds(of, name, thresholds), failing)
            metrics |= {f"{metric}{suffix}": value for metric, value in point.items()}
        found[name] = metrics
    for pair in together(of.names):
        metrics = sweep_metrics(Line.by(of, pair), failing, (ALL,))
        found[pair.name] = metrics | point_metrics(asked_together(of, pair), failing)
    for name, alarms in single_points(of).items():
        found[name] = point_metrics(alarms, failing)
    return found


def default_alarms(of: Watches) -> dict[str, Alarms]:
    """Every judge at its own threshold, named with it where it has several."""
    found = {}
    for name in of.names:
        own = thresholds_of(name)
        found[name if len(own) == 1 else f"{name}@{own[0]:.2f}"] = at_thresholds(of, name)
    return found | {p.name: asked_together(of, p) for p in together(of.names)} | single_points(of)


def single_points(of: Watches) -> dict[str, Alarms]:
    """Judges with a single operating point: with reasoning, and the trivial ones."""
    if not len(of):
        return {}
    name, threshold = primary(of)
    found: dict[str, Alarms] = {}
    if any(j.confirmed or j.cause for j in of.judged):
        found[f"{name} + reasoning"] = by_rule(of, confirmed, (name,))
    like = at_thresholds(of, name, (threshold,)) if name in of.names else None
    none = Alarms(of, np.zeros((1, len(of.judged)), bool), np.ones(len(of), bool))
    return found | trivial(of, none if like is None else like)


def primary(of: Watches) -> tuple[str, float]:
    """The judge that decided in the watched runs, and its threshold."""
    counted = Counter((r.detector, r.threshold) for r in of.rows if r.detector in of.names)
    if not counted:
        return PRIMARY, thresholds_of(PRIMARY)[0]
    return min(counted, key=lambda pair: (-counted[pair], pair))


def curves_of(of: Watches, failing: str) -> dict[str, dict[str, Any]]:
    """Judge → its ROC as the paper counts and in time, the latter's band, and risk.

    Of judges with another number of demonstrations, none.
    """
    judges: list[str | Together] = [n for n in of.names if not is_variant(n)]
    found = {}
    for judge in [*judges, *together(of.names)]:
        line = Line.by(of, judge)
        found[judge if isinstance(judge, str) else judge.name] = {
            ALL: roc(line, ALL, failing, False),
            "in_time": roc(line, ALL, failing, True),
            "band": roc_band(line, failing),
            "risk": risk(line),
        }
    return found


def by_demonstrations(of: Watches, found: Mapping[str, Metrics]) -> dict[str, list[dict[str, Any]]]:
    """Judge → what it is worth with each number of demonstrations, from the fewest on.

    Only of judges that were asked with several. One whose name says no number has as many as the
    runs that it watched.
    """
    told = Counter(r.demonstrations for r in of.rows)
    usual = min(told, key=lambda d: (-told[d], d)) if told else PLAIN
    plain = int(first) if (first := usual.split()[0]).isdigit() else int(PLAIN)
    curves: dict[str, dict[int, dict[str, Any]]] = {}
    for name in of.names:
        judge, count = demonstrations_of(name, plain)
        metrics = found[name]
        end = next(iter(suffixes(name)))
        points = curves.setdefault(judge, {})
        if count in points and name != judge:  # the same, asked with as many as there are
            continue
        points[count] = {
            "judge": name,
            "demonstrations": count,
            "auroc_in_time": metrics[f"auroc_in_time_{ALL}"],
            "in_time": metrics[f"in_time{end}"],
            "false_alarms_per_boundary": metrics[f"false_alarms_per_boundary_{ALL}" + end],
        }
    return {
        judge: [points[count] for count in sorted(points)]
        for judge, points in curves.items()
        if len(points) > 1
    }


def constancy(of: Watches) -> dict[str, Metric]:
    """Judge → share of faultless boundaries that it judged with a score of exactly 1."""
    ratios = {}
    for name, line in of.scores.items():
        judged = of.faultless & ~np.isnan(line)
        ratios[name] = Ratio(of.per_run(judged & (line == 1.0)), of.per_run(judged))
    return measured(ratios, of.clusters)


def not_judged(of: Watches) -> dict[str, Metric]:
    """Judge → share of the boundaries of runs that it watched at which it had nothing to say."""
    ratios = {}
    for name, line in of.scores.items():
        there = of.seen_by[name][of.run]
        ratios[name] = Ratio(of.per_run(there & np.isnan(line)), of.per_run(there))
    return measured(ratios, of.clusters)


def unforeseeable(of: Watches) -> dict[str, Metric]:
    """Share of the failures that can only be known when the harm is done, by set and of all."""
    late = (of.failing & ~of.foreseeable).astype(float)
    sets = sorted({r.set for r, bad in zip(of.rows, of.failing, strict=True) if bad})
    ratios = {
        name: Ratio(late * of.of_set(name), of.of_set(name).astype(float)) for name in (ALL, *sets)
    }
    return measured(ratios, of.clusters)


def _suffixes(name: str) -> dict[str, tuple[float, ...]]:
    found = suffixes(name)
    return dict(list(found.items())[:1]) if is_variant(name) else found
