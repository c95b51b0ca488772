"""Everything that the rows of an experiment say, as plain data: `summary.json`.

Calls: the experiments → here → metrics, sweep, outcomes, orderings, paper. Reads no files. Rows are
put in a fixed order first, so that the same episodes give the same summary however they were run.
Every metric is `{"value", "low", "high", "n", "method"}`, with `count` where it is a share; what
was not measured is None, never 0 and never NaN.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any

from forestall.statistics.cases import CASE_SETS, UNDISTURBED, Case
from forestall.statistics.cells import Names
from forestall.statistics.intervals import LEVEL, NOTHING, RESAMPLES, SEED, Metric
from forestall.statistics.metrics import (
    HARMLESS,
    PAPER_SET,
    THRESHOLDS,
    Alarms,
    at_thresholds,
    by_rule,
    canonical,
    confirmed,
    detection_rates,
    detectors,
    false_alarm_metrics,
    point_metrics,
    trivial,
    watched,
)
from forestall.statistics.orderings import orderings
from forestall.statistics.outcomes import (
    DETECTOR,
    ERROR,
    NO_STRATEGY,
    PROACTIVE,
    THRESHOLD,
    Runs,
    Setup,
    by_setup,
    compared,
    mean_over,
    of_set,
    outcome_metrics,
    prevented,
    sets_of,
)
from forestall.statistics.paper import comparison
from forestall.statistics.rows import EpisodeRow
from forestall.statistics.sweep import NEGATIVES, roc_points, sample, sweep_metrics

SUMMARY_FORMAT = 1
"""Raised whenever a field changes its meaning."""

DIGITS = 9
"""Of the numbers in a summary; sums may differ beyond between machines."""

FAILING_SETS = ("robofail", "irreversible")

OUTCOMES = ("success", "weak_success", "prevented", "errors", "stopped", "held", "replanned")
"""What is said of strategies by kind, task and knowability."""

Metrics = dict[str, Metric]


def summary(
    rows: Iterable[EpisodeRow],
    meta: Mapping[str, Any],
    notes: Sequence[str] = (),
    names: Names | None = None,
) -> dict[str, Any]:
    """Summarise an experiment.

    Args:
        rows: its episodes, in any order.
        meta: kept as it is: machine, versions, arguments.
        notes: what is to be said below every table, such as what is missing.
        names: what is shown in place of a detector's name; kept for the tables.

    Raises:
        InputError: an episode is there twice, or a failing one does not say when its failure can
            be known.
    """
    found = canonical(rows)
    setups: dict[str, dict[Case, EpisodeRow]] = by_setup(found)
    runs = watched(found)
    single = operating_points(runs)
    failing = [of for of in FAILING_SETS if any(r.set == of for r in runs)]
    main = failing[0] if failing else PAPER_SET
    by_set = {of: _detectors(runs, single, of) for of in dict.fromkeys([main, *failing])}
    first = f"@{THRESHOLDS[0]:.2f}"
    alarms = {d + first: at_thresholds(runs, d, THRESHOLDS[:1]) for d in detectors(runs)} | single
    strategies = {
        name: {of: outcome_metrics(of_set(s, of)) for of in sets_of(s)}
        for name, s in setups.items()
    }
    over = _over_thresholds(setups)
    result = {
        "format": SUMMARY_FORMAT,
        "meta": dict(meta),
        "names": dict(names or {}),
        "intervals": {"level": LEVEL, "resamples": RESAMPLES, "seed": SEED},
        "episodes": _episodes(found, notes),
        "strategies": strategies,
        "success_over_thresholds": over,
        "paired": _paired(setups),
        "detection_set": main,
        "detectors": by_set[main],
        "detectors_by_set": by_set,
        "roc": {
            of: {d: {n: _roc(runs, d, n, of) for n in NEGATIVES} for d in detectors(runs)}
            for of in by_set
        },
        "by_kind": _split(setups, alarms, lambda r: r.kind),
        "by_task": _split(setups, alarms, lambda r: r.task),
        "by_knowable": _split(setups, alarms, lambda r: r.knowable),
        "orderings": [o.to_json(names) for o in orderings(setups, runs)],
        "paper": comparison(strategies, by_set.get(PAPER_SET, {}), over, NOTHING),
    }
    plain = _plain(result)
    assert isinstance(plain, dict)
    return plain


def primary(runs: Sequence[EpisodeRow]) -> tuple[str, float]:
    """The detector that decided in the watched runs, and its threshold."""
    known = detectors(runs)
    counted = Counter((r.detector, r.threshold) for r in runs if r.detector in known)
    if not counted:
        return DETECTOR, THRESHOLD
    return min(counted, key=lambda pair: (-counted[pair], pair))


def operating_points(runs: Sequence[EpisodeRow]) -> dict[str, list[Alarms]]:
    """Detectors with a single operating point: with reasoning, and the trivial ones."""
    name, threshold = primary(runs)
    own = at_thresholds(runs, name, (threshold,)) if name in detectors(runs) else []
    found: dict[str, list[Alarms]] = {}
    if any(j.confirmed or j.cause for r in runs for j in r.judged):
        found[f"{name} + reasoning"] = by_rule(runs, confirmed)
    return {**found, **(trivial(runs, own) if runs else {})}


def _detectors(
    runs: Sequence[EpisodeRow], single: Mapping[str, Sequence[Alarms]], failing: str
) -> dict[str, Metrics]:
    found: dict[str, Metrics] = {}
    for name in detectors(runs):
        metrics = sweep_metrics(runs, name, failing)
        for suffix, thresholds in _suffixes().items():
            point = point_metrics(at_thresholds(runs, name, thresholds), failing)
            metrics |= {f"{metric}@{suffix}": value for metric, value in point.items()}
        found[name] = metrics
    for name, alarms in single.items():
        found[name] = point_metrics(alarms, failing)
    return found


def _suffixes() -> dict[str, tuple[float, ...]]:
    return {**{f"{t:.2f}": (t,) for t in THRESHOLDS}, "mean": THRESHOLDS}


def _roc(
    runs: Sequence[EpisodeRow], detector: str, negatives: str, failing: str
) -> list[dict[str, float | None]]:
    points = roc_points(sample(runs, detector, negatives, failing))
    return [
        {"false_alarm_rate": false, "detection_rate": detected, "score": score}
        for false, detected, score in points
    ]


def _over_thresholds(setups: Mapping[str, Runs]) -> dict[str, Metrics]:
    """Success of the proactive strategy at the paper's thresholds, by detector (its Fig. 8a)."""
    found: dict[str, Metrics] = {}
    there = {r.detector for runs in setups.values() for r in runs.values()}
    for detector in sorted(there):
        at = {t: setups.get(Setup(PROACTIVE, detector, t).name, {}) for t in THRESHOLDS}
        values = {
            f"success@{t:.2f}": outcome_metrics(of_set(runs, PAPER_SET))["success"]
            for t, runs in at.items()
        }
        shared = [c for c in at[THRESHOLDS[0]] if all(c in runs for runs in at.values())]
        values["success@mean"] = mean_over(
            [[at[t][c] for t in THRESHOLDS] for c in shared if c.set == PAPER_SET]
        )
        if any(v.n for v in values.values()):
            found[detector] = values
    return found


