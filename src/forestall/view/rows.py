"""What the index says of a run: from the head of its record, or from the lines written so far.

Called by `index.py`. A record has its boundaries last, and most of its size is theirs: reading
stops before them. A run that is not over is read from the lines that it has written.
"""

from __future__ import annotations

import os
import re
import socket
import time
from collections.abc import Mapping
from dataclasses import dataclass
from enum import Enum
from pathlib import Path
from typing import Any

from forestall.errors import FileFormatError
from forestall.files import HOLDER
from forestall.reading.documents import parse_json
from forestall.reading.fields import Field
from forestall.records.codec import check_header
from forestall.records.record import LINES_NAME, MOST_RECORD_BYTES, RECORD_NAME
from forestall.view.live import happened

_BOUNDARIES = b'\n "boundaries": '
_CHUNK = 2**15
_LISTED = frozenset({"alarms", "executed"})
_WANTED = _LISTED | {
    *("kind", "format", "complete", "task", "title", "scenario", "strategy", "seed"),
    *("success", "replans", "simulated_s"),
}
"""Keys of a record that a row is made of; of lists it is the length."""
_LOOKS_UP = 3
_QUIET_S = 600.0
_PROCESS = re.compile(r"^process (\d+) on (.+), since ")


class Outcome(Enum):
    """How a run stands, as the index filters by it."""

    SUCCEEDED = "succeeded"
    FAILED = "failed"
    NOT_SCORED = "not scored"
    RUNNING = "running"
    BROKEN_OFF = "broken off"
    UNREADABLE = "unreadable"


@dataclass(frozen=True, slots=True)
class RunRow:
    """A run in the index.

    Args:
        place: its folder, relative to the one that is viewed; "" for that itself.
        changed_s: when its record was written, as the file system tells the time.
        task: name of it.
        title: of the task.
        scenario: None where nothing was disturbed.
        strategy: as asked for.
        seed: of the scene.
        success: None where nobody scored.
        over: whether the record is whole.
        alarms: how many were raised.
        replans: how many plans were replaced.
        executed: how many subtasks were.
        simulated_s: of the robot's clock.
        problem: why the record cannot be read.
    """

    place: str
    changed_s: float
    task: str = ""
    title: str = ""
    scenario: str | None = None
    strategy: str = ""
    seed: int | None = None
    success: bool | None = None
    over: bool = False
    alarms: int = 0
    replans: int = 0
    executed: int = 0
    simulated_s: float = 0.0
    problem: str = ""

    @property
    def name(self) -> str:
        """What it is called where it cannot be read."""
        return self.place.rpartition("/")[2] or "this folder"


def source_of(folder: Path) -> Path | None:
    """The file that tells of a run, None where a folder holds none."""
    for name in (RECORD_NAME, LINES_NAME):
        if (folder / name).is_file():
            return folder / name
    return None


def read_row(place: str, source: Path, changed_s: float) -> RunRow:
    """The row of a run; one that cannot be read says why."""
    try:
        if source.name == RECORD_NAME:
            return _whole(place, _head(source), changed_s)
        return _begun(place, source, changed_s)
    except (FileFormatError, OSError) as error:
        return RunRow(place, changed_s, problem=str(error))


def outcome_of(row: RunRow, folder: Path) -> Outcome:
    """How a run stands now; whether one is still at work is asked of the system.

    Args:
        row: of the run.
        folder: of the run.
    """
    if row.problem:
        return Outcome.UNREADABLE
    if not row.over:
        return Outcome.RUNNING if at_work(folder, row.changed_s) else Outcome.BROKEN_OFF
    if row.success is None:
        return Outcome.NOT_SCORED
    return Outcome.SUCCEEDED if row.success else Outcome.FAILED


