"""Ten sentences that a sceptical reviewer would want, from the numbers of a summary.

Called by `tables` and `findings`. Nothing is written by hand: whichever way numbers turn out, the
sentence says so, and what was not measured is said to be.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterator, Mapping
from typing import Any

from forestall.statistics.cells import (
    EMPTY,
    Table,
    area,
    points,
    probability,
    seconds,
    share,
    shown,
)
from forestall.statistics.comparisons import (
    ADDED,
    AGAIN,
    CHANCE,
    FALSE,
    IN_TIME,
    LITERALLY,
    MODEL,
    with_model,
)
from forestall.statistics.judges import (
    LITERAL,
    MINED,
    MODELS,
    PLAN_CHECK,
    PRIMARY,
    Together,
    plan_check,
)
from forestall.statistics.orderings import FAILS, HOLDS, UNDECIDED, UNMEASURED
from forestall.statistics.outcomes import NO_STRATEGY, PROACTIVE, RETRY
from forestall.statistics.watches import ALL

Content = Mapping[str, Any]
Names = Mapping[str, str]

NOTHING_SAID = "not measured"


def told(summary: Mapping[str, Any]) -> Table:
    """The ten sentences as a table."""
    rows = tuple((str(k + 1), text) for k, text in enumerate(sentences(summary)))
    return Table("sentences", "Ten sentences for a sceptical reader", ("", "sentence"), rows)


def sentences(summary: Mapping[str, Any]) -> list[str]:
    """Ten, each of every household that was run, the one shown first before the other."""
    names = summary["names"]
    return [
        f"{claim} "
        + " ".join(
            f"{profile.capitalize()}: {'; '.join(said(content, names)) or NOTHING_SAID}."
            for profile, content in summary["profiles"].items()
        )
        for claim, said in _TOLD
    ]


def _demonstrations(content: Content, names: Names) -> Iterator[str]:
    for model in MODELS:
        check = plan_check(model)
        for judge in (PRIMARY, MINED):
            pair = Together(judge, check, both=False).name
            gain = _compared(content, ADDED, pair, check, IN_TIME)
            cost = _compared(content, ADDED, pair, check, FALSE)
            if gain is not None:
                more = "" if cost is None else f" ({_points(cost)} of runs with a false alarm)"
                yield f"{model} model, {judge}: {_points(gain)} in time{_after(gain)}{more}"
        first, second = with_model(PROACTIVE, model), with_model(PLAN_CHECK, model)
        acted = _compared(content, ADDED, first, second)
        if acted is not None:
            yield f"{first} over {second} in success: {_points(acted)}{_after(acted)}"


def _model(content: Content, names: Names) -> Iterator[str]:
    for model in MODELS:
        for judge in (MINED, PRIMARY):
            found = _compared(content, MODEL, plan_check(model), judge, IN_TIME)
            if found is not None:
                yield f"{model} model over {judge}: {_points(found)}{_after(found)}"


def _identity(content: Content, names: Names) -> Iterator[str]:
    own = content["detectors"].get(PRIMARY)
    if own is not None:
        yield f"area in time {area(own[f'auroc_in_time_{ALL}'])}"
        yield f"in time {share(own['in_time@0.90'])}"
        yield f"false alarms per run {share(own[f'false_alarms_per_run_{ALL}@0.90'])}"
        yield (
            "score of exactly 1.000 at "
            f"{share(content['constant'][PRIMARY])} of the faultless boundaries"
        )


def _literal(content: Content, names: Names) -> Iterator[str]:
    own = content["detectors"].get(LITERAL)
    if own is None:
        return
    yield f"area in time {area(own[f'auroc_in_time_{ALL}'])}"
    yield (
        f"at 0.90 in time {share(own['in_time@0.90'])} with false alarms in "
        f"{share(own[f'false_alarms_per_run_{ALL}@0.90'])} of the runs"
    )
    found = _compared(content, LITERALLY, LITERAL, PRIMARY, "AUROC in time")
    if found is not None:
        yield f"against the shipped reading {_points(found)} of area{_after(found)}"


def _orderings(content: Content, names: Names) -> Iterator[str]:
    found = [o for o in content["orderings"] if o["verdict"] != UNMEASURED]
    if not found:
        return
    counts = Counter(o["corrected"] for o in found)
    yield f"of {len(found)} " + ", ".join(
        f"{counts[v]} {words}" for v, words in _VERDICTS.items() if counts[v]
    )
    for o in found:
        if o["topic"] == "strategies":
            yield f"{o['better']} over {o['worse']} {o['corrected']}"
    held = [o for o in found if o["corrected"] == HOLDS and o["topic"] != "strategies"]
    for o in held:
        yield f"{shown(o['worse'], names)} is worse in {o['measure']}"


_VERDICTS = {HOLDS: "hold", FAILS: "do not hold", UNDECIDED: "undecided"}


def _chance(content: Content, names: Names) -> Iterator[str]:
    found = [o for o in content["comparisons"] if o["topic"] == CHANCE]
    for o in found:
        yield (
            f"{shown(o['better'], names)} {_percent(o['first'])} against {_percent(o['second'])}"
            f"{_after(o)}"
        )


def _retry(content: Content, names: Names) -> Iterator[str]:
    found = content["shared"]["strategies"]
    for name in (NO_STRATEGY, RETRY, PROACTIVE, PLAN_CHECK):
        if name in found:
            yield f"{name} succeeds in {share(found[name]['success'])}"
    for name in (PROACTIVE, PLAN_CHECK):
        pair = _compared(content, AGAIN, name, RETRY)
        if pair is not None:
            yield f"{name} minus {RETRY}, on all cases of both: {_points(pair)}{_after(pair)}"


def _cost(content: Content, names: Names) -> Iterator[str]:
    for name in (PROACTIVE, PLAN_CHECK, RETRY):
        found = content["cost_of_false_alarms"].get(name, {}).get(NO_STRATEGY, {})
        if found.get("seconds", EMPTY)["n"]:
            yield (
                f"{name}: {points(found['success'])} of success, {seconds(found['seconds'])} of "
                f"robot time; plans changed in {share(found['changed'])}, "
                f"{seconds(found['seconds_changed'])} more in those"
            )


def _unforeseeable(content: Content, names: Names) -> Iterator[str]:
    found = content["unforeseeable"].get(ALL, EMPTY)
    if found["n"]:
        yield share(found)


def _not_judged(content: Content, names: Names) -> Iterator[str]:
    silent = {n: m for n, m in content["not_judged"].items() if n in content["detectors"]}
    for name in (PRIMARY, MINED, PLAN_CHECK):
        if name in silent:
            yield f"{name} {share(silent[name])}"


Said = Callable[[Content, Names], Iterator[str]]

_TOLD: tuple[tuple[str, Said], ...] = (
    (
        "What demonstrations add to a model (asked beside the plan check, minus it alone).",
        _demonstrations,
    ),
    ("What the model adds to demonstrations, in detection in time.", _model),
    ("What identity and kindness are worth to the score.", _identity),
    ("What the paper's equations do, taken literally on the whole scene.", _literal),
    ("Of the paper's orderings, after Holm's correction.", _orderings),
    ("Detection in time against chance with as many false alarms per boundary.", _chance),
    ("What merely trying again does, on the cases that all strategies share.", _retry),
    ("What false alarms cost where nobody is needed, against no strategy.", _cost),
    ("Failures that can only be known when the harm is done, which no monitor can foresee.",
     _unforeseeable),
    ("Boundaries at which nothing was judged.", _not_judged),
)  # fmt: skip


def _compared(
    content: Content, topic: str, better: str, worse: str, measure: str = ""
) -> Mapping[str, Any] | None:
    return next(
        (
            o
            for o in content["comparisons"]
            if (o["topic"], o["better"], o["worse"]) == (topic, better, worse)
            and measure in ("", o["measure"])
        ),
        None,
    )


def _points(found: Mapping[str, Any]) -> str:
    return points(found["difference"])


def _after(found: Mapping[str, Any]) -> str:
    """The p-value after Holm's correction."""
    if found["p_holm"] is None:
        return ""
    said = probability(found["p_holm"])
    return f", p after Holm {said if said.startswith('<') else '= ' + said}"


def _percent(value: float | None) -> str:
    return NOTHING_SAID if value is None else f"{100 * value:.1f} %"
