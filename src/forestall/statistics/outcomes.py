"""What came of runs with a strategy: success, harm, time, effort, and differences on equal cases.

Calls: `profile`, `orderings` → here → `intervals`. A run that broke off counts as failed, not as
prevented, whatever else its row says; it is never left out. A watched run is one without
intervention: what its judges cost is not counted as the time of a robot that has none.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import replace

import numpy as np

from forestall.statistics.cases import CASE_SETS, FURTHER_SETS, Case
from forestall.statistics.intervals import Clusters, Metric, Ratio, mean, measured
from forestall.statistics.judges import PLAN_CHECK, PRIMARY
from forestall.statistics.pairs import Paired, paired
from forestall.statistics.rows import EXACT, NOBODY, PLAIN, TEMPLATES, EpisodeRow, Setup
from forestall.statistics.watches import ALL, WATCH, canonical, case_of, unit_of

NO_STRATEGY, POST_HOC, ONLINE, PROACTIVE = "none", "post-hoc", "online", "proactive"
RETRY = "retry-once"
STRATEGIES = (PROACTIVE, ONLINE, POST_HOC, NO_STRATEGY)
"""In the order of the paper's Table 1, best first."""

SIMPLE = (*STRATEGIES[:-1], "online-scene", PLAN_CHECK, RETRY, NO_STRATEGY)
"""Strategies by name alone, as they stand in tables."""

DETECTOR = PRIMARY
THRESHOLD = 0.9
"""What a strategy runs with unless its name says otherwise."""

ERROR, HELD, STOPPED = "error", "held", "stopped safely"

Runs = Mapping[Case, EpisodeRow]
"""One run of each case, in a fixed order."""


def name_of(setup: Setup) -> str:
    """The strategy, with what differs from the defaults behind it."""
    parts = [setup.strategy]
    if setup.detector != DETECTOR:
        parts.append(f"detector {setup.detector}")
    if setup.threshold != THRESHOLD:
        parts.append(f"threshold {setup.threshold:.4g}")
    if setup.without is not None:
        parts.append(f"without {setup.without}")
    if setup.reasoning != TEMPLATES:
        parts.append(f"reasoning by {setup.reasoning}")
    if setup.model != EXACT:
        parts.append(f"{setup.model} model")
    if setup.demonstrations != PLAIN:
        told = setup.demonstrations
        parts.append(f"{'no' if told == 'none' else told} demonstrations")
    return ", ".join(parts)


def by_setup(rows: Iterable[EpisodeRow]) -> dict[str, dict[Case, EpisodeRow]]:
    """Runs of each strategy by its name: the paper's four first, then the others by name.

    A run without intervention may be there both plain and watched; the plain one counts. Detector
    and threshold of a run without intervention, after the whole plan or after a subtask are part of
    the name only where the strategy was run with several; demonstrations, where it was run with
    several numbers of them.

    Args:
        rows: of one profile.
    """
    groups: dict[Setup, dict[Case, EpisodeRow]] = {}
    for row in canonical(rows):
        setup = row.setup
        if row.strategy in NOBODY:
            name = NO_STRATEGY if row.strategy == WATCH else row.strategy
            setup = Setup(name, DETECTOR, THRESHOLD)
        found = groups.setdefault(setup, {})
        if row.strategy == WATCH:
            found.setdefault(case_of(row), _unwatched(row))
        else:
            found[case_of(row)] = row
    plain = _plain_demonstrations(groups)
    named: dict[str, dict[Case, EpisodeRow]] = {}
    for setup, runs in groups.items():
        named[_name(setup, groups, plain)] = dict(sorted(runs.items(), key=_case))
    first = [s for s in STRATEGIES if s in named]
    return {name: named[name] for name in [*first, *sorted(set(named) - set(first))]}


def succeeded(row: EpisodeRow) -> bool:
    """Whether the goal was reached; not when the run broke off."""
    return row.success and row.end != ERROR


def prevented(row: EpisodeRow) -> bool:
    """Whether nothing happened that cannot be undone, as far as is known."""
    return not row.harmed and row.end != ERROR


