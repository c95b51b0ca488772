"""What raters' answers come to: shares with intervals, agreement, strengths, what could be found.

Called by `reporting.py` and by whoever wants the numbers; calls `clustered.py`, whose intervals go
by rater and by item.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from statistics import median
from typing import Any

import numpy as np

from forestall.statistics.intervals import Metric
from forestall.study.agreement import strengths
from forestall.study.answers import Rater
from forestall.study.clustered import Clusters, alpha_of, share_of
from forestall.study.model import Study
from forestall.study.power import ASSUMED, Variance, detectable, raters_needed, variance_of

LEAST_CHECKS = 2 / 3
"""Share of attention checks that a rater must have right to be counted."""

ALL = "all"
DIFFERENCES = (0.05, 0.1, 0.15, 0.2, 0.25)
RATERS = (5, 10, 15, 20, 30, 60)


@dataclass(frozen=True, slots=True)
class Comparison:
    """One answer that counts.

    Args:
        rater: number. `item`: name. `against`: the rival.
        score: 1 ours is better, 0 the rival is, 0.5 both.
        first: whether the side a was chosen, None for both.
        seconds: see `Answer`.
    """

    rater: int
    item: str
    against: str
    score: float
    first: bool | None
    seconds: float | None


def comparisons(study: Study, rater: Rater) -> list[Comparison]:
    """A rater's answers but for the attention checks."""
    found = []
    for position, answer in sorted(rater.answers.items()):
        trial = study.raters[rater.start.rater - 1][position]
        if trial.check:
            continue
        both = answer.choice == "both"
        score = 0.5 if both else float(answer.choice == trial.ours)
        first = None if both else answer.choice == "a"
        found.append(
            Comparison(rater.start.rater, trial.item, trial.against, score, first, answer.seconds)
        )
    return found


def checks(study: Study, rater: Rater) -> tuple[int, int]:
    """How many attention checks a rater has right, of how many."""
    trials = study.raters[rater.start.rater - 1]
    answered = [(trials[k], a) for k, a in rater.answers.items() if trials[k].check]
    return sum(a.choice == t.ours for t, a in answered), len(answered)


def attentive(study: Study, rater: Rater) -> bool:
    """Whether a rater has enough of the attention checks right; without any he is believed."""
    right, count = checks(study, rater)
    return right >= LEAST_CHECKS * count


def shares(found: Sequence[Comparison], against: Sequence[str]) -> dict[str, dict[str, Metric]]:
    """Of each rival, and of all together: wins, losses, both, and preference.

    Preference counts "both" as half a win; decided is the share of wins among wins and losses.

    Args:
        found: answers.
        against: the rivals.
    """
    table = {}
    for name in (*against, ALL):
        mine = [c for c in found if name in (c.against, ALL)]
        decided = [c for c in mine if c.score != 0.5]
        by, by_decided = _clusters(mine), _clusters(decided)
        table[name] = {
            "wins": share_of([c.score == 1 for c in mine], by),
            "losses": share_of([c.score == 0 for c in mine], by),
            "both": share_of([c.score == 0.5 for c in mine], by),
            "decided": share_of([c.score == 1 for c in decided], by_decided),
            "preference": share_of([c.score for c in mine], by),
        }
    return table


def _clusters(found: Sequence[Comparison]) -> Clusters:
    return Clusters.of([c.rater for c in found], [c.item for c in found])


