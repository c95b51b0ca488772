"""LeRobot data sets as recorded runs (implements `seams.DataSet`).

Named by `assembly.tables`; calls `lerobot_meta` and `lerobot_in`. An episode that cannot be used
is told with its reason, and the next one is read.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any

from forestall.config import DEFAULT_DOMAIN
from forestall.domain.model import Domain
from forestall.errors import FileFormatError, ForestallError, UnknownNameError
from forestall.extras import need
from forestall.logs.about import PARTS, recorded
from forestall.logs.layout import Columns, CsvStep, Step, read_layout, read_steps, status_of
from forestall.logs.lerobot_in import OWN, Looking
from forestall.logs.lerobot_meta import Episode, Meta, read_episodes, read_meta
from forestall.logs.lerobot_out import DETECTIONS, LOOK
from forestall.logs.moments import chosen, moments_of, notes_of
from forestall.types.recorded import RecordedRun, Unread

_SUCCESS = "next.success"


class LeRobotData:
    """Episodes of a data set.

    Args:
        folder: with meta/info.json.
        layout: a TOML file that says which column is what.
        steps: a CSV file that says when subtasks began, with a column `episode` for more than one.

    Raises:
        FileFormatError: no data set, or one of another version.
        InputError: a package is missing, or the layout names no column of it.
    """

    name = "lerobot"
    domain = DEFAULT_DOMAIN
    options: Mapping[str, Mapping[str, Any]] = {}
    parts = PARTS

    def __init__(
        self, folder: Path, *, layout: Path | None = None, steps: Path | None = None
    ) -> None:
        need("a LeRobot data set", "lerobot", "pyarrow")
        self._meta = read_meta(folder)
        self._layout = read_layout(layout)
        self._steps = None if steps is None else read_steps(steps)
        self._where = "" if steps is None else str(steps)
        self._cameras = _cameras(self._meta, self._layout.lerobot.cameras)
        self._episodes = list(read_episodes(self._meta, self._layout.lerobot.episodes))

    def __len__(self) -> int:
        return len(self._episodes)

    def runs(self, domain: Domain) -> Iterator[RecordedRun | Unread]:
        """Every episode in its order; pictures are read as looks are asked for."""
        for episode in self._episodes:
            name = f"{self._meta.folder.name}-{episode.index}"
            try:
                yield self._run(name, episode, domain)
            except ForestallError as error:
                yield Unread(name, str(error))

    def _run(self, name: str, episode: Episode, domain: Domain) -> RecordedRun:
        looking = Looking(self._meta, episode, self._cameras, self._layout)
        rows = looking.rows()
        if self._steps is not None:
            steps = self._from_csv(self._steps, episode)
        else:
            steps = looking.steps(rows)
        looks = sorted({row.look: row.stamp_ns for row in reversed(rows)}.values())
        timed = LOOK not in rows[0].cells
        if timed:
            looks = chosen(looks, steps, self._layout)
        about = dict(episode.about) or {"task": episode.task, "goal": episode.task}
        if "success" not in about:
            about["success"] = self._success(looking)
        moments = moments_of(looks, steps, self._layout.stale_s if timed else None)
        notes = [] if self._cameras[0].masks else [f"{self._cameras[0].rgb}: no masks"]
        notes += [] if self._cameras[0].depth else [f"{self._cameras[0].rgb}: no depth"]
        notes += notes_of(moments)
        return recorded(
            name, about, steps, moments, domain, partial(looking.looks, rows, moments), notes
        )

    def _success(self, looking: Looking) -> str:
        """Whether the last row says that the episode succeeded, where any row says it."""
        if _SUCCESS not in self._meta.info.features:
            return "null"
        last = [cells.get(_SUCCESS) for cells in looking.cells([_SUCCESS], 1024)][-1:]
        value = last[0][0] if last and isinstance(last[0], list) and last[0] else last[0]
        return "true" if value is True else "false"

    def _from_csv(self, rows: Sequence[CsvStep], episode: Episode) -> list[Step]:
        found = []
        for row in rows:
            place = f"{self._where}: line {row.line}"
            if row.episode != episode.index:
                continue
            meant = self._layout.subtask(row.said, place)
            if meant is not None:
                at_ns = round(row.time_s * 1e9)
                found.append(Step(at_ns, meant, *status_of(row.outcome, place)))
        return found


def _cameras(meta: Meta, named: tuple[Columns, ...] | None) -> tuple[Columns, ...]:
    """The cameras that a layout names, our own, or the first one that there is."""
    features = meta.info.features
    pictures = [n for n, f in features.items() if f.pictures and not f.depth]
    if named is not None:
        for camera in named:
            for column in (camera.rgb, camera.depth, camera.masks, camera.detections):
                if column is not None and column not in features:
                    raise UnknownNameError(f"column of {meta.folder}", column, features)
            if not features[camera.rgb].pictures:
                raise UnknownNameError("column of pictures", camera.rgb, pictures)
        return named
    if DETECTIONS in features:
        return (OWN,)
    if not pictures:
        raise FileFormatError(
            f"{meta.folder}: no column has pictures; there are {', '.join(features) or 'none'}"
        )
    depth = next((n for n, f in features.items() if f.depth and n.startswith(pictures[0])), None)
    return (Columns(rgb=pictures[0], depth=depth),)
