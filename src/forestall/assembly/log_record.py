"""The record of a run as a recorded run: its scene graphs are what was seen (`seams.DataSet`).

A record keeps pictures small and no depth, so that nothing can be perceived anew: the graphs are
handed on as they were believed. Named by `tables`; calls `records`.
"""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

from forestall.config import DEFAULT_DOMAIN
from forestall.domain.model import Domain
from forestall.errors import FileFormatError, ForestallError
from forestall.logs.about import recorded
from forestall.logs.layout import Step
from forestall.logs.moments import Moment, moments_of
from forestall.records.record import LINES_NAME, RECORD_NAME, read_record
from forestall.types.episode import BoundaryRecord, EpisodeRecord, StoredObservation
from forestall.types.observation import GripperState, Observation, Vec3
from forestall.types.recorded import Look, RecordedRun, Unread
from forestall.types.runtime import When


class Records:
    """The record in a folder, or every record in its folders.

    Args:
        folder: of `forestall run`, or with folders of it.

    Raises:
        FileFormatError: no record there.
    """

    name = "record"
    domain = DEFAULT_DOMAIN
    options: Mapping[str, Mapping[str, Any]] = {}
    parts: Mapping[str, str] = {"perceiver": "given-graph"}

    def __init__(self, folder: Path) -> None:
        places = [folder]
        if folder.is_dir() and not _has_record(folder):
            places = [f for f in sorted(folder.iterdir()) if _has_record(f)]
        if not places or not folder.exists():
            raise FileFormatError(f"{folder} has no {RECORD_NAME}, and no folder in it has one")
        self._places = places

    def __len__(self) -> int:
        return len(self._places)

    def runs(self, domain: Domain) -> Iterator[RecordedRun | Unread]:
        """Each record; its graphs are in memory while it is used."""
        for place in self._places:
            name = place.name or str(place)
            try:
                yield _run(name, read_record(place), domain)
            except ForestallError as error:
                yield Unread(name, str(error))


def _has_record(folder: Path) -> bool:
    return any((folder / name).is_file() for name in (RECORD_NAME, LINES_NAME))


@dataclass(frozen=True, slots=True)
class _Seen:
    """The boundaries of a record, the end of a run that looked there among them."""

    boundaries: tuple[BoundaryRecord, ...]
    moments: tuple[Moment, ...]


def _run(name: str, record: EpisodeRecord, domain: Domain) -> RecordedRun:
    boundaries = record.boundaries
    if not boundaries:
        raise FileFormatError("nothing was seen in it")
    before = {b.index: at for at, b in enumerate(boundaries) if b.when is When.BEFORE}
    steps = []
    for done in record.executed:
        if done.index not in before:
            raise FileFormatError(f"{done.subtask} was executed and not looked at before")
        outcome = done.outcome
        steps.append(Step(before[done.index], done.subtask, outcome.status, outcome.reason))
    moments = moments_of(range(len(boundaries)), steps)
    about = {
        "task": record.task.name,
        "scene": f"{record.task.scene.room or record.task.domain}-{record.seed}",
        "goal": record.task.goal.text,
        "domain": record.task.domain,
        "success": json.dumps(record.success),
        "why": "; ".join(record.failures),
    }
    seen = _Seen(boundaries, tuple(moments))
    return recorded(name, about, steps, moments, domain, partial(_looks, seen), ())


def _looks(seen: _Seen) -> Iterator[Look]:
    for moment in seen.moments:
        observation = None
        if moment.at_ns is not None:
            observation = _observation(seen.boundaries[moment.at_ns])
        yield Look(observation, moment.before, moment.done, moment.succeeded)


def _observation(boundary: BoundaryRecord) -> Observation:
    gripper, at_m = GripperState.untold(), (0.0, 0.0, 0.0)
    stored = boundary.observation
    if isinstance(stored, StoredObservation | Observation):
        gripper, at_m = stored.gripper, _point(stored.robot_position_world_m)
    return Observation((), gripper, boundary.time_s, at_m, boundary.graph)


def _point(at_m: Vec3) -> Vec3:
    return (float(at_m[0]), float(at_m[1]), float(at_m[2]))
