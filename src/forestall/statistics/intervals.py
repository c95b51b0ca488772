"""Numbers with their uncertainty: a bootstrap over rooms and scenarios, exact where it may be.

Called by everything here that counts; knows nothing of episodes. What happened at the boundaries
of one run, in a failing run and its undisturbed twin, and in one scenario in three rooms is not
independent. The bootstrap therefore draws whole rooms and whole scenarios and multiplies how often
each was drawn (the pigeonhole bootstrap: Owen, "The pigeonhole bootstrap", Annals of Applied
Statistics 2007); it is wide rather than narrow. A scenario that was met in one room only is drawn
with that room, and an undisturbed run has no scenario. Draws depend on the number of rooms and
scenarios alone, so that two judges or strategies on the same runs are compared on the same draws.
"""

from __future__ import annotations

from collections.abc import Callable, Hashable, Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from forestall.errors import InputError

SEED = 20_260
"""Of the bootstrap's draws; written into every summary."""

RESAMPLES = 2000
LEVEL = 0.95

Floats = NDArray[np.float64]
Bools = NDArray[np.bool_]
Ints = NDArray[np.int64]
Band = tuple[float, float] | None
Statistic = Callable[[Floats], Floats]
"""Weights of the runs (draws, runs) → value in each draw (draws,), NaN where it has none."""

EXACT = "exact"
BOOTSTRAP = "bootstrap over rooms"
PIGEONHOLE = "bootstrap over rooms and scenarios"
NONE = "none"


@dataclass(frozen=True, slots=True)
class Metric:
    """A number with its 95 % interval and its count.

    Args:
        value: None when nothing was counted.
        low: lower end of the interval, None when there are too few rooms for one.
        high: upper end, likewise.
        n: how many runs, boundaries or pairs it was computed from.
        method: of the interval: "exact" (Clopper-Pearson, where no two runs share a room or a
            scenario), "bootstrap over rooms", "bootstrap over rooms and scenarios" or "none".
        count: the numerator, where the value is a share of `n`.
        p: of a difference: two-sided, that there is none, by the deviation of the draws.
    """

    value: float | None
    low: float | None
    high: float | None
    n: int
    method: str = NONE
    count: int | None = None
    p: float | None = None

    def __post_init__(self) -> None:
        if self.n < 0 or (self.n == 0 and self.value is not None):
            raise InputError(f"a metric of {self.n} things cannot have the value {self.value}")

    def to_json(self) -> dict[str, Any]:
        """Plain data; `count` and `p` only where there is one."""
        data: dict[str, Any] = {
            "value": self.value,
            "low": self.low,
            "high": self.high,
            "n": self.n,
            "method": self.method,
        }
        more = {"count": self.count, "p": self.p}
        return data | {k: v for k, v in more.items() if v is not None}


NOTHING = Metric(None, None, None, 0)


class Unit(NamedTuple):
    """What a run shares with others."""

    room: Hashable
    scenario: Hashable | None = None


@dataclass(frozen=True, slots=True, eq=False)
class Clusters:
    """Runs by what they share.

    Args:
        rooms: (runs,) number of each one's room.
        scenarios: (runs,) number of each one's scenario among those that were met in several
            rooms, -1 for others.
        own: (runs,) number of each one's scenario among all, its own for a run without.
    """

    rooms: Ints
    scenarios: Ints
    own: Ints

    @classmethod
    def of(cls, units: Sequence[Hashable]) -> Clusters:
        """Of units; anything else is a room."""
        known = [u if isinstance(u, Unit) else Unit(u) for u in units]
        met: dict[Hashable, set[Hashable]] = {}
        for unit in known:
            if unit.scenario is not None:
                met.setdefault(unit.scenario, set()).add(unit.room)
        own = _numbered([k if u.scenario is None else (u.scenario,) for k, u in enumerate(known)])
        several = [
            u.scenario if u.scenario is not None and len(met[u.scenario]) > 1 else None
            for u in known
        ]
        return cls(_numbered([u.room for u in known]), _numbered(several), own)

    def __len__(self) -> int:
        return len(self.rooms)

    @property
    def method(self) -> str:
        """Of the intervals."""
        return PIGEONHOLE if self.scenarios.max(initial=-1) >= 0 else BOOTSTRAP

    @property
    def weights(self) -> Floats:
        """How often each run is in each draw, (draws, runs)."""
        return _weights(self)

    def independent(self, where: Bools) -> bool:
        """Whether no two of some runs share a room or a scenario."""
        count = int(where.sum())
        return self.rooms_in(where) == count and len(np.unique(self.own[where])) == count

    def rooms_in(self, where: Bools) -> int:
        """How many rooms some of the runs were in."""
        return len(np.unique(self.rooms[where]))


