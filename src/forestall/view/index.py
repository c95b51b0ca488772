"""All runs and experiments under a folder, kept up to date; called by `serving.py`.

A walk reads the folders, and of each run the head of its record (`rows.py`), unless its path, size
and time are those of the last walk. What was read is also kept in the cache folder, so that a view
opens at once; where that cannot be written the view works without.
"""

from __future__ import annotations

import hashlib
import json
import os
import threading
import time
from collections.abc import Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from forestall.config import cache_dir
from forestall.errors import FileFormatError, ForestallError
from forestall.experiments.folder import EFFORT, episodes_in
from forestall.experiments.stored import ABOUT, PACKED, ROWS
from forestall.files import replace_file
from forestall.reading.documents import read_json
from forestall.reading.files import read_bytes, read_packed_text
from forestall.records.beside import BESIDE_NAME
from forestall.records.record import LINES_NAME, RECORD_NAME
from forestall.view.rows import RunRow, read_row

CACHE_FORMAT = 2

_MOST_DEEP = 6
_PAGE = "index.html"
_LEAST_S = 1.0
_SHARE = 20


@dataclass(frozen=True, slots=True)
class ExperimentRow:
    """An experiment in the index.

    Args:
        place: its folder, relative to the one that is viewed.
        changed_s: when its last episode was written.
        kind: of it.
        split: that it was run on, "" where it says none.
        episodes: how many are finished.
        page: whether there is a page of it.
        wanted: how many episodes were asked for; 0 where nobody wrote that down.
    """

    place: str
    changed_s: float
    kind: str
    split: str
    episodes: int
    page: bool
    wanted: int = 0

    @property
    def name(self) -> str:
        """What it is called."""
        return self.place.rpartition("/")[2] or "this folder"


@dataclass(frozen=True, slots=True)
class Found:
    """What lies under the folder at one moment.

    Args:
        runs: by place, the newest first.
        experiments: by place, the newest first.
        version: rises when anything of it changes.
    """

    runs: Mapping[str, RunRow]
    experiments: Mapping[str, ExperimentRow]
    version: int


class Index:
    """The index of one folder; several threads may ask.

    Args:
        folder: that is viewed; nothing is written to it.
    """

    def __init__(self, folder: Path) -> None:
        self.folder = folder.resolve()
        self._lock = threading.Lock()
        self._kept: dict[str, tuple[list[int], RunRow | ExperimentRow]] = _cached(self.folder)
        self._found = Found({}, {}, 0)
        self._next_s = 0.0

    def now(self) -> Found:
        """What is there; walked again where the last walk is a moment ago."""
        with self._lock:
            if time.monotonic() >= self._next_s:
                started = time.monotonic()
                self._walk()
                ended = time.monotonic()
                self._next_s = ended + max(_LEAST_S, _SHARE * (ended - started))
            return self._found

    def folder_of(self, place: str) -> Path:
        """Where a run or an experiment of the index lies."""
        return self.folder / place if place else self.folder

    def _walk(self) -> None:
        kept: dict[str, tuple[list[int], RunRow | ExperimentRow]] = {}
        for place, source in _sources(self.folder, "", _MOST_DEEP):
            stamp = _stamp(source)
            if stamp is None:  # it went away meanwhile
                continue
            before = self._kept.get(place)
            if before is None or before[0] != stamp:
                before = (stamp, _read(place, source, stamp[0] / 1e9))
            kept[place] = before
        if kept == self._kept and self._found.version:
            return
        if kept != self._kept:
            _keep(self.folder, kept)
        self._kept = kept
        rows = sorted((row for _, row in kept.values()), key=lambda r: (-r.changed_s, r.place))
        self._found = Found(
            {r.place: r for r in rows if isinstance(r, RunRow)},
            {r.place: r for r in rows if isinstance(r, ExperimentRow)},
            self._found.version + 1,
        )


