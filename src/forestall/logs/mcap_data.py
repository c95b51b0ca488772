"""MCAP files as recorded runs (implements `seams.DataSet`).

Named by `assembly.tables`; calls `mcap_index` and `mcap_in`. A file that cannot be used is told
with its reason, and the next one is read.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from functools import partial
from pathlib import Path
from typing import Any

from forestall.config import DEFAULT_DOMAIN
from forestall.domain.model import Domain
from forestall.errors import FileFormatError, ForestallError
from forestall.extras import need
from forestall.logs.about import PARTS, recorded
from forestall.logs.layout import CsvStep, Layout, Step, read_layout, read_steps, status_of
from forestall.logs.mcap_file import McapFile
from forestall.logs.mcap_in import Looking
from forestall.logs.mcap_index import Index, index_of
from forestall.logs.mcap_out import ABOUT
from forestall.logs.moments import notes_of
from forestall.types.recorded import Look, RecordedRun, Unread

_EPOCH_S = 1e8
"""Times in a CSV file that are larger are seconds since 1970, and not since the log began."""


class McapLogs:
    """One file, or every file *.mcap of a folder, each of one run.

    Args:
        folder: the file or the folder.
        layout: a TOML file that says which topic is what.
        steps: a CSV file that says when subtasks began, of one file alone.

    Raises:
        FileFormatError: no such file, or none in the folder.
        InputError: a package is missing.
    """

    name = "mcap"
    domain = DEFAULT_DOMAIN
    options: Mapping[str, Mapping[str, Any]] = {}
    parts = PARTS

    def __init__(
        self, folder: Path, *, layout: Path | None = None, steps: Path | None = None
    ) -> None:
        need("a log in MCAP", "mcap", "mcap", "mcap_ros2")
        self._files = sorted(folder.glob("*.mcap")) if folder.is_dir() else [folder]
        self._layout = read_layout(layout)
        self._steps = None if steps is None else read_steps(steps)
        self._where = "" if steps is None else str(steps)
        if not self._files:
            raise FileFormatError(f"{folder} has no file *.mcap")
        if self._steps is not None and len(self._files) > 1:
            raise FileFormatError(f"{steps} is of one log, and {folder} has {len(self._files)}")

    def __len__(self) -> int:
        return len(self._files)

    def runs(self, domain: Domain) -> Iterator[RecordedRun | Unread]:
        """Every file in the order of its name; pictures are read as looks are asked for."""
        for path in self._files:
            try:
                yield self._run(path, domain)
            except ForestallError as error:
                yield Unread(path.stem, str(error))

    def _run(self, path: Path, domain: Domain) -> RecordedRun:
        with McapFile(path) as file:
            index = index_of(file, self._layout)
            cameras = index.cameras()
            steps = index.steps
            if self._steps is not None:
                steps = _from_csv(self._steps, index, self._where)
            looking = Looking(index, cameras, steps)
            about = file.about.get(ABOUT, {})
            moments = looking.moments()
            notes = [*index.notes, *_lacks(looking), *notes_of(moments)]
        return recorded(path.stem, about, steps, moments, domain, partial(_looks, looking), notes)


def _looks(looking: Looking) -> Iterator[Look]:
    """The looks of a file, which is opened anew."""
    with looking.index.file:
        yield from looking.looks()


def _lacks(looking: Looking) -> Iterator[str]:
    """What the cameras do not show."""
    for camera in looking.cameras:
        if camera.depth is None:
            yield f"{camera.rgb}: no depth that is aligned to it, so that nothing is located"
        if not camera.masks and camera.detections is None:
            yield f"{camera.rgb}: no masks and no detections; name a segmenter to have some"


def _from_csv(rows: list[CsvStep], index: Index, where: str) -> list[Step]:
    layout: Layout = index.layout
    found = []
    for row in rows:
        place = f"{where}: line {row.line}"
        meant = layout.subtask(row.said, place)
        if meant is None:
            continue
        starts_ns = 0 if row.time_s > _EPOCH_S else index.first_ns
        found.append(
            Step(round(row.time_s * 1e9) + starts_ns, meant, *status_of(row.outcome, place))
        )
    return found
