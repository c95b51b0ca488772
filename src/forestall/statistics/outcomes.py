"""What came of runs with a strategy: success, harm, time, effort, and differences on equal cases.

Calls: `summary`, `orderings` → here → `intervals`. A run that broke off counts as failed, not as
prevented, whatever else its row says; it is never left out. A watched run is one without
intervention: what its detectors cost is not counted as the time of a robot that has none.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace

from forestall.statistics.cases import CASE_SETS, Case
from forestall.statistics.intervals import Metric, Paired, mean, paired, proportion
from forestall.statistics.metrics import WATCH, canonical, case_of, scene_of
from forestall.statistics.rows import EpisodeRow

NO_STRATEGY, POST_HOC, ONLINE, PROACTIVE = "none", "post-hoc", "online", "proactive"
STRATEGIES = (PROACTIVE, ONLINE, POST_HOC, NO_STRATEGY)
"""In the order of the paper's Table 1, best first."""

DETECTOR = "scene-graph"
THRESHOLD = 0.9
"""What a strategy runs with unless its name says otherwise."""

ERROR, HELD, STOPPED = "error", "held", "stopped safely"


@dataclass(frozen=True, slots=True)
class Setup:
    """A strategy as it was run."""

    strategy: str
    detector: str = DETECTOR
    threshold: float = THRESHOLD
    without: str | None = None

    @property
    def name(self) -> str:
        """The strategy, with what differs from the defaults behind it."""
        parts = [self.strategy]
        if self.detector != DETECTOR:
            parts.append(f"detector {self.detector}")
        if self.threshold != THRESHOLD:
            parts.append(f"threshold {self.threshold:.4g}")
        if self.without is not None:
            parts.append(f"without {self.without}")
        return ", ".join(parts)


Runs = Mapping[Case, EpisodeRow]
"""One run of each case, in a fixed order."""


def by_setup(rows: Iterable[EpisodeRow]) -> dict[str, dict[Case, EpisodeRow]]:
    """Runs of each strategy by its name: the paper's four first, then the others by name.

    A run without intervention may be there both plain and watched; the plain one counts. Detector
    and threshold of a run without intervention, after the whole plan or after a subtask are part of
    the name only where the strategy was run with several.
    """
    groups: dict[Setup, dict[Case, EpisodeRow]] = {}
    for row in canonical(rows):
        if row.strategy in (WATCH, NO_STRATEGY):
            found = groups.setdefault(Setup(NO_STRATEGY), {})
            if row.strategy == NO_STRATEGY:
                found[case_of(row)] = row
            else:
                found.setdefault(case_of(row), _unwatched(row))
            continue
        setup = Setup(row.strategy, row.detector, row.threshold, row.without)
        groups.setdefault(setup, {})[case_of(row)] = row
    named = {_name(s, groups): dict(sorted(runs.items(), key=_case)) for s, runs in groups.items()}
    plain = [s for s in STRATEGIES if s in named]
    return {name: named[name] for name in [*plain, *sorted(set(named) - set(plain))]}


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
    timed = [r for r in runs if r.end != ERROR and not (r.implied and r.strategy != NO_STRATEGY)]
    good = [r for r in timed if succeeded(r)]
    has_weak = {r.task for r in runs if r.weak_success is not None}
    weak = [r for r in runs if r.weak_success is not None or r.task in has_weak]
    return {
        "success": proportion([succeeded(r) for r in runs]),
        "weak_success": proportion([bool(r.weak_success) and r.end != ERROR for r in weak]),
        "prevented": proportion([prevented(r) for r in runs]),
        "errors": proportion([r.end == ERROR for r in runs]),
        "stopped": proportion([r.end == STOPPED for r in runs]),
        "held": proportion([r.end == HELD for r in runs]),
        "replanned": proportion([r.replans > 0 for r in runs]),
        "simulated_s": _mean(timed, lambda r: r.simulated_s),
        "simulated_s_successful": _mean(good, lambda r: r.simulated_s),
        "reasoning_s": _mean(timed, lambda r: r.reasoning_s),
        "reasoning_s_successful": _mean(good, lambda r: r.reasoning_s),
        "tet_s": _mean(timed, lambda r: r.simulated_s + r.reasoning_s),
        "tet_s_successful": _mean(good, lambda r: r.simulated_s + r.reasoning_s),
        "replans": _mean(runs, lambda r: r.replans),
        "not_judged": _mean(runs, lambda r: r.not_judged),
        "planner_calls": _mean(runs, lambda r: r.planner_calls),
        "model_calls": _mean(runs, lambda r: r.model_calls),
    }


def mean_over(runs: Sequence[Sequence[EpisodeRow]]) -> Metric:
    """Mean success over several runs of each case, such as those at several thresholds."""
    shares = [sum(succeeded(r) for r in several) / len(several) for several in runs]
    return mean(shares, [scene_of(several[0]) for several in runs])


def of_set(runs: Runs, name: str) -> list[EpisodeRow]:
    """The runs of one set of cases."""
    return [r for case, r in runs.items() if case.set == name]


def sets_of(runs: Runs) -> tuple[str, ...]:
    """Which sets of cases there are, known ones first."""
    found = {case.set for case in runs}
    return (*(s for s in CASE_SETS if s in found), *sorted(found - set(CASE_SETS)))


def compared(
    first: Runs,
    second: Runs,
    of: str,
    what: Callable[[EpisodeRow], bool] = succeeded,
) -> Paired:
    """How two strategies differ on the cases of one set that both were run on."""
    both = [case for case in first if case in second and case.set == of]
    return paired(
        [what(first[c]) for c in both],
        [what(second[c]) for c in both],
        [scene_of(first[c]) for c in both],
    )


def _name(setup: Setup, groups: Iterable[Setup]) -> str:
    """Short where the strategy was not run with several detectors or thresholds."""
    kin = {(s.detector, s.threshold) for s in groups if s.strategy == setup.strategy}
    if setup.strategy != PROACTIVE and len(kin) == 1:
        return replace(setup, detector=DETECTOR, threshold=THRESHOLD).name
    return setup.name


def _unwatched(row: EpisodeRow) -> EpisodeRow:
    return replace(row, reasoning_s=0.0, planner_calls=0, model_calls=0, replans=0)


def _mean(runs: Sequence[EpisodeRow], what: Callable[[EpisodeRow], float]) -> Metric:
    return mean([what(r) for r in runs], [scene_of(r) for r in runs])


def _key(case: Case) -> tuple[str, str, str, int]:
    return case.set, case.task, case.scenario or "", case.seed


def _case(item: tuple[Case, EpisodeRow]) -> tuple[str, str, str, int]:
    return _key(item[0])
