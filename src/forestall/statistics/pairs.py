"""How two things differ on the same runs.

Called by `outcomes`; calls `intervals`.
"""

from __future__ import annotations

from collections.abc import Hashable, Sequence
from dataclasses import dataclass
from typing import Any

from forestall.errors import InputError
from forestall.statistics.intervals import Clusters, Metric, measured, of_runs


@dataclass(frozen=True, slots=True)
class Paired:
    """How two things differ on the same runs.

    Args:
        difference: mean of first minus second, with its interval.
        only_first: pairs in which only the first one succeeded.
        only_second: likewise.
        p: McNemar's exact test, two-sided, for which pairs are independent; None when nothing was
            paired. The difference has one of its own, for which rooms and scenarios are.
    """

    difference: Metric
    only_first: int
    only_second: int
    p: float | None

    def to_json(self) -> dict[str, Any]:
        """Plain data: the difference with what the tests say of it."""
        return {
            **self.difference.to_json(),
            "only_first": self.only_first,
            "only_second": self.only_second,
            "p": self.p,
            "p_clustered": self.difference.p,
        }


def paired(first: Sequence[bool], second: Sequence[bool], units: Sequence[Hashable]) -> Paired:
    """Difference of two shares on the same runs: bootstrap, and McNemar's exact test.

    Raises:
        InputError: the sequences differ in length.
    """
    from scipy.stats import binomtest

    if not len(first) == len(second) == len(units):
        raise InputError("pairs need as many first as second outcomes, and their rooms")
    parts = {"first": of_runs(first), "second": of_runs(second)}
    mixed = {"difference": {"first": 1.0, "second": -1.0}}
    difference = measured(parts, Clusters.of(units), mixed)["difference"]
    only_first = sum(a and not b for a, b in zip(first, second, strict=True))
    only_second = sum(b and not a for a, b in zip(first, second, strict=True))
    if not first:
        return Paired(difference, 0, 0, None)
    discordant = only_first + only_second
    p = float(binomtest(only_first, discordant).pvalue) if discordant else 1.0
    return Paired(difference, only_first, only_second, p)
