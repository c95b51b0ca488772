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


Floats = NDArray[np.float64]


def alphas(counts: Floats) -> Floats:
    """Nominal alpha: 1 where all agree, 0 where they agree as often as chance.

    Args:
        counts: (..., units, values) how often each thing that was judged was given each value, each
            time by another rater.

    Returns:
        (...,) NaN where fewer than two values stand beside another, or all of them are the same.
    """
    differ, paired = disagreement(counts)
    return alpha_from(differ.sum(axis=-1), paired.sum(axis=-2))


def disagreement(counts: Floats) -> tuple[Floats, Floats]:
    """What alpha needs of each unit (..., values).

    Returns:
        (...,) how much its values differ; (..., values) those that stand beside another.
    """
    number = counts.sum(axis=-1)
    several = number > 1
    pairs = number**2 - (counts**2).sum(axis=-1)
    return np.where(several, pairs / np.where(several, number - 1, 1), 0), counts * several[
        ..., None
    ]


def alpha_from(differ: Floats, paired: Floats) -> Floats:
    """Alpha from sums over units.

    Args:
        differ: (...,) see `disagreement`.
        paired: (..., values) likewise.
    """
    number = paired.sum(axis=-1)
    expected = number**2 - (paired**2).sum(axis=-1)
    defined = expected > 0
    return np.where(defined, 1 - (number - 1) * differ / np.where(defined, expected, 1), np.nan)


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