def _head(source: Path) -> Any:
    """What the index asks of a record before its boundaries, or all of that."""
    data = b""
    with source.open("rb") as file:
        while _BOUNDARIES not in data[-len(_BOUNDARIES) - _CHUNK :]:
            more = file.read(_CHUNK)
            if not more:
                return parse_json(data.decode("utf-8", "replace"))
            data += more
            if len(data) > MOST_RECORD_BYTES:
                raise FileFormatError(f"{source} is larger than a record may be")
    head = data[: data.index(_BOUNDARIES)].rstrip().removesuffix(b",").decode("utf-8", "replace")
    brief = _brief(head)
    return parse_json(f"{head}}}") if brief is None else brief


def _brief(head: str) -> dict[str, Any] | None:
    """The keys that a row is made of, from a record with one key a line, as ours are written.

    Most of a head is of no use here, and reading it is most of what a first view takes. None where
    the lines are not as expected, and everything is to be read.
    """
    opening, *lines = head.split("\n")
    found: dict[str, str] = {}
    counts: dict[str, int] = {}
    key = ""
    for line in lines:
        if line.startswith("  ") and found.get(key) == "[":  # one of a list
            counts[key] += 1
        elif line.startswith(' "'):
            key, colon, value = line[2:].partition('": ')
            if not colon or key in found:
                return None
            found[key], counts[key] = value.removesuffix(","), 0
        elif line not in (" ]", " ],"):
            return None
    if opening != "{" or not found.keys() >= _WANTED:
        return None
    texts = (f'"{k}": {found[k]}' for k in _WANTED - _LISTED)
    listed = {k: [None] * counts[k] for k in _LISTED if found[k] in ("[", "[]")}
    return (
        None if len(listed) < len(_LISTED) else {**parse_json(f"{{{', '.join(texts)}}}"), **listed}
    )


def _whole(place: str, data: Any, changed_s: float) -> RunRow:
    check_header(data)
    field = Field(data)
    return RunRow(
        **_named(place, field, changed_s),
        success=field.maybe("success", Field.flag),
        over=field["complete"].flag(),
        alarms=len(field["alarms"].items()),
        replans=field["replans"].whole(),
        executed=len(field["executed"].items()),
        simulated_s=field["simulated_s"].number(),
    )


def _begun(place: str, source: Path, changed_s: float) -> RunRow:
    events, _ = happened(source, 0)
    if not events:
        raise FileFormatError(f"{source}: nothing of the run is written yet")
    start = Field(events[0])
    boundaries = [e for e in events if e.get("event") == "boundary"]
    executed = [e for e in events if e.get("event") == "executed"]
    times = [_time(e) for e in events]
    alarms = [e["alarm"] for e in boundaries if isinstance(e.get("alarm"), Mapping)]
    return RunRow(
        **_named(place, start, changed_s),
        alarms=len(alarms),
        replans=sum(bool(a.get("replanned")) for a in alarms),
        executed=len(executed),
        simulated_s=max(times, default=0.0),
    )


def _named(place: str, field: Field, changed_s: float) -> dict[str, Any]:
    return {
        "place": place,
        "changed_s": changed_s,
        "task": field["task"].text(),
        "title": field["title"].text(),
        "scenario": field.maybe("scenario", Field.text),
        "strategy": field["strategy"].text(),
        "seed": field["seed"].whole(),
    }


def _time(event: Mapping[str, Any]) -> float:
    boundary = event.get("boundary")
    told = boundary.get("time_s") if isinstance(boundary, Mapping) else event.get("time_s")
    return float(told) if isinstance(told, int | float) else 0.0


def at_work(folder: Path, changed_s: float) -> bool:
    """Whether somebody still writes: the holder of the folder or of one above it lives.

    Where nobody holds one, or who does is on another machine, what was written lately counts.
    """
    for place in (folder, *folder.parents[:_LOOKS_UP]):
        try:
            said = _PROCESS.match((place / HOLDER).read_text("utf-8")[:200])
        except (OSError, UnicodeDecodeError):
            continue
        if said and said[2] == socket.gethostname():
            return _lives(int(said[1]))
        break
    return time.time() - changed_s < _QUIET_S


def _lives(process: int) -> bool:
    try:
        os.kill(process, 0)
    except PermissionError:
        return True
    except (OSError, OverflowError):
        return False
    return True
