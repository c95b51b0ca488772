"""What whoever owns the robot hands over to a monitor, as the values that are worked with.

Called by `monitor.py`. Subtasks and plans may come as text, an outcome as a word, a scene in its
short form (`types.symbolic`).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from forestall.errors import InputError, UnknownNameError
from forestall.types.episode import SkillOutcome, SkillStatus
from forestall.types.graph import SceneGraph
from forestall.types.observation import Observation
from forestall.types.plan import Plan, Subtask
from forestall.types.scene import SceneNeeds
from forestall.types.symbolic import scene_graph
from forestall.types.task import Goal, Task

Scene = Observation | SceneGraph | Mapping[str, Any]
"""What a caller hands over to be judged."""

ENDED = {
    "done": SkillStatus.SUCCEEDED,
    "failed": SkillStatus.FAILED,
    "refused": SkillStatus.REFUSED,
}
"""How a subtask may have ended, in a caller's words."""


def task_of(said: Task | Plan | Sequence[str]) -> Task:
    """A task; a plan alone, or a list of subtasks in text form, is one without a goal condition.

    Raises:
        InputError: it is none of these.
    """
    if isinstance(said, Sequence) and not isinstance(said, str):
        said = Plan(tuple(subtask_of(s) for s in said))
    if not isinstance(said, Task | Plan):
        raise InputError(f"a task, a plan or a list of subtasks is needed, not {said!r}")
    if isinstance(said, Plan):
        return Task(said.goal, said.goal, Goal(said.goal), said, SceneNeeds())
    return said


def subtask_of(said: Subtask | str) -> Subtask:
    """A subtask, which may be said as text.

    Raises:
        InputError: it is neither, or the text is no subtask.
    """
    if isinstance(said, str):
        return Subtask.parse(said)
    if not isinstance(said, Subtask):
        raise InputError(f"a subtask is a text, skill(thing, place), not {said!r}")
    return said


def outcome_of(said: SkillOutcome | str, reason: str) -> SkillOutcome:
    """How a subtask ended, which may be said in a word of `ENDED`.

    Raises:
        UnknownNameError: another word.
    """
    if isinstance(said, SkillOutcome):
        return said
    if said not in ENDED:
        raise UnknownNameError("outcome of a subtask", str(said), ENDED)
    return SkillOutcome(ENDED[said], 0.0, reason)


def scene_of(scene: Scene, perceives: bool) -> Observation | SceneGraph:
    """What can be judged.

    Args:
        scene: as it was handed over.
        perceives: whether observations are of use.

    Raises:
        InputError: it is neither a picture nor a scene, or a picture that nobody can perceive.
    """
    if isinstance(scene, Mapping):
        return scene_graph(scene)
    if not isinstance(scene, SceneGraph | Observation):
        raise InputError(
            f"a scene is a mapping, a scene graph or an observation, not {type(scene).__name__}"
        )
    if not isinstance(scene, SceneGraph) and not perceives:
        raise InputError("this monitor has no perceiver: give it a scene graph")
    return scene
