"""Whether the paper's orderings hold in the rows, each in a sentence; and what else is compared.

Calls: `profile` → here → `sweep`, `outcomes`, `intervals`. Two things are compared on the runs that
both were measured on; an ordering holds when the interval of the difference lies above 0. Judges
are compared at equal false-alarm rates, since the one that alarms more often always detects more.
Many are compared at once: `corrected` says what is left of a verdict when the p-values of its
family are corrected by Holm's method.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Any

import numpy as np

from forestall.statistics.cells import Names, points, shown
from forestall.statistics.intervals import NOTHING, Floats, Metric, Ratio, bootstrap, measured
from forestall.statistics.judges import THRESHOLDS, Together
from forestall.statistics.metrics import at_thresholds
from forestall.statistics.outcomes import (
    NO_STRATEGY,
    ONLINE,
    POST_HOC,
    PROACTIVE,
    Runs,
    compared,
    of_set,
    succeeded,
)
from forestall.statistics.paper import ABLATIONS, FULL
from forestall.statistics.sweep import Line, auroc, detection_at, sample
from forestall.statistics.watches import ALL, PAPER_SET, Watches

HOLDS = "holds"
FAILS = "does not hold"
UNDECIDED = "not decided"
UNMEASURED = "not measured"

ENOUGH = 10
"""Fewer pairs than this decide nothing, however they come out."""

ALPHA = 0.05
"""Of a family of comparisons."""

OTHER_DETECTORS = ("objects", "caption", "image")

EQUAL_FALSE_ALARMS: Mapping[str, tuple[float | None, bool]] = {
    "detection at 5 % false alarms": (0.05, False),
    "detection at 10 % false alarms": (0.10, False),
    "AUROC": (None, False),
    "AUROC in time": (None, True),
}
"""Measure → the rate of false alarms, None for the area, and whether only alarms in time count."""


@dataclass(frozen=True, slots=True)
class Ordering:
    """One ordering, held against the rows.

    Args:
        topic: "strategies", "detectors", "ablations" or "reasoning" of the paper, or another.
        better: name of what should be better.
        worse: name of what should be worse.
        measure: in which it should be, in words.
        first: value of the better one, None when not measured.
        second: value of the worse one, likewise.
        difference: first minus second on the same runs.
        p: two-sided, that there is no difference.
        p_holm: the same, corrected for its family.
    """

    topic: str
    better: str
    worse: str
    measure: str
    first: float | None
    second: float | None
    difference: Metric
    p: float | None = None
    p_holm: float | None = None

    @property
    def verdict(self) -> str:
        """One of the four verdicts."""
        low, high = self.difference.low, self.difference.high
        if self.difference.value is None:
            return UNMEASURED
        if low is None or high is None or self.difference.n < ENOUGH:
            return UNDECIDED
        if low > 0:
            return HOLDS
        return FAILS if high <= 0 else UNDECIDED

    @property
    def corrected(self) -> str:
        """What is left of the verdict among its family; no difference at all stays none."""
        same = self.difference.low == self.difference.high == 0
        if self.verdict in (UNMEASURED, UNDECIDED) or same:
            return self.verdict
        return self.verdict if self.p_holm is not None and self.p_holm <= ALPHA else UNDECIDED

    def sentence(self, names: Names | None = None) -> str:
        """The verdict in plain English, with judges shown as `names` says."""
        better, worse = (shown(n, names or {}) for n in (self.better, self.worse))
        claim = f"{better} over {worse} in {self.measure}"
        if self.first is None or self.second is None or self.difference.value is None:
            return f"{claim}: {UNMEASURED}."
        seen = (
            f"{_percent(self.first)} against {_percent(self.second)}, difference "
            f"{points(self.difference.to_json())}"
        )
        if self.verdict in (HOLDS, FAILS):
            lost = "" if self.corrected == self.verdict else " (not after Holm's correction)"
            return f"{claim}: {self.verdict}{lost}: {seen}."
        if self.difference.n < ENOUGH or self.difference.low is None:
            return f"{claim}: not decided: too few runs: {seen}."
        return f"{claim}: not decided: the interval includes 0: {seen}."

    def to_json(self, names: Names | None = None) -> dict[str, Any]:
        """Plain data."""
        return {
            "topic": self.topic,
            "better": self.better,
            "worse": self.worse,
            "measure": self.measure,
            "first": self.first,
            "second": self.second,
            "difference": self.difference.to_json(),
            "verdict": self.verdict,
            "p": self.p,
            "p_holm": self.p_holm,
            "corrected": self.corrected,
            "sentence": self.sentence(names),
        }


def holm(family: Iterable[Ordering]) -> list[Ordering]:
    """The same orderings with their p-values corrected for all that were measured (Holm 1979)."""
    found = list(family)
    tested = sorted((k for k, o in enumerate(found) if o.p is not None), key=lambda k: _p(found[k]))
    reached = 0.0
    for place, k in enumerate(tested):
        reached = max(reached, min(1.0, (len(tested) - place) * _p(found[k])))
        found[k] = replace(found[k], p_holm=reached)
    return found


def orderings(
    setups: Mapping[str, Runs],
    watched: Watches,
    failing: str = PAPER_SET,
    on: str = "irreversible",
) -> list[Ordering]:
    """Every ordering of the paper: one family.

    Args:
        setups: runs by strategy.
        watched: runs that judges watched.
        failing: set of the failing runs that judges are compared on, or `ALL`.
        on: the set that strategies are compared on, or `ALL`.
    """
    chain = (PROACTIVE, ONLINE, POST_HOC, NO_STRATEGY)
    found = [
        strategies_differ("strategies", setups, better, worse, on)
        for better, worse in pairwise(chain)
    ]
    found += [
        judges_differ("detectors", watched, FULL, other, measure, failing)
        for measure in EQUAL_FALSE_ALARMS
        for other in OTHER_DETECTORS
    ]
    for thresholds in (THRESHOLDS, THRESHOLDS[:1]):
        found += [
            rates_differ("ablations", watched, FULL, other, thresholds, failing)
            for other in ABLATIONS.values()
        ]
    found += [
        judges_differ("ablations", watched, FULL, other, measure, failing)
        for measure in EQUAL_FALSE_ALARMS
        for other in ABLATIONS.values()
    ]
    without = f"{PROACTIVE}, without reasoning"
    found += [
        strategies_differ("reasoning", setups, PROACTIVE, without, of)
        for of in dict.fromkeys((failing, on))
    ]
    return holm(found)


def strategies_differ(
    topic: str, setups: Mapping[str, Runs], better: str, worse: str, of: str
) -> Ordering:
    """Success of two strategies on the cases of a set that both were run on.

    Its p is the larger of McNemar's, for which cases are independent, and the bootstrap's.
    """
    measure = "success on all sets" if of == ALL else f"success on the {of} set"
    first, second = setups.get(better, {}), setups.get(worse, {})
    pair = compared(first, second, of)
    if pair.difference.value is None:
        return Ordering(topic, better, worse, measure, None, None, NOTHING)
    rates = [
        float(np.mean([succeeded(r) for r in of_set({c: runs[c] for c in runs if c in other}, of)]))
        for runs, other in ((first, second), (second, first))
    ]
    known = [p for p in (pair.p, pair.difference.p) if p is not None]
    p = max(known) if pair.difference.low is not None else None
    one, other = rates
    return Ordering(topic, better, worse, measure, one, other, pair.difference, p)


def judges_differ(
    topic: str,
    watched: Watches,
    better: str | Together,
    worse: str | Together,
    measure: str,
    failing: str = PAPER_SET,
) -> Ordering:
    """Two judges at equal false-alarm rates, on runs that both watched."""
    one, other = _name(better), _name(worse)
    if not _known(watched, better) or not _known(watched, worse):
        return Ordering(topic, one, other, measure, None, None, NOTHING)
    rate, in_time = EQUAL_FALSE_ALARMS[measure]
    lines = [Line.by(watched, judge) for judge in (better, worse)]
    both = lines[0].seen_by & lines[1].seen_by
    samples = [sample(replace(x, seen_by=both), ALL, failing, in_time) for x in lines]
    if not samples[0].complete:
        return Ordering(topic, one, other, measure, None, None, NOTHING)
    a, b = (auroc(s) if rate is None else detection_at(s, rate) for s in samples)

    def difference(w: Floats) -> Floats:
        return a(w) - b(w)

    ones = np.ones((1, len(watched)))
    count = int(samples[0].counted.sum())
    found = bootstrap(difference, watched.clusters, count, differ=True)
    values = float(a(ones)[0]), float(b(ones)[0])
    return Ordering(topic, one, other, measure, *values, found, found.p)


def rates_differ(
    topic: str,
    watched: Watches,
    better: str,
    worse: str,
    thresholds: Sequence[float],
    failing: str = PAPER_SET,
) -> Ordering:
    """Detection rates as the paper counts them, whatever the false alarms."""
    at = "0.90" if len(thresholds) == 1 else "three thresholds, on average"
    measure = f"detection as the paper counts it (at {at}, false alarms left aside)"
    if not {better, worse} <= set(watched.names):
        return Ordering(topic, better, worse, measure, None, None, NOTHING)
    alarms = {d: at_thresholds(watched, d, thresholds) for d in (better, worse)}
    where = watched.of_set(failing) & alarms[better].seen_by & alarms[worse].seen_by
    shares = {d: a.share() for d, a in alarms.items()}
    return shares_differ(topic, watched, (better, worse), measure, shares, where)


def shares_differ(
    topic: str,
    watched: Watches,
    pair: tuple[str, str],
    measure: str,
    shares: Mapping[str, Floats],
    where: Floats | np.ndarray,
) -> Ordering:
    """Two shares of the same runs, such as those with an alarm in time."""
    if not where.any():
        return Ordering(topic, *pair, measure, None, None, NOTHING)
    ratios = {d: Ratio(shares[d] * where, where.astype(float), whole=False) for d in pair}
    mixed = {"difference": {pair[0]: 1.0, pair[1]: -1.0}}
    found = measured(ratios, watched.clusters, mixed)
    first, second = (found[d].value for d in pair)
    difference = found["difference"]
    return Ordering(topic, *pair, measure, first, second, difference, difference.p)


def _known(watched: Watches, judge: str | Together) -> bool:
    parts = {judge} if isinstance(judge, str) else {judge.first, judge.second}
    return parts <= set(watched.names)


def _name(judge: str | Together) -> str:
    return judge if isinstance(judge, str) else judge.name


def _p(of: Ordering) -> float:
    return 1.0 if of.p is None else of.p


def _percent(value: float) -> str:
    return f"{100 * value:.1f} %"
