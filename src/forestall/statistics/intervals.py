"""Numbers with their uncertainty: exact for proportions, a bootstrap over scenes for the rest.

Called by `metrics`, `sweep`, `outcomes` and `orderings`; knows nothing of episodes. What happened
at the boundaries of one run, and in a failing run and its undisturbed twin, is not independent:
they share a scene. The bootstrap therefore draws whole scenes, and with a scene everything that
was run in it. Its draws depend on the number of scenes alone, so that two detectors or strategies
on the same scenes are always compared on the same draws.
"""

from __future__ import annotations

from collections.abc import Callable, Hashable, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.stats import binomtest

from forestall.errors import InputError

SEED = 20_260
"""Of the bootstrap's draws; written into every summary."""

RESAMPLES = 2000
LEVEL = 0.95

Floats = NDArray[np.float64]
Statistic = Callable[[Floats], Floats]
"""Weights of the runs (draws, runs) → value in each draw (draws,), NaN where it has none."""

EXACT = "exact"
BOOTSTRAP = "bootstrap"
NONE = "none"


@dataclass(frozen=True, slots=True)
class Metric:
    """A number with its 95 % interval and its count.

    Args:
        value: None when nothing was counted.
        low: lower end of the interval, None when there are too few scenes for one.
        high: upper end, likewise.
        n: how many runs, boundaries or pairs it was computed from.
        method: of the interval: "exact" (Clopper-Pearson), "bootstrap" (over scenes) or "none".
        count: the numerator, where the value is a share of `n`.
    """

    value: float | None
    low: float | None
    high: float | None
    n: int
    method: str = NONE
    count: int | None = None

    def __post_init__(self) -> None:
        if self.n < 0 or (self.n == 0 and self.value is not None):
            raise InputError(f"a metric of {self.n} things cannot have the value {self.value}")

    def to_json(self) -> dict[str, Any]:
        """Plain data; `count` only where there is one."""
        data: dict[str, Any] = {
            "value": self.value,
            "low": self.low,
            "high": self.high,
            "n": self.n,
            "method": self.method,
        }
        return data if self.count is None else {**data, "count": self.count}


NOTHING = Metric(None, None, None, 0)


@dataclass(frozen=True, slots=True)
class Paired:
    """How two things differ on the same runs.

    Args:
        difference: mean of first minus second, with its interval.
        only_first: pairs in which only the first one succeeded.
        only_second: likewise.
        p: McNemar's exact test, two-sided; None when nothing was paired.
    """

    difference: Metric
    only_first: int
    only_second: int
    p: float | None

    def to_json(self) -> dict[str, Any]:
        """Plain data: the difference with what the test says of it."""
        return {
            **self.difference.to_json(),
            "only_first": self.only_first,
            "only_second": self.only_second,
            "p": self.p,
        }


def proportion(hits: Sequence[bool]) -> Metric:
    """Share of independent runs, with its exact interval (Clopper-Pearson)."""
    if not hits:
        return NOTHING
    good = sum(map(bool, hits))
    low, high = _clopper_pearson(good, len(hits))
    return Metric(good / len(hits), low, high, len(hits), EXACT, good)


def bootstrap(
    statistic: Statistic,
    scenes: Sequence[Hashable],
    n: int | None = None,
    count: int | None = None,
    units: int | None = None,
) -> Metric:
    """A statistic of runs with its percentile interval.

    Draws in which the statistic has no value are left out of the interval. Where every draw gives
    the same share of 0 or 1, the bootstrap would claim certainty; the exact interval of as many
    independent units then stands for it.

    Args:
        statistic: of the weights of the runs.
        scenes: of each run; runs of one scene are drawn together.
        n: what is reported as count, the number of runs by default.
        count: the numerator, where the value is a share of `n`.
        units: of a share: how many scenes it is a share in.
    """
    n = len(scenes) if n is None else n
    if not scenes or n == 0:
        return NOTHING
    value = float(statistic(np.ones((1, len(scenes))))[0])
    if np.isnan(value):
        return Metric(None, None, None, n)
    codes = {scene: code for code, scene in enumerate(dict.fromkeys(scenes))}
    if len(codes) < 2:
        return Metric(value, None, None, n, NONE, count)
    drawn = statistic(_draws(len(codes))[:, [codes[s] for s in scenes]])
    low, high = np.percentile(drawn[~np.isnan(drawn)], [50 * (1 - LEVEL), 50 * (1 + LEVEL)])
    if units and low == high and value in (0.0, 1.0):
        return Metric(value, *_clopper_pearson(round(value * units), units), n, EXACT, count)
    return Metric(value, float(low), float(high), n, BOOTSTRAP, count)


