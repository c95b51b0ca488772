"""Runs beside a run: the same start under other strategies, kept in its folder.

Such a run is a run like any other, in `beside/<strategy>`, whose provenance says what it is beside.
Written by the command line, read by the page, the view and whoever prints a run. Calls `record.py`.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from forestall.records.record import RECORD_NAME, read_record
from forestall.types.episode import EpisodeRecord

BESIDE_NAME = "beside"
ALONE = "none"
"""The strategy that nobody steps in with: what it costs to have no monitor."""

TIMELINE_NAME = "timeline.svg"
"""In `beside/`: all of them over simulated time."""


def folder_beside(folder: Path, strategy: str) -> Path:
    """Where the same start under another strategy lies."""
    return folder / BESIDE_NAME / strategy.replace("/", "-").replace(":", "-")


def records_beside(folder: Path) -> list[Path]:
    """The records of finished runs beside a run, whatever start they had."""
    return sorted(folder.glob(f"{BESIDE_NAME}/*/{RECORD_NAME}"))


def beside_what(record: EpisodeRecord) -> dict[str, Any]:
    """What the record of a run beside this one says of it."""
    return {"run": "../..", "strategy": record.strategy}


def beside(folder: Path, record: EpisodeRecord) -> tuple[EpisodeRecord, ...]:
    """The finished runs beside a run, nobody's first.

    Args:
        folder: of the run.
        record: of the run; what lies beside an earlier run of this folder, that had another start,
            is left out.

    Raises:
        FileFormatError: one of them is damaged.
    """
    found = []
    for path in records_beside(folder):
        other = read_record(path.parent)
        if same_start(record, other) and other.strategy != record.strategy:
            found.append(other)
    return tuple(sorted(found, key=lambda r: (r.strategy != ALONE, r.strategy)))


def same_start(one: EpisodeRecord, other: EpisodeRecord) -> bool:
    """Whether two runs began alike: task, scenario, seed, first plan, and what their files said."""

    def start(record: EpisodeRecord) -> tuple[Any, ...]:
        inputs = dict(record.provenance).get("inputs")
        said = tuple(sorted(inputs.items())) if isinstance(inputs, Mapping) else inputs
        return (record.task.name, record.scenario, record.seed, record.initial_plan, said)

    return start(one) == start(other)
