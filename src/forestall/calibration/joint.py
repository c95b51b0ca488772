"""Several judges, or several parts of a run, under one bound per run.

Called by `fitted` and tests; calls numpy. Each column is one judge, or one judge on one kind of
boundary; a run has an extreme in each. In the bag of all runs and the new one, every run has a rank
in every column; the smallest rank, divided by the column's share of the budget, makes one number of
a run (the minimum of its p-values), and that is compared over the bag. It is a symmetric function
of the bag, so that the bound is exact whatever the columns have to do with each other. It alarms
wherever splitting the level by the shares (Bonferroni) would, and earlier where columns agree.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from forestall.calibration.conformal import NOT_JUDGED, checked_level

Matrix = npt.NDArray[np.float64]

_ROUNDING = 1e-12


def p_value(extremes: Matrix, shares: Sequence[float], new: Sequence[float]) -> float:
    """How rare a run this strange is over all columns.

    It can only fall while the extremes of a run fall, boundary by boundary; an alarm as soon as it
    is at most `a` comes in a share of at most `a` of all exchangeable runs.

    Args:
        extremes: (n, c) of the calibration runs, inf where a run has nothing in a column.
        shares: (c,) of the budget, above 0; only their proportions count.
        new: (c,) of the new run.
    """
    bag = np.vstack([extremes, np.asarray(new, dtype=np.float64)[None, :]])
    least = np.full(len(bag), np.inf)
    for column, share in zip(bag.T, shares, strict=True):
        ranks = np.searchsorted(np.sort(column), column, side="right")
        least = np.minimum(least, np.where(column < NOT_JUDGED, ranks / share, np.inf))
    return float(np.count_nonzero(least <= least[-1])) / len(bag)


def thresholds(extremes: Matrix, shares: Sequence[float], level: float) -> tuple[float | None, ...]:
    """For each column the largest t such that alarms at scores below keep to the level.

    All of them together: P(a new run is below the threshold of any column) <= level.

    Args:
        extremes: as in `p_value`.
        shares: as in `p_value`.
        level: the bound on false alarms per run.

    Returns:
        None for a column in which no score could be called an alarm.

    Raises:
        InputError: a level that is not between 0 and 1.
    """
    checked_level(level)
    return tuple(_threshold(extremes, shares, level, column) for column in range(extremes.shape[1]))


def _threshold(
    extremes: Matrix, shares: Sequence[float], level: float, column: int
) -> float | None:
    """By halving: what is an alarm stays one with a lower score."""
    values = np.unique(extremes[:, column])
    values = values[values < NOT_JUDGED]

    def allowed(value: float) -> bool:
        new = np.full(extremes.shape[1], NOT_JUDGED)
        new[column] = np.nextafter(value, -np.inf)
        return p_value(extremes, shares, new.tolist()) <= level + _ROUNDING

    low, high = 0, len(values)  # values[:low] are allowed, values[high:] are not
    while low < high:
        middle = (low + high) // 2
        if allowed(float(values[middle])):
            low = middle + 1
        else:
            high = middle
    return float(values[low - 1]) if low else None


def smallest_level(extremes: Matrix, shares: Sequence[float], column: int) -> float:
    """The smallest bound at which a run stranger than all others in one column is an alarm."""
    new = np.full(extremes.shape[1], NOT_JUDGED)
    new[column] = -np.inf
    return p_value(extremes, shares, new.tolist())
