"""The record of a run on disk: written as it happens, finished atomically, read back.

`RunRecorder` listens to the episode loop. A folder holds `record.json` (the finished run, see
`docs/record-format.md`), `boundaries.jsonl` (one line for each thing that happened, flushed at
once, so that a killed run can still be read) and `images/`. Both are read into an `EpisodeRecord`
by the one codec (`codec.py`).
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from forestall.errors import FileFormatError, InputError
from forestall.files import naming, replace_file
from forestall.reading.documents import parse_json
from forestall.reading.fields import Field
from forestall.reading.files import read_text
from forestall.records.boundaries import boundary_json, by_reference, executed_json
from forestall.records.codec import (
    KIND,
    RECORD_FORMAT,
    alarm_json,
    check_header,
    head_json,
    record_from_json,
    record_to_json,
)
from forestall.records.derived import alarm_at, left_at, new_plan
from forestall.records.pictures import encode_jpeg, file_name
from forestall.records.plain import plain
from forestall.types.episode import BoundaryRecord, EpisodeRecord, ExecutedRecord
from forestall.types.observation import Observation
from forestall.types.runtime import BoundaryContext

RECORD_NAME = "record.json"
LINES_NAME = "boundaries.jsonl"
IMAGES_NAME = "images"

MOST_RECORD_BYTES = 2**28
"""How large a record may be: about a thousand boundaries."""


class RunRecorder:
    """Listener that keeps a run readable at every moment.

    `on_start` takes away what an earlier run left in the same folder, its page first: no page
    is left beside the record of another run.

    Args:
        folder: made when the run starts; nobody else writes to it (`files.alone`).
        page: where the page of this run will be; its file lies in the folder.
    """

    def __init__(self, folder: Path | str, *, page: str | None = None) -> None:
        self.folder = Path(folder)
        self._page = page
        self.complete = False
        """Whether the record of a whole run is written."""
        self._started = False
        self._stored: list[BoundaryRecord] = []

    def on_start(self, record: EpisodeRecord) -> None:
        """The episode begins."""
        self.folder.mkdir(parents=True, exist_ok=True)
        for name in (Path(self._page or "").name, RECORD_NAME):
            if name:
                (self.folder / name).unlink(missing_ok=True)
        (self.folder / LINES_NAME).write_text("", encoding="utf-8")
        self._started, self.complete = True, False
        self._stored = []
        self._write(
            "start",
            kind=KIND,
            format=RECORD_FORMAT,
            **head_json(record),
        )

    def on_boundary(self, boundary: BoundaryRecord, context: BoundaryContext) -> None:
        """A boundary was judged."""
        boundary = _stored(self.folder, boundary)
        position = len(self._stored)
        plan = new_plan(boundary.replan)
        alarm = alarm_at(position, boundary, plan)
        self._write(
            "boundary",
            boundary=boundary_json(
                boundary,
                position=position,
                mark=None,
                before=left_at(context),
                after=None if plan is None else plan.subtasks,
            ),
            alarm=None if alarm is None else alarm_json(alarm),
        )
        self._stored.append(boundary)

    def on_executed(self, executed: ExecutedRecord, time_s: float) -> None:
        """A subtask was executed."""
        self._write("executed", time_s=time_s, executed=executed_json(executed))

    def on_end(self, record: EpisodeRecord) -> None:
        """The episode is over."""
        if len(self._stored) == len(record.boundaries):  # their pictures are written already
            both = zip(record.boundaries, self._stored, strict=True)
            stored = tuple(replace(b, observation=s.observation) for b, s in both)
            record = replace(record, boundaries=stored)
        write_record(self.folder, record, page=self._page)
        self._write("end", end=record.end.value)
        self.complete = True

    def _write(self, what: str, **fields: Any) -> None:
        if not self._started:
            raise InputError("the recorder has not been started: call on_start first")
        # Opened for each line: a run that raises leaves nothing open and nothing unwritten.
        path = self.folder / LINES_NAME
        with naming(path), path.open("a", encoding="utf-8", newline="\n") as lines:
            lines.write(_dumps({"event": what, **fields}) + "\n")
            lines.flush()


def write_record(folder: Path | str, record: EpisodeRecord, *, page: str | None = None) -> Path:
    """Write `record.json` and its images so that a reader sees all of it or nothing.

    Args:
        folder: made when it is not there.
        record: the finished run.
        page: where its page is, relative to the folder.

    Returns:
        The path of `record.json`.
    """
    folder = Path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    boundaries = tuple(_stored(folder, b) for b in record.boundaries)
    data = record_to_json(replace(record, boundaries=boundaries), page=page)
    path = folder / RECORD_NAME
    replace_file(path, _by_line(data).encode("utf-8"))
    return path


def read_record(path: Path | str) -> EpisodeRecord:
    """Read the record of a run, finished or killed.

    Args:
        path: the run's folder, its `record.json` or its `boundaries.jsonl`.

    Returns:
        The record; observations are by reference, their pictures files of the folder. A run that
        was killed has the end `UNFINISHED` and what had been written until then; what only the end
        knows is None.

    Raises:
        FileFormatError: no record there, an empty or damaged file, another format version; with
            the file and the place in it.
    """
    path = Path(path)
    if path.is_dir():
        whole, lines = path / RECORD_NAME, path / LINES_NAME
        path = whole if whole.exists() or not lines.exists() else lines
    torn = "replace" if path.suffix == ".jsonl" else "strict"  # a kill may split a character
    text = read_text(path, "record of a run", MOST_RECORD_BYTES, torn)
    if not text.strip():
        raise FileFormatError(f"{path} is empty: not the record of a run")
    try:
        if path.suffix == ".jsonl":
            return _read_lines(text)
        return record_from_json(parse_json(text))
    except FileFormatError as error:
        raise FileFormatError(f"{path}: {error}") from error


def _stored(folder: Path, boundary: BoundaryRecord) -> BoundaryRecord:
    """A boundary whose pictures are files of the folder."""
    seen = boundary.observation
    if not isinstance(seen, Observation):
        return boundary
    pictures = []
    for frame in seen.frames:
        data = encode_jpeg(frame.rgb)
        path = folder / IMAGES_NAME / file_name(data)
        if not path.exists():
            path.parent.mkdir(parents=True, exist_ok=True)
            replace_file(path, data)
        pictures.append(f"{IMAGES_NAME}/{path.name}")
    return replace(boundary, observation=by_reference(seen, pictures))


def _dumps(value: Any) -> str:
    return json.dumps(plain(value), ensure_ascii=False, allow_nan=False)


def _by_line(data: Mapping[str, Any]) -> str:
    """One key a line, one boundary a line: small, and still good to read and to search."""
    rows = []
    for key, value in data.items():
        text = _dumps(value)
        if key in ("boundaries", "alarms", "executed", "events") and value:
            text = "[\n  " + ",\n  ".join(_dumps(v) for v in value) + "\n ]"
        rows.append(f" {_dumps(key)}: {text}")
    return "{\n" + ",\n".join(rows) + "\n}\n"


def _read_lines(text: str) -> EpisodeRecord:
    """A record from what had been written when the run was killed."""
    rows = text.split("\n")
    events: list[Field] = []
    for number, row in enumerate(rows, 1):
        if not row:
            continue
        try:
            events.append(Field(parse_json(row), f"line {number}"))
        except FileFormatError as error:
            if number == len(rows):  # the line that was being written when the run was killed
                break
            raise FileFormatError(f"damaged at line {number}: {error}") from error
    if not events:
        raise FileFormatError("it ends before its first line does: nothing of the run is left")
    check_header(events[0].value)
    return _unfinished(events[0].value, events[1:])


def _unfinished(start: Mapping[str, Any], events: Sequence[Field]) -> EpisodeRecord:
    boundaries: list[Any] = []
    executed: list[Any] = []
    simulated_s, compute_s = 0.0, {}
    for event in events:
        what = event["event"].text()
        if what == "boundary":
            boundary = event["boundary"]
            simulated_s = max(simulated_s, boundary["time_s"].number())
            compute_s = dict(boundary["compute_s"].pairs(Field.number))
            boundaries.append(boundary.value)
        elif what == "executed":
            simulated_s = max(simulated_s, event["time_s"].number())
            executed.append(event["executed"].value)
    return record_from_json(
        {
            **start,
            "success": None,
            "weak_success": None,
            "failures": [],
            "executed": executed,
            "end": None,
            "simulated_s": simulated_s,
            "compute_s": compute_s,
            "events": [],
            "harmed": [],
            "boundaries": boundaries,
            "final": None,
        }
    )