def outcome_metrics(runs: Sequence[EpisodeRow]) -> dict[str, Metric]:
    """Success, harm, time and effort of one strategy on one set.

    `tet` is the paper's total execution time: robot time (`simulated_s`) plus what it spends on
    judging and planning (`reasoning_s`); each also over the successful runs alone. Runs that broke
    off have no time, and runs that were not executed, since they must be the watched ones, have no
    computing time where somebody judges.
    """
    every = np.ones(len(runs), bool)
    timed = _where(runs, lambda r: r.end != ERROR and not (r.implied and r.strategy not in NOBODY))
    good = timed & _where(runs, succeeded)
    tasks = {r.task for r in runs if r.weak_success is not None}
    weak = _where(runs, lambda r: r.task in tasks)
    shares: dict[str, tuple[Callable[[EpisodeRow], bool], np.ndarray]] = {
        "success": (succeeded, every),
        "weak_success": (lambda r: bool(r.weak_success) and r.end != ERROR, weak),
        "prevented": (prevented, every),
        "errors": (lambda r: r.end == ERROR, every),
        "stopped": (lambda r: r.end == STOPPED, every),
        "held": (lambda r: r.end == HELD, every),
        "replanned": (lambda r: r.replans > 0, every),
    }
    means: dict[str, tuple[Callable[[EpisodeRow], float], np.ndarray]] = {
        "replans": (lambda r: r.replans, every),
        "not_judged": (lambda r: r.not_judged, every),
        "planner_calls": (lambda r: r.planner_calls, every),
        "model_calls": (lambda r: r.model_calls, every),
    }
    for name, of in (("simulated_s", _robot_s), ("reasoning_s", _own_s), ("tet_s", _total_s)):
        means |= {name: (of, timed), f"{name}_successful": (of, good)}
    ratios = {n: _ratio(runs, what, where, True) for n, (what, where) in shares.items()}
    ratios |= {n: _ratio(runs, what, where, False) for n, (what, where) in means.items()}
    return measured(ratios, Clusters.of([unit_of(r) for r in runs]))


def mean_over(runs: Sequence[Sequence[EpisodeRow]]) -> Metric:
    """Mean success over several runs of each case, such as those at several thresholds."""
    shares = [sum(succeeded(r) for r in several) / len(several) for several in runs]
    return mean(shares, [unit_of(several[0]) for several in runs])


def of_set(runs: Runs, name: str) -> list[EpisodeRow]:
    """The runs of one set of cases, or of `ALL`."""
    return [r for case, r in runs.items() if name in (ALL, case.set)]


def sets_of(runs: Runs) -> tuple[str, ...]:
    """Which sets of cases there are, known ones first."""
    known, found = (*CASE_SETS, *FURTHER_SETS), {case.set for case in runs}
    return (*(s for s in known if s in found), *sorted(found - set(known)))


def compared(
    first: Runs,
    second: Runs,
    of: str,
    what: Callable[[EpisodeRow], bool] = succeeded,
) -> Paired:
    """How two strategies differ on the cases of one set, or `ALL`, that both were run on."""
    both = [case for case in first if case in second and of in (ALL, case.set)]
    return paired(
        [what(first[c]) for c in both],
        [what(second[c]) for c in both],
        [unit_of(first[c]) for c in both],
    )


def time_between(first: Runs, second: Runs, of: str) -> Metric:
    """Robot time of one strategy minus that of another on the cases that both were run on."""
    both = [c for c in first if c in second and of in (ALL, c.set)]
    kept = [c for c in both if ERROR not in _ends(first, second, c)]
    more = [first[c].simulated_s - second[c].simulated_s for c in kept]
    return mean(more, [unit_of(first[c]) for c in kept])


def shared_cases(setups: Mapping[str, Runs]) -> frozenset[Case]:
    """Cases that every strategy of the paper, the plan check and the retry were run on.

    Those of them that were run at all; without a case that they share, none.
    """
    there = [frozenset(setups[name]) for name in SIMPLE if name in setups]
    return frozenset.intersection(*there) if there else frozenset()


