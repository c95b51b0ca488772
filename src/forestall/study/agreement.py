"""Krippendorff's alpha and Bradley-Terry strengths; called by the report, call nothing.

Krippendorff, "Computing Krippendorff's Alpha-Reliability" (2011); Bradley and Terry, "Rank analysis
of incomplete block designs" (Biometrika 1952), fitted as in Hunter, "MM algorithms for generalized
Bradley-Terry models" (Annals of Statistics 2004).
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Hashable, Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

_MOST_STEPS = 10_000
_CLOSE = 1e-10


def alpha(units: Mapping[Hashable, Sequence[Hashable]]) -> float | None:
    """Nominal alpha: 1 where all agree, 0 where they agree as often as chance.

    Args:
        units: what was judged → the values that it was given, each by another rater.

    Returns:
        None where fewer than two values stand beside another, or all of them are the same.
    """
    coincidences: Counter[tuple[Hashable, Hashable]] = Counter()
    for values in units.values():
        if len(values) < 2:
            continue
        counts = Counter(values)
        for a, n in counts.items():
            for b, m in counts.items():
                coincidences[a, b] += n * (m - (a == b)) / (len(values) - 1)  # type: ignore[assignment]
    totals: Counter[Hashable] = Counter()
    for (a, _), n in coincidences.items():
        totals[a] += n
    n_all = sum(totals.values())
    expected = n_all**2 - sum(n**2 for n in totals.values())
    if n_all < 2 or expected <= 0:
        return None
    observed = sum(n for (a, b), n in coincidences.items() if a != b)
    return 1 - (n_all - 1) * observed / expected


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
