"""The tables of an experiment, from its summary: Markdown and CSV.

Calls: the experiments → here. Tables of counts hold no measured computing time, so that they are
the same whenever the episodes are; what was measured with a clock is in tables of its own
(`Table.timed`). Every share says how many of how many, every number its 95 % interval, and what was
not measured is a dash.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import replace
from typing import Any

from forestall.statistics.cases import UNDISTURBED
from forestall.statistics.cells import (
    DASH,
    EMPTY,
    Columns,
    Form,
    Names,
    Table,
    area,
    cells,
    heads,
    mean,
    number,
    points,
    probability,
    seconds,
    share,
    shown,
)
from forestall.statistics.further_tables import compared_table, further_tables
from forestall.statistics.judges import THRESHOLDS, is_variant
from forestall.statistics.metrics import TRIVIAL
from forestall.statistics.outcomes import PROACTIVE
from forestall.statistics.paper import ABLATIONS, FULL, PERCENT
from forestall.statistics.sentences import told
from forestall.statistics.side_by_side import side_by_side
from forestall.statistics.watches import ALL, HARMLESS

_SUFFIXES = (*(f"{t:.2f}" for t in THRESHOLDS), "mean")


def tables(summary: Mapping[str, Any], names: Names | None = None) -> tuple[Table, ...]:
    """Every table of a summary: what both households say, then those of the one shown first.

    Args:
        summary: of `summary.summary`, or read from its file.
        names: what is shown in place of a judge's name; the summary's own by default.
    """
    names = summary["names"] if names is None else names
    first = summary["shown"]
    notes = [f"{DASH}: not measured.", *(f"{n}." for n in summary["episodes"]["notes"])]
    found = [told(summary), *side_by_side(summary, names)]
    for profile, content in summary["profiles"].items():
        made = of_profile(content, names)
        found += made if profile == first else [t.of(profile) for t in made]
    found.sort(key=lambda t: t.timed)
    return tuple(replace(t, note=" ".join(filter(None, [t.note, *notes]))) for t in found)


def of_profile(content: Mapping[str, Any], names: Names) -> list[Table]:
    """Every table of one household, those without measured time first."""
    by_set = content["detectors_by_set"]
    return [
        _strategies(content, names),
        _harm(content, names),
        *further_tables(content, names),
        *(_detectors(of, found, content, names) for of, found in by_set.items()),
        *(_sweep(of, found, names) for of, found in by_set.items()),
        _ablation(content, names),
        _parts(content, names),
        *(_trivial(of, found, names) for of, found in by_set.items()),
        *(t for key in ("set", "kind", "task", "knowable") for t in _split(content, key, names)),
        _paper(content, names, timed=False),
        _orderings(content, names),
        _times(content, names),
        _paper(content, names, timed=True),
    ]


_OUTCOMES: Columns = (
    ("success", "success", share),
    ("success, REFLECT's check", "weak_success", share),
    ("nothing irreversible happened", "prevented", share),
    ("plan changed", "replanned", share),
)
_RUNS: Columns = (
    *_OUTCOMES,
    ("robot time", "simulated_s", seconds),
    ("plans adopted", "replans", mean),
    ("planner calls", "planner_calls", mean),
    ("model calls", "model_calls", mean),
    ("broke off", "errors", share),
    ("stopped safely", "stopped", share),
    ("held", "held", share),
    ("moments not judged", "not_judged", mean),
)
_TIMES: Columns = (
    ("robot time", "simulated_s", seconds),
    ("computing time", "reasoning_s", seconds),
    ("total execution time", "tet_s", seconds),
    ("robot time, successful", "simulated_s_successful", seconds),
    ("computing time, successful", "reasoning_s_successful", seconds),
    ("total, successful", "tet_s_successful", seconds),
)
_DETECTED: Columns = (
    ("detected (as the paper counts)", "fdr", share),
    ("detected in time", "in_time", share),
    ("detected after it could be known", "after_known", share),
)
_FALSE: Columns = tuple(
    (f"false alarms per {per}, {of}", f"false_alarms_per_{per}_{of}", form)
    for per, form in (("run", share), ("boundary", share), ("hour", mean))
    for of in (UNDISTURBED, HARMLESS, ALL)
)
_POINT: Columns = (
    *_DETECTED,
    *_FALSE,
    ("told apart from its undisturbed twin", "pairs_apart", share),
    ("alarms before it could be known, per boundary", "early_alarms_per_boundary", share),
    ("balanced accuracy, undisturbed", f"balanced_accuracy_{UNDISTURBED}", share),
    ("balanced accuracy, all", "balanced_accuracy_all", share),
    ("lead, subtasks", "lead_subtasks", mean),
    ("lead, robot time", "lead_s", seconds),
    ("cause named right", "cause_right", share),
    ("the very fact named", "cause_exact", share),
    ("in time by chance at as many false alarms", "chance_in_time", number(".3f")),
    ("more than chance in time", "over_chance", points),
)


def _swept(negatives: str) -> Columns:
    return (
        ("AUROC", f"auroc_{negatives}", area),
        ("AUROC in time", f"auroc_in_time_{negatives}", area),
        ("AUROC of boundaries", "auroc_boundary", area),
        ("average precision", f"average_precision_{negatives}", area),
        *(
            (
                f"detected{' in time' if what == 'in_time' else ''} at {int(rate)} % false alarms",
                f"{what}_fa{rate}_{negatives}",
                share,
            )
            for what in ("detection", "in_time")
            for rate in ("01", "05", "10")
        ),
    )


def _strategies(summary: Mapping[str, Any], names: Names) -> Table:
    rows = [
        (of, shown(name, names), *cells(metrics, _RUNS))
        for of, name, metrics in _by_set(summary["strategies"])
    ]
    return Table(
        "strategies",
        "Strategies (the paper's Table 1 is the irreversible set)",
        ("set", "strategy", *heads(_RUNS)),
        tuple(rows),
        "On undisturbed and harmless runs every changed plan is the work of a false alarm.",
    )


def _harm(summary: Mapping[str, Any], names: Names) -> Table:
    rows = []
    for of, name, pair in _by_set(summary["paired"]):
        success, kept = pair["success"], pair["prevented"]
        rows.append(
            (of, shown(name, names), points(success), probability(success["p"]), points(kept))
        )
    return Table(
        "monitor-or-none",
        "With a strategy against without any, on the same cases",
        ("set", "strategy", "success", "McNemar's p", "nothing irreversible happened"),
        tuple(rows),
        "On undisturbed and harmless runs a difference below 0 is the harm of false alarms.",
    )


def _detectors(
    of: str, found: Mapping[str, Any], summary: Mapping[str, Any], names: Names
) -> Table:
    over = summary["success_over_thresholds"] if of == "robofail" else {}
    rows = []
    for name in _main(found):
        for suffix in _SUFFIXES if _with_thresholds(found[name]) else ("",):
            success = over.get(name, {}).get(f"success@{suffix}", EMPTY)
            values = cells(found[name], _POINT, suffix)
            rows.append((shown(name, names), suffix or DASH, *values, share(success)))
    return Table(
        f"detectors-{of}",
        f"Judges on the same observations, {_failing(of)} (the paper's Fig. 8a)",
        ("detector", "threshold", *heads(_POINT), "success of the proactive strategy"),
        tuple(rows),
        '"mean" is over the three thresholds, as the paper reports it.',
    )


def _sweep(of: str, found: Mapping[str, Any], names: Names) -> Table:
    columns = {UNDISTURBED: "undisturbed", "all": "undisturbed and harmless"}
    rows = [
        (shown(name, names), text, *cells(found[name], _swept(negatives)))
        for name in found
        if _swept_one(found[name])
        for negatives, text in columns.items()
    ]
    return Table(
        f"sweep-{of}",
        f"Judges at equal false-alarm rates, {_failing(of)}",
        ("detector", "false alarms counted on", *heads(_swept("all"))),
        tuple(rows),
        "A false-alarm rate is a share of runs; the threshold is the best that keeps to it on these"
        " very runs.",
    )


def _ablation(summary: Mapping[str, Any], names: Names) -> Table:
    columns: list[tuple[str, str, Form]] = []
    for suffix in ("mean", "0.90"):
        columns.append((f"detected, {suffix}", f"fdr@{suffix}", share))
        columns += [
            (f"false alarms per run, {of}, {suffix}", f"false_alarms_per_run_{of}@{suffix}", share)
            for of in (UNDISTURBED, HARMLESS)
        ]
    columns += [c for c in _swept("all") if not c[1].startswith("in_time")]
    found = summary["detectors"]
    rows = [
        (shown(name, names), *cells(found.get(name, {}), columns))
        for name in (FULL, *ABLATIONS.values())
    ]
    return Table(
        "ablation-score",
        f"Parts of the score left out, {_failing(summary['detection_set'])} (the paper's Table 2, "
        "left)",
        ("score", *heads(columns)),
        tuple(rows),
        "A score that alarms more often detects more; the last columns compare at equal"
        " false-alarm rates.",
    )


def _parts(summary: Mapping[str, Any], names: Names) -> Table:
    by_model = f"{PROACTIVE}, reasoning by"
    found = [
        (of, name, metrics)
        for of, name, metrics in _by_set(summary["strategies"])
        if name == PROACTIVE or name.startswith((f"{PROACTIVE}, without", by_model))
    ]
    rows = [(of, shown(name, names), *cells(metrics, _OUTCOMES)) for of, name, metrics in found]
    return Table(
        "ablation-parts",
        "Parts of the proactive strategy left out (the paper's Table 2, right)",
        ("set", "strategy", *heads(_OUTCOMES)),
        tuple(rows),
        "The plain strategy reasons by templates over mined facts. A model stands alone: nobody "
        "explains, or plans where it plans, in its place."
        if any(name.startswith(by_model) for _, name, _ in found)
        else "",
    )


def _trivial(of: str, found: Mapping[str, Any], names: Names) -> Table:
    rows = []
    for name in (*_main(found), *(t for t in TRIVIAL if t in found)):
        suffix = "0.90" if _with_thresholds(found[name]) else ""
        text = f"{shown(name, names)}, threshold 0.90" if suffix else shown(name, names)
        rows.append((text, *cells(found[name], _POINT, suffix)))
    return Table(
        f"trivial-{of}",
        f"Beside judges that cost nothing, and the truth; {_failing(of)}",
        ("detector", *heads(_POINT)),
        tuple(rows),
        '"random" has as many false alarms per boundary as the primary judge; "true plan check" '
        "asks the simulator.",
    )


def _split(summary: Mapping[str, Any], key: str, names: Names) -> Iterable[Table]:
    outcomes, detected, false = [], [], []
    for of, values in summary[f"by_{key}"].items():
        for value, groups in values.items():
            for name, metrics in groups["strategies"].items():
                begin = (of, value, shown(name, names))
                outcomes.append((*begin, *cells(metrics, _OUTCOMES)))
            for name, metrics in groups["detectors"].items():
                begin = (of, value, shown(name, names))
                if metrics["fdr"]["n"]:
                    detected.append((*begin, *cells(metrics, _DETECTED)))
                if metrics["false_alarms_per_run_all"]["n"]:
                    false.append((*begin, *cells(metrics, _PER)))
    title = {"kind": "kind", "task": "task", "knowable": "how it can be known", "set": "its set"}
    for name, what, columns, rows in (
        ("strategies", "Strategies", _OUTCOMES, outcomes),
        ("detection", "Detection", _DETECTED, detected),
        ("false-alarms", "False alarms", _PER, false),
    ):
        if rows or name != "false-alarms":
            who = "strategy" if name == "strategies" else "detector"
            header = ("set", title[key], who, *heads(columns))
            yield Table(f"{name}-by-{key}", f"{what} by {title[key]}", header, tuple(rows))


_PER: Columns = (
    ("false alarms per run", "false_alarms_per_run_all", share),
    ("unfounded ones per run", "unfounded_per_run_all", share),
    ("false alarms per faultless boundary", "false_alarms_per_boundary_all", share),
    ("false alarms per hour", "false_alarms_per_hour_all", mean),
)


def _paper(summary: Mapping[str, Any], names: Names, timed: bool) -> Table:
    rows = []
    for line in summary["paper"]:
        if (line["unit"] != PERCENT) is timed:
            write = seconds if timed else share
            false = [] if timed else [share(line["false_alarms"][s]) for s in _GOOD]
            rows.append(
                (
                    line["what"],
                    f"{line['source']}: {line['paper']:g} {line['unit']}",
                    f"{shown(line['name'], names)}, {line['set']}",
                    write(line["ours"]),
                    *false,
                )
            )
    false_heads = () if timed else tuple(f"with false alarms per run, {s}" for s in _GOOD)
    return Table(
        "paper-times" if timed else "paper",
        "The paper's execution times and ours" if timed else "The paper's numbers and ours",
        ("what", "paper", "ours is of", "ours", *false_heads),
        tuple(rows),
        "On our scenes, not the paper's."
        + ("" if timed else " For a strategy, false alarms are runs whose plan it changed."),
        timed,
    )


_GOOD = (UNDISTURBED, HARMLESS)


def _orderings(summary: Mapping[str, Any], names: Names) -> Table:
    return compared_table("orderings", "The paper's orderings", summary["orderings"], names)


def _times(summary: Mapping[str, Any], names: Names) -> Table:
    rows = [
        (of, shown(name, names), *cells(metrics, _TIMES))
        for of, name, metrics in _by_set(summary["strategies"])
    ]
    return Table(
        "times",
        "Execution time: simulated robot time and measured computing time",
        ("set", "strategy", *heads(_TIMES)),
        tuple(rows),
        "Computing time was measured and differs from run to run and from machine to machine.",
        timed=True,
    )


def _by_set(found: Mapping[str, Mapping[str, Any]]) -> list[tuple[str, str, Any]]:
    """(set, name, metrics), the sets together."""
    sets = dict.fromkeys(of for metrics in found.values() for of in metrics)
    return [(of, name, found[name][of]) for of in sets for name in found if of in found[name]]


def _main(found: Mapping[str, Any]) -> list[str]:
    """Detectors that are no ablations of the score, the paper's first, and no trivial ones."""
    out = {*TRIVIAL, *ABLATIONS.values()}
    names = [n for n in found if n not in out and not is_variant(n)]
    return sorted(names, key=lambda n: (n != FULL, not n.startswith(FULL), n))


def _swept_one(metrics: Mapping[str, Any]) -> bool:
    return "auroc_all" in metrics


def _with_thresholds(metrics: Mapping[str, Any]) -> bool:
    return f"fdr@{THRESHOLDS[0]:.2f}" in metrics


def _failing(of: str) -> str:
    return "all failing runs" if of == ALL else f"failing runs of the {of} set"


__all__ = ["Table", "tables"]
