"""A run as it happens: the lines that its recorder flushes, read on from where they were read.

Called by `rows.py` and `pages.py`. The recorder writes a line at once for whatever happens
(`records/record.py`); half a line that is being written is left for the next time.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from forestall.errors import FileFormatError
from forestall.reading.documents import parse_json
from forestall.reading.files import is_inside
from forestall.records.codec import check_header
from forestall.records.record import MOST_RECORD_BYTES

_SIGNS = {"succeeded": "✓", "refused": "✕", "failed": "✕"}


def happened(path: Path, offset: int) -> tuple[list[dict[str, Any]], int]:
    """What has been written since a place in the file.

    Args:
        path: of `boundaries.jsonl`.
        offset: in bytes; 0 from the beginning.

    Returns:
        The events, and the place behind the last whole line.

    Raises:
        FileFormatError: a whole line is damaged, or the first is not that of a run.
        OSError: it cannot be read.
    """
    with path.open("rb") as file:
        file.seek(offset)
        data = file.read(MOST_RECORD_BYTES)
    whole = data[: data.rfind(b"\n") + 1]
    found = []
    for number, line in enumerate(whole.splitlines(), 1):
        event = parse_json(line.decode("utf-8", "replace"))
        if not isinstance(event, dict):
            raise FileFormatError(f"{path}: line {number} is no event of a run")
        found.append(event)
    if offset == 0 and found:
        check_header(found[0])
    return found, offset + len(whole)


@dataclass(frozen=True, slots=True)
class Line:
    """One thing that happened, as the live page says it.

    Args:
        sign: what came of it in one character.
        look: its class in the style sheet.
        what: in words.
        subtask: that it concerns.
        said: what the owner is told, or why a step went wrong.
        time_s: of the robot's clock.
        score: against what threshold, where something was compared.
    """

    sign: str
    look: str
    what: str
    subtask: str
    said: str
    time_s: float
    score: str = ""


@dataclass(frozen=True, slots=True)
class Progress:
    """How far a run has come.

    Args:
        task: title of it.
        scenario: None where nothing was disturbed.
        strategy: as asked for.
        seed: of the scene.
        done: executed subtasks with their signs.
        left: what is still to be done, as far as the last boundary says.
        lines: what happened, the newest first.
        picture: name of the newest, None where none is kept.
        alarms: how many were raised.
        time_s: of the robot's clock.
        end: why it ended, "" before that.
    """

    task: str
    scenario: str | None
    strategy: str
    seed: str
    done: tuple[tuple[str, str], ...] = ()
    left: tuple[str, ...] = ()
    lines: tuple[Line, ...] = field(default=())
    picture: str | None = None
    alarms: int = 0
    time_s: float = 0.0
    end: str = ""


def progress(events: Sequence[Mapping[str, Any]]) -> Progress:
    """What the events so far say; unusual values are shown as they are.

    Args:
        events: of one run, its start first.
    """
    start = events[0]
    lines, done = [], []
    left: Sequence[Any] = _list(start.get("initial_plan"))
    picture, end = None, ""
    for event in events[1:]:
        what = event.get("event")
        if what == "boundary":
            boundary = _dict(event.get("boundary"))
            lines.append(_judged(boundary, event.get("alarm") is not None))
            after = boundary.get("plan_after")
            left = _list(boundary.get("plan_before") if after is None else after)
            image = boundary.get("image")
            picture = image if isinstance(image, str) and is_inside(image) else picture
        elif what == "executed":
            step = _dict(event.get("executed"))
            done.append((_SIGNS.get(str(step.get("status")), "?"), str(step.get("subtask"))))
            lines.append(_executed(step, event))
            left = left[1:]
        elif what == "end":
            end = str(event.get("end"))
    scenario = start.get("scenario")
    return Progress(
        task=str(start.get("title") or start.get("task")),
        scenario=None if scenario is None else str(scenario),
        strategy=str(start.get("strategy")),
        seed=str(start.get("seed")),
        done=tuple(done),
        left=tuple(map(str, left)),
        lines=tuple(reversed(lines)),
        picture=picture,
        alarms=sum(e.get("alarm") is not None for e in events),
        time_s=max((line.time_s for line in lines), default=0.0),
        end=end,
    )


def _judged(boundary: Mapping[str, Any], alarm: bool) -> Line:
    verdict = _dict(boundary.get("verdict"))
    outcome = str(boundary.get("outcome") or "judged")
    score, threshold = verdict.get("score"), verdict.get("threshold")
    compared = isinstance(score, int | float) and isinstance(threshold, int | float)
    when = str(boundary.get("when") or "before")
    return Line(
        sign="!" if alarm else ("–" if not verdict else "✓"),
        look="alarm" if alarm else "",
        what=f"{'at the end, after' if when == 'end' else when}: {outcome}",
        subtask=str(boundary.get("subtask")),
        said=str(boundary.get("sentence") or ""),
        time_s=_number(boundary.get("time_s")),
        score=f"{score:.3f} / {threshold:.2f}" if compared else "",
    )


def _executed(step: Mapping[str, Any], event: Mapping[str, Any]) -> Line:
    status = str(step.get("status"))
    return Line(
        sign=_SIGNS.get(status, "?"),
        look="" if status == "succeeded" else "broke",
        what=f"executed: {status}",
        subtask=str(step.get("subtask")),
        said=str(step.get("reason") or ""),
        time_s=_number(event.get("time_s")),
    )


def _dict(value: Any) -> Mapping[str, Any]:
    return value if isinstance(value, Mapping) else {}


def _list(value: Any) -> Sequence[Any]:
    return value if isinstance(value, list) else []


def _number(value: Any) -> float:
    return float(value) if isinstance(value, int | float) else 0.0
