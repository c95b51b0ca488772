"""Curves over all thresholds with their bands: detection in time, and risk, against false alarms.

Calls: `judgements` → here → `sweep`. Bands are 95 % intervals from the first draws of the
bootstrap, at each place for itself.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from forestall.statistics.intervals import Floats, bands, divided
from forestall.statistics.sweep import Line, Sample, best_at, cumulated, sample
from forestall.statistics.watches import ALL

DRAWS = 400
"""Of a band."""

GRID = tuple(k / 40 for k in range(41))
"""False-alarm rates at which a band is given."""

STEPS = 60
"""Thresholds of a risk curve at most."""


def roc_points(of: Sample) -> list[tuple[float, float, float | None]]:
    """(false-alarm rate, detection rate, score) with an alarm at every run up to that score.

    Begins at (0, 0, None) and ends where no higher threshold raises more alarms, which lies short
    of (1, 1) when some runs have no score at all.
    """
    if not of.complete:
        return []
    hits, alarms = cumulated(of, np.ones((1, len(of.score))))
    levels = np.unique(of.score[of.counted])
    points: list[tuple[float, float, float | None]] = [(0.0, 0.0, None)]
    for level, hit, alarm in zip(levels, hits[0], alarms[0], strict=True):
        if np.isfinite(level):
            points.append((float(alarm / alarms[0, -1]), float(hit / hits[0, -1]), float(level)))
    return points


def roc(line: Line, negatives: str, failing: str, in_time: bool) -> list[dict[str, Any]]:
    """`roc_points` as plain data."""
    found = roc_points(sample(line, negatives, failing, in_time))
    return [
        {"false_alarm_rate": false, "detection_rate": detected, "score": score}
        for false, detected, score in found
    ]


def roc_band(line: Line, failing: str) -> list[dict[str, Any]]:
    """Detection in time at the false-alarm rates of `GRID`, with its band."""
    of = sample(line, ALL, failing, in_time=True)
    if not of.complete:
        return []
    hits, alarms = cumulated(of, of.clusters.weights[:DRAWS])
    whole = cumulated(of, np.ones((1, len(of.score))))
    found = []
    for rate in GRID:
        low, high = _band(best_at(hits, alarms, rate))
        value = float(best_at(*whole, rate)[0])
        found.append({"at": rate, "value": value, "low": low, "high": high})
    return found


def risk(line: Line) -> list[dict[str, Any]]:
    """What is left to risk, against false alarms per hour of robot time, as the threshold rises.

    A run fails if it fails unwatched and there is no alarm in time; likewise it does harm that
    cannot be undone. Shares are of all runs that the judge watched. False alarms are those in runs
    that do not fail. Begins without any alarm.
    """
    of = line.of
    seen, calm = line.seen_by, ~of.failing
    if not seen.any() or not (seen & calm).any():
        return []
    harmed = of.where(lambda r: bool(r.harmed))
    score = np.where(of.timely, line.score, np.inf)
    lowest = np.full(len(of), np.inf)
    np.minimum.at(lowest, of.run, score)
    counted = seen[of.run] & np.isfinite(line.score)
    levels = _levels(line.score[counted])
    alarms = np.stack(
        [of.per_run((line.score <= level) & calm[of.run]) * seen for level in levels], axis=1
    )
    missed = lowest[:, None] > levels
    hours = (of.hours * calm * seen)[:, None]
    weights = np.vstack([np.ones((1, len(of))), of.clusters.weights[:DRAWS]])
    per_hour = divided(weights @ alarms, weights @ hours)
    lost, hurt = (
        divided(weights @ (missed * (kind & seen)[:, None]), weights @ seen[:, None].astype(float))
        for kind in (of.failing, harmed & of.failing)
    )
    found = []
    for k, level in enumerate(levels):
        point: dict[str, Any] = {"score": float(level) if np.isfinite(level) else None}
        for name, values in (("per_hour", per_hour), ("failed", lost), ("harmed", hurt)):
            low, high = _band(values[1:, k])
            point |= {name: float(values[0, k]), f"{name}_low": low, f"{name}_high": high}
        found.append(point)
    return found


def _levels(scores: Floats) -> Floats:
    """-inf and at most `STEPS` scores, evenly by how many lie below."""
    known = np.unique(scores)
    if len(known) > STEPS:
        known = np.unique(np.quantile(scores, np.linspace(0, 1, STEPS), method="lower"))
    return np.concatenate([[-np.inf], known])


def _band(drawn: Floats) -> tuple[float | None, float | None]:
    return bands(drawn[:, None])[0] or (None, None)
