"""An experiment while it runs: how far it is, and its newest episodes. Called by `serving.py`.

A call of the command writes down what it wants before it begins (`effort.jsonl`), and a line for
each finished episode. They are counted in the bytes that the page asks to be told of: the index may
be a moment older.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from forestall.errors import FileFormatError
from forestall.experiments.folder import EFFORT, episodes_in
from forestall.experiments.stored import MOST_ROWS_BYTES, ROWS, Asked
from forestall.reading.documents import parse_json
from forestall.reading.files import read_bytes

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
        done: how many episodes are finished.
        newest: of them, the last one first.
        size: of the file of rows in bytes, when it was read; a page asks what has come since.
        left_s: how long the rest takes at the pace so far, as the bar of the command has it; None
            before the first episode of a call, and where nobody is at work.
    """

    asked: Sequence[Asked]
    done: int
    newest: Sequence[EpisodeLine]
    size: int
    left_s: float | None = None


def batch_of(folder: Path, busy: bool = True) -> Batch:
    """How far an experiment has come.

    Args:
        folder: of it.
        busy: whether somebody is at work on it.

    Raises:
        FileFormatError: what it writes is damaged.
    """
    results = episodes_in(folder)
    asked = sorted(results.asked(), key=lambda a: (a.profile, a.set, a.setup))
    data = read_bytes(folder / ROWS, "results", MOST_ROWS_BYTES) if size_of(folder) else b""
    whole = data[: data.rfind(b"\n") + 1]
    lines = whole[-_TAIL_BYTES:].decode("utf-8", "replace").split("\n")[:-1]
    if len(whole) > _TAIL_BYTES:
        del lines[0]  # the first may be half of one
    found = [_line(parse_json(line)) for line in reversed(lines[-NEWEST:])]
    done, wanted = whole.count(b"\n"), sum(a.episodes for a in asked)
    before = results.begun_with() if busy else None
    left_s = None if before is None else _left_s(folder, done - before, wanted - done)
    return Batch(asked, done, found, len(data), left_s)


def _left_s(folder: Path, new: int, missing: int) -> float | None:
    """Time for the missing episodes: a call writes down that it begins, and each new episode."""
    try:
        began, last = ((folder / name).stat().st_mtime for name in (EFFORT, ROWS))
    except OSError:
        return None
    return max(missing, 0) * (last - began) / new if new > 0 and last > began else None


def size_of(folder: Path) -> int:
    """Bytes of rows that are written; 0 before the first."""
    try:
        return (folder / ROWS).stat().st_size
    except OSError:
        return 0


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