@dataclass(frozen=True, slots=True, eq=False)
class Ratio:
    """A sum over runs divided by another, such as alarms by boundaries.

    Args:
        above: (runs,) what is counted. `below`: (runs,) of what.
        n: what is reported as count; the sum of `below` by default.
        whole: whether what is counted are things and not means of several.
        free: whether it can be any number, and is no share.
    """

    above: Floats
    below: Floats
    n: int | None = None
    whole: bool = True
    free: bool = False

    @property
    def share(self) -> bool:
        """Whether it is a share of runs that either have it or not."""
        there = self.below[self.below > 0]
        one = bool((there == 1).all() and np.isin(self.above, (0.0, 1.0)).all())
        return self.whole and self.n is None and one


def measured(
    ratios: Mapping[str, Ratio],
    clusters: Clusters,
    mixed: Mapping[str, Mapping[str, float]] | None = None,
) -> dict[str, Metric]:
    """Ratios with their intervals, all from the same draws.

    A share of runs of which no two share a room or a scenario has its exact interval. So has one
    of 0 or 1 in every draw, of as many units as there are rooms: the bootstrap would claim
    certainty.

    Args:
        ratios: by name.
        clusters: of the runs.
        mixed: further numbers: name → ratio → factor, such as the difference of two.
    """
    if not ratios:
        return {}
    if not len(clusters):
        return dict.fromkeys([*ratios, *(mixed or {})], NOTHING)
    names, half = list(ratios), len(ratios)
    sums = np.stack([*(ratios[n].above for n in names), *(ratios[n].below for n in names)], axis=1)
    used = np.flatnonzero(sums.any(axis=1))
    weights = clusters.weights
    few = 2 * len(used) < len(clusters)
    drawn = weights[:, used] @ sums[used] if few else weights @ sums
    whole = sums.sum(axis=0, keepdims=True)
    parts = dict(zip(names, divided(whole[:, :half], whole[:, half:])[0], strict=True))
    draws = divided(drawn[:, :half], drawn[:, half:])
    found = {
        name: _of_ratio(ratios[name], float(parts[name]), band, clusters)
        for name, band in zip(names, bands(draws), strict=True)
    }
    for name, factors in (mixed or {}).items():
        value = sum(factor * float(parts[part]) for part, factor in factors.items())
        line = sum(factor * draws[:, names.index(part)] for part, factor in factors.items())
        where = np.any([ratios[part].below > 0 for part in factors], axis=0)
        found[name] = _whole(value, np.asarray(line), int(where.sum()), where, clusters, True)
    return found


def bands(drawn: Floats) -> list[Band]:
    """Percentile intervals of columns of draws, None where none has a value."""
    ordered = np.sort(drawn, axis=0)  # what has no value comes last
    count = (~np.isnan(drawn)).sum(axis=0)
    found: list[Band] = []
    for column, n in zip(ordered.T, count, strict=True):
        ends = [(n - 1) * (1 - LEVEL) / 2, (n - 1) * (1 + LEVEL) / 2]
        low, high = np.interp(ends, np.arange(n), column[:n]) if n else (None, None)
        found.append(None if low is None or high is None else (float(low), float(high)))
    return found


def _of_ratio(ratio: Ratio, value: float, band: Band, clusters: Clusters) -> Metric:
    n = round(float(ratio.below.sum())) if ratio.n is None else ratio.n
    if np.isnan(value) or n == 0:
        return Metric(None, None, None, n)
    where = ratio.below > 0
    count = round(float(ratio.above.sum())) if ratio.whole else None
    if ratio.share and count is not None and clusters.independent(where):
        return Metric(value, *_clopper_pearson(count, n), n, EXACT, count)
    rooms = clusters.rooms_in(where)
    if rooms < 2 or band is None:
        return Metric(value, None, None, n, NONE, count)
    if band[0] == band[1] and not ratio.free and ratio.n is None and value in (0.0, 1.0):
        return Metric(value, *_clopper_pearson(round(value * rooms), rooms), n, EXACT, count)
    return Metric(value, *band, n, clusters.method, count)


def _whole(
    value: float, drawn: Floats, n: int, where: Bools, clusters: Clusters, differ: bool
) -> Metric:
    """A number with the interval of its draws."""
    if np.isnan(value) or n == 0:
        return Metric(None, None, None, n)
    band = bands(drawn[:, None])[0]
    if clusters.rooms_in(where) < 2 or band is None:
        return Metric(value, None, None, n)
    p = _two_sided(value, drawn[~np.isnan(drawn)]) if differ else None
    return Metric(value, *band, n, clusters.method, None, p)


