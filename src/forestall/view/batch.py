"""An experiment while it runs: how far it is, and its newest episodes. Called by `serving.py`.

A call of the command writes down what it wants before it begins (`effort.jsonl`), and a line for
each finished episode. Of those lines the last are read; how many there are the index knows.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from forestall.errors import FileFormatError
from forestall.experiments.folder import episodes_in
from forestall.experiments.stored import ROWS, Asked
from forestall.reading.documents import parse_json

NEWEST = 20
"""So many episodes are shown."""

_TAIL_BYTES = 2**20


@dataclass(frozen=True, slots=True)
class EpisodeLine:
    """One finished episode.

    Args:
        task: name of it.
        scenario: None where nothing was disturbed.
        strategy: as asked for.
        seed: of the scene.
        success: whether the goal was reached.
        end: why it ended.
        simulated_s: of the robot's clock.
    """

    task: str
    scenario: str | None
    strategy: str
    seed: str
    success: bool
    end: str
    simulated_s: float


@dataclass(frozen=True, slots=True)
class Batch:
    """An experiment that is at work, or broke off.

    Args:
        asked: what is wanted, by set and setup.
        newest: episodes, the last one first.
        size: of the file of rows in bytes; a page asks what has come since.
    """

    asked: Sequence[Asked]
    newest: Sequence[EpisodeLine]
    size: int


def batch_of(folder: Path) -> Batch:
    """How far an experiment has come.

    Raises:
        FileFormatError: what it writes is damaged.
    """
    asked = sorted(episodes_in(folder).asked(), key=lambda a: (a.profile, a.set, a.setup))
    lines, size = _last_lines(folder / ROWS)
    found = [_line(parse_json(line)) for line in reversed(lines[-NEWEST:])]
    return Batch(asked, found, size)


def size_of(folder: Path) -> int:
    """Bytes of rows that are written; 0 before the first."""
    try:
        return (folder / ROWS).stat().st_size
    except OSError:
        return 0


def _last_lines(file: Path) -> tuple[list[str], int]:
    """The last whole lines of a file, and its size."""
    size = size_of(file.parent)
    if not size:
        return [], 0
    with file.open("rb") as rows:
        rows.seek(max(0, size - _TAIL_BYTES))
        data = rows.read(_TAIL_BYTES)
    whole = data[: data.rfind(b"\n") + 1].decode("utf-8", "replace").split("\n")[:-1]
    return (whole if size <= _TAIL_BYTES else whole[1:]), size


def _line(row: Any) -> EpisodeLine:
    if not isinstance(row, Mapping):
        raise FileFormatError("a line of the results is no episode")
    scenario, seconds = row.get("scenario"), row.get("simulated_s")
    return EpisodeLine(
        task=str(row.get("task")),
        scenario=None if scenario is None else str(scenario),
        strategy=str(row.get("strategy")),
        seed=str(row.get("seed")),
        success=row.get("success") is True,
        end=str(row.get("end")),
        simulated_s=float(seconds) if isinstance(seconds, int | float) else 0.0,
    )
