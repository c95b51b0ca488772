"""RoboFail as a data set (implements `seams.DataSet`).

Named by `assembly.tables`; calls `layout` and `looks`. An episode that cannot be used is told
with its reason, and the next one is read.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from functools import partial
from pathlib import Path
from typing import Any

from forestall.domain.model import Domain
from forestall.errors import FileFormatError, ForestallError
from forestall.types.recorded import RecordedRun, Unread
from forestall.worlds.ai2thor.robofail.layout import MOST_FRAMES, episode_folders, read_episode
from forestall.worlds.ai2thor.robofail.looks import looks_of, spans_of, step_at


class RoboFail:
    """Episodes in a folder.

    Args:
        folder: of the data set, of one task, or of one episode.

    Raises:
        FileFormatError: no such folder, or no episode in it.
    """

    name = "robofail"
    domain = "ai2thor"
    options: Mapping[str, Mapping[str, Any]] = {"perceiver": {"most_equal": MOST_FRAMES}}
    """A renderer gives the same picture while nothing moves, for as long as that is."""
    parts: Mapping[str, str] = {}

    def __init__(self, folder: Path) -> None:
        self._folders = episode_folders(folder)

    def __len__(self) -> int:
        return len(self._folders)

    def runs(self, domain: Domain) -> Iterator[RecordedRun | Unread]:
        """Every episode in the order of its number; events are read as looks are asked for."""
        read: dict[str, Path] = {}
        for folder in self._folders:
            try:
                first = read.setdefault(folder.name, folder)
                if first != folder:
                    raise FileFormatError(f"{folder} has the name of {first}: import it alone")
                yield _run(folder, domain)
            except ForestallError as error:
                yield Unread(folder.name, str(error))


def _run(folder: Path, domain: Domain) -> RecordedRun:
    episode = read_episode(folder)
    domain.check_plan(episode.plan)
    spans, left_out = spans_of(episode)
    fails = None if episode.failure is None else step_at(spans, episode.failure[0])
    return RecordedRun(
        episode.name,
        episode.task,
        episode.scene,
        episode.plan,
        partial(looks_of, episode, spans, domain),
        fails,
        episode.failure or (0, 0),
        episode.kind,
        episode.reason,
        left_out,
    )
