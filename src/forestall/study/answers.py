"""What raters answer: one append-only file for each, a line for each answer, synced at once.

Written by the server (`serving.py`) and by simulated raters; read by the report. Killed at any
moment, a file holds every answer that was acknowledged, and at most half a line more, which the
next writer takes away: the rater was never told that it was kept.
"""

from __future__ import annotations

import errno
import json
import os
import time
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from functools import cache
from pathlib import Path
from typing import ClassVar, Literal, TypeVar

from pydantic import ConfigDict, TypeAdapter

from forestall.errors import FileFormatError, InputError
from forestall.files import make_folder, naming
from forestall.reading.documents import parse_json
from forestall.reading.files import read_text
from forestall.reading.models import validated_json
from forestall.study.model import ANSWERS_NAME, Study

Choice = Literal["a", "b", "both"]
CHOICES: tuple[Choice, ...] = ("a", "b", "both")

MOST_NAME = 300
"""Characters that a rater's name may have."""

L = TypeVar("L", "Start", "Answer")

_STRICT = ConfigDict(extra="forbid", allow_inf_nan=False)


@dataclass(frozen=True, slots=True)
class Start:
    """The first line of a file: who it is, and that he agreed.

    Args:
        study: digest of the study.
        rater: number, from 1.
        simulated: whether a program answers, and no person.
        name: what the rater calls himself, may be empty.
        token: digest of the secret that the rater's browser keeps, empty for a simulated one.
        at: when, as seconds since 1970.
    """

    __pydantic_config__: ClassVar[ConfigDict] = _STRICT

    study: str
    rater: int
    simulated: bool
    name: str = ""
    token: str = ""
    at: float = 0.0
    event: Literal["start"] = "start"
    format: Literal[1] = 1


@dataclass(frozen=True, slots=True)
class Answer:
    """One answer; of several to one trial the last one counts.

    Args:
        trial: position among the rater's trials, from 0.
        choice: which explanation is better; "both" where they are as good, or nobody can tell.
        seconds: that the page was open, None where the browser did not measure it.
        at: when, as seconds since 1970.
    """

    __pydantic_config__: ClassVar[ConfigDict] = _STRICT

    trial: int
    choice: Choice
    seconds: float | None = None
    at: float = 0.0
    event: Literal["answer"] = "answer"


@dataclass(frozen=True, slots=True)
class Rater:
    """What one file holds.

    Args:
        start: its first line.
        answers: trial → the last answer.
    """

    start: Start
    answers: Mapping[int, Answer] = field(hash=False)

    def next_trial(self, count: int) -> int | None:
        """The first trial without an answer, None when all have one."""
        return next((k for k in range(count) if k not in self.answers), None)


class AnswerFile:
    """Appends to the file of one rater.

    Args:
        path: of the file; a new one is made for `start`, an existing one is taken up.
        start: of a new rater.

    Raises:
        InputError: there is such a file already, and `start` was given.
    """

    def __init__(self, path: Path, start: Start | None = None) -> None:
        self.path = path
        if start is None:
            _mend(path)
            return
        make_folder(path.parent)
        try:
            with naming(path):
                path.open("xb").close()
        except FileExistsError as error:
            raise InputError(f"{path} is there already") from error
        _sync_folder(path.parent)
        self._append(start)

    def add(self, answer: Answer) -> None:
        """Keep an answer; it is on the disk when this returns."""
        self._append(answer)

    def _append(self, line: Start | Answer) -> None:
        """Write a whole line or none: what did not fit on a full disk is taken back."""
        data = json.dumps(asdict(line), ensure_ascii=False).encode() + b"\n"
        with naming(self.path), self.path.open("ab", buffering=0) as file:
            before = file.tell()
            try:
                if file.write(data) != len(data):
                    raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
                os.fsync(file.fileno())
            except OSError:
                os.truncate(file.fileno(), before)
                raise


def file_of(folder: Path, rater: int) -> Path:
    """Where the answers of a rater lie; no name of anybody is part of it."""
    return folder / ANSWERS_NAME / f"rater-{rater:03d}.jsonl"


def read_answers(path: Path, study: Study) -> Rater | None:
    """The answers of one file, None where a kill left no whole line.

    Raises:
        FileFormatError: a line is damaged, or of another study or another rater.
    """
    whole, _, _ = read_text(path, "file of answers", torn="replace").rpartition("\n")
    lines = whole.split("\n") if whole else []
    start: Start | None = None
    answers: dict[int, Answer] = {}
    for number, line in enumerate(lines, 1):
        try:
            if start is None:
                start = _start(line, path, study)
            else:
                answer = _line(_answers(), line)
                count = len(study.raters[start.rater - 1])
                if not 0 <= answer.trial < count:
                    raise FileFormatError(f"trial {answer.trial} of {count}")
                answers[answer.trial] = answer
        except FileFormatError as error:
            raise FileFormatError(f"{path}, line {number}: {error}") from error
    return None if start is None else Rater(start, answers)


def read_raters(folder: Path, study: Study) -> list[Rater]:
    """Everybody who has begun, by number."""
    files = sorted((folder / ANSWERS_NAME).glob("rater-*.jsonl"))
    return [r for r in (read_answers(f, study) for f in files) if r is not None]


def now() -> float:
    """Seconds since 1970, to the tenth."""
    return round(time.time(), 1)


def _start(line: str, path: Path, study: Study) -> Start:
    start = _line(_starts(), line)
    if start.study != study.digest:
        raise FileFormatError("answers to another study than the one in study.json")
    if not 1 <= start.rater <= len(study.raters):
        raise FileFormatError(f"rater {start.rater} of {len(study.raters)}")
    if path.name != file_of(path.parent, start.rater).name:
        raise FileFormatError(f"the answers of rater {start.rater}, in a file of another name")
    return start


def _line(adapter: TypeAdapter[L], line: str) -> L:
    parse_json(line)
    return validated_json(adapter, line)


def _mend(path: Path) -> None:
    """Take half a last line away."""
    data = path.read_bytes()
    whole = data.rfind(b"\n") + 1
    if whole < len(data):
        with naming(path):
            os.truncate(path, whole)


def _sync_folder(folder: Path) -> None:
    """See that a new name in a folder survives a power cut, where the system can."""
    if os.name != "posix":
        return
    handle = os.open(folder, os.O_RDONLY)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)


@cache
def _starts() -> TypeAdapter[Start]:
    return TypeAdapter(Start)


@cache
def _answers() -> TypeAdapter[Answer]:
    return TypeAdapter(Answer)


__all__ = [
    "CHOICES", "MOST_NAME", "Answer", "AnswerFile", "Choice", "Rater", "Start", "file_of", "now",
    "read_answers", "read_raters",
]  # fmt: skip