def _sources(folder: Path, place: str, deep: int) -> Iterator[tuple[str, Path]]:
    """Every run and experiment with the file that tells of it; what cannot be entered is passed."""
    try:
        with os.scandir(folder) as entries:
            inside = {e.name: e for e in entries}
    except OSError:
        return
    own = next((n for n in (RECORD_NAME, LINES_NAME) if n in inside), None)
    if own is not None:
        yield place, folder / own
        if BESIDE_NAME in inside and deep:
            yield from _sources(folder / BESIDE_NAME, _joined(place, BESIDE_NAME), deep - 1)
        return
    if ABOUT in inside:
        rows = next((n for n in (ROWS, ROWS + PACKED) if n in inside), ABOUT)
        yield place, folder / rows
    if not deep:
        return
    for name in sorted(inside):
        if not name.startswith(".") and inside[name].is_dir(follow_symlinks=False):
            yield from _sources(folder / name, _joined(place, name), deep - 1)


def _joined(place: str, name: str) -> str:
    return f"{place}/{name}" if place else name


def _stamp(source: Path) -> list[int] | None:
    """When the file was changed, how large it is, and what else tells of an experiment."""
    try:
        found = source.stat()
    except OSError:
        return None
    page, effort = False, 0
    if source.name.startswith((ROWS, ABOUT)):
        page = (source.parent / _PAGE).is_file()
        with suppress(OSError):
            effort = (source.parent / EFFORT).stat().st_size
    return [found.st_mtime_ns, found.st_size, int(page), int(source.name == RECORD_NAME), effort]


def _read(place: str, source: Path, changed_s: float) -> RunRow | ExperimentRow:
    if source.name in (RECORD_NAME, LINES_NAME):
        return read_row(place, source, changed_s)
    kind, split = "", ""
    try:
        about = read_json(source.parent / ABOUT, "description of results")
        if isinstance(about, dict):
            kind, split = str(about.get("kind") or ""), str(about.get("split") or "")
        episodes = _episodes(source)
    except (FileFormatError, OSError) as error:
        kind, episodes = str(error), 0
    wanted = 0
    with suppress(FileFormatError, OSError):  # results of some kinds are not counted ahead
        wanted = sum(a.episodes for a in episodes_in(source.parent).asked())
    page = (source.parent / _PAGE).is_file()
    return ExperimentRow(place, changed_s, kind, split, episodes, page, wanted)


def _episodes(source: Path) -> int:
    if source.name == ROWS:
        return read_bytes(source, "results").count(b"\n")
    if source.name == ROWS + PACKED:
        return read_packed_text(source, "results").count("\n")
    return 0


# --- the cache ------------------------------------------------------------------------------------


def _cache_file(folder: Path) -> Path:
    name = hashlib.blake2b(os.fsencode(folder), digest_size=12).hexdigest()
    return cache_dir() / "view" / f"{name}.json"


def _cached(folder: Path) -> dict[str, tuple[list[int], RunRow | ExperimentRow]]:
    """What the last view of the folder read; nothing where that is not to be had."""
    try:
        data = json.loads(_cache_file(folder).read_text("utf-8"))
        if data["format"] != CACHE_FORMAT:
            return {}
        return {
            place: (stamp, RunRow(**row) if kind == "run" else ExperimentRow(**row))
            for place, (stamp, kind, row) in data["rows"].items()
        }
    except (ForestallError, OSError, ValueError, KeyError, TypeError, AttributeError):
        return {}


def _keep(folder: Path, kept: Mapping[str, tuple[list[int], RunRow | ExperimentRow]]) -> None:
    rows: dict[str, Any] = {
        place: [stamp, "run" if isinstance(row, RunRow) else "experiment", _plain(row)]
        for place, (stamp, row) in kept.items()
    }
    try:
        file = _cache_file(folder)
        file.parent.mkdir(parents=True, exist_ok=True)
        replace_file(file, json.dumps({"format": CACHE_FORMAT, "rows": rows}).encode())
    except (ForestallError, OSError, ValueError):
        return


def _plain(row: RunRow | ExperimentRow) -> dict[str, Any]:
    return {name: getattr(row, name) for name in row.__slots__}
