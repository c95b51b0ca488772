"""Whether the paper's orderings hold in the rows, each in a sentence.

Calls: `summary` → here → `intervals`. Two things are compared on the runs that both were measured
on; an ordering holds when the interval of the difference lies above 0. Detectors are compared at
equal false-alarm rates, since the one that alarms more often always detects more.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np

from forestall.statistics.cells import Names, points, shown
from forestall.statistics.intervals import NOTHING, Floats, Metric, bootstrap, mean
from forestall.statistics.metrics import (
    PAPER_SET,
    THRESHOLDS,
    at_thresholds,
    scene_of,
    scores,
)
from forestall.statistics.outcomes import (
    NO_STRATEGY,
    ONLINE,
    POST_HOC,
    PROACTIVE,
    Runs,
    compared,
    of_set,
    outcome_metrics,
)
from forestall.statistics.paper import ABLATIONS, FULL
from forestall.statistics.rows import EpisodeRow
from forestall.statistics.sweep import auroc, detection_at, sample

HOLDS = "holds"
FAILS = "does not hold"
UNDECIDED = "not decided"
UNMEASURED = "not measured"

ENOUGH = 10
"""Fewer pairs than this decide nothing, however they come out."""

OTHER_DETECTORS = ("objects", "caption", "image")

EQUAL_FALSE_ALARMS = {
    "detection at 5 % false alarms": 0.05,
    "detection at 10 % false alarms": 0.10,
    "AUROC": None,
}


@dataclass(frozen=True, slots=True)
class Ordering:
    """One ordering of the paper, held against the rows.

    Args:
        topic: "strategies", "detectors", "ablations" or "reasoning".
        better: name of what should be better.
        worse: name of what should be worse.
        measure: in which it should be, in words.
        first: value of the better one, None when not measured.
        second: value of the worse one, likewise.
        difference: first minus second on the same runs.
    """

    topic: str
    better: str
    worse: str
    measure: str
    first: float | None
    second: float | None
    difference: Metric

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

    def sentence(self, names: Names | None = None) -> str:
        """The verdict in plain English, with detectors shown as `names` says."""
        better, worse = (shown(n, names or {}) for n in (self.better, self.worse))
        claim = f"{better} over {worse} in {self.measure}"
        if self.first is None or self.second is None or self.difference.value is None:
            return f"{claim}: {UNMEASURED}."
        seen = (
            f"{_percent(self.first)} against {_percent(self.second)}, difference "
            f"{points(self.difference.to_json())}"
        )
        if self.verdict == HOLDS:
            return f"{claim}: holds: {seen}."
        if self.verdict == FAILS:
            return f"{claim}: does not hold: {seen}."
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
            "sentence": self.sentence(names),
        }


def orderings(
    setups: Mapping[str, Runs], watched: Sequence[EpisodeRow], failing: str = PAPER_SET
) -> list[Ordering]:
    """Every ordering of the paper.

    Args:
        setups: runs by strategy.
        watched: runs that detectors watched.
        failing: set of the failing runs that detectors are compared on.
    """
    chain = (PROACTIVE, ONLINE, POST_HOC, NO_STRATEGY)
    found = [
        strategies_differ("strategies", setups, better, worse, "irreversible")
        for better, worse in pairwise(chain)
    ]
    found += [
        detectors_differ("detectors", watched, FULL, other, measure, failing)
        for measure in EQUAL_FALSE_ALARMS
        for other in OTHER_DETECTORS
    ]
    for thresholds in (THRESHOLDS, THRESHOLDS[:1]):
        found += [
            rates_differ("ablations", watched, FULL, other, thresholds, failing)
            for other in ABLATIONS.values()
        ]
    found += [
        detectors_differ("ablations", watched, FULL, other, measure, failing)
        for measure in EQUAL_FALSE_ALARMS
        for other in ABLATIONS.values()
    ]
    without = f"{PROACTIVE}, without reasoning"
    found += [
        strategies_differ("reasoning", setups, PROACTIVE, without, of)
        for of in (PAPER_SET, "irreversible")
    ]
    return found


def strategies_differ(
    topic: str, setups: Mapping[str, Runs], better: str, worse: str, of: str
) -> Ordering:
    """Success of two strategies on the cases of a set that both were run on."""
    measure = f"success on the {of} set"
    first, second = setups.get(better, {}), setups.get(worse, {})
    pair = compared(first, second, of)
    if pair.difference.value is None:
        return Ordering(topic, better, worse, measure, None, None, NOTHING)
    rates = [
        outcome_metrics(of_set({c: r for c, r in runs.items() if c in other}, of))["success"].value
        for runs, other in ((first, second), (second, first))
    ]
    return Ordering(topic, better, worse, measure, rates[0], rates[1], pair.difference)


def detectors_differ(
    topic: str,
    watched: Sequence[EpisodeRow],
    better: str,
    worse: str,
    measure: str,
    failing: str = PAPER_SET,
) -> Ordering:
    """Two detectors at equal false-alarm rates, undisturbed and harmless runs as negatives."""
    rows = _both(watched, better, worse)
    one, other = (sample(rows, d, "all", failing) for d in (better, worse))
    if not one.complete:
        return Ordering(topic, better, worse, measure, None, None, NOTHING)
    rate = EQUAL_FALSE_ALARMS[measure]
    a, b = (auroc(s) if rate is None else detection_at(s, rate) for s in (one, other))

    def difference(w: Floats) -> Floats:
        return a(w) - b(w)

    ones = np.ones((1, len(one.scenes)))
    return Ordering(
        topic,
        better,
        worse,
        measure,
        float(a(ones)[0]),
        float(b(ones)[0]),
        bootstrap(difference, one.scenes),
    )


def rates_differ(
    topic: str,
    watched: Sequence[EpisodeRow],
    better: str,
    worse: str,
    thresholds: Sequence[float],
    failing: str = PAPER_SET,
) -> Ordering:
    """Detection rates as the paper counts them, whatever the false alarms."""
    at = "0.90" if len(thresholds) == 1 else "three thresholds, on average"
    measure = f"detection as the paper counts it (at {at}, false alarms left aside)"
    rows = [r for r in _both(watched, better, worse) if r.set == failing]
    first, second = (
        [a.share() for a in at_thresholds(rows, d, thresholds)] for d in (better, worse)
    )
    if not rows:
        return Ordering(topic, better, worse, measure, None, None, NOTHING)
    difference = mean(
        [a - b for a, b in zip(first, second, strict=True)], [scene_of(r) for r in rows]
    )
    return Ordering(
        topic,
        better,
        worse,
        measure,
        float(np.mean(first)),
        float(np.mean(second)),
        difference,
    )


def _both(rows: Sequence[EpisodeRow], *names: str) -> list[EpisodeRow]:
    """Runs that every one of the detectors watched."""
    known = {d for r in rows for j in r.judged for d in j.scores}
    if not known.issuperset(names):
        return []
    return [r for r in rows if all(scores(r, d) is not None for d in names)]


def _percent(value: float) -> str:
    return f"{100 * value:.1f} %"
