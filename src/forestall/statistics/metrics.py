"""How well alarms tell failing runs from others: detection, false alarms, lead.

Calls: `summary`, `orderings` → here → `intervals`. Everything is computed from the rows of runs
that nobody interrupted (strategy "watch"), in which many detectors judged the same observations; a
boundary raises an alarm when its score lies below the threshold (paper, Sec. 3.3). A boundary
without a score raises none, and a run that broke off raises none from there on.
"""

from __future__ import annotations

from collections.abc import Hashable, Iterable, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from forestall.errors import InputError
from forestall.statistics.cases import UNDISTURBED, Case
from forestall.statistics.intervals import (
    NOTHING,
    SEED,
    Floats,
    Metric,
    bootstrap,
    divided,
    rate,
    ratio,
)
from forestall.statistics.intervals import proportion as exact
from forestall.statistics.rows import EpisodeRow, Judged

WATCH = "watch"
HARMLESS = "harmless"
PAPER_SET = "robofail"

THRESHOLDS = (0.90, 0.85, 0.80)
"""Of the paper's experiments (Sec. 4, "Analysis of Potential Failure Detection")."""

RANDOM_DRAWS = 200

ALWAYS, NEVER, RANDOM, TRUTH = "always", "never", "random", "true plan check"
TRIVIAL = (ALWAYS, NEVER, RANDOM, TRUTH)
"""Detectors that cost nothing, and the simulator's truth as the upper bound."""


def order(row: EpisodeRow) -> tuple[str | int | float, ...]:
    """Where a row stands among others, whatever order they were written in."""
    return (
        row.profile,
        row.set,
        row.task,
        row.scenario or "",
        row.seed,
        row.strategy,
        row.detector,
        row.threshold,
        row.without or "",
        row.model,
        row.demonstrations,
    )


def canonical(rows: Iterable[EpisodeRow]) -> tuple[EpisodeRow, ...]:
    """Rows in a fixed order.

    Raises:
        InputError: one episode is there twice; it would count twice.
    """
    found = sorted(rows, key=order)
    for one, other in pairwise(found):
        if order(one) == order(other):
            raise InputError(f"two rows of the same episode: {order(one)}")
    return tuple(found)


def case_of(row: EpisodeRow) -> Case:
    """The case that a row is an episode of."""
    return Case(row.set, row.task, row.scenario, row.seed)


def scene_of(row: EpisodeRow) -> Hashable:
    """What episodes share that are not independent of each other."""
    return row.task, row.seed


def watched(rows: Iterable[EpisodeRow]) -> tuple[EpisodeRow, ...]:
    """The runs that detectors watched, one of each case, in a fixed order.

    Raises:
        InputError: two of one case.
    """
    found = canonical(r for r in rows if r.strategy == WATCH)
    for one, other in pairwise(found):
        if case_of(one) == case_of(other):
            raise InputError(f"two watched runs of one case: {case_of(one)}")
    return found


def boundaries(row: EpisodeRow) -> tuple[Judged, ...]:
    """The moments of a watched run at which an alarm could have been raised."""
    return tuple(j for j in row.judged if j.when == "before" or j.scores)


def scores(row: EpisodeRow, detector: str) -> dict[int, float | None] | None:
    """Score by place among the boundaries, None when the detector did not watch this run."""
    found = {k: j.scores[detector] for k, j in enumerate(boundaries(row)) if detector in j.scores}
    return found if found or not boundaries(row) else None


def detectors(rows: Iterable[EpisodeRow]) -> tuple[str, ...]:
    """Every detector that gave a score, sorted."""
    return tuple(
        sorted({d for r in rows if r.strategy == WATCH for j in r.judged for d in j.scores})
    )