def summary(study: Study, raters: Sequence[Rater]) -> dict[str, Any]:
    """All numbers of some raters, as plain data.

    Args:
        study: that they answered.
        raters: either all people or all simulated; a caller never mixes them.
    """
    counted = [r for r in raters if attentive(study, r)]
    found = [c for r in counted for c in comparisons(study, r)]
    everybody = [c for r in raters for c in comparisons(study, r)]
    right = [checks(study, r) for r in raters]
    data: dict[str, Any] = {
        "raters": len(raters),
        "finished": sum(len(r.answers) == len(study.raters[r.start.rater - 1]) for r in raters),
        "not_attentive": len(raters) - len(counted),
        "checks": {"right": sum(a for a, _ in right), "of": sum(b for _, b in right)},
        "answers": len(found),
        "items": len({c.item for c in found}),
    }
    if not found:
        return data
    table = shares(found, study.against)
    data["against"] = {name: _rival(name, row, found) for name, row in table.items()}
    if len(counted) < len(raters):
        all_of_them = shares(everybody, study.against)[ALL]["preference"]
        data["preference_of_all_raters"] = all_of_them.to_json()
    data["alpha"] = _alpha(found)
    data["strengths"] = _strengths(study, found, table)
    decided = [c.first for c in found if c.first is not None]
    seconds = [c.seconds for c in found if c.seconds is not None]
    data["side_a"] = sum(decided) / len(decided) if decided else None
    data["median_s"] = median(seconds) if seconds else None
    measured_parts = variance_of(
        [c.score for c in found], [c.against for c in found],
        [c.rater for c in found], [c.item for c in found],
    )  # fmt: skip
    data["power"] = power_of(study, measured_parts or ASSUMED)
    return data


def power_of(study: Study, variance: Variance = ASSUMED) -> dict[str, Any]:
    """What a study of these items can find, with its raters, with others, and how many it takes."""
    own = [t for t in study.raters[0] if not t.check]
    each, items = len(own) / len(study.against), len(study.items)
    counts = sorted({*RATERS, len(study.raters)})
    return {
        "variance": {
            "rater": variance.rater,
            "item": variance.item,
            "rest": variance.rest,
            "assumed": variance.assumed,
        },
        "answers_each": each,
        "detectable": {str(n): detectable(variance, n, items, each) for n in counts},
        "raters_needed": {str(d): raters_needed(variance, d, items, each) for d in DIFFERENCES},
    }


def _rival(name: str, row: dict[str, Metric], found: Sequence[Comparison]) -> dict[str, Any]:
    """Numbers against one rival; better: the whole interval of the preference is above one half."""
    preference = row["preference"]
    low, high = preference.low, preference.high
    verdict = None
    if low is not None and high is not None:
        verdict = "better" if low > 0.5 else "worse" if high < 0.5 else "not told apart"
    return {
        **{what: metric.to_json() for what, metric in row.items()},
        "raters": len({c.rater for c in found if name in (c.against, ALL)}),
        "verdict": verdict,
        "odds": None if name == ALL else _odds(preference),
    }


def _odds(preference: Metric) -> dict[str, float | None]:
    """Bradley-Terry odds that ours beats a rival, with their interval.

    Where rivals are compared with ours alone, its odds against each depend on nothing else, and
    are those of the preference.
    """

    def odds(share: float | None) -> float | None:
        return None if share is None or not 0 < share < 1 else share / (1 - share)

    ends = {"value": preference.value, "low": preference.low, "high": preference.high}
    return {end: odds(share) for end, share in ends.items()}


def _strengths(
    study: Study, found: Sequence[Comparison], table: Mapping[str, Mapping[str, Metric]]
) -> dict[str, dict[str, float | None]] | None:
    """Bradley-Terry log-strengths, ours 0; intervals are those of the odds, as ours is in each."""
    names = (study.ours, *study.against)
    wins = np.zeros((len(names), len(names)))
    for c in found:
        k = names.index(c.against)
        wins[0, k] += c.score
        wins[k, 0] += 1 - c.score
    fitted = strengths(wins)
    if fitted is None or not all(map(math.isfinite, fitted)):
        return None
    said: dict[str, dict[str, float | None]] = {}
    for name, value in zip(study.against, fitted[1:], strict=True):
        odds = _odds(table[name]["preference"])
        low, high = (None if o is None else -math.log(o) for o in (odds["high"], odds["low"]))
        said[name] = {"value": float(value), "low": low, "high": high}
    return said


def _alpha(found: Sequence[Comparison]) -> dict[str, Any]:
    """Agreement about which of the three it is, over comparisons that several raters made."""
    units = [(c.item, c.against) for c in found]
    several = sum(times > 1 for times in Counter(units).values())
    metric = alpha_of([c.score for c in found], units, _clusters(found))
    return {**metric.to_json(), "comparisons": several}