def _two_sided(value: float, drawn: Floats) -> float:
    """How surprising a difference is if there is none, by the deviation of its draws.

    Not by counting draws beyond 0: of 2000, that is never below 0.001, which no correction for
    many comparisons would leave anything of.
    """
    from scipy.stats import norm

    deviation = float(drawn.std())
    if deviation == 0:
        return 1.0 if value == 0 else 2 / (len(drawn) + 1)
    return float(2 * norm.sf(abs(value) / deviation))


def bootstrap(
    statistic: Statistic,
    units: Clusters | Sequence[Hashable],
    n: int | None = None,
    of: int | None = None,
    differ: bool = False,
) -> Metric:
    """A statistic of runs with its percentile interval.

    Draws in which the statistic has no value are left out of the interval.

    Args:
        statistic: of the weights of the runs.
        units: of the runs.
        n: what is reported as count, the number of runs by default.
        of: of a share: in how many rooms; where every draw gives the same share of 0 or 1, the
            exact interval of so many units stands for certainty.
        differ: whether it is a difference, which has a p-value.
    """
    clusters = units if isinstance(units, Clusters) else Clusters.of(units)
    n = len(clusters) if n is None else n
    if not len(clusters) or n == 0:
        return NOTHING
    value = float(statistic(np.ones((1, len(clusters))))[0])
    everywhere = np.ones(len(clusters), bool)
    if np.isnan(value) or clusters.rooms_in(everywhere) < 2:
        return Metric(None if np.isnan(value) else value, None, None, n)
    found = _whole(value, statistic(clusters.weights), n, everywhere, clusters, differ)
    if of and found.low == found.high and value in (0.0, 1.0):
        return Metric(value, *_clopper_pearson(round(value * of), of), n, EXACT)
    return found


def proportion(hits: Sequence[bool], units: Sequence[Hashable] | None = None) -> Metric:
    """Share of runs: exact where they are independent, as they are without units."""
    clusters = Clusters.of(range(len(hits)) if units is None else units)
    return measured({"": of_runs(hits)}, clusters)[""]


def rate(
    hits: Sequence[float], chances: Sequence[int], units: Sequence[Hashable], whole: bool = True
) -> Metric:
    """Share of chances that were hits, such as alarms at boundaries; `n` counts the chances."""
    ratio = Ratio(np.asarray(hits, float), np.asarray(chances, float), whole=whole)
    return measured({"": ratio}, Clusters.of(units))[""]


def mean(values: Sequence[float], units: Sequence[Hashable]) -> Metric:
    """Mean over runs."""
    return measured({"": of_runs(values, whole=False)}, Clusters.of(units))[""]


def divided(above: Floats, below: Floats) -> Floats:
    """Quotient, NaN where the divisor is 0."""
    result = np.full(np.broadcast_shapes(above.shape, below.shape), np.nan)
    np.divide(above, below, out=result, where=below > 0)
    return result


def of_runs(values: Sequence[float], whole: bool = True) -> Ratio:
    """One value of each run, and every run once."""
    return Ratio(np.asarray(values, float), np.ones(len(values)), whole=whole, free=not whole)


def _numbered(values: Sequence[Hashable | None]) -> Ints:
    """Different things by different numbers from 0, None by -1."""
    codes = {v: k for k, v in enumerate(dict.fromkeys(v for v in values if v is not None))}
    return np.array([-1 if v is None else codes[v] for v in values], np.int64)


@lru_cache(maxsize=10_000)
def _clopper_pearson(good: int, n: int) -> tuple[float, float]:
    from scipy.stats import binomtest

    interval = binomtest(good, n).proportion_ci(LEVEL)
    return float(interval.low), float(interval.high)


@lru_cache(maxsize=6)
def _weights(clusters: Clusters) -> Floats:
    drawn = _draws(int(clusters.rooms.max()) + 1)[:, clusters.rooms]
    crossed = clusters.scenarios >= 0
    if crossed.any():
        codes = clusters.scenarios[crossed]
        drawn[:, crossed] *= _draws(int(codes.max()) + 1, 1)[:, codes]
    drawn.setflags(write=False)
    return drawn


@lru_cache(maxsize=32)
def _draws(count: int, which: int = 0) -> Floats:
    """How often each room (or, `which` 1, scenario) is in each draw, (RESAMPLES, count)."""
    random = np.random.default_rng(SEED + which)
    drawn = random.multinomial(count, np.full(count, 1 / count), size=RESAMPLES).astype(float)
    drawn.setflags(write=False)
    return drawn
