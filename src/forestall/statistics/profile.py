"""Everything that the rows of one household say, as metrics by name.

Calls: `summary` → here → judgements, outcomes, orderings, comparisons, rooms, paper. Profiles are
never mixed: in the kind household a run fails if its set says so, and sets are looked at one by
one; in the honest one any run can fail or not, and all that do are looked at together.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any

import numpy as np

from forestall.statistics.bounded import bounded
from forestall.statistics.cases import Case
from forestall.statistics.cells import Names
from forestall.statistics.comparisons import comparisons
from forestall.statistics.intervals import NOTHING, Metric
from forestall.statistics.judgements import (
    Metrics,
    by_demonstrations,
    constancy,
    curves_of,
    default_alarms,
    judgements,
    not_judged,
    unforeseeable,
)
from forestall.statistics.judges import THRESHOLDS, is_variant
from forestall.statistics.metrics import ALWAYS, NEVER, RANDOM, Alarms, detection_rates
from forestall.statistics.orderings import orderings
from forestall.statistics.outcomes import (
    NO_STRATEGY,
    PROACTIVE,
    RETRY,
    Runs,
    by_setup,
    compared,
    false_alarm_cost,
    harm_prevented,
    mean_over,
    name_of,
    of_set,
    outcome_metrics,
    prevented,
    sets_of,
    shared_cases,
    time_between,
)
from forestall.statistics.paper import comparison
from forestall.statistics.rooms import over_rooms
from forestall.statistics.rows import HONEST, EpisodeRow, Setup
from forestall.statistics.watches import ALL, PAPER_SET, Watches

FAILING_SETS = ("robofail", "irreversible")

OUTCOMES = ("success", "weak_success", "prevented", "errors", "stopped", "held", "replanned")
"""What is said of strategies by kind, task and knowability."""

GROUPS: Mapping[str, Callable[[EpisodeRow], str | None]] = {
    "set": lambda r: r.set,
    "kind": lambda r: r.kind,
    "task": lambda r: r.task,
    "knowable": lambda r: r.knowable,
}


def content(
    rows: Sequence[EpisodeRow],
    profile: str,
    names: Names | None,
    calibration: Sequence[EpisodeRow] = (),
) -> dict[str, Any]:
    """What the rows of one profile say.

    Args:
        rows: of that profile alone, each once.
        profile: its name.
        names: what is shown in place of a judge's name, in sentences.
        calibration: rows of the same profile and another split, to draw thresholds from.

    Raises:
        InputError: a failing run does not say when its failure can be known.
    """
    setups = by_setup(rows)
    runs = Watches.of(rows)
    main, further = _detection_sets(runs, profile)
    by_set = {of: judgements(runs, of) for of in (main, *further)}
    alarms = {n: a for n, a in default_alarms(runs).items() if not is_variant(n)}
    told = {n: a for n, a in alarms.items() if n not in (ALWAYS, NEVER, RANDOM)}
    strategies = {
        name: {of: outcome_metrics(of_set(s, of)) for of in _sets(s, profile)}
        for name, s in setups.items()
    }
    over = _over_thresholds(setups, rows)
    on = ALL if profile == HONEST else "irreversible"
    return {
        "detection_set": main,
        "episodes": len(rows),
        "watched": {"runs": len(runs), "failing": int(runs.failing.sum())},
        "strategies": strategies,
        "success_over_thresholds": over,
        "paired": _paired(setups, NO_STRATEGY, profile),
        "paired_with_retry": _paired(setups, RETRY, profile),
        "shared": _shared(setups),
        "cost_of_false_alarms": _costs(setups),
        "main_judges": [n for n in runs.names if not is_variant(n)],
        "detectors": by_set[main],
        "detectors_by_set": by_set,
        "curves": {of: curves_of(runs, of) for of in by_set},
        "demonstrations": by_demonstrations(runs, by_set[main]),
        "bounded": bounded(rows, calibration) if calibration else None,
        "constant": constancy(runs),
        "not_judged": not_judged(runs),
        "unforeseeable": unforeseeable(runs),
        "rooms": over_rooms(setups, told),
        **{
            f"by_{name}": _split(setups, told, key, name == "set" or profile == HONEST)
            for name, key in GROUPS.items()
        },
        "orderings": [o.to_json(names) for o in orderings(setups, runs, main, on)],
        "comparisons": [o.to_json(names) for o in comparisons(setups, runs, main)],
        "paper": comparison(strategies, by_set.get(PAPER_SET, {}), over, NOTHING),
    }


def _detection_sets(runs: Watches, profile: str) -> tuple[str, tuple[str, ...]]:
    """The set whose failing runs judges are compared on, and others for the paper's numbers."""
    there = [of for of in FAILING_SETS if runs.of_set(of).any()]
    if profile == HONEST:
        return ALL, tuple(of for of in there if of == PAPER_SET)
    return (there[0], tuple(there[1:])) if there else (PAPER_SET, ())


