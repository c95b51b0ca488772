"""The record of a run on disk: written as it happens, finished atomically, read back.

`RunRecorder` listens to the episode loop. A folder holds `record.json` (the finished run, see
`docs/record-format.md`), `boundaries.jsonl` (one line for each thing that happened, flushed at
once, so that a killed run can still be read) and `images/`.
"""

from __future__ import annotations

import json
import os
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from forestall.errors import FileFormatError, InputError
from forestall.records.as_json import (
    KIND,
    RECORD_FORMAT,
    alarm_json,
    boundary_json,
    executed_json,
    goal_json,
    plain,
    record_json,
)
from forestall.records.derived import alarm_at, boundary_of, new_plan, reasoning_s
from forestall.records.pictures import encode_jpeg, file_name
from forestall.types.episode import BoundaryRecord, EpisodeRecord, ExecutedRecord, SkillOutcome
from forestall.types.plan import Plan, Subtask
from forestall.types.runtime import BoundaryContext, StrategyAnswer, When
from forestall.types.task import Task

RECORD_NAME = "record.json"
LINES_NAME = "boundaries.jsonl"
IMAGES_NAME = "images"


class RunRecorder:
    """Listener that keeps a run readable at every moment.

    `on_start` empties what an earlier run left in the same folder.

    Args:
        folder: made when the run starts.
        scenario: name of the scenario, None for the undisturbed task.
        strategy: name of the strategy.
        provenance: what is known before the run: perception, memory, versions.
        page: where the page of this run will be, relative to the folder.
    """

    def __init__(
        self,
        folder: Path | str,
        *,
        scenario: str | None = None,
        strategy: str | None = None,
        provenance: Mapping[str, Any] | None = None,
        page: str | None = None,
    ) -> None:
        self.folder = Path(folder)
        self._scenario = scenario
        self._strategy = strategy
        self._provenance = dict(provenance or {})
        self._page = page
        self._started = False
        self._position = 0
        self._index = -1
        self._looks = 0

    def on_start(self, task: Task, plan: Plan, seed: int) -> None:
        """The episode begins."""
        self.folder.mkdir(parents=True, exist_ok=True)
        (self.folder / RECORD_NAME).unlink(missing_ok=True)
        (self.folder / LINES_NAME).write_text("", encoding="utf-8")
        self._started = True
        self._position = 0
        self._index, self._looks = -1, 0
        self._write(
            "start",
            kind=KIND,
            format=RECORD_FORMAT,
            task=task.name,
            title=task.title,
            goal=goal_json(task.goal),
            scenario=self._scenario,
            strategy=self._strategy,
            seed=seed,
            initial_plan=plan.texts(),
            provenance=self._provenance,
        )

    def on_boundary(self, context: BoundaryContext, answer: StrategyAnswer) -> None:
        """A boundary was judged."""
        again = context.looks == self._looks + 1 and context.looks > 1
        if context.when is not When.AFTER and not again:
            self._index += 1
        self._looks = context.looks
        boundary = boundary_of(self._index, context, answer)
        plan = new_plan(boundary.replan)
        alarm = alarm_at(self._position, boundary, plan)
        self._write(
            "boundary",
            boundary=boundary_json(
                boundary,
                position=self._position,
                image=_write_image(self.folder, boundary),
                mark=None,
                before=context.remaining()[context.when is When.AFTER :],
                after=None if plan is None else plan.subtasks,
            ),
            alarm=None if alarm is None else alarm_json(alarm),
        )
        self._position += 1

    def on_executed(self, subtask: Subtask, outcome: SkillOutcome, time_s: float) -> None:
        """A subtask was executed."""
        executed = ExecutedRecord(subtask, outcome, max(0, self._index))
        self._write("executed", time_s=time_s, executed=executed_json(executed))

    def on_end(self, record: EpisodeRecord) -> None:
        """The episode is over."""
        write_record(self.folder, record, page=self._page)
        self._write("end", end=record.end.value)

    def _write(self, what: str, **fields: Any) -> None:
        if not self._started:
            raise InputError("the recorder has not been started: call on_start first")
        # Opened for each line: a run that raises leaves nothing open and nothing unwritten.
        with (self.folder / LINES_NAME).open("a", encoding="utf-8", newline="\n") as lines:
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
    images = {
        position: name
        for position, boundary in enumerate(record.boundaries)
        if (name := _write_image(folder, boundary)) is not None
    }
    data = record_json(record, page=page, images=images)
    path = folder / RECORD_NAME
    replace_file(path, _by_line(data).encode("utf-8"))
    return path


