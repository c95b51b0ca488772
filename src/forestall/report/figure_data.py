"""What the experiment's figures show, taken from its summary and its rows.

Calls: `experiment_view.py` → here; gives the plain values that the figures draw. Rates and means
are the summary's, so that a figure and a table cannot differ; of rows only single runs are shown.
What the summary does not hold is left out, and the page says that it is missing.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

from forestall.report.figure_values import Curve, Distribution, Dot, Estimate, Lane, Shares, Spent

if TYPE_CHECKING:
    from forestall.statistics.rows import EpisodeRow

Summary = Mapping[str, Any]
Names = Callable[[str], str]
"""Name of a detector, strategy or set → the one that is shown."""

SETS = ("robofail", "irreversible", "undisturbed", "harmless")
STRATEGIES = ("none", "post-hoc", "online", "proactive")
DETECTORS = ("scene-graph", "objects", "caption", "image")
THRESHOLDS = ("0.90", "0.85", "0.80")
WATCH = "watch"
KNOWABLE = {
    "scene": "seen before anything is done",
    "plan": "by one who knows the task",
    "after": "after something went wrong",
}
"""Through what a failure can be known, in words."""

_FULL = DETECTORS[0]
_CASE = tuple[str, str, str, int]


def detectors(summary: Summary) -> tuple[str, ...]:
    """Detectors with scores of their own and as many demonstrations as usual, the paper's first."""
    found = [d for d in summary.get("main_judges", ()) if d in summary.get("detectors", {})]
    return tuple(sorted(found, key=lambda d: (_place(d, DETECTORS), d)))


def ablations(summary: Summary) -> tuple[str, ...]:
    """Detectors that are the full score without a part of it."""
    return tuple(d for d in detectors(summary) if d.startswith(f"{_FULL} without"))


def main_detectors(summary: Summary) -> tuple[str, ...]:
    """Detectors that are no ablation."""
    left_out = ablations(summary)
    return tuple(d for d in detectors(summary) if d not in left_out)


def roc(summary: Summary, names: Names) -> tuple[tuple[str, tuple[Curve, ...]], ...]:
    """Curves in two panels: the detectors with the trivial ones, and the parts of the score."""
    of = summary.get("detection_set", SETS[0])
    lines = summary.get("curves", {}).get(of, {})
    measured = summary.get("detectors", {})

    def line(name: str) -> Curve | None:
        points = lines.get(name, {}).get("all", [])
        if not points:
            return None
        metrics = measured[name]
        found = [(float(t), _point(metrics, f"@{t}")) for t in THRESHOLDS]
        return Curve(
            names(name),
            _corners([(p["false_alarm_rate"], p["detection_rate"]) for p in points]),
            tuple((t, *at) for t, at in found if at is not None),
            metrics["auroc_all"]["value"],
        )

    main = [c for d in main_detectors(summary) if (c := line(d))]
    parts = [c for d in ablations(summary) if (c := line(d))]
    trivial = [
        Curve(names(d), (at,), single=True)
        for d, m in measured.items()
        if "auroc_all" not in m and (at := _point(m, "")) is not None
    ]
    panels = [("detectors", (*main, *trivial))] if main else []
    if parts and (whole := line(_FULL)):
        panels.append(("parts of the score", (whole, *parts)))
    return tuple(panels)


def success(summary: Summary, names: Names) -> tuple[tuple[str, tuple[Dot, ...]], ...]:
    """Success by strategy, for each set that was run."""
    measured = summary.get("strategies", {})
    paper = {
        (p["set"], p["name"]): p["paper"] / 100
        for p in summary.get("paper", [])
        if p["kind"] == "strategies" and p["metric"] == "success"
    }
    there = [s for s in STRATEGIES if s in measured]
    return tuple(
        (
            names(of),
            tuple(
                Dot(
                    names(s),
                    _estimate(measured[s].get(of, {}).get("success")),
                    paper.get((of, s)),
                )
                for s in there
            ),
        )
        for of in SETS
        if any(of in measured[s] for s in there)
    )


