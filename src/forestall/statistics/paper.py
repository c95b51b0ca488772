"""The paper's numbers as data, each with its place there and with ours beside it.

Read by `summary`. The shares of the paper's Table 2 are multiples of 1/300 (94.01 nearly so): means
over three thresholds on 100 scenarios, as its Section 4 describes for Figure 8a. Ours beside them
are the same means; the summary also holds each threshold on its own.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from forestall.statistics.cases import UNDISTURBED
from forestall.statistics.watches import HARMLESS

PERCENT, SECONDS = "%", "s"
DETECTOR, STRATEGY, THRESHOLDS = "detectors", "strategies", "success_over_thresholds"

FULL = "scene-graph"
ABLATIONS = {
    "without subtask node": "scene-graph without subtask node",
    "without structural matching": "scene-graph without structure",
    "without node matching": "scene-graph without nodes",
    "without edge matching": "scene-graph without edges",
}
"""The paper's ablations of the score by the detectors that have them."""


@dataclass(frozen=True, slots=True)
class PaperNumber:
    """One number of the paper.

    Args:
        what: it is, in words.
        value: percent or seconds.
        unit: of it.
        source: where in the paper.
        kind: whether ours is among "detectors", "strategies" or "success_over_thresholds" of a
            summary.
        name: of ours there.
        metric: of ours there.
        set: of cases.
    """

    what: str
    value: float
    unit: str
    source: str
    kind: str
    name: str
    metric: str
    set: str


def _table_1(name: str, method: str, percent: float, seconds: float) -> list[PaperNumber]:
    where = "Table 1"
    return [
        PaperNumber(
            f"success, {method}", percent, PERCENT, where, STRATEGY, name, "success", "irreversible"
        ),
        PaperNumber(
            f"total execution time, {method}",
            seconds,
            SECONDS,
            where,
            STRATEGY,
            name,
            "tet_s",
            "irreversible",
        ),
    ]


def _table_2(what: str, percent: float, name: str, kind: str = DETECTOR) -> PaperNumber:
    metric, text = ("fdr@mean", "detection") if kind == DETECTOR else ("success", "success")
    return PaperNumber(
        f"{text}, {what}", percent, PERCENT, "Table 2", kind, name, metric, "robofail"
    )


PAPER: tuple[PaperNumber, ...] = (
    *_table_1("proactive", "proactive", 70.0, 109.2),
    *_table_1("online", "REFLECT-online", 30.0, 133.9),
    *_table_1("post-hoc", "REFLECT", 20.0, 151.0),
    *_table_1("none", "without replanning", 0.0, 84.6),
    _table_2("full score", 94.01, FULL),
    _table_2("without subtask node", 84.33, ABLATIONS["without subtask node"]),
    _table_2("without structural matching", 82.67, ABLATIONS["without structural matching"]),
    _table_2("without node matching", 74.67, ABLATIONS["without node matching"]),
    _table_2("without edge matching", 70.33, ABLATIONS["without edge matching"]),
    _table_2("with reasoning", 75.67, "proactive", STRATEGY),
    PaperNumber(
        "success, with reasoning, mean over three thresholds",
        75.67,
        PERCENT,
        "Table 2",
        THRESHOLDS,
        FULL,
        "success@mean",
        "robofail",
    ),
    _table_2("without reasoning", 37.67, "proactive, without reasoning", STRATEGY),
)


def comparison(
    strategies: Mapping[str, Mapping[str, Mapping[str, Any]]],
    detectors: Mapping[str, Mapping[str, Any]],
    over: Mapping[str, Mapping[str, Any]],
    empty: Any,
) -> list[dict[str, Any]]:
    """Every number of the paper with ours, and what false alarms ours comes with.

    Args:
        strategies: of a summary.
        detectors: of a summary, on the set that the paper's are on.
        over: success over thresholds, of a summary; comes without false alarms, which are those of
            each threshold.
        empty: stands for what was not measured.
    """
    lines = []
    for number in PAPER:
        if number.kind == DETECTOR:
            found = detectors.get(number.name, {})
            ours = found.get(number.metric, empty)
            suffix = number.metric.partition("@")[2]
            false = {
                of: found.get(f"false_alarms_per_run_{of}@{suffix}", empty)
                for of in (UNDISTURBED, HARMLESS)
            }
        elif number.kind == THRESHOLDS:
            ours = over.get(number.name, {}).get(number.metric, empty)
            false = dict.fromkeys((UNDISTURBED, HARMLESS), empty)
        else:
            sets = strategies.get(number.name, {})
            ours = sets.get(number.set, {}).get(number.metric, empty)
            false = {of: sets.get(of, {}).get("replanned", empty) for of in (UNDISTURBED, HARMLESS)}
        lines.append(
            {
                "what": number.what,
                "paper": number.value,
                "unit": number.unit,
                "source": number.source,
                "kind": number.kind,
                "name": number.name,
                "set": number.set,
                "metric": number.metric,
                "ours": ours,
                "false_alarms": false,
            }
        )
    return lines