def read_record(path: Path | str) -> dict[str, Any]:
    """Read the record of a run, finished or killed.

    Args:
        path: the run's folder, its `record.json` or its `boundaries.jsonl`.

    Returns:
        What `record_json` made. A run that was killed has `complete` False, `end` None and what
        had been written until then; what only the end knows is None.

    Raises:
        FileFormatError: no record there, an empty or truncated file, another format version.
    """
    path = Path(path)
    if path.is_dir():
        whole, lines = path / RECORD_NAME, path / LINES_NAME
        path = whole if whole.exists() or not lines.exists() else lines
    try:
        torn = "replace" if path.suffix == ".jsonl" else "strict"  # a kill may split a character
        text = path.read_text(encoding="utf-8", errors=torn)
    except OSError as error:
        raise FileFormatError(f"no record of a run at {path}: {error.strerror}") from error
    except UnicodeDecodeError as error:
        raise FileFormatError(f"{path} is not the record of a run: it is not text") from error
    if not text.strip():
        raise FileFormatError(f"{path} is empty: not the record of a run")
    if path.suffix == ".jsonl":
        return _read_lines(path, text)
    try:
        data = json.loads(text)
    except json.JSONDecodeError as error:
        raise FileFormatError(
            f"{path} is damaged or truncated (line {error.lineno}): {error.msg}"
        ) from error
    _check_header(path, data)
    missing = sorted({"task", "end", "boundaries", "executed", "alarms"} - data.keys())
    if missing:
        raise FileFormatError(f"{path} lacks {', '.join(missing)}")
    return dict(data)


def replace_file(path: Path, data: bytes) -> None:
    """Write a file so that it is never seen half written."""
    temporary = path.with_name(f".{path.name}.{os.getpid()}.tmp")
    try:
        with temporary.open("wb") as file:
            file.write(data)
            file.flush()
            os.fsync(file.fileno())
        os.replace(temporary, path)
    except BaseException:
        temporary.unlink(missing_ok=True)
        raise


def _write_image(folder: Path, boundary: BoundaryRecord) -> str | None:
    if boundary.observation is None:
        return None
    data = encode_jpeg(boundary.observation.frames[-1].rgb)
    path = folder / IMAGES_NAME / file_name(data)
    if not path.exists():
        path.parent.mkdir(parents=True, exist_ok=True)
        replace_file(path, data)
    return f"{IMAGES_NAME}/{path.name}"


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


def _check_header(path: Path, data: Any) -> None:
    if not isinstance(data, dict) or data.get("kind") != KIND:
        raise FileFormatError(f"{path} is not the record of a run")
    if data.get("format") != RECORD_FORMAT:
        raise FileFormatError(
            f"{path} has record format {data.get('format')!r}: this version reads {RECORD_FORMAT}"
        )


def _read_lines(path: Path, text: str) -> dict[str, Any]:
    rows = text.split("\n")
    events: list[dict[str, Any]] = []
    for number, row in enumerate(rows, 1):
        if not row:
            continue
        try:
            events.append(json.loads(row))
        except json.JSONDecodeError as error:
            if number == len(rows):  # the line that was being written when the run was killed
                break
            raise FileFormatError(f"{path} is damaged at line {number}: {error.msg}") from error
    if not events:
        raise FileFormatError(f"{path} ends before its first line does: nothing of the run is left")
    start = events[0]
    _check_header(path, start)
    return _unfinished(start, events[1:])


def _unfinished(start: Mapping[str, Any], events: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    boundaries = [e["boundary"] for e in events if e.get("event") == "boundary"]
    compute: dict[str, float] = {}
    for boundary in boundaries:
        for phase, seconds in boundary["seconds"].items():
            compute[phase] = compute.get(phase, 0.0) + seconds
    times = [b["time_s"] for b in boundaries]
    times += [e["time_s"] for e in events if e.get("event") == "executed"]
    simulated, reasoning = max(times, default=0.0), reasoning_s(compute.items())
    known = start.get("provenance") or {}
    names = ("task", "title", "goal", "scenario", "strategy", "seed")
    return {
        "kind": KIND,
        "format": RECORD_FORMAT,
        "complete": False,
        **{name: start.get(name) for name in names},
        "success": None,
        "weak_success": None,
        "failures": [],
        "alarms": [e["alarm"] for e in events if e.get("alarm")],
        "replans": sum(b["plan_after"] is not None for b in boundaries),
        "initial_plan": start.get("initial_plan", []),
        "executed": [e["executed"] for e in events if e.get("event") == "executed"],
        "end": None,
        "simulated_s": simulated,
        "compute_s": compute,
        "computed_s": sum(compute.values()),
        "reasoning_s": reasoning,
        "total_s": simulated + reasoning,
        "perception": {
            "segmenter": None,
            "state_estimator": None,
            **(known.get("perception") or {}),
        },
        "memory": known.get("memory"),
        "versions": known.get("versions") or {},
        "provenance": known,
        "page": None,
        "events": [],
        "boundaries": boundaries,
        "final": None,
    }
