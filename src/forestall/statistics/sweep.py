"""Detectors without a threshold: ROC, AUROC, average precision, detection at equal false alarms.

Calls: `summary`, `orderings` → here → `intervals`. The score of a run is the lowest among its
boundaries, since that is where a falling threshold raises the last alarm; a run without any score
is the least suspicious. Negatives are undisturbed runs, or undisturbed and harmless ones.
"""

from __future__ import annotations

from collections.abc import Hashable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from forestall.statistics.cases import UNDISTURBED
from forestall.statistics.intervals import NOTHING, Floats, Metric, Statistic, bootstrap, divided
from forestall.statistics.metrics import (
    HARMLESS,
    PAPER_SET,
    boundaries,
    foreseeable,
    moments,
    scene_of,
    scores,
)
from forestall.statistics.rows import EpisodeRow

FALSE_ALARM_RATES = (0.01, 0.05, 0.10)

NEGATIVES = {UNDISTURBED: (UNDISTURBED,), "all": (UNDISTURBED, HARMLESS)}
"""Sets of runs in which every alarm is a false one, by the name that metrics end in."""

_ROUNDING = 1e-12


@dataclass(frozen=True, slots=True)
class Sample:
    """Scores of runs.

    Args:
        score: lowest of each run, +inf for one without score.
        failing: whether it is a failing one.
        scenes: of each run.
        unread: how many runs the detector did not watch.
    """

    score: Floats
    failing: NDArray[np.bool_]
    scenes: tuple[Hashable, ...]
    unread: int = 0

    @property
    def complete(self) -> bool:
        """Whether there are failing and other runs."""
        return bool(self.failing.any() and not self.failing.all())


def sample(
    rows: Sequence[EpisodeRow],
    detector: str,
    negatives: str = "all",
    failing: str = PAPER_SET,
    in_time: bool = False,
) -> Sample:
    """Scores of one detector on watched runs.

    Args:
        rows: watched runs.
        detector: its name.
        negatives: key of `NEGATIVES`.
        failing: set of the failing runs.
        in_time: only count foreseeable failures, and in them only boundaries from when the
            failure can be known up to the harm; other runs count whole.
    """
    score, labels, scenes, unread = [], [], [], 0
    for row in rows:
        bad = row.set == failing
        if not bad and row.set not in NEGATIVES[negatives]:
            continue
        if bad and in_time and not foreseeable(row):
            continue
        given = scores(row, detector)
        if given is None:
            unread += 1
            continue
        first, last = moments(row) if bad and in_time else (0, None)
        there = boundaries(row)
        inside = [
            v
            for k, v in given.items()
            if v is not None
            and first <= there[k].index
            and (last is None or there[k].index <= last)
        ]
        score.append(min(inside, default=np.inf))
        labels.append(bad)
        scenes.append(scene_of(row))
    return Sample(np.array(score, float), np.array(labels, bool), tuple(scenes), unread)


def auroc(of: Sample) -> Statistic:
    """Area under the ROC: how often a failing run has the lower score, a tie counting half."""
    bad, good = of.score[of.failing], of.score[~of.failing]
    above = (bad[:, None] < good[None, :]) + 0.5 * (bad[:, None] == good[None, :])

    def value(w: Floats) -> Floats:
        positive, negative = w[:, of.failing], w[:, ~of.failing]
        pairs = ((positive @ above) * negative).sum(axis=1)
        return divided(pairs, positive.sum(axis=1) * negative.sum(axis=1))

    return value


def average_precision(of: Sample) -> Statistic:
    """Sum over thresholds of (gain in recall) times precision."""

    def value(w: Floats) -> Floats:
        hits, alarms = _cumulated(of, w)
        gain = np.diff(hits, axis=1, prepend=0.0)
        precision = divided(hits, hits + alarms)
        total = (gain * np.nan_to_num(precision)).sum(axis=1)
        return divided(total, hits[:, -1])

    return value


def detection_at(of: Sample, rate: float) -> Statistic:
    """The largest detection rate of a threshold whose false-alarm rate does not exceed `rate`."""

    def value(w: Floats) -> Floats:
        hits, alarms = _cumulated(of, w)
        detected = divided(hits, hits[:, -1:])
        false = divided(alarms, alarms[:, -1:])
        best = np.where(false <= rate + _ROUNDING, detected, 0.0).max(axis=1)
        defined = (hits[:, -1] > 0) & (alarms[:, -1] > 0)
        return np.where(defined, best, np.nan)

    return value


def measured(statistic: Statistic, of: Sample) -> Metric:
    """A statistic of a sample with its interval, nothing where it lacks failing or other runs."""
    return bootstrap(statistic, of.scenes) if of.complete else NOTHING


def detected_at(of: Sample, rate: float) -> Metric:
    """`detection_at` with its interval."""
    if not of.complete:
        return NOTHING
    units = len({s for s, bad in zip(of.scenes, of.failing, strict=True) if bad})
    return bootstrap(detection_at(of, rate), of.scenes, units=units)


def sweep_metrics(
    rows: Sequence[EpisodeRow], detector: str, failing: str = PAPER_SET
) -> dict[str, Metric]:
    """Everything that needs no threshold, against each kind of negatives."""
    found: dict[str, Metric] = {}
    for name in NEGATIVES:
        of = sample(rows, detector, name, failing)
        timely = sample(rows, detector, name, failing, in_time=True)
        found[f"auroc_{name}"] = measured(auroc(of), of)
        found[f"average_precision_{name}"] = measured(average_precision(of), of)
        for rate in FALSE_ALARM_RATES:
            percent = f"fa{round(100 * rate):02d}_{name}"
            found[f"detection_{percent}"] = detected_at(of, rate)
            found[f"in_time_{percent}"] = detected_at(timely, rate)
    return found


def roc_points(of: Sample) -> list[tuple[float, float, float | None]]:
    """(false-alarm rate, detection rate, score) with an alarm at every run up to that score.

    Begins at (0, 0, None) and ends where no higher threshold raises more alarms, which lies short
    of (1, 1) when some runs have no score at all.
    """
    if not of.complete:
        return []
    points: list[tuple[float, float, float | None]] = [(0.0, 0.0, None)]
    good = ~of.failing
    for score in np.unique(of.score[np.isfinite(of.score)]):
        raised = of.score <= score
        points.append(
            (
                float((raised & good).sum() / good.sum()),
                float((raised & of.failing).sum() / of.failing.sum()),
                float(score),
            )
        )
    return points


def _cumulated(of: Sample, w: Floats) -> tuple[Floats, Floats]:
    """Weight of failing and of other runs up to each distinct score, (draws, scores) each."""
    rank = np.argsort(of.score, kind="stable")
    ascending, failing = of.score[rank], of.failing[rank]
    last = np.append(ascending[1:] != ascending[:-1], True)
    weight = w[:, rank]
    hits = np.cumsum(weight * failing, axis=1)
    alarms = np.cumsum(weight * ~failing, axis=1)
    return hits[:, last], alarms[:, last]
