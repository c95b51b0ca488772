"""Runs of a household that somebody else wrote: what was seen before each step, how it ended.

Made by a plug-in that reads them (`seams.Foreign`), judged by an experiment. Plans without a run
come from a `seams.PlanSet`.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

from forestall.types.demonstration import Demonstration, DemonstrationStep
from forestall.types.graph import SceneGraph
from forestall.types.plan import Plan
from forestall.types.scene import SceneNeeds


@dataclass(frozen=True, slots=True)
class ForeignPlan:
    """A plan that nobody here has seen carried out, and the scene that it is for.

    Args:
        name: of its own.
        plan: its steps, in its domain's words.
        scene: that it starts in.
        goal: what it is to reach, "fact; fact; never fact"; "" where nobody says.
        label: what its authors call it: "safe", "unsafe", ...; "" where they say nothing.
        left_out: what of it could not be converted, a sentence each.
    """

    name: str
    plan: Plan
    scene: SceneGraph | SceneNeeds
    goal: str = ""
    label: str = ""
    left_out: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class ForeignRun:
    """One run.

    Args:
        name: of its own.
        program: which program it is, or was made of.
        task: what the program is for.
        plan: its steps.
        scenes: what was seen before each step, as far as the run came.
        final: what was seen after the last one, None where a step was refused.
        change: which sort of change makes it fail, "" for a good one.
        why: why the last step was refused, in the words of who executed it.
        scoped: what of each scene concerns its step, with the step in the names of the scene; where
            it is empty, all of it does.
    """

    name: str
    program: str
    task: str
    plan: Plan
    scenes: tuple[SceneGraph, ...]
    final: SceneGraph | None = None
    change: str = ""
    why: str = ""
    scoped: tuple[SceneGraph, ...] = ()

    @property
    def fails(self) -> int | None:
        """Index of the step that was refused, None for a run that went well."""
        return None if self.final is not None else len(self.scenes) - 1

    def concerns(self, at: int) -> SceneGraph:
        """What of a scene concerns its step."""
        step = self.plan.subtasks[at]
        return self.scoped[at] if self.scoped else replace(self.scenes[at], subtask=step)

    def demonstration(self) -> Demonstration:
        """The run as a demonstration."""
        steps = []
        for at, (step, scene) in enumerate(zip(self.plan, self.scenes, strict=True)):
            scoped = self.concerns(at)
            meant = scoped.subtask or step
            steps.append(DemonstrationStep(at, meant, scoped, replace(scene, subtask=meant)))
        made = tuple(steps)
        return Demonstration(self.task, self.program, 0, made, id=self.name, final=self.final)
