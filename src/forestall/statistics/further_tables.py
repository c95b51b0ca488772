"""Tables of what the paper does not ask: models, demonstrations, costs, rooms, many comparisons.

Called by `tables`; reads the part of a summary that is of one household.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from forestall.statistics.cells import (
    DASH,
    Columns,
    Names,
    Table,
    area,
    cells,
    heads,
    mean,
    points,
    probability,
    seconds,
    share,
    shown,
)
from forestall.statistics.judges import MODELS, OTHERS, PLAN_CHECK, Together, plan_check
from forestall.statistics.outcomes import NO_STRATEGY, PROACTIVE, RETRY
from forestall.statistics.rows import EXACT

Content = Mapping[str, Any]

JUDGED: Columns = (
    ("detected in time", "in_time", share),
    ("AUROC in time", "auroc_in_time_all", area),
    ("false alarms per faultless boundary", "false_alarms_per_boundary_all", share),
    ("false alarms per run", "false_alarms_per_run_all", share),
    ("unfounded ones per run", "unfounded_per_run_all", share),
    ("false alarms per hour", "false_alarms_per_hour_all", mean),
    ("cause named right", "cause_right", share),
)
"""What is said of a judge side by side."""

ACTED: Columns = (
    ("success", "success", share),
    ("harm prevented", "harm_prevented", share),
    ("robot time", "simulated_s", seconds),
)
"""What is said of a strategy side by side."""

FALSE_NOTE = (
    "At a boundary an alarm is false where the truth has nothing against going on; in a run and in "
    "an hour of robot time, in runs that do not fail. Unfounded: in such a run, and the truth has "
    "nothing against going on."
)


def further_tables(content: Content, names: Names) -> list[Table]:
    """All of them, of one household."""
    return [
        _with_retry(content, names),
        _shared(content, names),
        _costs(content, names),
        _judges_by_model(content, names),
        _strategies_by_model(content, names),
        _demonstrations(content, names),
        *_bounded(content, names),
        compared_table(
            "comparisons", "What else is compared", content["comparisons"], names, by="topic"
        ),
        _limits(content, names),
        _unforeseeable(content),
        _rooms(content, names),
    ]


def compared_table(
    name: str, title: str, found: Sequence[Mapping[str, Any]], names: Names, by: str = "table"
) -> Table:
    """One line for each ordering; `by` says what a family is, the table or a topic."""
    rows = [
        (
            o["topic"],
            o["measure"],
            shown(o["better"], names),
            shown(o["worse"], names),
            DASH if o["first"] is None else f"{100 * o['first']:.1f} %",
            DASH if o["second"] is None else f"{100 * o['second']:.1f} %",
            points(o["difference"]),
            o["verdict"],
            probability(o["p"]),
            probability(o["p_holm"]),
            o["corrected"],
        )
        for o in found
    ]
    return Table(
        name,
        title,
        (
            *("about", "measure", "should be better", "than", "first", "second", "difference"),
            *("verdict", "p", "p after Holm", "verdict after Holm"),
        ),
        tuple(rows),
        "An ordering holds when the interval of the difference on the same runs lies above 0. p is "
        "two-sided, by the deviation of the draws (of strategies the larger of it and McNemar's); "
        f"corrected at 0.05 by Holm's method for all of one {by}.",
    )


def _with_retry(content: Content, names: Names) -> Table:
    rows = [
        (
            of,
            shown(name, names),
            points(pair["success"]),
            f"{pair['success']['only_first']} : {pair['success']['only_second']}",
            probability(pair["success"]["p"]),
            probability(pair["success"]["p_clustered"]),
            points(pair["prevented"]),
            seconds(pair["seconds"]),
        )
        for name, sets in content["paired_with_retry"].items()
        for of, pair in sets.items()
        if pair["success"]["value"] is not None
    ]
    return Table(
        "monitor-or-retry",
        "With a strategy against merely trying again, on the same cases",
        (
            *("set", "strategy", "success", "only this : only trying again", "McNemar's p"),
            *("p over rooms and scenarios", "nothing irreversible happened"),
            "robot time",
        ),
        tuple(rows),
    )


def _shared(content: Content, names: Names) -> Table:
    found = content["shared"]
    columns = (*ACTED, ("nothing irreversible happened", "prevented", share))
    rows = [(shown(n, names), *cells(m, columns)) for n, m in found["strategies"].items()]
    return Table(
        "strategies-shared",
        f"Strategies on the {found['cases']} cases that all of them were run on",
        ("strategy", *heads(columns)),
        tuple(rows),
        "Harm prevented: of the cases in which harm that cannot be undone is done when nobody "
        "steps in, those without it.",
    )


def _costs(content: Content, names: Names) -> Table:
    columns: Columns = (
        ("success", "success", points),
        ("robot time", "seconds", seconds),
        ("plan changed", "changed", share),
        ("robot time where the plan was changed", "seconds_changed", seconds),
    )
    rows = [
        (shown(name, names), base, *cells(metrics, columns))
        for name, bases in content["cost_of_false_alarms"].items()
        for base, metrics in bases.items()
        if metrics["seconds"]["n"]
    ]
    return Table(
        "cost-of-false-alarms",
        "What a strategy costs in runs that succeed when nobody steps in",
        ("strategy", "against", *heads(columns)),
        tuple(rows),
        "Strategy minus what it is against, on the same cases. Where nobody is needed, every "
        "changed plan is the work of a false alarm.",
    )


def _judges_by_model(content: Content, names: Names) -> Table:
    found = content["detectors"]
    rows = []
    for model in MODELS:
        check = plan_check(model)
        pairs = [Together(j, check, both).name for j in OTHERS for both in (False, True)]
        for judge in (check, *pairs):
            if judge in found:
                rows.append((model, shown(judge, names), *cells(found[judge], JUDGED)))
    rows += [(DASH, shown(j, names), *cells(found[j], JUDGED)) for j in OTHERS if j in found]
    return Table(
        "judges-by-model",
        "The plan check by what its model knows, alone and with judges that know demonstrations",
        ("model", "judge", *heads(JUDGED)),
        tuple(rows),
        f"`or` raises an alarm if either does, `and` if both do. {FALSE_NOTE}",
    )


def _strategies_by_model(content: Content, names: Names) -> Table:
    found = content["shared"]["strategies"]
    rows = []
    for model in MODELS:
        for strategy in (PROACTIVE, PLAN_CHECK):
            name = strategy if model == EXACT else f"{strategy}, {model} model"
            if name in found:
                rows.append((model, shown(strategy, names), *cells(found[name], ACTED)))
    rows += [(DASH, s, *cells(found[s], ACTED)) for s in (RETRY, NO_STRATEGY) if s in found]
    return Table(
        "strategies-by-model",
        "Strategies by what their model knows, on the cases that the plain ones share",
        ("model", "strategy", *heads(ACTED)),
        tuple(rows),
    )


def _demonstrations(content: Content, names: Names) -> Table:
    columns: Columns = (
        ("AUROC in time", "auroc_in_time", area),
        ("detected in time", "in_time", share),
        ("false alarms per faultless boundary", "false_alarms_per_boundary", share),
    )
    rows = [
        (shown(judge, names), str(point["demonstrations"]), *cells(point, columns))
        for judge, curve in content["demonstrations"].items()
        for point in curve
    ]
    return Table(
        "demonstrations",
        "By number of demonstrations",
        ("judge", "demonstrations", *heads(columns)),
        tuple(rows),
    )


def _bounded(content: Content, names: Names) -> list[Table]:
    """None where nothing was calibrated."""
    found = content["bounded"]
    if found is None:
        return []
    columns: Columns = (
        ("detected in time", "in_time", share),
        ("unfounded alarms per undisturbed run", "unfounded_per_run_undisturbed", share),
        ("unfounded alarms per harmless run", "unfounded_per_run_harmless", share),
        ("any per undisturbed run", "false_alarms_per_run_undisturbed", share),
        ("cause named right", "cause_right", share),
    )
    rows = [
        (shown(name, names), _lines(judge["thresholds"]), *cells(judge, columns))
        for name, judge in found["judges"].items()
    ]
    bound = f"{100 * found['level']:.0f} %"
    table = Table(
        "bounded",
        f"At a bound of {bound} on runs with an unfounded alarm",
        ("judge", "alarm below", *heads(columns)),
        tuple(rows),
        f"Thresholds are drawn from {found['runs']} undisturbed runs of other rooms, so that the "
        f"expected share of new ones with an unfounded alarm is at most {bound} (where the truth "
        "has something against going on an alarm is right, though the run then goes well); so many "
        "runs can show "
        f"{100 * found['smallest_level']:.1f} % at best. `or`: together under one bound; `and`: "
        "all must alarm at one boundary. A dash: no alarm is possible within the bound.",
    )
    return [table]


def _lines(drawn: Sequence[float | None]) -> str:
    return ", ".join(DASH if t is None or t <= 0 else f"{t:.3f}" for t in drawn)


def _limits(content: Content, names: Names) -> Table:
    constant, silent = content["constant"], content["not_judged"]
    rows = [(shown(n, names), share(constant[n]), share(silent[n])) for n in constant]
    return Table(
        "limits",
        "Where judges say nothing, and where they say the same",
        (
            *("judge", "faultless boundaries with a score of exactly 1"),
            "boundaries at which nothing was judged",
        ),
        tuple(rows),
        "The first share is of the faultless boundaries that it judged, the second of all in runs "
        "that it watched.",
    )


def _unforeseeable(content: Content) -> Table:
    rows = [(of, share(metric)) for of, metric in content["unforeseeable"].items()]
    return Table(
        "unforeseeable",
        "Failures that can only be known when the harm is done",
        ("failing runs of", "share"),
        tuple(rows),
        "They are no part of detection in time.",
    )


def _rooms(content: Content, names: Names) -> Table:
    rows = []
    for kind, measure in (("strategies", "success"), ("judges", "alarm in time")):
        for name, found in content["rooms"][kind].items():
            between, within = (found[k] for k in ("between", "within"))
            rows.append(
                (
                    measure,
                    shown(name, names),
                    f"{found['scenarios']} in {found['runs']} runs",
                    f"{100 * found['mean']:.1f} %",
                    DASH if between is None else f"{100 * between:.1f} points",
                    f"{100 * within:.1f} points",
                    f"{100 * found['differing']:.1f} %",
                )
            )
    return Table(
        "rooms",
        "The same scenario in several rooms",
        (
            *("measure", "strategy or judge", "scenarios", "mean"),
            *("deviation between scenarios", "deviation between rooms of a scenario"),
            "scenarios that come out otherwise in another room",
        ),
        tuple(rows),
        "Standard deviations; scenarios that were run in one room only are left out.",
    )
