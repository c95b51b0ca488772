"""A record told to a writer once more, with what was judged in it.

Called by `assembly.logs`; calls a writer that shows judgements. Of a record in a folder pictures
are colour alone: depth and masks are not kept there.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from forestall.logs.writing import Executed, JudgedWriter, head_of
from forestall.records.derived import moments
from forestall.records.pictures import rgb_of
from forestall.types.episode import BoundaryRecord, EpisodeRecord, StoredObservation
from forestall.types.observation import Frame, Observation


def retell(record: EpisodeRecord, folder: Path | None, writer: JudgedWriter) -> None:
    """Tell all of a record.

    Args:
        record: of a run, finished or not.
        folder: that its pictures are in, None where it has them itself.
        writer: of one run.

    Raises:
        InputError: it cannot be written.
        FileFormatError: a picture that is none, or not as large as the record says.
    """
    writer.begin(head_of(record))
    for moment in moments(record):
        if moment.boundary is not None:
            seen = _seen(moment.boundary, folder)
            if seen is not None:
                writer.look(seen)
            writer.judged(moment.boundary, moment.before, moment.after)
        if moment.executed is not None:
            outcome = moment.executed.outcome
            writer.executed(Executed(moment.executed.subtask, outcome.status, outcome.reason))
    writer.finish(record.success, "; ".join(record.failures))


def _seen(boundary: BoundaryRecord, folder: Path | None) -> Observation | None:
    """What was seen at a boundary; None where the record does not keep it."""
    seen = boundary.observation
    if not isinstance(seen, StoredObservation):
        return seen
    frames = []
    for stored in seen.frames:
        rgb = rgb_of(stored, folder)
        if rgb is None:
            continue
        depth_m = np.zeros((stored.intrinsics.height, stored.intrinsics.width), np.float32)
        pose = np.array(stored.camera_to_world, np.float64)
        frames.append(Frame(rgb, depth_m, stored.intrinsics, pose, colour_only=True))
    place = seen.robot_position_world_m
    return Observation(tuple(frames), seen.gripper, seen.time_s, place, boundary.graph)
