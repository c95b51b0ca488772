"""A task's world, open for a program of one's own: `forestall.open_task`.

Called by users (an executive, a learner, an experiment with a loop of its own); calls `make`. The
episode loop and `Monitor` need none of it.
"""

from __future__ import annotations

from contextlib import ExitStack
from typing import Any

from forestall.assembly.configuration import run_config
from forestall.assembly.make import make_environment, make_world, prepare
from forestall.domain.model import Domain
from forestall.seams.acting import Environment
from forestall.tasks.faults import apply_scene_faults
from forestall.tasks.goals import TruthGoalChecker, irreversible
from forestall.types.graph import SceneGraph
from forestall.types.plan import Plan
from forestall.types.task import Task


class OpenTask:
    """A task in its world, until it is closed; made by `open_task`.

    Attributes:
        task: goal, nominal plan, and what the scene needs.
        plan: the plan to start with: the nominal one, with the scenario's changes.
        domain: what the world is about.
        environment: what the robot looks at and acts in; `reset(seed)` draws a scene.
    """

    task: Task
    plan: Plan
    domain: Domain
    environment: Environment

    def __init__(self, task: str, scenario: str | None, options: dict[str, Any]) -> None:
        prepared = prepare(run_config(task, scenario, **options))
        self.task, self.domain = prepared.loaded.task, prepared.loaded.domain
        self.plan = prepared.plan
        needs = apply_scene_faults(self.task.scene, prepared.faults, self.domain)
        with ExitStack() as opening:
            part = make_world(prepared.config, self.domain)
            world = opening.enter_context(part.open(needs, self.domain))
            self._oracle = world.oracle
            self.environment = make_environment(prepared, world)
            self.environment.reset(0)
            self._open = opening.pop_all()

    def truth(self) -> SceneGraph:
        """Everything as it is: to score with, to learn from; never for a monitor that is tried."""
        return self._oracle.truth()

    def unmet(self) -> tuple[str, ...]:
        """What of the goal is not so, or was spoilt on the way, a sentence each; () when done."""
        return TruthGoalChecker(self.domain).check(self.task.goal, self._oracle)[2]

    def spoilt(self) -> tuple[str, ...]:
        """What must never happen for the goal and has happened, a sentence each."""
        return tuple(what for _, what in irreversible(self.task.goal, self._oracle, self.domain))

    def close(self) -> None:
        """Free what the world holds; may be called again."""
        self._open.close()

    def __enter__(self) -> OpenTask:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


def open_task(task: str, scenario: str | None = None, **options: Any) -> OpenTask:
    """Open the world of a task, in the start state of seed 0.

    Args:
        task: name of a shipped task, or a task file.
        scenario: name of a shipped scenario, or a scenario file; None for an undisturbed scene.
        **options: parts and their options, as for a run: `world="symbolic"` (facts alone, for any
            domain), `world={"name": "kitchen", "profile": "honest"}`, `domain="own.toml"`,
            `sensor="realsense"`; `forestall parts` lists them.

    Raises:
        InputError: a name, an option or a value that is not valid; says what would be.
    """
    return OpenTask(task, scenario, options)
