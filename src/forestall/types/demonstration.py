"""Demonstrations: successful runs, as stored in the memory."""

from __future__ import annotations

from dataclasses import dataclass

from forestall.types.graph import SceneGraph
from forestall.types.plan import Subtask


@dataclass(frozen=True, slots=True)
class View:
    """What a picture of a boundary comes down to, for detectors that compare pictures.

    `image` is the feature (`types.feature`) of an image encoder over the whole picture, `caption`
    what a captioner says of it. `encoder` and `captioner` name the two.
    """

    image: bytes | None = None
    caption: str = ""
    encoder: str = ""
    captioner: str = ""


@dataclass(frozen=True, slots=True)
class DemonstrationStep:
    """What was observed just before one subtask of a successful run.

    `graph` is scoped to the subtask, `whole` is everything that was known. `image` is the content
    hash of the stored picture, None when pictures are not kept. `view` is None where nobody looked
    at the picture as a whole. `observation` is the content hash of all that was seen (pictures,
    depth, masks, cameras, hand), None where it was not kept.
    """

    index: int
    subtask: Subtask
    graph: SceneGraph
    whole: SceneGraph
    image: str | None = None
    view: View | None = None
    observation: str | None = None


@dataclass(frozen=True, slots=True)
class Demonstration:
    """One successful run.

    `scene` names the scene (for example "kitchen-17"). `final` is everything that was known after
    the last subtask, None where nobody looked.
    """

    task: str
    scene: str
    seed: int
    steps: tuple[DemonstrationStep, ...]
    perception: tuple[tuple[str, str], ...] = ()
    version: str = ""
    id: str = ""
    final: SceneGraph | None = None

    def after(self, position: int) -> SceneGraph | None:
        """Everything that was known after the step at a position."""
        following = self.steps[position + 1 : position + 2]
        return following[0].whole if following else self.final
