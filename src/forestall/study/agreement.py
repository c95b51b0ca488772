"""Krippendorff's alpha and Bradley-Terry strengths; called by the report, call nothing.

Krippendorff, "Computing Krippendorff's Alpha-Reliability" (2011); Bradley and Terry, "Rank analysis
of incomplete block designs" (Biometrika 1952), fitted as in Hunter, "MM algorithms for generalized
Bradley-Terry models" (Annals of Statistics 2004).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

_MOST_STEPS = 10_000
_CLOSE = 1e-10


def alphas(counts: NDArray[np.float64]) -> NDArray[np.float64]:
    """Nominal alpha: 1 where all agree, 0 where they agree as often as chance.

    Args:
        counts: (..., units, values) how often each thing that was judged was given each value, each
            time by another rater.

    Returns:
        (...,) NaN where fewer than two values stand beside another, or all of them are the same.
    """
    of_unit = counts.sum(axis=-1)
    several = of_unit > 1
    pairs = of_unit**2 - (counts**2).sum(axis=-1)
    differ = np.where(several, pairs / np.where(several, of_unit - 1, 1), 0).sum(axis=-1)
    totals = (counts * several[..., None]).sum(axis=-2)
    all_of_them = totals.sum(axis=-1)
    expected = all_of_them**2 - (totals**2).sum(axis=-1)
    defined = expected > 0
    share = differ / np.where(defined, expected, 1)
    return np.where(defined, 1 - (all_of_them - 1) * share, np.nan)


def strengths(wins: NDArray[np.float64]) -> NDArray[np.float64] | None:
    """Bradley-Terry log-strengths; i beats j with odds exp(strength i - strength j).

    Args:
        wins: (n, n) how often row beat column; a tie is half a win of each.

    Returns:
        (n,) with the first one 0, or None where they are not finite: some never lose to, or are
        never compared with, all the others.
    """
    n = len(wins)
    if not _connected(wins > 0):
        return None
    games, won = wins + wins.T, wins.sum(axis=1)
    value = np.ones(n)
    for _ in range(_MOST_STEPS):
        pairs = games / (value[:, None] + value[None, :])
        new = won / pairs.sum(axis=1)
        new /= new[0]
        close = np.allclose(new, value, rtol=_CLOSE, atol=0)
        value = new
        if close:
            break
    found: NDArray[np.float64] = np.log(value)
    return found


def _connected(beats: NDArray[np.bool_]) -> bool:
    """Whether everybody has beaten everybody over others (Ford's condition)."""
    reach = beats | np.eye(len(beats), dtype=bool)
    for _ in range(len(beats)):
        reach = (reach.astype(int) @ reach.astype(int)) > 0
    return bool(reach.all())
