"""How many raters show which difference. Called by the report and by `make`; calls nothing.

An answer scores 1 where ours wins, 0 where it loses, 1/2 for both. Its variance has three parts: of
raters (some like one kind of explanation better), of items (some are easier for one detector), and
the rest. The mean over R raters with k answers each on I items about one rival then has the
variance rater/R + item/I + rest/(R k). More raters do not take the share of the items away: where
that alone hides a difference, more items are needed.
"""

from __future__ import annotations

import math
from collections.abc import Hashable, Sequence
from dataclasses import dataclass
from statistics import NormalDist

import numpy as np

POWER = 0.8
LEVEL = 0.05
_MOST_RATERS = 10_000


@dataclass(frozen=True, slots=True)
class Variance:
    """Parts of the variance of one answer's score.

    Args:
        rater: between raters. `item`: between items. `rest`: within both.
        assumed: whether nothing was measured.
    """

    rater: float
    item: float
    rest: float
    assumed: bool = False

    def of_mean(self, raters: float, items: float, each: float) -> float:
        """Variance of a mean; `each` answers of each rater."""
        return self.rater / raters + self.item / items + self.rest / (raters * each)


ASSUMED = Variance(rater=0.01, item=0.03, rest=0.16, assumed=True)
"""Before anybody has answered: a total of 0.2 (a coin without "both" has 0.25), 5 % of it between
raters and 15 % between items."""


def variance_of(
    scores: Sequence[float],
    rivals: Sequence[Hashable],
    raters: Sequence[Hashable],
    items: Sequence[Hashable],
) -> Variance | None:
    """The parts, from products of two answers that share a rater, an item, or neither.

    Each score is taken from the mean of its rival.

    Returns:
        None where no two answers about a rival share a rater, or none share an item.
    """
    y = np.asarray(scores, float)
    for rival in dict.fromkeys(rivals):
        of = np.array([r == rival for r in rivals])
        y[of] -= y[of].mean()
    rater = _covariance(y, list(zip(rivals, raters, strict=True)))
    item = _covariance(y, list(zip(rivals, items, strict=True)))
    if rater is None or item is None:
        return None
    rater, item = max(0.0, rater), max(0.0, item)
    return Variance(rater, item, max(0.0, float((y**2).mean()) - rater - item))


def detectable(variance: Variance, raters: int, items: int, each: float) -> float:
    """The least preference above one half that is found with `POWER`, on both sides at `LEVEL`.

    Args:
        variance: of an answer.
        raters: how many.
        items: how many are shown beside one rival.
        each: answers of each rater about one rival.
    """
    return _reach() * math.sqrt(variance.of_mean(raters, items, each))


def raters_needed(variance: Variance, difference: float, items: int, each: float) -> int | None:
    """How many raters find a preference of one half plus `difference`.

    Returns:
        None where the items alone hide it, however many raters there are.
    """
    left = (difference / _reach()) ** 2 - variance.item / items
    if left <= 0:
        return None
    needed = int(np.ceil((variance.rater + variance.rest / each) / left))
    return max(2, needed) if needed <= _MOST_RATERS else None


def _reach() -> float:
    normal = NormalDist()
    return normal.inv_cdf(1 - LEVEL / 2) + normal.inv_cdf(POWER)


def _covariance(y: np.ndarray, groups: Sequence[Hashable]) -> float | None:
    """Mean product of two different answers of one group."""
    codes = {g: k for k, g in enumerate(dict.fromkeys(groups))}
    code = np.array([codes[g] for g in groups], int)
    sums = np.bincount(code, y)
    squares = np.bincount(code, y**2)
    counts = np.bincount(code)
    pairs = float((counts * (counts - 1)).sum())
    return None if pairs == 0 else float((sums**2 - squares).sum()) / pairs
