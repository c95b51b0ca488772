"""The same start under several strategies, as a table and on one timeline (the paper's Figure 7).

Called by the page of a run and by the command line; calls `records/` and `run_figures.py`. What
stands here is what the records say, nothing that only the simulator knows but the scorer's verdict.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from urllib.parse import quote

from forestall.records.beside import folder_beside
from forestall.records.derived import alarms, reasoning_s, replans
from forestall.report.figure_values import Lane
from forestall.report.words import duration
from forestall.types.episode import EpisodeRecord
from forestall.types.runtime import When

COLUMNS = (
    ("strategy", False),
    ("outcome", False),
    ("alarms", True),
    ("new plans", True),
    ("subtasks", True),
    ("robot time", True),
    ("reasoning", True),
    ("why not", False),
)
"""Of the table, and whether one stands at the right."""

LONG = ("why not",)
"""What has no room in a terminal's table."""


@dataclass(frozen=True, slots=True)
class BesideRow:
    """One run of the table.

    Args:
        cells: in the order of `COLUMNS`.
        good: whether it reached the goal, None where nobody scored.
        link: to its page from that of the run; "" for that run itself.
    """

    cells: tuple[str, ...]
    good: bool | None
    link: str


@dataclass(frozen=True, slots=True)
class BesideView:
    """What the page shows.

    Args:
        rows: the run itself first.
        drawing: the timeline as SVG of a file.
    """

    rows: tuple[BesideRow, ...]
    drawing: bytes


def beside_view(record: EpisodeRecord, others: Sequence[EpisodeRecord]) -> BesideView | None:
    """The run and those beside it; None where there are none."""
    from forestall.report.run_figures import timelines

    if not others:
        return None
    lanes = [_lane(r) for r in (*others, record)]
    return BesideView(beside_rows(record, others), timelines(lanes))


def beside_rows(record: EpisodeRecord, others: Sequence[EpisodeRecord]) -> tuple[BesideRow, ...]:
    """A row for each, the run itself first."""
    return (_row(record, ""), *(_row(other, _link(other)) for other in others))


def _link(other: EpisodeRecord) -> str:
    return quote(f"{folder_beside(Path(), other.strategy).as_posix()}/index.html")


def _row(record: EpisodeRecord, link: str) -> BesideRow:
    said = {True: "succeeded", False: "failed", None: "not scored"}[record.success]
    why = [words for _, words in record.harmed] or list(record.failures)
    cells = (
        record.strategy,
        said,
        str(len(alarms(record))),
        str(replans(record)),
        str(len(record.executed)),
        duration(record.simulated_s),
        duration(reasoning_s(record.compute_s)),
        "" if record.success else "; ".join(why),
    )
    return BesideRow(cells, record.success, link)


def _lane(record: EpisodeRecord) -> Lane:
    """A run on the timeline; when its failure could be known no record of a run says."""
    found = alarms(record)
    return Lane(
        label=record.strategy,
        ticks=tuple(sorted({b.time_s for b in record.boundaries if b.when is not When.END})),
        alarms=tuple(sorted({record.boundaries[a.position].time_s for a in found})),
        replans=tuple(sorted({record.boundaries[a.position].time_s for a in found if a.replanned})),
        known_s=None,
        harmed_s=record.harmed[0][0] if record.harmed else None,
        end_s=record.simulated_s,
        success=bool(record.success),
    )
