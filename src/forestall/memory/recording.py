"""From a finished run to a demonstration.

Only runs whose strict check succeeded become demonstrations (paper, Sec. 3 "Buffer Construction").
"""

from __future__ import annotations

from collections.abc import Callable

from forestall.types.demonstration import Demonstration, DemonstrationStep
from forestall.types.episode import EpisodeEnd, EpisodeRecord, SkillStatus
from forestall.types.observation import Rgb


def demonstration_from(
    record: EpisodeRecord, version: str, keep_image: Callable[[Rgb], str] | None = None
) -> Demonstration | None:
    """The demonstration of a record, None when the run or one of its steps did not succeed.

    Args:
        record: a scored run of an undisturbed task.
        version: of the software, for the store.
        keep_image: stores a picture and returns its content hash; None keeps no pictures.
    """
    smooth = all(e.outcome.status is SkillStatus.SUCCEEDED for e in record.executed)
    if not (record.success and smooth and record.end is EpisodeEnd.PLAN_FINISHED):
        return None
    perception = dict(record.provenance).get("perception", {})
    return Demonstration(
        task=record.task.name,
        scene=f"{record.task.scene.room}-{record.seed}",
        seed=record.seed,
        steps=tuple(
            DemonstrationStep(
                index=b.index,
                subtask=b.subtask,
                graph=b.scoped,
                whole=b.graph,
                image=None
                if keep_image is None or b.observation is None
                else keep_image(b.observation.frames[-1].rgb),
            )
            for b in record.boundaries
        ),
        perception=tuple(sorted(perception.items())),
        version=version,
    )