def _paired(setups: Mapping[str, Runs]) -> dict[str, dict[str, dict[str, Any]]]:
    """Every strategy minus no strategy, on the cases that both were run on."""
    base = setups.get(NO_STRATEGY, {})
    found: dict[str, dict[str, dict[str, Any]]] = {}
    for name, runs in setups.items():
        if name != NO_STRATEGY:
            found[name] = {
                of: {
                    "success": compared(runs, base, of).to_json(),
                    "prevented": compared(runs, base, of, prevented).to_json(),
                }
                for of in sets_of(runs)
            }
    return found


def _split(
    setups: Mapping[str, Runs],
    alarms: Mapping[str, Sequence[Alarms]],
    key: Callable[[EpisodeRow], str | None],
) -> dict[str, dict[str, dict[str, dict[str, Metrics]]]]:
    """Set → value of the key → "strategies" and "detectors" → name → metric."""
    everything = [r for runs in setups.values() for r in runs.values()]
    found: dict[str, dict[str, dict[str, dict[str, Metrics]]]] = {}
    for of in sorted({r.set for r in everything}, key=_set_order):
        for value in sorted({k for r in everything if r.set == of and (k := key(r)) is not None}):
            chosen = {
                name: [r for r in of_set(runs, of) if key(r) == value]
                for name, runs in setups.items()
            }
            raised = {
                name: [a for a in every if a.row.set == of and key(a.row) == value]
                for name, every in alarms.items()
            }
            found.setdefault(of, {})[value] = {
                "strategies": {n: _outcomes(r) for n, r in chosen.items() if r},
                "detectors": _rates({n: a for n, a in raised.items() if a}, of),
            }
    return found


def _outcomes(runs: Sequence[EpisodeRow]) -> Metrics:
    metrics = outcome_metrics(runs)
    return {m: metrics[m] for m in OUTCOMES}


def _rates(chosen: Mapping[str, Sequence[Alarms]], of: str) -> dict[str, Metrics]:
    """Rates of the detectors in some of the runs of one set."""
    found = {}
    for name, alarms in chosen.items():
        if of in (UNDISTURBED, HARMLESS):
            found[name] = false_alarm_metrics(alarms, of)
        else:
            found[name] = detection_rates(alarms)
    return found


def _episodes(rows: Sequence[EpisodeRow], notes: Sequence[str]) -> dict[str, Any]:
    broken = sum(r.end == ERROR for r in rows)
    if broken:
        notes = [*notes, f"{broken} of {len(rows)} episodes broke off; they count as failed"]
    return {
        "found": len(rows),
        "executed": sum(not r.implied for r in rows),
        "errors": broken,
        "notes": list(notes),
    }


def _set_order(name: str) -> tuple[int, str]:
    return (CASE_SETS.index(name) if name in CASE_SETS else len(CASE_SETS), name)


def _plain(data: object) -> object:
    """As JSON has it: no metric objects, no tuples, no NaN, rounded numbers."""
    if isinstance(data, Metric):
        return _plain(data.to_json())
    if isinstance(data, Mapping):
        return {str(k): _plain(v) for k, v in data.items()}
    if isinstance(data, list | tuple):
        return [_plain(v) for v in data]
    if isinstance(data, float):
        return round(data, DIGITS) + 0.0 if math.isfinite(data) else None
    return data
