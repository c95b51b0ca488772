"""Ten sentences that a sceptical reviewer would want, from the numbers of a summary.

Called by `tables`. Nothing is written by hand: whichever way numbers turn out, the
sentence says so, and what was not measured is said to be.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterator, Mapping
from typing import Any

from forestall.statistics.cells import (
    DASH,
    EMPTY,
    Table,
    area,
    points,
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
from forestall.statistics.orderings import ALPHA, FAILS, HOLDS, UNDECIDED, UNMEASURED
from forestall.statistics.outcomes import NO_STRATEGY, PROACTIVE, RETRY
from forestall.statistics.rows import HONEST, KIND
from forestall.statistics.watches import ALL

Content = Mapping[str, Any]
Names = Mapping[str, str]

NOTHING_SAID = "not measured"
BOTH = (KIND, HONEST)
STAYS = "* marks"


def told(summary: Mapping[str, Any]) -> Table:
    """The ten sentences as a table, one column for each household."""
    names, contents = summary["names"], summary["profiles"]
    rows = tuple(
        (
            str(k),
            claim,
            *("; ".join(said(contents[p], names)) or DASH if p in contents else DASH for p in BOTH),
        )
        for k, (claim, said) in enumerate(_TOLD, 1)
    )
    return Table(
        "sentences",
        "What a sceptical reader asks",
        ("", "question", *BOTH),
        rows,
        f"In brackets 95 % intervals. {STAYS} what Holm's correction for all of the topic leaves.",
    )


def _demonstrations(content: Content, names: Names) -> Iterator[str]:
    for judge in (PRIMARY, MINED):
        pairs = {
            model: (Together(judge, check, both=False).name, check)
            for model in MODELS
            for check in (plan_check(model),)
        }
        gains = _each(content, ADDED, pairs, IN_TIME)
        if gains:
            costs = _each(content, ADDED, pairs, FALSE)
            yield f"{judge}, in time: {gains}; in runs with a false alarm: {costs}"
    acted = {m: (with_model(PROACTIVE, m), with_model(PLAN_CHECK, m)) for m in MODELS}
    if gains := _each(content, ADDED, acted):
        yield f"{PROACTIVE} over {PLAN_CHECK}, in success: {gains}"


def _model(content: Content, names: Names) -> Iterator[str]:
    for judge in (MINED, PRIMARY):
        pairs = {model: (plan_check(model), judge) for model in MODELS}
        if gains := _each(content, MODEL, pairs, IN_TIME):
            yield f"over {judge}: {gains}"


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
        yield f"its area minus the shipped reading's, times 100: {_brief(found)}"


def _orderings(content: Content, names: Names) -> Iterator[str]:
    found = [o for o in content["orderings"] if o["verdict"] != UNMEASURED]
    if not found:
        return
    counts = Counter(o["corrected"] for o in found)
    yield f"of {len(found)}: " + ", ".join(
        f"{counts[v]} {words}" for v, words in _VERDICTS.items() if counts[v]
    )
    pairs: dict[tuple[str, str], list[bool]] = {}
    for o in found:
        pairs.setdefault((o["better"], o["worse"]), []).append(o["corrected"] == HOLDS)
    for (better, worse), held in pairs.items():
        yield f"{shown(better, names)} over {shown(worse, names)} {sum(held)}/{len(held)}"


_VERDICTS = {HOLDS: "hold", FAILS: "do not hold", UNDECIDED: "undecided"}


def _chance(content: Content, names: Names) -> Iterator[str]:
    found = [o for o in content["comparisons"] if o["topic"] == CHANCE]
    for o in found:
        yield (
            f"{shown(o['better'], names)} {_percent(o['first'])} against {_percent(o['second'])}"
            f"{_star(o)}"
        )


def _retry(content: Content, names: Names) -> Iterator[str]:
    found = content["shared"]["strategies"]
    for name in (NO_STRATEGY, RETRY, PROACTIVE, PLAN_CHECK):
        if name in found:
            yield f"{name} succeeds in {share(found[name]['success'])}"
    for name in (PROACTIVE, PLAN_CHECK):
        pair = _compared(content, AGAIN, name, RETRY)
        if pair is not None:
            yield f"{name} minus {RETRY}, on all cases of both: {_brief(pair)} points"


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
        "What do demonstrations add to a model? Judge or plan check minus plan check, in points.",
        _demonstrations,
    ),
    ("What does the model add to demonstrations? Plan check minus judge in time, points.", _model),
    ("What are identity and kindness worth to the score?", _identity),
    ("What do the paper's equations do, taken literally on the whole scene?", _literal),
    ("Which of the paper's orderings hold, after Holm's correction?", _orderings),
    ("What would chance with as many false alarms per boundary detect in time?", _chance),
    ("What does merely trying again reach, on the cases that all strategies share?", _retry),
    ("What do false alarms cost where nobody is needed, against no strategy?", _cost),
    ("How many failures can only be known when the harm is done?",
     _unforeseeable),
    ("At how many boundaries was nothing judged?", _not_judged),
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


def _each(
    content: Content, topic: str, pairs: Mapping[str, tuple[str, str]], measure: str = ""
) -> str:
    """What each pair gains, by model."""
    found = {m: _compared(content, topic, *pair, measure) for m, pair in pairs.items()}
    return ", ".join(f"{_brief(o)} ({model})" for model, o in found.items() if o is not None)


def _brief(found: Mapping[str, Any]) -> str:
    """A difference in points with its interval, marked if it stays after Holm's correction."""
    metric = found["difference"]
    low, high = metric["low"], metric["high"]
    between = "" if low is None else f" [{100 * low:+.1f}, {100 * high:+.1f}]"
    return f"{100 * metric['value']:+.1f}{between}{_star(found)}"


def _star(found: Mapping[str, Any]) -> str:
    return " *" if found["p_holm"] is not None and found["p_holm"] <= ALPHA else ""


def _percent(value: float | None) -> str:
    return NOTHING_SAID if value is None else f"{100 * value:.1f} %"