def by_kind(
    summary: Summary, names: Names
) -> tuple[tuple[tuple[str, int], ...], tuple[tuple[str, tuple[Estimate, ...]], ...]]:
    """Kinds of failure with their counts; for each main detector an estimate for each kind."""
    groups = _groups(summary, "by_kind")
    shown = main_detectors(summary)[: len(DETECTORS)]
    counts = {
        kind: max((group[d]["fdr"]["n"] for d in shown if d in group), default=0)
        for kind, group in groups.items()
    }
    kinds = sorted((k for k, n in counts.items() if n), key=lambda k: (-counts[k], k))
    if not kinds:
        return (), ()
    series = tuple(
        (names(d), tuple(_estimate(groups[k].get(d, {}).get("fdr")) for k in kinds)) for d in shown
    )
    return tuple((k.replace("_", " "), counts[k]) for k in kinds), series


def knowability(summary: Summary, names: Names) -> tuple[tuple[str, tuple[Shares, ...]], ...]:
    """When each detector raised its alarm, by through what the failure can be known."""
    groups = _groups(summary, "by_knowable")
    found = []
    for key, words in KNOWABLE.items():
        group = groups.get(key, {})
        shares = [s for d in main_detectors(summary) if (s := _shares(names(d), group.get(d, {})))]
        if shares:
            found.append((words, tuple(shares)))
    return tuple(found)


def timelines(
    rows: Sequence[EpisodeRow], names: Names, case: _CASE | None = None
) -> tuple[EpisodeRow, tuple[Lane, ...]] | None:
    """The runs of one case as lanes.

    Args:
        rows: all of them.
        names: of strategies.
        case: set, task, scenario and seed; by default one that shows how strategies differ, an
            irreversible one of the salad (as in the paper) before others.

    Returns:
        A run of the case and its lanes, None when no case was run with two strategies.
    """
    groups: dict[_CASE, dict[str, EpisodeRow]] = defaultdict(dict)
    for row in sorted(rows, key=_preferred):
        if row.without is None and row.reasoning == "templates":
            groups[case_of(row)].setdefault(_strategy(row), row)
    if case is None:
        able = [c for c, runs in groups.items() if len(runs) > 1 and _any(runs).failing]
        if not able:
            return None
        case = min(able, key=lambda c: (*_telling(groups[c]), *c))
    runs = groups.get(case, {})
    if not runs:
        return None
    order = sorted(runs, key=lambda s: (_place(s, STRATEGIES), s))
    known_s = _known_s(runs["none"]) if "none" in runs else None
    return _any(runs), tuple(_lane(names(s), runs[s], known_s) for s in order)


def distributions(
    rows: Iterable[EpisodeRow], summary: Summary, names: Names
) -> tuple[Distribution, ...]:
    """The lowest score of each run by detector, for failing and for other runs."""
    runs = [r for r in rows if r.strategy == WATCH]
    failing = summary.get("detection_set", SETS[0])
    groups = {
        "failing": [r for r in runs if r.failing and failing in ("all", r.set)],
        "undisturbed": [r for r in runs if not r.failing and r.scenario is None],
        "harmless": [r for r in runs if not r.failing and r.scenario is not None],
    }
    found = []
    for detector in detectors(summary):
        lows = tuple((name, _lows(inside, detector)) for name, inside in groups.items())
        if any(values for _, values in lows):
            found.append(Distribution(names(detector), lows, float(THRESHOLDS[0])))
    return tuple(found)


def time_spent(summary: Summary, names: Names) -> tuple[str, tuple[Spent, ...]]:
    """Mean seconds by strategy, on the set that the paper timed or the first that was run."""
    measured = summary.get("strategies", {})
    paper = {p["name"]: p["paper"] for p in summary.get("paper", []) if p["metric"] == "tet_s"}
    there = [s for s in STRATEGIES if s in measured]
    sets = ("irreversible", *SETS)
    of = next((x for x in sets if any(x in measured[s] for s in there)), "")
    found = []
    for s in there:
        metrics = measured[s].get(of, {})
        robot, computing = (metrics.get(m, {}) for m in ("simulated_s", "reasoning_s"))
        if robot.get("value") is not None:
            seconds = (robot["value"], computing.get("value") or 0.0)
            found.append(Spent(names(s), *seconds, robot["n"], paper.get(s)))
    return of, tuple(found)


def case_of(row: EpisodeRow) -> _CASE:
    """Set, task, scenario and seed."""
    return row.set, row.task, row.scenario or "", row.seed