@dataclass(frozen=True, slots=True)
class Alarms:
    """Where a detector raised alarms in one run.

    Args:
        row: the run.
        raised: (draws, boundaries); several draws for chance, and for a mean over thresholds.
    """

    row: EpisodeRow
    raised: NDArray[np.bool_]

    def share(self, first: float = -np.inf, last: float = np.inf) -> float:
        """Share of draws with an alarm at a boundary from `first` to `last`."""
        return float(self.raised[:, self._between(first, last)].any(axis=1).mean())

    def raised_before(self, index: float = np.inf) -> tuple[float, int]:
        """Mean number of alarms before a position, and of boundaries there."""
        inside = self._between(-np.inf, index - 0.5)
        return float(self.raised[:, inside].sum(axis=1).mean()), int(inside.sum())

    def lead(self) -> tuple[float, float, float]:
        """Subtasks and seconds from the first alarm in time to the harm, and share of draws.

        Both are summed over draws with an alarm in time and divided by the number of draws.
        """
        known, effect = moments(self.row)
        places = np.flatnonzero(self._between(known, effect))
        raised = self.raised[:, places]
        hit = raised.any(axis=1)
        if not hit.any():
            return 0.0, 0.0, 0.0
        there = boundaries(self.row)
        at = [j.time_s for j in there if j.index == effect]
        harm_s = at[0] if at else self.row.simulated_s
        first = [there[places[k]] for k in raised[hit].argmax(axis=1)]
        draws = len(self.raised)
        return (
            sum(effect - j.index for j in first) / draws,
            sum(harm_s - j.time_s for j in first) / draws,
            float(hit.mean()),
        )

    def _between(self, first: float, last: float) -> NDArray[np.bool_]:
        index = np.array([j.index for j in boundaries(self.row)], float)
        return (index >= first) & (index <= last)


def moments(row: EpisodeRow) -> tuple[int, int]:
    """When a failing run can first be known to fail, and when the harm is done.

    Raises:
        InputError: the run is not a failing one.
    """
    if row.known is None or row.effect is None:
        raise InputError(
            f"{case_of(row)} does not say when its failure can be known and takes effect"
        )
    return row.known, row.effect


def foreseeable(row: EpisodeRow) -> bool:
    """Whether the failure can be known before the harm is done."""
    known, effect = moments(row)
    return known <= effect


def at_thresholds(
    rows: Iterable[EpisodeRow], detector: str, thresholds: Sequence[float]
) -> list[Alarms]:
    """A detector's alarms in the runs that it watched, one draw for each threshold."""
    found = []
    for row in rows:
        given = scores(row, detector)
        if given is not None:
            value = [given.get(k) for k in range(len(boundaries(row)))]
            line = np.array([np.inf if v is None else v for v in value], float)
            found.append(Alarms(row, line[None, :] < np.array(thresholds, float)[:, None]))
    return found


class _Rule(Protocol):
    def __call__(self, judged: Judged, /) -> bool: ...


def by_rule(rows: Iterable[EpisodeRow], rule: _Rule) -> list[Alarms]:
    """Alarms wherever a rule says so."""
    return [Alarms(r, np.array([[rule(j) for j in boundaries(r)]], bool)) for r in rows]


def confirmed(judged: Judged) -> bool:
    """An alarm of the deciding detector in which the reasoner found something to change."""
    return judged.confirmed and judged.decision == "replan"


def impossible(judged: Judged) -> bool:
    """The simulator's truth: the next subtask, or the goal by this plan, is out of reach."""
    return judged.reachable is False or judged.possible is False


def at_random(rows: Iterable[EpisodeRow], like: Sequence[Alarms]) -> list[Alarms]:
    """Alarms at random boundaries, at the rate per boundary of another detector's alarms."""
    raised = sum(a.raised_before()[0] for a in like)
    there = sum(a.raised_before()[1] for a in like)
    often = raised / there if there else 0.0
    random = np.random.default_rng(SEED)
    return [Alarms(r, random.random((RANDOM_DRAWS, len(boundaries(r)))) < often) for r in rows]


def trivial(rows: Sequence[EpisodeRow], like: Sequence[Alarms]) -> dict[str, list[Alarms]]:
    """The trivial detectors on the same runs; chance fires as often as `like`."""
    return {
        ALWAYS: by_rule(rows, lambda _: True),
        NEVER: by_rule(rows, lambda _: False),
        RANDOM: at_random(rows, like),
        TRUTH: by_rule(rows, impossible),
    }


def point_metrics(alarms: Sequence[Alarms], failing: str = PAPER_SET) -> dict[str, Metric]:
    """Everything that can be said of one operating point.

    Args:
        alarms: of failing, undisturbed and harmless runs.
        failing: which set the detection rates are about.
    """
    bad = [a for a in alarms if a.row.set == failing]
    undisturbed = [a for a in alarms if a.row.set == UNDISTURBED]
    harmless = [a for a in alarms if a.row.set == HARMLESS]
    found = detection_metrics(bad)
    found |= false_alarm_metrics(undisturbed, UNDISTURBED) | false_alarm_metrics(harmless, HARMLESS)
    found["pairs_apart"] = pairs_apart(bad, undisturbed)
    found[f"balanced_accuracy_{UNDISTURBED}"] = balanced_accuracy(bad, undisturbed)
    found["balanced_accuracy_all"] = balanced_accuracy(bad, undisturbed + harmless)
    return found