def ratio(
    numerators: Sequence[float],
    denominators: Sequence[float],
    scenes: Sequence[Hashable],
    n: int | None = None,
) -> Metric:
    """Sum over sum.

    Args:
        numerators: of each run, such as the time that it gained.
        denominators: of each run, such as whether it gained any.
        scenes: of each run.
        n: what is reported as count, the number of runs by default.
    """
    above, below = np.asarray(numerators, float), np.asarray(denominators, float)
    return bootstrap(lambda w: divided(w @ above, w @ below), scenes, n)


def rate(
    hits: Sequence[float], chances: Sequence[int], scenes: Sequence[Hashable], whole: bool = True
) -> Metric:
    """Share of chances that were hits, such as alarms at boundaries; `n` counts the chances.

    Args:
        hits: of each run.
        chances: of each run.
        scenes: of each run.
        whole: whether hits are counts and not means of several.
    """
    above, below = np.asarray(hits, float), np.asarray(chances, float)
    return bootstrap(
        lambda w: divided(w @ above, w @ below),
        scenes,
        sum(chances),
        round(float(above.sum())) if whole else None,
        len({s for s, c in zip(scenes, chances, strict=True) if c}),
    )


def mean(values: Sequence[float], scenes: Sequence[Hashable]) -> Metric:
    """Mean over runs."""
    given = np.asarray(values, float)
    return bootstrap(lambda w: divided(w @ given, w.sum(axis=1)), scenes)


def paired(first: Sequence[bool], second: Sequence[bool], scenes: Sequence[Hashable]) -> Paired:
    """Difference of two shares on the same runs: bootstrap over scenes, and McNemar's exact test.

    Raises:
        InputError: the sequences differ in length.
    """
    if not len(first) == len(second) == len(scenes):
        raise InputError("pairs need as many first as second outcomes, and their scenes")
    difference = mean([float(a) - float(b) for a, b in zip(first, second, strict=True)], scenes)
    only_first = sum(a and not b for a, b in zip(first, second, strict=True))
    only_second = sum(b and not a for a, b in zip(first, second, strict=True))
    if not first:
        return Paired(difference, 0, 0, None)
    discordant = only_first + only_second
    p = float(binomtest(only_first, discordant).pvalue) if discordant else 1.0
    return Paired(difference, only_first, only_second, p)


def divided(above: Floats, below: Floats) -> Floats:
    """Quotient, NaN where the divisor is 0."""
    result = np.full(np.broadcast_shapes(above.shape, below.shape), np.nan)
    np.divide(above, below, out=result, where=below > 0)
    return result


@lru_cache(maxsize=10_000)
def _clopper_pearson(good: int, n: int) -> tuple[float, float]:
    interval = binomtest(good, n).proportion_ci(LEVEL)
    return float(interval.low), float(interval.high)


@lru_cache(maxsize=32)
def _draws(scenes: int) -> Floats:
    """How often each scene is in each draw, (RESAMPLES, scenes)."""
    random = np.random.default_rng(SEED)
    drawn = random.multinomial(scenes, np.full(scenes, 1 / scenes), size=RESAMPLES).astype(float)
    drawn.setflags(write=False)
    return drawn
