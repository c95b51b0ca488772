"""The folder of an experiment's results: what it is, and one JSON line for each finished episode.

Called by `conduct` and `speed`. Every line is written at once and flushed, so that a run can be
killed at any moment and taken up again; half a last line is dropped. Results of other code, of
another memory or of other settings are never mixed in.
"""

from __future__ import annotations

import hashlib
import json
import os
import platform
import time
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import IO, Any, Generic, Protocol, TypeVar

import forestall
from forestall.errors import FileFormatError, ForestallError, InputError
from forestall.experiments import stored
from forestall.experiments.stored import (
    PACKED,
    AnyAbout,
    Asked,
    Call,
    ExperimentAbout,
    ExperimentCall,
    lines_of,
)
from forestall.files import alone, make_folder, replace_file
from forestall.fingerprint import ROW_MAKING, sources_digest, weights_of
from forestall.reading.documents import read_json
from forestall.reading.models import validated
from forestall.statistics.rows import ROW_FORMAT, EpisodeRow, Setup

EXPERIMENT = "experiment"
ABOUT, ROWS = stored.ABOUT, stored.ROWS
EFFORT = "effort.jsonl"

R = TypeVar("R", bound="Row")
C = TypeVar("C", bound=Call)


class Row(Protocol):
    """One finished piece of work: a line of the folder."""

    @property
    def key(self) -> str:
        """What makes it the same one within the folder."""

    def to_json(self) -> dict[str, Any]:
        """Plain data."""


@dataclass(frozen=True, slots=True)
class About:
    """What all rows of a folder have in common; together with a row's key it says what it is.

    Args:
        kind: of the rows.
        what: settings and the like, as JSON has them.
        sources: digest of the code and of the memory's content.
    """

    kind: str
    what: dict[str, Any]
    sources: str

    @classmethod
    def now(cls, kind: str, what: Mapping[str, Any], memory: str | None = None) -> About:
        """With the digest of the code at hand, of weights of others, and of the memory if given."""
        content = Path(memory).read_bytes() if memory else b""
        parts = what.get("settings", {}).get("parts", {})
        weights = weights_of(part["name"] for part in parts.values())
        digest = sources_digest([hashlib.blake2b(content).hexdigest(), weights], but=ROW_MAKING)
        return cls(kind, json.loads(json.dumps(what)), digest)

    @property
    def digest(self) -> str:
        """Eight hexadecimal digits of all of it: what may share a folder has the same."""
        text = json.dumps(_flat(self.to_json()), sort_keys=True)
        return hashlib.blake2b(text.encode(), digest_size=4).hexdigest()

    def to_json(self) -> dict[str, Any]:
        """As it stands in the folder."""
        code = {"version": forestall.__version__, "sources": self.sources}
        return {"kind": self.kind, **self.what, **code, "row_format": ROW_FORMAT}


