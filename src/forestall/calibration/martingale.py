"""Whether a calibration still fits: a bet against exchangeability that cannot win for long.

Called by assembly and tests; calls numpy. Each run of a stream gets a p-value among all runs before
it, ties broken at random, which makes these independent and uniform as long as the runs are
exchangeable (Vovk et al., ch. 8). A capital of 1 is put on small ones: on the derivative of p^e for
several e, with a little of the capital moved between them at each step (the jumper of Vovk et al.,
"Retrain or not retrain", COPA 2021), so that it also grows where the change comes late. The capital
is a martingale: by Ville's inequality P(it ever reaches c) <= 1 / c.
"""

from __future__ import annotations

from bisect import bisect_left, bisect_right, insort
from collections.abc import Iterable, Mapping

import numpy as np

from forestall.calibration.conformal import checked_level

EXPONENTS = (0.1, 0.25, 0.5, 0.75, 1.0)
"""Of the bets; 1 is no bet at all."""

JUMP = 0.01
"""Share of the capital that is dealt out anew at each step."""

ENOUGH = 1e12
"""A capital that is not bet again: nobody asks for a level below its inverse."""


class ExchangeabilityTest:
    """A stream of runs, one extreme each, against "it is as when it was calibrated".

    Runs are compared within their group (a task), so that it may change which tasks are done.

    Args:
        extremes: group → those of the calibration runs: nothing is bet on these.
        rng: breaks ties; with the same one the same stream has the same capital.
    """

    def __init__(self, extremes: Mapping[str, Iterable[float]], rng: np.random.Generator) -> None:
        self._seen = {group: sorted(of) for group, of in extremes.items()}
        self._rng = rng
        self._capital = np.full(len(EXPONENTS), 1 / len(EXPONENTS))
        self._most = 1.0
        self.added = 0

    def add(self, extreme: float, group: str = "") -> float:
        """One more run; returns the capital after it."""
        self.added += 1
        p = self._p_value(extreme, self._seen.setdefault(group, []))
        if self._most >= ENOUGH:
            return self.capital
        exponents = np.asarray(EXPONENTS)
        moved = (1 - JUMP) * self._capital + JUMP * self._capital.sum() / len(exponents)
        self._capital = moved * exponents * p ** (exponents - 1)
        self._most = max(self._most, self.capital)
        return self.capital

    @property
    def capital(self) -> float:
        """What 1 has come to: how strongly the runs speak against exchangeability now."""
        return float(self._capital.sum())

    @property
    def most(self) -> float:
        """The most that it ever was."""
        return self._most

    def broken(self, level: float) -> bool:
        """Whether it no longer fits; said wrongly of a share of at most `level` of all streams.

        Raises:
            InputError: a level that is not between 0 and 1.
        """
        return self._most >= 1 / checked_level(level)

    def _p_value(self, extreme: float, seen: list[float]) -> float:
        """Uniform on (0, 1] and independent of the earlier ones, if runs are exchangeable."""
        lower = bisect_left(seen, extreme)
        equal = bisect_right(seen, extreme) - lower + 1
        insort(seen, extreme)
        return (lower + (1.0 - self._rng.random()) * equal) / len(seen)