def _place(name: str, order: Sequence[str]) -> int:
    return order.index(name) if name in order else len(order)


def _estimate(metric: Mapping[str, Any] | None) -> Estimate:
    if metric is None:
        return Estimate(None)
    return Estimate(metric["value"], metric["low"], metric["high"], metric["n"])


def _groups(summary: Summary, by: str) -> dict[str, Mapping[str, Any]]:
    of = summary.get("detection_set", SETS[0])
    found = summary.get(by, {}).get(of, {})
    at = f"@{THRESHOLDS[0]}"
    return {
        key: {d.removesuffix(at): m for d, m in group.get("detectors", {}).items()}
        for key, group in sorted(found.items())
    }


def _point(metrics: Mapping[str, Any], suffix: str) -> tuple[float, float] | None:
    """(false alarms, detection) per run at one threshold, undisturbed and harmless together."""
    hit = metrics.get(f"fdr{suffix}", {}).get("value")
    parts = [
        (m["value"], m["n"])
        for of in ("undisturbed", "harmless")
        if (m := metrics.get(f"false_alarms_per_run_{of}{suffix}", {})).get("value") is not None
    ]
    if hit is None or not parts:
        return None
    return sum(v * n for v, n in parts) / sum(n for _, n in parts), hit


def _corners(points: Sequence[tuple[float, float]]) -> tuple[tuple[float, float], ...]:
    """The same line without points in the middle of a straight stretch."""
    kept: list[tuple[float, float]] = []
    for point in points:
        while len(kept) > 1 and (
            kept[-2][0] == kept[-1][0] == point[0] or kept[-2][1] == kept[-1][1] == point[1]
        ):
            kept.pop()
        kept.append(point)
    return tuple(kept)


def _shares(label: str, metrics: Mapping[str, Any]) -> Shares | None:
    n = metrics.get("fdr", {}).get("n")
    if not n:
        return None
    in_time, known, every = (
        metrics.get(m, {}).get("count") or 0 for m in ("in_time", "after_known", "fdr")
    )
    return Shares(label, in_time / n, (known - in_time) / n, (every - known) / n, n)


def _lows(rows: Iterable[EpisodeRow], detector: str) -> tuple[float, ...]:
    found = [[s for j in r.judged if (s := j.scores.get(detector)) is not None] for r in rows]
    return tuple(sorted(min(scores) for scores in found if scores))


def _strategy(row: EpisodeRow) -> str:
    """A watched run is one that nobody stepped into."""
    return "none" if row.strategy == WATCH else row.strategy


def _preferred(row: EpisodeRow) -> tuple[bool, bool, bool, bool, str, float, str]:
    """Small for the run that stands for its strategy: what it is by default, and was run."""
    return (
        row.implied,
        row.model != "exact",
        row.detector != _FULL,
        f"{row.threshold:.2f}" != THRESHOLDS[0],
        *(row.detector, row.threshold, row.demonstrations),
    )


def _any(runs: Mapping[str, EpisodeRow]) -> EpisodeRow:
    return runs[min(runs)]


def _telling(runs: Mapping[str, EpisodeRow]) -> tuple[bool, bool, bool, int, int]:
    """Small for a case whose timelines show much."""
    row = _any(runs)
    ahead = "proactive" in runs and runs["proactive"].success
    others = sum(r.success for s, r in runs.items() if s != "proactive")
    salad = row.task == "make-salad"
    return row.set != "irreversible", not salad, not ahead, -len(runs), others


def _known_s(row: EpisodeRow) -> float | None:
    if row.known is None:
        return None
    return next((j.time_s for j in row.judged if j.index >= row.known), row.simulated_s)


def _lane(label: str, row: EpisodeRow, known_s: float | None) -> Lane:
    alarms = {j.time_s for j in row.judged if j.decision == "replan" and row.strategy != WATCH}
    return Lane(
        label=label,
        ticks=tuple(sorted({j.time_s for j in row.judged if j.when != "end"})),
        alarms=tuple(sorted(alarms)),
        replans=tuple(sorted({j.time_s for j in row.judged if j.replanned})),
        known_s=known_s if known_s is not None and known_s <= row.simulated_s else None,
        harmed_s=row.harmed_s,
        end_s=row.simulated_s,
        success=row.success and row.end != "error",
    )
