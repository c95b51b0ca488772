"""A run as a folder of stored observations: written from a run, and read as a recorded one.

The simplest log: looks in the format of docs/observation-format.md, numbered, and `run.json` with
what was carried out between them. Named by `tables`; calls perception's reader and writer, and
`logs` for what every log says.
"""

from __future__ import annotations

import json
import shutil
import uuid
from collections.abc import Iterator, Mapping
from dataclasses import asdict, dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

from pydantic import BaseModel, ConfigDict, Field

from forestall.config import DEFAULT_DOMAIN
from forestall.domain.model import Domain
from forestall.domain.words import Names
from forestall.errors import FileFormatError, ForestallError, InputError
from forestall.files import replace_file
from forestall.logs.about import PARTS, recorded
from forestall.logs.layout import Step
from forestall.logs.moments import Moment, moments_of
from forestall.logs.writing import Executed, Head
from forestall.perception.folder import read_observation, write_observation
from forestall.reading.documents import read_json
from forestall.reading.files import inside
from forestall.reading.models import validated
from forestall.types.episode import SkillStatus
from forestall.types.observation import Detection, Observation
from forestall.types.plan import Subtask
from forestall.types.recorded import Look, RecordedRun, Unread

RUN_FILE = "run.json"
FORMAT = 1
MOST_LOOKS = 10_000


class _Strict(BaseModel):
    model_config = ConfigDict(extra="forbid")


class _Executed(_Strict):
    subtask: str
    status: SkillStatus = SkillStatus.SUCCEEDED
    reason: str = ""


class _Look(_Strict):
    observation: str | None
    executed: list[_Executed] = []


class _Run(_Strict):
    format: int
    about: dict[str, str] = {}
    looks: list[_Look] = Field(min_length=1, max_length=MOST_LOOKS)


class FolderWriter:
    """Writes one run (implements `logs.writing.LogWriter`).

    Args:
        path: of the folder; it appears when the run is over.

    Raises:
        InputError: it is there already.
    """

    def __init__(self, path: Path) -> None:
        if path.exists():
            raise InputError(f"{path} is there already: name a new folder")
        self._path = path
        self._partial = path.with_name(f".{uuid.uuid4().hex}.part")
        self._looks: list[dict[str, Any]] = []
        self._since: list[dict[str, str]] = []

    def begin(self, head: Head) -> None:
        """The run begins."""
        self._head = head
        self._partial.mkdir(parents=True)

    def look(self, observation: Observation) -> None:
        """One folder for each look."""
        if any(frame.colour_only for frame in observation.frames) or not observation.frames:
            raise InputError("a stored observation has pictures with depth; write another log")
        name = f"{len(self._looks) + 1:04d}"
        write_observation(self._partial / name, observation)
        self._note(name)

    def executed(self, executed: Executed) -> None:
        """A subtask was carried out since the last look."""
        said = {"subtask": str(executed.subtask), "status": executed.status.value}
        self._since.append({**said, "reason": executed.reason})

    def finish(self, success: bool | None, why: str) -> None:
        """Say what the run was of; the folder appears."""
        if self._since:
            self._note(None)
        about = {**asdict(self._head), "success": json.dumps(success), "why": why}
        data = {"format": FORMAT, "about": about, "looks": self._looks}
        replace_file(self._partial / RUN_FILE, (json.dumps(data, indent=1) + "\n").encode())
        self._partial.rename(self._path)

    def abandon(self) -> None:
        """Take away what was written."""
        shutil.rmtree(self._partial, ignore_errors=True)

    def _note(self, observation: str | None) -> None:
        self._looks.append({"observation": observation, "executed": self._since})
        self._since = []


@dataclass(frozen=True, slots=True)
class _Read:
    """One run as its file says it: the folder of each look, the subtasks, the looks among them."""

    folder: Path
    names: tuple[str | None, ...]
    steps: tuple[Step, ...]
    moments: tuple[Moment, ...]


class FolderRuns:
    """The run in a folder, or every run in its folders (implements `seams.DataSet`).

    Args:
        folder: with `run.json`, or with folders that have one.

    Raises:
        FileFormatError: no such folder, or no run in it.
    """

    name = "folder"
    domain = DEFAULT_DOMAIN
    options: Mapping[str, Mapping[str, Any]] = {}
    parts = PARTS

    def __init__(self, folder: Path) -> None:
        if not folder.is_dir():
            raise FileFormatError(f"{folder} is no folder: give one with {RUN_FILE}")
        self._folders = [folder]
        if not (folder / RUN_FILE).is_file():
            self._folders = [f for f in sorted(folder.iterdir()) if (f / RUN_FILE).is_file()]
        if not self._folders:
            raise FileFormatError(f"{folder} has no {RUN_FILE}, and no folder in it has one")

    def __len__(self) -> int:
        return len(self._folders)

    def runs(self, domain: Domain) -> Iterator[RecordedRun | Unread]:
        """Each run; pictures are read as looks are asked for."""
        for folder in self._folders:
            try:
                yield _run(folder, domain)
            except ForestallError as error:
                yield Unread(folder.name, str(error))


def _run(folder: Path, domain: Domain) -> RecordedRun:
    file = folder / RUN_FILE
    data = validated(_Run, read_json(file, "run"), str(file))
    if data.format != FORMAT:
        raise FileFormatError(f"{file}: format {data.format}: this version reads {FORMAT}")
    steps: list[Step] = []
    for number, look in enumerate(data.looks):
        for done in look.executed:
            try:
                subtask = Subtask.parse(done.subtask)
            except InputError as error:
                raise FileFormatError(f"{file}: looks.{number}: {error}") from error
            steps.append(Step(number - 1, subtask, done.status, done.reason))
    if data.looks[0].executed:
        raise FileFormatError(f"{file}: looks.0: nothing was seen before its first subtask")
    seen = [n for n, look in enumerate(data.looks) if look.observation is not None]
    moments = tuple(moments_of(seen, steps))
    names = tuple(data.looks[n].observation for n in seen)
    read = _Read(folder, names, tuple(steps), moments)
    return recorded(
        folder.name, data.about, steps, moments, domain, partial(_looks, read, domain), ()
    )


def _looks(read: _Read, domain: Domain) -> Iterator[Look]:
    names = Names(domain)
    folders = iter(read.names)
    for moment in read.moments:
        seen = None
        if moment.at_ns is not None:
            folder = inside(read.folder, next(folders) or "")
            observation, states = read_observation(folder, domain, None, names, numbered=False)
            seen = _with_states(observation, states)
        yield Look(seen, moment.before, moment.done, moment.succeeded)


def _with_states(observation: Observation, states: Mapping[str, Mapping[str, str]]) -> Observation:
    """Every detection with the states that were written down beside it."""

    def told(detection: Detection) -> Detection:
        known = states.get(detection.instance or "", {})
        return replace(detection, states=tuple(known.items())) if known else detection

    frames = tuple(
        replace(f, detections=None if f.detections is None else tuple(map(told, f.detections)))
        for f in observation.frames
    )
    return replace(observation, frames=frames)
