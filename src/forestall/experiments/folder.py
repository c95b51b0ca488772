"""The folder of an experiment's results: what it is, and one JSON line for each finished episode.

Called by `conduct`. Every line is written at once and flushed, so that a run can be killed at any
moment and taken up again; half a last line is dropped. Results of other code or other settings are
never mixed in.
"""

from __future__ import annotations

import json
import os
import platform
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import IO, Any

import forestall
from forestall.benchmark.rows import ROW_FORMAT, EpisodeRow
from forestall.errors import FileFormatError, ForestallError, InputError
from forestall.experiments.runs import Settings
from forestall.fingerprint import sources_digest
from forestall.report.record import replace_file

KIND = "experiment"
ABOUT = "experiment.json"
ROWS = "episodes.jsonl"
EFFORT = "effort.jsonl"


@dataclass(frozen=True, slots=True)
class About:
    """What all episodes of a folder have in common."""

    split: str
    rounds: int
    settings: Settings
    version: str = forestall.__version__
    sources: str = ""
    row_format: int = ROW_FORMAT

    @classmethod
    def now(cls, split: str, rounds: int, settings: Settings) -> About:
        """With the digest of the code at hand."""
        return cls(split, rounds, settings, sources=sources_digest())


class ResultsFolder:
    """Reads and writes one folder of results.

    Args:
        path: made when something is first written.
    """

    def __init__(self, path: Path) -> None:
        self.path = path

    def open(self, about: About) -> dict[str, EpisodeRow]:
        """Begin or take up an experiment; the rows that are there, by key.

        Raises:
            InputError: the folder holds other results, or is no folder that can be written.
        """
        try:
            self.path.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise InputError(f"{self.path} cannot be a folder of results: {error}") from error
        file = self.path / ABOUT
        if not file.exists():
            if any(self.path.iterdir()):
                raise InputError(
                    f"{self.path} is not empty and holds no experiment: give another --out"
                )
            with _room(file):
                replace_file(file, json.dumps({"kind": KIND, **asdict(about)}, indent=2).encode())
            return {}
        self._check(about)
        return self.rows()

    def about(self) -> dict[str, Any]:
        """What the folder says of itself.

        Raises:
            FileFormatError: it holds no experiment.
        """
        file = self.path / ABOUT
        try:
            data = json.loads(file.read_text(encoding="utf-8"))
        except (OSError, ValueError) as error:
            raise FileFormatError(f"{file}: no experiment: {error}") from error
        if not isinstance(data, dict) or data.get("kind") != KIND:
            raise FileFormatError(f"{file}: no experiment")
        return data

    def rows(self) -> dict[str, EpisodeRow]:
        """Every finished episode by key.

        Raises:
            FileFormatError: a line that is no episode of this version.
        """
        file = self.path / ROWS
        if not file.exists():
            return {}
        whole, newline, half = file.read_text(encoding="utf-8").rpartition("\n")
        if half:
            replace_file(file, (whole + newline).encode())
        rows = {}
        for number, line in enumerate(whole.splitlines(), 1):
            try:
                row = EpisodeRow.from_json(json.loads(line))
            except (ValueError, AttributeError, FileFormatError) as error:
                raise FileFormatError(f"{file}, line {number}: {error}") from error
            rows[row.key] = row
        return rows

    @contextmanager
    def writing(self) -> Iterator[IO[str]]:
        """The open file of rows; hand it to `add`."""
        with _room(self.path / ROWS), (self.path / ROWS).open("a", encoding="utf-8") as lines:
            yield lines

    def add(self, lines: IO[str], row: EpisodeRow) -> None:
        """Write one episode."""
        with _room(self.path / ROWS):
            lines.write(json.dumps(row.to_json()) + "\n")
            lines.flush()

    def note_effort(self, episodes: int, seconds: float, workers: int, engine: str) -> None:
        """Write down what a call of the command did, and on which machine."""
        effort = {
            "episodes": episodes,
            "seconds": round(seconds, 1),
            "jobs": workers,
            "engine": engine,
            "machine": f"{_processor()}, {os.cpu_count()} cores, {platform.platform()}",
            "python": platform.python_version(),
            "date": time.strftime("%Y-%m-%d"),
        }
        with _room(self.path / EFFORT), (self.path / EFFORT).open("a", encoding="utf-8") as lines:
            lines.write(json.dumps(effort) + "\n")

    def effort(self) -> dict[str, str]:
        """How long the episodes took, and on which machines, in words."""
        file = self.path / EFFORT
        if not file.exists():
            return {}
        calls = [json.loads(line) for line in file.read_text(encoding="utf-8").splitlines()]
        seconds = sum(c["seconds"] for c in calls)
        return {
            "duration": f"{seconds / 60:.0f} min for {sum(c['episodes'] for c in calls)} episodes "
            f"and what they need, in {len(calls)} call(s) of the command",
            "machine": "; ".join(sorted({c["machine"] for c in calls})),
            "jobs": ", ".join(sorted({f"{c['jobs']} ({c['engine']})" for c in calls})),
            "date": ", ".join(sorted({c["date"] for c in calls})),
        }

    def _check(self, about: About) -> None:
        found, wanted = self.about(), {"kind": KIND, **asdict(about)}
        for name, value in wanted.items():
            if found.get(name) != value:
                raise InputError(
                    f"{self.path} holds results with {name} {found.get(name)!r}, this run has "
                    f"{value!r}: give another --out, or remove the folder"
                )


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


def _processor() -> str:
    """The processor's name where the system tells it."""
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
        return next(x.partition(":")[2].strip() for x in lines if x.startswith("model name"))
    except (OSError, StopIteration):
        return platform.processor() or platform.machine()
