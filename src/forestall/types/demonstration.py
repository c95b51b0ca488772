"""Demonstrations: successful runs, as stored in the memory."""

from __future__ import annotations

from dataclasses import dataclass

from forestall.types.graph import SceneGraph
from forestall.types.plan import Subtask


@dataclass(frozen=True, slots=True)
class DemonstrationStep:
    """What was observed just before one subtask of a successful run.

    `graph` is scoped to the subtask, `whole` is everything that was known. `image` is the content
    hash of the stored picture, None when pictures are not kept.
    """

    index: int
    subtask: Subtask
    graph: SceneGraph
    whole: SceneGraph
    image: str | None = None


@dataclass(frozen=True, slots=True)
class Demonstration:
    """One successful run. `scene` names the scene (for example "kitchen-17")."""

    task: str
    scene: str
    seed: int
    steps: tuple[DemonstrationStep, ...]
    perception: tuple[tuple[str, str], ...] = ()
    version: str = ""
    id: str = ""
