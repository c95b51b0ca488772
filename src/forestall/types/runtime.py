"""What the monitor hands to a strategy, and what it gets back."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import Enum
from typing import TYPE_CHECKING

from forestall.types.graph import SceneGraph
from forestall.types.observation import Observation
from forestall.types.plan import Plan, Subtask
from forestall.types.task import Task
from forestall.types.verdict import Decision, Diagnosis, Reference, Replan, Verdict

if TYPE_CHECKING:
    from forestall.types.episode import SkillStatus


class LooksAfter(Enum):
    """After what a strategy wants the robot to look again where it has just worked."""

    NOTHING = "nothing"
    SUBTASK = "subtask"
    EPISODE = "episode"


class When(Enum):
    """At which moment of a run something was judged."""

    BEFORE = "before"  # a subtask
    AFTER = "after"  # a subtask
    END = "end"  # the plan is finished


@dataclass(frozen=True, slots=True)
class BoundaryContext:
    """Everything a strategy may know at one boundary; no simulator truth.

    Args:
        task: the task with its goal.
        plan: the plan being executed.
        index: index in `plan` of the subtask that comes next.
        done: how far the task has come, as a position in the plan that the run started with,
            counted from its end (during a repair it is lower by what the repair adds).
        subtask: that subtask, grounded to instance names where they are known.
        graph: the whole fused scene graph.
        scoped: the part that concerns the subtask.
        observation: the newest observation, None where a scene graph alone was given.
        references: retrieved demonstrations (filled by strategies that use them).
        looks: how many times the robot looked at this boundary (1 at first).
        may_look: whether it may look once more.
        replans: how many plans were made in this episode so far.
        searches: how many of them only look for something; each goes to another place.
        when: at which moment this is. After the subtask `index` is still its own, at the end of the
            plan it is the plan's length and `subtask` the last one.
        refused: ground subtasks that the robot refused, about whose arguments nothing has changed
            since; a plan that has one of them will be refused again.
        vain: ground subtasks that were tried twice or more in a row and came to nothing each time:
            as far as anybody sees, their effects did not come about. Another way is better.
        executed: what was tried so far, and how each subtask ended.
        said: what every judge said of this scene, where several are heard.
        meant: category → the instance that it has meant in this run, the subtask's own among them.
    """

    task: Task
    plan: Plan
    index: int
    done: int
    subtask: Subtask
    graph: SceneGraph
    scoped: SceneGraph
    observation: Observation | None
    references: tuple[Reference, ...] = ()
    looks: int = 1
    may_look: bool = True
    replans: int = 0
    searches: int = 0
    when: When = When.BEFORE
    refused: tuple[Subtask, ...] = ()
    vain: tuple[Subtask, ...] = ()
    executed: tuple[tuple[Subtask, SkillStatus], ...] = ()
    said: tuple[Verdict, ...] = ()
    meant: Mapping[str, str] = field(default_factory=dict)

    def remaining(self) -> tuple[Subtask, ...]:
        """What is left of the plan, this subtask first (not grounded)."""
        return self.plan.subtasks[self.index :]


@dataclass(frozen=True, slots=True)
class StrategyAnswer:
    """Go on, look again, go on with another plan, or stop."""

    decision: Decision
    verdict: Verdict | None = None
    diagnosis: Diagnosis | None = None
    replan: Replan | None = None
    why: str = ""
    seconds: tuple[tuple[str, float], ...] = ()  # compute by phase: retrieve, compare, ...
    watched: tuple[Verdict, ...] = ()  # what every judge said of the same observation
    suspected: Diagnosis | None = None  # what another look is to make sure of
    only_watched: bool = False  # nothing is ever interrupted
