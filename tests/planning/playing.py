"""A run by the plan check alone, in a scene that a test makes up."""

from __future__ import annotations

from typing import Any, Protocol

from forestall import Goal, Monitor, Outcome, Plan, Subtask, Task
from forestall.types.graph import SceneGraph
from forestall.types.scene import SceneNeeds

MOST = 40


class Scene(Protocol):
    """What is seen, and what becomes of a step."""

    def look(self) -> SceneGraph | dict[str, Any]:
        """What the robot sees now."""

    def do(self, step: Subtask) -> str:
        """Carry a step out; how it ended, as the robot says it."""


def begun(goal: Goal, plan: Plan, shown: str, thing: str) -> Monitor:
    """A monitor at the start of a run, which has no demonstration of the task.

    Args:
        goal: of the task.
        plan: of the task.
        shown: a step that it has seen done once, elsewhere.
        thing: all that was seen then.
    """
    monitor = Monitor.from_demonstrations(
        [(shown, {"objects": [thing]})], domain="household", strategy="plan-check"
    )
    monitor.start(Task("made-up", goal.text, goal, plan, SceneNeeds()))
    return monitor


def played(monitor: Monitor, scene: Scene) -> Monitor:
    """The same monitor once the plan is finished, or the robot held."""
    for _ in range(MOST):
        if monitor.finished:
            break
        decision = monitor.before(scene.look())
        if decision.may_start:
            assert decision.command is not None
            monitor.after(scene.do(decision.command))
        elif decision.outcome not in (Outcome.REPLAN, Outcome.LOOK):
            break
    return monitor
