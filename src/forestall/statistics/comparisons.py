"""What the paper does not compare and a sceptic would, each topic a family of its own.

Calls: `profile` → here → `orderings`. What demonstrations add to a model (the plan check), what the
model adds to demonstrations, what the paper's literal score does, what chance would detect at equal
false alarms, and what a robot reaches that merely tries again.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from forestall.statistics.judges import (
    LITERAL,
    MODELS,
    OTHERS,
    PLAN_CHECK,
    PRIMARY,
    Together,
    is_variant,
    plan_check,
)
from forestall.statistics.metrics import Alarms, asked_together, at_thresholds, point_metrics
from forestall.statistics.orderings import (
    UNMEASURED,
    Ordering,
    holm,
    judges_differ,
    shares_differ,
    strategies_differ,
)
from forestall.statistics.outcomes import PROACTIVE, RETRY, SIMPLE, Runs
from forestall.statistics.rows import EXACT
from forestall.statistics.watches import ALL, Watches

ADDED, MODEL, LITERALLY, CHANCE, AGAIN = (
    "what demonstrations add",
    "what the model adds",
    "the literal score",
    "chance at equal false alarms",
    "trying again",
)
TOPICS = (ADDED, MODEL, LITERALLY, CHANCE, AGAIN)
IN_TIME = "detection in time"
FALSE = "runs without a failure that get an alarm (more is worse)"


def comparisons(setups: Mapping[str, Runs], watched: Watches, failing: str) -> list[Ordering]:
    """All that could be measured, p-values corrected by Holm's method for those of one topic."""
    every = (
        *_demonstrations(setups, watched, failing),
        *_model(watched, failing),
        *(
            judges_differ(LITERALLY, watched, LITERAL, PRIMARY, measure, failing)
            for measure in ("AUROC in time", "AUROC")
        ),
        *_chance(watched, failing),
        *(strategies_differ(AGAIN, setups, s, RETRY, ALL) for s in SIMPLE if s != RETRY),
    )
    there = [o for o in every if o.verdict != UNMEASURED]
    return [o for topic in TOPICS for o in holm(x for x in there if x.topic == topic)]


def with_model(strategy: str, model: str) -> str:
    """A strategy's name with the model that it reads."""
    return strategy if model == EXACT else f"{strategy}, {model} model"


def _demonstrations(
    setups: Mapping[str, Runs], watched: Watches, failing: str
) -> Iterator[Ordering]:
    for model in MODELS:
        check = plan_check(model)
        for judge in OTHERS:
            pair = Together(judge, check, both=False)
            if {judge, check} <= set(watched.names):
                alarms = {
                    pair.name: asked_together(watched, pair),
                    check: at_thresholds(watched, check),
                }
                yield _in_time(ADDED, watched, alarms, (pair.name, check), failing)
                yield _false(ADDED, watched, alarms, (pair.name, check))
        first, second = with_model(PROACTIVE, model), with_model(PLAN_CHECK, model)
        yield strategies_differ(ADDED, setups, first, second, ALL)


def _model(watched: Watches, failing: str) -> Iterator[Ordering]:
    for model in MODELS:
        check = plan_check(model)
        for judge in OTHERS:
            if {judge, check} <= set(watched.names):
                alarms = {name: at_thresholds(watched, name) for name in (judge, check)}
                yield _in_time(MODEL, watched, alarms, (check, judge), failing)
                yield judges_differ(MODEL, watched, check, judge, "AUROC in time", failing)


def _chance(watched: Watches, failing: str) -> Iterator[Ordering]:
    for judge in watched.names:
        if is_variant(judge) or judge.startswith(f"{PRIMARY} without"):
            continue
        found = point_metrics(at_thresholds(watched, judge), failing)
        more = found["over_chance"]
        values = found["in_time"].value, found["chance_in_time"].value
        yield Ordering(CHANCE, judge, "chance", IN_TIME, *values, more, more.p)


def _in_time(
    topic: str,
    watched: Watches,
    alarms: Mapping[str, Alarms],
    pair: tuple[str, str],
    failing: str,
) -> Ordering:
    seen = alarms[pair[0]].seen_by & alarms[pair[1]].seen_by
    where = watched.of_set(failing) & watched.foreseeable & seen
    shares = {name: alarms[name].share(watched.timely) for name in pair}
    return shares_differ(topic, watched, pair, IN_TIME, shares, where)


def _false(
    topic: str, watched: Watches, alarms: Mapping[str, Alarms], pair: tuple[str, str]
) -> Ordering:
    """What it costs: more false alarms are no gain."""
    seen = alarms[pair[0]].seen_by & alarms[pair[1]].seen_by
    shares = {name: alarms[name].share() for name in pair}
    return shares_differ(topic, watched, pair, FALSE, shares, seen & ~watched.failing)