class ResultsFolder(Generic[R]):
    """Reads and writes one folder of results.

    Args:
        path: made when something is first written.
        read: makes a row of what its `to_json` gave.
        kind: of the rows.
    """

    def __init__(
        self, path: Path, read: Callable[[dict[str, Any]], R], kind: str = EXPERIMENT
    ) -> None:
        self.path = path
        self._read = read
        self._kind = kind

    def open(self, about: About) -> dict[str, R]:
        """Begin or take up the work; the rows that are there, by key.

        Raises:
            InputError: the folder holds other results, or is no folder that can be written.
        """
        self._claim()
        file = self.path / ABOUT
        if not file.exists():
            with _room(file):
                replace_file(file, json.dumps(about.to_json(), indent=2).encode())
            return {}
        self._check(about)
        effort = self.path / EFFORT
        if effort.exists():
            whole, newline, half = effort.read_bytes().rpartition(b"\n")
            if half:  # a kill or a full disk; the next line would be joined to it
                replace_file(effort, whole + newline)
        return self.rows(mend=True)

    def about(self) -> dict[str, Any]:
        """What the folder says of itself.

        Raises:
            FileFormatError: it holds no experiment.
        """
        file = self.path / ABOUT
        if not file.exists():
            what = "holds no experiment" if self.path.is_dir() else "is no folder"
            raise FileFormatError(f"{self.path} {what}")
        data = read_json(file, "description of results")
        if not isinstance(data, dict) or data.get("kind") != self._kind:
            raise FileFormatError(f"{file}: no {self._kind}")
        settings = data.get("settings")
        if self._kind == EXPERIMENT and isinstance(settings, dict) and "parts" not in settings:
            raise FileFormatError(
                f"{file}: results of an earlier version; run the experiment again"
            )
        validated(ExperimentAbout if self._kind == EXPERIMENT else AnyAbout, data, str(file))
        return data

    def rows(self, mend: bool = False) -> dict[str, R]:
        """Every finished episode by key.

        Args:
            mend: take half a last line, which a kill may leave, out of the file; only where nobody
                else can be writing.

        Raises:
            FileFormatError: a line that is no episode of this version.
        """
        file = self.path / ROWS
        packed = file.with_name(file.name + PACKED)
        if not file.exists() and not packed.exists():
            return {}
        lines, whole, half = lines_of(file if file.exists() else packed)
        if half and mend and file.exists():
            replace_file(file, whole.encode())
        rows = {}
        for place, data in lines:
            try:
                row = self._read(data)
            except FileFormatError as error:
                raise FileFormatError(f"{place}: {error}") from error
            rows[row.key] = row
        return rows

    @contextmanager
    def alone(self) -> Iterator[None]:
        """Keep other calls of the command out of the folder.

        Raises:
            InputError: one is at work in it; says which.
        """
        self._claim()
        with alone(self.path):
            yield

    @contextmanager
    def writing(self) -> Iterator[IO[str]]:
        """The open file of rows; hand it to `add`."""
        with _room(self.path / ROWS):
            lines = (self.path / ROWS).open("a", encoding="utf-8")
        try:
            yield lines
        finally:
            with _room(self.path / ROWS):  # what did not fit is tried once more
                lines.close()

    def add(self, lines: IO[str], row: R) -> None:
        """Write one episode."""
        with _room(self.path / ROWS):
            lines.write(json.dumps(row.to_json()) + "\n")
            lines.flush()

    @contextmanager
    def effort_of(
        self,
        choice: Any,
        asked: Iterable[tuple[str, Setup]],
        workers: int,
        engine: str,
        before: int = 0,
    ) -> Iterator[Callable[[int], None]]:
        """Write down what a call of the command was for, and at its end what it did and where.

        Args:
            choice: what was said on the command line.
            asked: set and setup of every episode that this means, those that are there included.
            workers: how many at once.
            engine: of what kind.
            before: how many of the episodes are there already.

        Yields:
            What is to be told how many episodes are done.
        """
        about = {
            "choice": asdict(choice),
            "asked": [
                {
                    "set": of,
                    "profile": setup.profile,
                    "strategy": setup.strategy,
                    "setup": setup.name,
                    "episodes": count,
                }
                for (of, setup), count in Counter(asked).items()
            ],
            "before": before,
            "jobs": workers,
            "engine": engine,
            "machine": f"{_processor()}, {os.cpu_count()} cores, {platform.platform()}",
            "python": platform.python_version(),
            "date": time.strftime("%Y-%m-%d"),
        }
        started, done = time.monotonic(), 0

        def count(episodes: int) -> None:
            nonlocal done
            done = episodes

        self._note({**about, "episodes": 0, "seconds": 0.0})
        try:
            yield count
        finally:
            seconds = round(time.monotonic() - started, 1)
            self._note({**about, "episodes": done, "seconds": seconds})

    def _note(self, effort: dict[str, Any]) -> None:
        with _room(self.path / EFFORT), (self.path / EFFORT).open("a", encoding="utf-8") as lines:
            lines.write(json.dumps(effort) + "\n")

    def effort(self) -> dict[str, str]:
        """How long the episodes took, and on which machines, in words."""
        calls = self._calls(Call)
        if not calls:
            return {}
        seconds = sum(c.seconds for c in calls)
        return {
            "duration": f"{seconds / 60:.0f} min for {sum(c.episodes for c in calls)} episodes "
            "and their demonstrations, in the calls of the command that came to an end",
            "machine": "; ".join(sorted({c.machine for c in calls})),
            "jobs": ", ".join(sorted({f"{c.jobs} ({c.engine})" for c in calls})),
            "date": ", ".join(sorted({c.date for c in calls})),
        }

    def asked(self) -> list[Asked]:
        """What calls wanted: of each kind the most that one did, for the less is in the more."""
        most: dict[tuple[str, str], Asked] = {}
        for asked in (a for call in self._calls(ExperimentCall) for a in call.asked):
            before = most.get((asked.set, asked.setup))
            if before is None or before.episodes < asked.episodes:
                most[asked.set, asked.setup] = asked
        return list(most.values())

    def begun_with(self) -> int | None:
        """How many episodes were there when the call began that has not come to an end.

        None where there is no such call, or it did not write that down.
        """
        calls = self._calls(ExperimentCall)
        return calls[-1].before if calls and not calls[-1].seconds else None

    def _calls(self, model: type[C]) -> list[C]:
        file = self.path / EFFORT
        if not file.exists():
            return []
        return [validated(model, data, place) for place, data in lines_of(file)[0]]

    def _claim(self) -> None:
        """See that the folder can be one of results, and make it."""
        make_folder(self.path)
        others = [p.name for p in self.path.iterdir() if not p.name.startswith((".", ABOUT))]
        if others and not (self.path / ABOUT).exists():
            raise InputError(
                f"{self.path} is not empty and holds no experiment: give another --out"
            )

    def _check(self, about: About) -> None:
        found, wanted = _flat(self.about()), _flat(about.to_json())
        for name, value in wanted.items():
            if found.get(name) != value:
                raise InputError(
                    f"{self.path} holds results with {name} {found.get(name)!r}, this run has "
                    f"{value!r}: give another --out, or remove the folder"
                )


def episodes_in(path: Path, kind: str = EXPERIMENT) -> ResultsFolder[EpisodeRow]:
    """A folder of episodes."""
    return ResultsFolder(path, EpisodeRow.from_json, kind)


@contextmanager
def _room(file: Path) -> Iterator[None]:
    """Say plainly what a full or broken disk means."""
    try:
        yield
    except OSError as error:
        raise ForestallError(
            f"{file} cannot be written: {error}. What was finished before is kept; run the same "
            "command again to go on."
        ) from error


def _flat(about: dict[str, Any]) -> dict[str, Any]:
    """With the settings among the other fields, without what changes no row."""
    fields = {**about, **about.get("settings", {})}
    for kind, part in fields.pop("parts", {}).items():
        fields[kind] = part["name"]
        for option, value in {**part["defaulted"], **part["given"]}.items():
            fields[f"{kind}.{option}"] = value
    return {k: v for k, v in fields.items() if k not in ("settings", "pages")}


def _processor() -> str:
    """The processor's name where the system tells it."""
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
        return next(x.partition(":")[2].strip() for x in lines if x.startswith("model name"))
    except (OSError, StopIteration):
        return platform.processor() or platform.machine()
