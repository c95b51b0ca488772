"""From a finished run to a demonstration.

Only runs whose strict check succeeded become demonstrations (paper, Sec. 3 "Buffer Construction").
"""

from __future__ import annotations

from collections.abc import Callable

from forestall.types.decision import Outcome
from forestall.types.demonstration import Demonstration, DemonstrationStep, View
from forestall.types.episode import BoundaryRecord, EpisodeEnd, EpisodeRecord, SkillStatus
from forestall.types.observation import Observation, Rgb
from forestall.types.runtime import When


def demonstration_from(
    record: EpisodeRecord,
    version: str,
    keep_image: Callable[[Rgb], str] | None = None,
    view_of: Callable[[BoundaryRecord], View | None] | None = None,
    keep: Callable[[Observation], str] | None = None,
) -> Demonstration | None:
    """The demonstration of a record, None when the run or one of its steps did not succeed.

    Neither does one that was replanned become one: its steps have no place in the nominal plan.

    Args:
        record: a scored run, or the record of one that was read from a folder.
        version: of the software, for the store.
        keep_image: stores a picture and returns its content hash; None keeps no pictures.
        view_of: says what the picture of a boundary comes down to; None keeps no views.
        keep: stores all that was seen and returns its content hash; None keeps nothing of it.
    """
    smooth = all(e.outcome.status is SkillStatus.SUCCEEDED for e in record.executed)
    replanned = any(b.outcome is Outcome.REPLAN for b in record.boundaries)
    if not (record.success and smooth and record.end is EpisodeEnd.PLAN_FINISHED) or replanned:
        return None
    last_look = {b.index: b for b in record.boundaries if b.when is When.BEFORE}
    perception = dict(record.provenance).get("perception", {})
    return Demonstration(
        task=record.task.name,
        scene=f"{record.task.scene.room or record.task.domain}-{record.seed}",
        seed=record.seed,
        steps=tuple(
            DemonstrationStep(
                index=b.index,
                subtask=b.subtask,
                graph=b.scoped,
                whole=b.graph,
                image=None
                if keep_image is None
                or not isinstance(b.observation, Observation)
                or not b.observation.frames
                else keep_image(b.observation.frames[-1].rgb),
                view=None if view_of is None else view_of(b),
                observation=None
                if keep is None
                or not isinstance(b.observation, Observation)
                or not b.observation.frames
                else keep(b.observation),
            )
            for b in last_look.values()
        ),
        perception=tuple(sorted(perception.items())),
        version=version,
        final=record.final,
    )