def harm_prevented(runs: Runs, base: Runs) -> Metric:
    """Of the cases in which the base does harm that cannot be undone: those without it here."""
    harmed = [c for c in runs if c in base and base[c].harmed]
    hits = [prevented(runs[c]) for c in harmed]
    ratio = Ratio(np.array(hits, float), np.ones(len(harmed)))
    return measured({"": ratio}, Clusters.of([unit_of(runs[c]) for c in harmed]))[""]


def false_alarm_cost(runs: Runs, base: Runs, calm: Runs) -> dict[str, Metric]:
    """What a strategy costs where nobody is needed, on cases in which `calm` succeeds.

    Args:
        runs: with the strategy.
        base: what it is compared with: nobody, or a robot that tries again.
        calm: runs without intervention.

    Returns:
        `seconds`, robot time more than the base; `success`, the difference; `changed`, runs whose
        plan was changed; `seconds_changed`, robot time more in those.
    """
    there = [
        c
        for c in runs
        if c in base and c in calm and succeeded(calm[c]) and ERROR not in _ends(runs, base, c)
    ]
    more = np.array([runs[c].simulated_s - base[c].simulated_s for c in there], float)
    gain = np.array([float(succeeded(runs[c])) - succeeded(base[c]) for c in there], float)
    changed = np.array([runs[c].replans > 0 for c in there], float)
    one = np.ones(len(there))
    ratios = {
        "seconds": Ratio(more, one, whole=False, free=True),
        "success": Ratio(gain, one, whole=False, free=True),
        "changed": Ratio(changed, one),
        "seconds_changed": Ratio(more * changed, changed, whole=False, free=True),
    }
    return measured(ratios, Clusters.of([unit_of(runs[c]) for c in there]))


def _ends(runs: Runs, base: Runs, case: Case) -> tuple[str, str]:
    return runs[case].end, base[case].end


def _plain_demonstrations(groups: Iterable[Setup]) -> dict[str, str]:
    """Strategy → the demonstrations that its name does not mention."""
    counts: dict[str, Counter[str]] = {}
    for setup in groups:
        counts.setdefault(setup.strategy, Counter())[setup.demonstrations] += 1
    return {
        strategy: PLAIN if PLAIN in found else min(found, key=lambda d: (-found[d], d))
        for strategy, found in counts.items()
    }


def _name(setup: Setup, groups: Iterable[Setup], plain: Mapping[str, str]) -> str:
    """Short where the strategy was not run with several detectors or thresholds."""
    kin = {(s.detector, s.threshold) for s in groups if s.strategy == setup.strategy}
    if setup.strategy != PROACTIVE and len(kin) == 1:
        setup = replace(setup, detector=DETECTOR, threshold=THRESHOLD)
    if setup.demonstrations == plain[setup.strategy]:
        setup = replace(setup, demonstrations=PLAIN)
    return name_of(setup)


def _unwatched(row: EpisodeRow) -> EpisodeRow:
    return replace(row, reasoning_s=0.0, planner_calls=0, model_calls=0, replans=0)


def _robot_s(row: EpisodeRow) -> float:
    return row.simulated_s


def _own_s(row: EpisodeRow) -> float:
    return row.reasoning_s


def _total_s(row: EpisodeRow) -> float:
    return row.simulated_s + row.reasoning_s


def _where(runs: Sequence[EpisodeRow], rule: Callable[[EpisodeRow], bool]) -> np.ndarray:
    return np.array([rule(r) for r in runs], bool)


def _ratio(
    runs: Sequence[EpisodeRow],
    what: Callable[[EpisodeRow], float],
    where: np.ndarray,
    whole: bool,
) -> Ratio:
    values = np.array([float(what(r)) for r in runs], float)
    return Ratio(values * where, where.astype(float), whole=whole, free=not whole)


def _case(item: tuple[Case, EpisodeRow]) -> tuple[str, str, str, int]:
    case = item[0]
    return case.set, case.task, case.scenario or "", case.seed