def detection_rates(bad: Sequence[Alarms]) -> dict[str, Metric]:
    """How many failing runs are detected.

    `fdr` counts as the paper does: any alarm anywhere in a failing run. `after_known` only counts
    alarms from when the failure can be known, `in_time` only those up to the harm, of the failures
    that can be known before it.
    """
    seen = [a for a in bad if foreseeable(a.row)]
    return {
        "fdr": _share([a.share() for a in bad], bad),
        "in_time": _share([a.share(*moments(a.row)) for a in seen], seen),
        "after_known": _share([a.share(moments(a.row)[0]) for a in bad], bad),
    }


def detection_metrics(bad: Sequence[Alarms]) -> dict[str, Metric]:
    """Detection rates, alarms before a failure can be known, and lead over the harm."""
    early = [a.raised_before(moments(a.row)[0]) for a in bad]
    seen = [a for a in bad if foreseeable(a.row)]
    leads = [a.lead() for a in seen]
    scenes = [scene_of(a.row) for a in seen]
    in_time = [share for _, _, share in leads]
    hit = sum(share > 0 for share in in_time)
    return {
        **detection_rates(bad),
        "early_alarms_per_boundary": _per_boundary(bad, early),
        "lead_subtasks": ratio([k for k, _, _ in leads], in_time, scenes, hit),
        "lead_s": ratio([s for _, s, _ in leads], in_time, scenes, hit),
    }


def false_alarm_metrics(good: Sequence[Alarms], of: str) -> dict[str, Metric]:
    """False alarms in runs of one set that would have succeeded; its name ends each metric's."""
    return {
        f"false_alarms_per_boundary_{of}": _per_boundary(good, [a.raised_before() for a in good]),
        f"false_alarms_per_run_{of}": _share([a.share() for a in good], good),
    }


def pairs_apart(bad: Sequence[Alarms], undisturbed: Sequence[Alarms]) -> Metric:
    """Failing runs with an alarm whose undisturbed twin in the same room has none.

    Of a failing run and its twin, which differ in the fault alone, so many are told apart.
    """
    twins = {case_of(a.row): a for a in undisturbed}
    pairs = [(a, twins[twin]) for a in bad if (twin := case_of(a.row).twin) in twins]
    apart = [
        float((a.raised.any(axis=1) & ~b.raised.any(axis=1)).mean())
        if len(a.raised) == len(b.raised)
        else a.share() * (1 - b.share())
        for a, b in pairs
    ]
    return _share(apart, [a for a, _ in pairs])


def balanced_accuracy(bad: Sequence[Alarms], good: Sequence[Alarms]) -> Metric:
    """Mean of the share of failing runs with and of the other runs without any alarm."""
    if not bad or not good:
        return NOTHING
    hit = np.array([a.share() for a in bad])
    quiet = np.array([1 - a.share() for a in good])

    def value(w: Floats) -> Floats:
        first, second = w[:, : len(hit)], w[:, len(hit) :]
        sensitivity = divided(first @ hit, first.sum(axis=1))
        return (sensitivity + divided(second @ quiet, second.sum(axis=1))) / 2

    return bootstrap(value, [scene_of(a.row) for a in (*bad, *good)])


def _share(values: Sequence[float], alarms: Sequence[Alarms]) -> Metric:
    """Exact where each run either has it or not; a bootstrap for means over draws."""
    if _single(alarms):
        return exact([v > 0 for v in values])
    return rate(values, [1] * len(values), [scene_of(a.row) for a in alarms], whole=False)


def _per_boundary(alarms: Sequence[Alarms], counts: Sequence[tuple[float, int]]) -> Metric:
    scenes = [scene_of(a.row) for a in alarms]
    return rate([k for k, _ in counts], [n for _, n in counts], scenes, _single(alarms))


def _single(alarms: Sequence[Alarms]) -> bool:
    return all(len(a.raised) == 1 for a in alarms)
