"""One number for each run, and what may be said of a new one: split-conformal, finite sample.

Called by `fitted` and tests; calls numpy. A score says how well a scene fits, higher is better; the
extreme of a run is its smallest score over the boundaries, so that a bound on it bounds any alarm
in the run. Where calibration runs and the new run are exchangeable, all of this holds for every
number of them and every distribution (Vovk, Gammerman, Shafer: Algorithmic Learning in a Random
World, 2nd ed., Prop. 2.4; Lei et al., JASA 2018).
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence

import numpy as np

from forestall.errors import InputError

NOT_JUDGED = math.inf
"""The extreme of a run in which nothing was judged: no threshold makes it an alarm."""

_ROUNDING = 1e-9
"""By how much a product of a level and a number of runs may miss a whole number."""


def extreme(scores: Iterable[float | None]) -> float:
    """The smallest score of a run; boundaries that were not judged (None) do not count."""
    return min((s for s in scores if s is not None), default=NOT_JUDGED)


def p_value(extremes: Sequence[float], score: float) -> float:
    """How rare a score this low is among runs: (1 + how many are as low or lower) / (n + 1).

    Args:
        extremes: of the n calibration runs.
        score: extreme of the new run, or of one of its boundaries.

    Returns:
        A number p for which a new run's extreme has P(p <= a) <= a, for every a.
    """
    lower = int(np.count_nonzero(np.asarray(extremes, dtype=np.float64) <= score))
    return (1 + lower) / (len(extremes) + 1)


def threshold(extremes: Sequence[float], level: float) -> float | None:
    """The largest t with P(a new run's extreme < t) <= level; None where no t has that.

    It is the k-th smallest extreme, k = floor((n + 1) level): in terms of strangeness the
    ceil((n + 1)(1 - level))-th smallest one. Never larger than the largest extreme of a run in
    which something was judged.

    Raises:
        InputError: a level that is not between 0 and 1.
    """
    k = math.floor((len(extremes) + 1) * checked_level(level) + _ROUNDING)
    judged = sorted(e for e in extremes if e < NOT_JUDGED)
    if k < 1 or not judged:
        return None
    return judged[min(k, len(judged)) - 1]


def smallest_level(runs: int) -> float:
    """The smallest bound that so many runs can show for one judge."""
    return 1 / (runs + 1)


def runs_needed(level: float, share: int = 1) -> int:
    """How many calibration runs a level needs.

    Args:
        level: the bound on false alarms per run.
        share: the smallest bound is `share` / (n + 1); 1 for one judge.
    """
    return max(0, math.ceil(share / checked_level(level) - _ROUNDING) - 1)


def checked_level(level: float) -> float:
    """The level.

    Raises:
        InputError: it is not between 0 and 1.
    """
    if not 0 < level < 1:
        raise InputError(f"level {level}: a bound is above 0 and below 1, such as 0.05")
    return level
