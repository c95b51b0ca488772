"""Judges without a threshold: area under the curve, precision, detection at equal false alarms.

Calls: `judgements`, `curves`, `orderings` → here → `watches`, `intervals`. The score of a run is
the lowest among its boundaries, since that is where a falling threshold raises the last alarm; in
time, the lowest of a failing run from when its failure can be known up to the harm. A run without
any score is the least suspicious, and so is a boundary. Two judges that are asked together have the
lower of both scores (`or`) or the higher (`and`).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from forestall.statistics.intervals import (
    NOTHING,
    Bools,
    Clusters,
    Floats,
    Metric,
    Statistic,
    bootstrap,
    divided,
)
from forestall.statistics.judges import Together
from forestall.statistics.watches import ALL, PAPER_SET, Watches

FALSE_ALARM_RATES = (0.01, 0.05, 0.10)

NEGATIVES = ("undisturbed", ALL)
"""Runs in which every alarm is a false one, by the name that metrics end in."""

_ROUNDING = 1e-12


@dataclass(frozen=True, slots=True, eq=False)
class Line:
    """What a judge, or two together, say of watched runs.

    Args:
        of: the runs.
        score: (boundaries,), +inf where nothing was judged.
        seen_by: (runs,) which of them it watched.
    """

    of: Watches
    score: Floats
    seen_by: Bools

    @classmethod
    def by(cls, of: Watches, judge: str | Together) -> Line:
        """Of a judge, or of two."""
        if isinstance(judge, str):
            return cls(of, np.nan_to_num(of.scores[judge], nan=np.inf), of.seen_by[judge])
        one, other = (cls.by(of, name) for name in (judge.first, judge.second))
        meet = np.maximum if judge.both else np.minimum
        return cls(of, meet(one.score, other.score), one.seen_by & other.seen_by)


@dataclass(frozen=True, slots=True, eq=False)
class Sample:
    """Scores of runs.

    Args:
        score: lowest of each run, +inf for one without score.
        failing: whether it is a failing one.
        counted: (runs,) whether it counts here.
        clusters: of the runs.
    """

    score: Floats
    failing: Bools
    counted: Bools
    clusters: Clusters

    @property
    def complete(self) -> bool:
        """Whether there are failing and other runs."""
        return bool(self.bad.any() and self.good.any())

    @property
    def bad(self) -> Bools:
        """Failing runs that count."""
        return self.failing & self.counted

    @property
    def good(self) -> Bools:
        """Other runs that count."""
        return ~self.failing & self.counted


def sample(
    line: Line, negatives: str = ALL, failing: str = PAPER_SET, in_time: bool = False
) -> Sample:
    """Scores of one judge on watched runs.

    Args:
        line: of the judge.
        negatives: one of `NEGATIVES`.
        failing: set of the failing runs, or `ALL`.
        in_time: only count foreseeable failures, and in them only boundaries from when the
            failure can be known up to the harm; other runs count whole.
    """
    of = line.of
    bad = of.of_set(failing)
    good = ~of.failing if negatives == ALL else of.undisturbed
    score = line.score
    if in_time:
        bad = bad & of.foreseeable
        score = np.where(of.timely | ~of.failing[of.run], score, np.inf)
    lowest = np.full(len(of), np.inf)
    np.minimum.at(lowest, of.run, score)
    return Sample(lowest, of.failing, (bad | good) & line.seen_by, of.clusters)


def auroc(of: Sample) -> Statistic:
    """Area under the ROC: how often a failing run has the lower score, a tie counting half."""

    def value(w: Floats) -> Floats:
        hits, alarms = cumulated(of, w)
        false = np.diff(alarms, axis=1, prepend=0.0)
        lower = hits - 0.5 * np.diff(hits, axis=1, prepend=0.0)
        return divided((false * lower).sum(axis=1), hits[:, -1] * alarms[:, -1])

    return value


def average_precision(of: Sample) -> Statistic:
    """Sum over thresholds of (gain in recall) times precision."""

    def value(w: Floats) -> Floats:
        hits, alarms = cumulated(of, w)
        gain = np.diff(hits, axis=1, prepend=0.0)
        precision = divided(hits, hits + alarms)
        total = (gain * np.nan_to_num(precision)).sum(axis=1)
        return divided(total, hits[:, -1])

    return value


def detection_at(of: Sample, rate: float) -> Statistic:
    """The largest detection rate of a threshold whose false-alarm rate does not exceed `rate`."""

    def value(w: Floats) -> Floats:
        hits, alarms = cumulated(of, w)
        return best_at(hits, alarms, rate)

    return value


def best_at(hits: Floats, alarms: Floats, rate: float) -> Floats:
    """Of cumulated weights: the detection that keeps to a false-alarm rate, (draws,)."""
    allowed = (alarms <= (rate + _ROUNDING) * alarms[:, -1:]).sum(axis=1)
    reached = np.take_along_axis(hits, np.maximum(allowed - 1, 0)[:, None], axis=1)[:, 0]
    best = np.where(allowed > 0, divided(reached, hits[:, -1]), 0.0)
    defined = (hits[:, -1] > 0) & (alarms[:, -1] > 0)
    return np.where(defined, best, np.nan)


def measured(statistic: Statistic, of: Sample) -> Metric:
    """A statistic of a sample with its interval, nothing where it lacks failing or other runs."""
    return bootstrap(statistic, of.clusters, int(of.counted.sum())) if of.complete else NOTHING


def detected_at(of: Sample, rate: float) -> Metric:
    """`detection_at` with its interval; a share of failing runs."""
    if not of.complete:
        return NOTHING
    n = int(of.counted.sum())
    return bootstrap(detection_at(of, rate), of.clusters, n, of.clusters.rooms_in(of.bad))


def sweep_metrics(
    line: Line, failing: str = PAPER_SET, negatives: Sequence[str] = NEGATIVES
) -> dict[str, Metric]:
    """Everything that needs no threshold, against each kind of negatives."""
    found: dict[str, Metric] = {}
    for name in negatives:
        of = sample(line, name, failing)
        found[f"auroc_{name}"] = measured(auroc(of), of)
        found[f"average_precision_{name}"] = measured(average_precision(of), of)
        for rate in FALSE_ALARM_RATES:
            found[f"detection_{_percent(rate)}_{name}"] = detected_at(of, rate)
        timely = sample(line, name, failing, in_time=True)
        found[f"auroc_in_time_{name}"] = measured(auroc(timely), timely)
        for rate in FALSE_ALARM_RATES:
            found[f"in_time_{_percent(rate)}_{name}"] = detected_at(timely, rate)
    found["auroc_boundary"] = boundary_area(line, failing)
    return found


def boundary_area(line: Line, failing: str = PAPER_SET) -> Metric:
    """Area under the curve of boundaries: those in time of failures against faultless ones.

    Every boundary in time counts as one that should raise an alarm. Whole runs are drawn.
    """
    of = line.of
    seen = line.seen_by[of.run]
    bad = of.timely & seen & of.of_set(failing)[of.run]
    good = of.faultless & seen & ~bad
    if not bad.any() or not good.any():
        return NOTHING
    above = _pairs(line, bad, good)
    rows = np.flatnonzero(above.any(axis=1))
    each_bad, each_good = of.per_run(bad), of.per_run(good)

    def value(w: Floats) -> Floats:
        won = ((w[:, rows] @ above[rows]) * w).sum(axis=1)
        return divided(won, (w @ each_bad) * (w @ each_good))

    return bootstrap(value, of.clusters, int(bad.sum() + good.sum()))


def _pairs(line: Line, bad: Bools, good: Bools) -> Floats:
    """How often a bad boundary of one run has the lower score than a good one of another.

    (runs, runs), ties counting half.
    """
    of, runs = line.of, len(line.of)
    grid = np.unique(line.score[bad])
    there = np.zeros((2 * len(grid) + 1, runs), np.int16)  # at each score of the grid, and between
    place = np.searchsorted(grid, line.score) + np.searchsorted(grid, line.score, side="right")
    np.add.at(there, (place[good], of.run[good]), 1)
    twice = 2 * np.cumsum(there[::-1], axis=0, dtype=np.int16)[::-1] - there
    found = np.zeros((runs, runs))
    np.add.at(found, of.run[bad], twice[place[bad]] / 2)
    return found


@lru_cache(maxsize=2)
def _cumulated_whole(of: Sample) -> tuple[Floats, Floats]:
    return _cumulate(of, of.clusters.weights)


def cumulated(of: Sample, w: Floats) -> tuple[Floats, Floats]:
    """Weight of failing and of other runs up to each distinct score, (draws, scores) each."""
    if len(of.clusters) and w is of.clusters.weights:
        return _cumulated_whole(of)
    return _cumulate(of, w)


def _cumulate(of: Sample, w: Floats) -> tuple[Floats, Floats]:
    counted = np.flatnonzero(of.counted)
    rank = counted[np.argsort(of.score[counted], kind="stable")]
    ascending, failing = of.score[rank], of.failing[rank]
    last = np.flatnonzero(np.append(ascending[1:] != ascending[:-1], True))
    weight = w[:, rank]
    hits = np.cumsum(weight * failing, axis=1)
    alarms = np.cumsum(weight * ~failing, axis=1)
    return hits[:, last], alarms[:, last]


def _percent(rate: float) -> str:
    return f"fa{round(100 * rate):02d}"
