"""Everything that the rows of an experiment say, as plain data: `summary.json`.

Calls: the experiments → here → `profile`. Reads no files. Rows are put in a fixed order first, so
that the same episodes give the same summary however they were run. `profiles` has one part for each
household, all of one shape, and nothing is counted over two of them; `shown` is the one that
tables and figures show first. Every metric is `{"value", "low", "high", "n", "method"}`, with
`count` where it is a share; what was not measured is None, never 0 and never NaN.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from forestall.statistics.cells import Names
from forestall.statistics.intervals import LEVEL, RESAMPLES, SEED, Metric
from forestall.statistics.outcomes import ERROR
from forestall.statistics.profile import content
from forestall.statistics.rows import HONEST, KIND, EpisodeRow
from forestall.statistics.watches import canonical

SUMMARY_FORMAT = 2
"""Raised whenever a field changes its meaning."""

DIGITS = 9
"""Of the numbers in a summary; sums may differ beyond between machines."""


def summary(
    rows: Iterable[EpisodeRow],
    meta: Mapping[str, Any],
    notes: Sequence[str] = (),
    names: Names | None = None,
    calibration: Iterable[EpisodeRow] = (),
) -> dict[str, Any]:
    """Summarise an experiment.

    Args:
        rows: its episodes, in any order.
        meta: kept as it is: machine, versions, arguments.
        notes: what is to be said below every table, such as what is missing.
        names: what is shown in place of a judge's name; kept for the tables.
        calibration: rows of another split, that thresholds are drawn from.

    Raises:
        InputError: an episode is there twice, or a failing one does not say when its failure can
            be known.
    """
    found, apart = canonical(rows), canonical(calibration)
    there = {r.profile for r in found} or {KIND}
    profiles = [p for p in (HONEST, KIND) if p in there]
    plain = _plain(
        {
            "format": SUMMARY_FORMAT,
            "meta": dict(meta),
            "names": dict(names or {}),
            "intervals": {"level": LEVEL, "resamples": RESAMPLES, "seed": SEED},
            "episodes": _episodes(found, notes),
            "shown": profiles[0],
            "profiles": {
                p: content(
                    [r for r in found if r.profile == p],
                    p,
                    names,
                    [r for r in apart if r.profile == p],
                )
                for p in profiles
            },
        }
    )
    assert isinstance(plain, dict)
    return plain


def _episodes(rows: Sequence[EpisodeRow], notes: Sequence[str]) -> dict[str, Any]:
    broken = sum(r.end == ERROR for r in rows)
    if broken:
        notes = [*notes, f"{broken} of {len(rows)} episodes broke off; they count as failed"]
    return {
        "found": len(rows),
        "executed": sum(not r.implied for r in rows),
        "errors": broken,
        "notes": list(notes),
    }


def _plain(data: object) -> object:
    """As JSON has it: no metric objects, no tuples, no NaN, rounded numbers."""
    if isinstance(data, Metric):
        return _plain(data.to_json())
    if isinstance(data, Mapping):
        return {str(k): _plain(v) for k, v in data.items()}
    if isinstance(data, list | tuple):
        return [_plain(v) for v in data]
    if isinstance(data, float):
        return round(data, DIGITS) + 0.0 if math.isfinite(data) else None
    return data
