"""What the numbers of a summary say about the method, in sentences.

Called by the experiments for the page. Nothing is written by hand: a sentence appears where its
numbers were measured, whichever way they turn out.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from forestall.statistics.cells import points, share
from forestall.statistics.metrics import ALWAYS, TRUTH
from forestall.statistics.outcomes import DETECTOR, NO_STRATEGY, ONLINE, PROACTIVE
from forestall.statistics.paper import ABLATIONS
from forestall.statistics.watches import PAPER_SET

Summary = Mapping[str, Any]
Metrics = Mapping[str, Mapping[str, Any]]

REASONED = f"{DETECTOR} + reasoning"
CHANCE = (0.4, 0.6)
"""An AUROC between these is called near chance."""

WEAK = 0.7
"""A detection rate below this is called weak."""


def findings(summary: Summary) -> list[str]:
    """Sentences for the page, of the household that is shown first; see also `sentences`."""
    content = {**summary["profiles"][summary["shown"]], "names": summary["names"]}
    return [
        sentence
        for part in (
            _alarms,
            _thresholds,
            _ablated,
            _reasoned,
            _kinds,
            _knowable,
            _chance,
            _strategies,
        )
        for sentence in part(content)
    ]


def _alarms(summary: Summary) -> Iterator[str]:
    found: Mapping[str, Metrics] = summary["detectors"]
    if DETECTOR not in found:
        return
    own = found[DETECTOR]
    undisturbed, harmless = (
        own[f"false_alarms_per_run_{of}@0.90"] for of in ("undisturbed", "harmless")
    )
    yield (
        f"At the paper's threshold the score alarms in {share(own['fdr@0.90'])} of the failing "
        f"runs; it also alarms in {share(undisturbed)} of the undisturbed and in "
        f"{share(harmless)} of the harmlessly disturbed ones."
    )
    if ALWAYS in found:
        yield (
            f"A monitor that always alarms detects {share(found[ALWAYS]['fdr'])}: a detection rate "
            "without a false-alarm rate beside it says nothing."
        )
    if TRUTH in found:
        yield (
            "Alarms in time (after the failure can be known, not after the step that does the "
            f"harm): {share(own['in_time@0.90'])}; with the simulator's truth, the upper bound, "
            f"{share(found[TRUTH]['in_time'])}."
        )


def _thresholds(summary: Summary) -> Iterator[str]:
    own = summary["detectors"].get(DETECTOR)
    if own and _value(own["fdr@0.90"]) > _value(own["fdr@0.80"]):
        yield (
            f"The score dilutes small decisive differences: at 0.80 it finds "
            f"{share(own['fdr@0.80'])}, at 0.85 {share(own['fdr@0.85'])}, at 0.90 "
            f"{share(own['fdr@0.90'])}."
        )


def _ablated(summary: Summary) -> Iterator[str]:
    found: Mapping[str, Metrics] = summary["detectors"]
    for name in (a for a in ABLATIONS if a in found and DETECTOR in found):
        full, less = found[DETECTOR], found[name]
        if _value(less["fdr@mean"]) >= _value(full["fdr@mean"]):
            yield (
                f"{name}: the detection rate does not fall, as it does in the paper, but is "
                f"{share(less['fdr@mean'])} (full score {share(full['fdr@mean'])}), with "
                f"{share(less['false_alarms_per_run_harmless@mean'])} against "
                f"{share(full['false_alarms_per_run_harmless@mean'])} false alarms on harmless "
                f"runs; the area under its curve is {_area(less)} against {_area(full)}."
            )


def _reasoned(summary: Summary) -> Iterator[str]:
    found: Mapping[str, Metrics] = summary["detectors"]
    if REASONED in found and DETECTOR in found:
        own, both = found[DETECTOR], found[REASONED]
        yield (
            "Counting an alarm only where the reasoning module names something that must change: "
            f"{share(both['fdr'])} instead of {share(own['fdr@0.90'])} of the failing runs, "
            f"{share(both['false_alarms_per_run_harmless'])} instead of "
            f"{share(own['false_alarms_per_run_harmless@0.90'])} of the harmless ones."
        )


def _kinds(summary: Summary) -> Iterator[str]:
    kinds = summary["by_kind"].get(summary["detection_set"], {})
    weak = [
        f"{kind} {share(rates['fdr'])}"
        for kind, found in kinds.items()
        if (rates := found["detectors"].get(f"{DETECTOR}@0.90"))
        and _value(rates["fdr"], 1.0) < WEAK
    ]
    if weak:
        yield f"Kinds of failure that the score finds rarely: {'; '.join(weak)}."


def _knowable(summary: Summary) -> Iterator[str]:
    words = {
        "scene": "visible in the scene from the start",
        "plan": "in the plan",
        "after": "slips of the robot on the way",
    }
    said = [
        f"{words[of]} {share(rates['fdr'])}"
        for of, found in summary["by_knowable"].get(summary["detection_set"], {}).items()
        if (rates := found["detectors"].get(f"{DETECTOR}@0.90"))
    ]
    if said:
        yield f"Detection by where a failure shows: {'; '.join(said)}."


def _chance(summary: Summary) -> Iterator[str]:
    found: Mapping[str, Metrics] = summary["detectors"]
    names = summary["names"]
    dull = [
        names.get(name, name)
        for name, metrics in found.items()
        if CHANCE[0] <= _value(metrics.get("auroc_all", {}), -1.0) <= CHANCE[1]
    ]
    if dull:
        yield f"Near chance, whatever the threshold: {', '.join(dull)}."


def _strategies(summary: Summary) -> Iterator[str]:
    found = summary["strategies"]
    for of in ("irreversible", PAPER_SET):
        runs = {name: sets[of] for name, sets in found.items() if of in sets}
        if PROACTIVE in runs and NO_STRATEGY in runs:
            own = runs[PROACTIVE]
            yield (
                f"{of}: the proactive strategy succeeds in {share(own['success'])} by the strict "
                f"check and in {share(own['weak_success'])} by REFLECT's own; nobody stepping in, "
                f"{share(runs[NO_STRATEGY]['success'])} and "
                f"{share(runs[NO_STRATEGY]['weak_success'])}."
            )
        if PROACTIVE in runs and ONLINE in runs:
            times = [runs[n]["simulated_s"] for n in (PROACTIVE, ONLINE)]
            a, b = (t["value"] for t in times)
            same = times[0]["n"] == times[1]["n"]
            if same and a is not None and b is not None and a > b:
                yield (
                    f"{of}: the proactive runs take longer than the online ones ({a:.0f} against "
                    f"{b:.0f} s of robot time); a run that is stopped early is a short one."
                )
    for of, pair in summary["paired"].get(PROACTIVE, {}).items():
        if of in ("undisturbed", "harmless"):
            change = points(pair["success"])
            yield f"{of}: success with the monitor minus success without it is {change}."


def _value(metric: Mapping[str, Any], missing: float = 0.0) -> float:
    value = metric.get("value")
    return missing if value is None else float(value)


def _area(metrics: Metrics) -> str:
    value = metrics["auroc_all"]["value"]
    return "not measured" if value is None else f"{value:.3f}"
