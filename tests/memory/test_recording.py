from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from demonstration_samples import demonstration

from forestall.memory.recording import demonstration_from
from forestall.types.demonstration import View
from forestall.types.episode import (
    BoundaryRecord,
    EpisodeEnd,
    EpisodeRecord,
    ExecutedRecord,
    SkillOutcome,
    SkillStatus,
)
from forestall.types.observation import Frame, GripperState, Intrinsics, Observation, Rgb
from forestall.types.plan import Plan
from forestall.types.runtime import When
from forestall.types.scene import SceneNeeds
from forestall.types.task import Goal, Task

SAMPLE = demonstration("make-coffee", 3, ("pick_up(Mug-1)", "put_in(Mug-1, Sink-1)"))
DONE = SkillOutcome(SkillStatus.SUCCEEDED, 1.0)


def observation(grey: int) -> Observation:
    frame = Frame(
        np.full((2, 2, 3), grey, np.uint8),
        np.zeros((2, 2), np.float32),
        Intrinsics.from_vertical_fov(2, 2, 60.0),
        np.eye(4),
    )
    return Observation((frame,), GripperState(None, (0.0, 0.0, 0.0)), 0.0)


def record() -> EpisodeRecord:
    """The run behind the sample, with a look after its last subtask."""
    boundaries = [
        BoundaryRecord(s.index, s.subtask, s.whole, s.graph, observation(s.index + 1), 1, None)
        for s in SAMPLE.steps
    ]
    last = replace(boundaries[-1], index=2, when=When.END, observation=observation(9))
    steps = tuple(s.subtask for s in SAMPLE.steps)
    return EpisodeRecord(
        task=Task("make-coffee", "", Goal(""), Plan(steps), SceneNeeds()),
        scenario=None,
        strategy="none",
        seed=3,
        initial_plan=Plan(steps),
        boundaries=(*boundaries, last),
        executed=tuple(ExecutedRecord(s, DONE, i) for i, s in enumerate(steps)),
        end=EpisodeEnd.PLAN_FINISHED,
        success=True,
        final=SAMPLE.steps[-1].whole,
    )


def grey(boundary: BoundaryRecord) -> View | None:
    assert boundary.observation is not None
    frame = boundary.observation.frames[-1]
    assert isinstance(frame, Frame)
    return View(caption=f"grey {frame.rgb[0, 0, 0]}", captioner="grey")


def test_steps_views_and_the_last_look() -> None:
    made = demonstration_from(record(), "1", view_of=grey)
    assert made is not None
    assert [(s.index, s.subtask, s.graph) for s in made.steps] == [
        (s.index, s.subtask, s.graph) for s in SAMPLE.steps
    ]
    views = [s.view for s in made.steps]
    assert [v and v.caption for v in views] == ["grey 1", "grey 2"]
    assert made.after(0) == SAMPLE.steps[1].whole
    assert made.after(1) == made.final == record().final


def test_pictures_and_views_are_kept_on_demand_only() -> None:
    def keep(rgb: Rgb) -> str:
        return f"picture {rgb[0, 0, 0]}"

    made = demonstration_from(record(), "1", keep)
    assert made is not None
    assert [(s.image, s.view) for s in made.steps] == [("picture 1", None), ("picture 2", None)]


@pytest.mark.parametrize(
    "changed",
    [
        replace(record(), success=False),
        replace(record(), end=EpisodeEnd.STOPPED),
        replace(
            record(),
            executed=(
                ExecutedRecord(
                    SAMPLE.steps[0].subtask, SkillOutcome(SkillStatus.REFUSED, 1.0, "no"), 0
                ),
            ),
        ),
    ],
)
def test_other_runs_are_no_demonstrations(changed: EpisodeRecord) -> None:
    assert demonstration_from(changed, "1", view_of=grey) is None
