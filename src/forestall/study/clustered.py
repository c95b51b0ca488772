"""Numbers of answers with 95 % intervals that go by who answered and about what.

Called by `measuring.py`; calls statistics. Two answers of one rater are not independent, nor are
two about one item. Variances of both clusterings are added, and that of single answers, which is
in both, is taken off (Cameron, Gelbach and Miller, "Robust inference with multiway clustering",
2011), but for no more than leaves the larger of the two; Student's t with one degree of freedom
fewer than there are raters or items, whichever are fewer. The pigeonhole bootstrap of
`statistics/intervals.py` counts what differs from answer to answer three times and is wider than
need be here. `python -m study.coverage` in `tests` measures what these intervals hold.
"""

from __future__ import annotations

from collections.abc import Hashable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from forestall.statistics.intervals import EXACT, LEVEL, NOTHING, Metric
from forestall.study.agreement import alpha_from, alphas, disagreement

CLUSTERED = "clustered by rater and item"
"""Method of an interval."""

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]


@dataclass(frozen=True, slots=True, eq=False)
class Clusters:
    """Answers by what they share.

    Args:
        raters: (n,) code of each answer's rater, from 0 without a gap. `items`: of its item.
    """

    raters: Ints
    items: Ints

    @classmethod
    def of(cls, raters: Sequence[Hashable], items: Sequence[Hashable]) -> Clusters:
        """Of answers by the names of rater and item."""
        return cls(codes(raters), codes(items))

    @property
    def fewer(self) -> int:
        """How many raters or items there are, whichever are fewer."""
        return min(int(self.raters.max()), int(self.items.max())) + 1

    @property
    def t(self) -> float:
        """How many standard errors an interval reaches to each side."""
        from scipy.stats import t

        return float(t.ppf((1 + LEVEL) / 2, self.fewer - 1))


def share_of(values: Sequence[float], clusters: Clusters) -> Metric:
    """The mean of values from 0 to 1; on the logit scale, so that no end lies outside.

    A share of 0 or 1 has the exact interval of as many answers as there are raters or items.

    Args:
        values: one of each answer.
        clusters: of the answers.
    """
    from scipy.special import expit, logit
    from scipy.stats import binomtest

    n = len(values)
    if n == 0:
        return NOTHING
    y = np.asarray(values, float)
    mean = float(y.mean())
    whole = bool(np.isin(y, (0.0, 1.0)).all())
    count = round(float(y.sum())) if whole else None
    groups = clusters.fewer
    if groups < 2:
        return Metric(mean, None, None, n, count=count)
    if mean in (0.0, 1.0):
        exact = binomtest(round(mean * groups), groups).proportion_ci(LEVEL)
        return Metric(mean, float(exact.low), float(exact.high), n, EXACT, count)
    rest = (y - mean) / n
    by_rater, by_item = _of_sums(rest, clusters.raters), _of_sums(rest, clusters.items)
    variance = max(by_rater + by_item - float((rest**2).sum()), by_rater, by_item)
    if variance == 0:  # all are the same half
        return Metric(mean, None, None, n, count=count)
    reach = clusters.t * variance**0.5 / (mean * (1 - mean))
    middle = float(logit(mean))
    low, high = expit([middle - reach, middle + reach])
    return Metric(mean, float(low), float(high), n, CLUSTERED, count)


def alpha_of(values: Sequence[Hashable], units: Sequence[Hashable], clusters: Clusters) -> Metric:
    """Krippendorff's alpha; its interval by leaving out one rater, one item, one answer at a time.

    MacKinnon, Nielsen and Webb, "Jackknife inference with two-way clustering" (2024). A pair of
    answers is left out with either rater, but with one item: the variance by item alone is the
    least that it can be.

    Args:
        values: one of each answer.
        units: what each answer is about.
        clusters: of the answers.

    Returns:
        Without a value where alpha has none; without an interval where it has none without some
        rater or item, where there are fewer than two of these, or where all answers agree.
    """
    n = len(values)
    if n == 0:
        return NOTHING
    unit, value = codes(units), codes(values)
    counts = np.zeros((int(unit.max()) + 1, int(value.max()) + 1))
    np.add.at(counts, (unit, value), 1)
    found = float(alphas(counts))
    if np.isnan(found):
        return Metric(None, None, None, n)
    if clusters.fewer < 2:
        return Metric(found, None, None, n)

    def without_each(by: Ints) -> float:
        groups = int(by.max()) + 1
        left_out = np.zeros((groups, *counts.shape))
        np.add.at(left_out, (by, unit, value), 1)
        less = alphas(counts - left_out)
        return float(((less - found) ** 2).sum()) * (groups - 1) / groups

    by_rater, by_item = without_each(clusters.raters), without_each(clusters.items)
    variance = max(by_rater + by_item - _without_one(counts, found), by_item)
    if np.isnan([by_rater, by_item, variance]).any() or variance == 0:
        return Metric(found, None, None, n)
    reach = clusters.t * variance**0.5
    return Metric(found, max(found - reach, -1.0), min(found + reach, 1.0), n, CLUSTERED)


def _without_one(counts: Floats, found: float) -> float:
    """Variance of alpha by leaving out one answer at a time; equal ones are left out but once."""
    units, values = np.nonzero(counts)
    less = counts[units]
    less[np.arange(len(units)), values] -= 1
    differ, paired = disagreement(counts)
    differ_less, paired_less = disagreement(less)
    without = alpha_from(
        differ.sum() - differ[units] + differ_less, paired.sum(axis=0) - paired[units] + paired_less
    )
    n = float(counts.sum())
    return float((counts[units, values] * (without - found) ** 2).sum()) * (n - 1) / n


def codes(values: Sequence[Hashable]) -> Ints:
    """(n,) A number for each of the values, from 0 in the order of their first."""
    known = {v: k for k, v in enumerate(dict.fromkeys(values))}
    return np.array([known[v] for v in values], np.int64)


def _of_sums(rest: Floats, by: Ints) -> float:
    """Variance of a mean from the sums of its residuals over whole groups."""
    count = int(by.max()) + 1
    return float((np.bincount(by, rest) ** 2).sum()) * count / (count - 1)
