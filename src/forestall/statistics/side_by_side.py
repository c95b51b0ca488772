"""The two households side by side: every judge and strategy, kind beside honest.

Called by `tables`; reads a whole summary.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from forestall.statistics.cells import DASH, Columns, Names, Table, cells, shown
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


def side_by_side(summary: Mapping[str, Any], names: Names) -> Table:
    """One line for each judge or strategy and measure; what neither household has is left out."""
    contents = {p: summary["profiles"].get(p) for p in COLUMNS}
    there = [c for c in contents.values() if c is not None]
    judges = dict.fromkeys(n for c in there for n in c["detectors"] if _told(n))
    known = {n for c in there for n in c["shared"]["strategies"]}
    acted = [s for s in (*SIMPLE, *sorted(known - set(SIMPLE))) if s in known]
    rows: list[tuple[str, ...]] = []
    for name in sorted(judges, key=_place):
        found = [c and c["detectors"].get(name) for c in contents.values()]
        rows += _lines(shown(name, names), found, JUDGED)
    for name in acted:
        found = [c and c["shared"]["strategies"].get(name) for c in contents.values()]
        rows += _lines(shown(name, names), found, ACTED)
    cases = ", ".join(f"{c['shared']['cases']} {p}" for p, c in contents.items() if c is not None)
    return Table(
        "side-by-side",
        "The kind and the honest household side by side",
        ("judge or strategy", "measure", *COLUMNS),
        tuple(rows),
        f"Judges in runs that nobody interrupts, each at its own threshold. {FALSE_NOTE} In time: "
        "of the failures that can be known before the harm is done. Strategies on the cases that "
        f"all of them were run on ({cases}).",
    )


def _lines(
    name: str, found: list[Mapping[str, Any] | None], columns: Columns
) -> Iterator[tuple[str, ...]]:
    each = [cells(metrics or {}, columns) for metrics in found]
    for (measure, _, _), *values in zip(columns, *each, strict=True):
        if any(value != DASH for value in values):
            yield name, measure, *values


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
