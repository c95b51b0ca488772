"""The two households side by side: every judge and strategy, kind beside honest.

Called by `tables`; reads a whole summary.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from typing import Any

from forestall.statistics.cells import Columns, Names, Table, cells, heads, shown
from forestall.statistics.further_tables import ACTED, FALSE_NOTE, JUDGED
from forestall.statistics.judges import (
    LITERAL,
    MINED,
    MODELS,
    OTHERS,
    PLAN_CHECK,
    PRIMARY,
    Together,
    is_variant,
    plan_check,
)
from forestall.statistics.metrics import ALWAYS, NEVER, RANDOM, TRUTH
from forestall.statistics.outcomes import SIMPLE
from forestall.statistics.paper import ABLATIONS
from forestall.statistics.rows import EXACT, HONEST, KIND

COLUMNS = (KIND, HONEST)


def side_by_side(summary: Mapping[str, Any], names: Names) -> tuple[Table, Table]:
    """Judges, and strategies: a line for each in each household, kind above honest."""
    contents = {p: summary["profiles"].get(p) for p in COLUMNS}
    there = [c for c in contents.values() if c is not None]
    judges = dict.fromkeys(n for c in there for n in c["detectors"] if _told(n))
    known = {n for c in there for n in c["shared"]["strategies"]}
    acted = [s for s in (*SIMPLE, *sorted(known - set(SIMPLE))) if s in known]
    cases = ", ".join(f"{c['shared']['cases']} {p}" for p, c in contents.items() if c is not None)
    return (
        Table(
            "side-by-side",
            "Judges in the kind and in the honest household",
            ("judge", "household", *heads(JUDGED)),
            tuple(
                line
                for name in sorted(judges, key=_place)
                for line in _lines(name, names, contents, lambda c: c["detectors"], JUDGED)
            ),
            f"In runs that nobody interrupts, each at its own threshold. {FALSE_NOTE} In time: of "
            "the failures that can be known before the harm is done.",
        ),
        Table(
            "strategies-side-by-side",
            "Strategies in the kind and in the honest household",
            ("strategy", "household", *heads(ACTED)),
            tuple(
                line
                for name in acted
                for line in _lines(
                    name, names, contents, lambda c: c["shared"]["strategies"], ACTED
                )
            ),
            f"On the cases that all strategies of a household were run on ({cases}).",
        ),
    )


def _lines(
    name: str,
    names: Names,
    contents: Mapping[str, Any],
    part: Callable[[Any], Mapping[str, Any]],
    columns: Columns,
) -> Iterator[tuple[str, ...]]:
    """What is known of a judge or strategy, household by household."""
    for household, content in contents.items():
        if content is not None and name in part(content):
            yield shown(name, names), household, *cells(part(content)[name], columns)


def _told(name: str) -> bool:
    """Whether it stands in this table; the others have one of their own."""
    return not is_variant(name) and name not in LEFT_OUT


def _place(name: str) -> int:
    """Judges in question first, those that cost nothing last."""
    if name in (ALWAYS, TRUTH):
        return 9
    known = (PRIMARY, LITERAL, MINED)
    return known.index(name) if name in known else 4 - name.startswith(PLAN_CHECK)


def _further() -> Iterator[str]:
    """Two judges that are asked together, but for the primary one and the exact model."""
    for model in MODELS:
        for judge in OTHERS:
            if (judge, model) != (PRIMARY, EXACT):
                for both in (False, True):
                    yield Together(judge, plan_check(model), both).name


LEFT_OUT = {NEVER, RANDOM, *ABLATIONS.values(), *_further()}