def _sets(runs: Runs, profile: str) -> tuple[str, ...]:
    return (*sets_of(runs), *((ALL,) if profile == HONEST else ()))


def _over_thresholds(setups: Mapping[str, Runs], rows: Iterable[EpisodeRow]) -> dict[str, Metrics]:
    """Success of the proactive strategy at the paper's thresholds, by detector (its Fig. 8a)."""
    found: dict[str, Metrics] = {}
    for detector in sorted({r.detector for r in rows}):
        at = {t: setups.get(name_of(Setup(PROACTIVE, detector, t)), {}) for t in THRESHOLDS}
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


def _paired(setups: Mapping[str, Runs], base: str, profile: str) -> dict[str, dict[str, Any]]:
    """Every strategy minus a simple one, on the cases that both were run on."""
    second = setups.get(base, {})
    return {
        name: {
            of: {
                "success": compared(runs, second, of).to_json(),
                "prevented": compared(runs, second, of, prevented).to_json(),
                "seconds": time_between(runs, second, of),
            }
            for of in _sets(runs, profile)
        }
        for name, runs in setups.items()
        if name != base and second
    }


def _shared(setups: Mapping[str, Runs]) -> dict[str, Any]:
    """Strategies on the cases that all of them were run on."""
    cases = shared_cases(setups)
    base = {c: r for c, r in setups.get(NO_STRATEGY, {}).items() if c in cases}
    found = {}
    for name, runs in setups.items():
        there: dict[Case, EpisodeRow] = {c: r for c, r in runs.items() if c in cases}
        if there:
            found[name] = {
                **outcome_metrics(list(there.values())),
                "harm_prevented": harm_prevented(there, base),
            }
    return {"cases": len(cases), "strategies": found}


def _costs(setups: Mapping[str, Runs]) -> dict[str, dict[str, Metrics]]:
    """Strategy → base → what it costs where nobody is needed."""
    calm = setups.get(NO_STRATEGY, {})
    return {
        name: {
            base: false_alarm_cost(runs, setups[base], calm)
            for base in (NO_STRATEGY, RETRY)
            if base in setups and base != name
        }
        for name, runs in setups.items()
        if name != NO_STRATEGY
    }


def _split(
    setups: Mapping[str, Runs],
    alarms: Mapping[str, Alarms],
    key: Callable[[EpisodeRow], str | None],
    joined: bool,
) -> dict[str, dict[str, dict[str, dict[str, Metrics]]]]:
    """Set (or `ALL`) → value of the key → "strategies" and "detectors" → name → metric."""
    rows = [r for runs in setups.values() for r in runs.values()]
    found: dict[str, dict[str, dict[str, dict[str, Metrics]]]] = {}
    for of in (ALL,) if joined and rows else dict.fromkeys(sorted(r.set for r in rows)):
        for value in sorted({k for r in rows if of in (ALL, r.set) and (k := key(r)) is not None}):
            chosen = {
                name: [r for r in of_set(runs, of) if key(r) == value]
                for name, runs in setups.items()
            }
            found.setdefault(of, {})[value] = {
                "strategies": {n: _outcomes(r) for n, r in chosen.items() if r},
                "detectors": _rates(alarms, of, key, value),
            }
    return found


def _outcomes(runs: Sequence[EpisodeRow]) -> Metrics:
    metrics = outcome_metrics(runs)
    return {m: metrics[m] for m in OUTCOMES}


def _rates(
    alarms: Mapping[str, Alarms],
    of: str,
    key: Callable[[EpisodeRow], str | None],
    value: str,
) -> dict[str, Metrics]:
    """Rates of the judges in some of the runs of one set."""
    found: dict[str, dict[str, Metric]] = {}
    where: np.ndarray | None = None
    for name, one in alarms.items():
        if where is None:
            where = one.of.where(lambda r: of in (ALL, r.set) and key(r) == value)
        some = one.of_runs(where)
        if some.seen_by.any():
            found[name] = detection_rates(some, one.of.failing)
    return found
