"""Symbolic runs: graphs as they would be seen before each subtask, demonstrations, contexts."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from forestall.planning.execute import Refusal, apply, resolve
from forestall.planning.state import State
from forestall.planning.validate import observed
from forestall.types.facts import GRIPPER
from forestall.types.graph import Box, ObjectNode, Relation, SceneGraph
from forestall.types.observation import Frame, GripperState, Intrinsics, Observation
from forestall.types.plan import Plan, Subtask
from forestall.types.runtime import BoundaryContext
from forestall.types.scene import SceneNeeds
from forestall.types.task import Task
from forestall.types.verdict import Reference
from planning.corpus import DOMAIN, GOALS, PLANS, home_of, scene

_BOX = Box((0.0, 0.0, 0.0), (0.1, 0.1, 0.1))
OBSERVATION = Observation(
    frames=(
        Frame(
            np.zeros((2, 2, 3), np.uint8),
            np.zeros((2, 2), np.float32),
            Intrinsics.from_vertical_fov(2, 2, 60.0),
            np.eye(4),
        ),
    ),
    gripper=GripperState(None, (0.0, 0.0, 0.0)),
    time_s=0.0,
)


def seen(state: State) -> SceneGraph:
    """The graph of a state as a robot would see it: what is in closed containers is hidden."""
    visible = sorted(n for n in state.kinds if state.says("accessible", n))
    hidden = [n for n in visible if state.says("shut", n)]
    nodes = [ObjectNode(GRIPPER, GRIPPER)]
    for name in visible:
        values = tuple((a, v) for (n, a), v in state.values.items() if n == name)
        box = None if name in state.lost else _BOX
        nodes.append(ObjectNode(name, state.kinds[name], values, _BOX.centre if box else None, box))
    relations = [Relation(n, p.relation, p.parent) for n in visible if (p := state.place(n))]
    if state.held is not None:
        relations.append(Relation(state.held, "held_by", GRIPPER))
    relations += [Relation(f[1], f[0], f[2]) for f in state.facts if f[0] == "blocking"]
    return SceneGraph(tuple(nodes), tuple(relations), hidden=tuple(hidden))


def ground(state: State, subtask: Subtask) -> Subtask:
    """A subtask with instance names where they are known."""
    names = resolve(state.copy(), subtask)
    return subtask if isinstance(names, Refusal) else Subtask(subtask.skill, names)


def demonstrations(task: str, count: int = 4) -> list[list[Reference]]:
    """For each subtask of a nominal plan its references from undisturbed runs."""
    steps: list[list[Reference]] = [[] for _ in PLANS[task].subtasks]
    for k in range(count):
        spot = f"Apple-1 on CounterTop-{k % 2 + 1}"
        state = observed(scene(home_of(task), spot if task != "switch-devices" else ""), DOMAIN)
        for index, subtask in enumerate(PLANS[task].subtasks):
            step = ground(state, subtask)
            steps[index].append(Reference(f"demo-{k}", task, index, step, 1.0, seen(state)))
            after = apply(state, step)
            assert not isinstance(after, Refusal), after.reason
            state = after
    return steps


def task_of(name: str, plan: Plan | None = None) -> Task:
    """A task of the corpus."""
    return Task(name, name, GOALS[name], plan or PLANS[name], SceneNeeds())


def context(
    task: str,
    plan: Plan,
    index: int,
    graph: SceneGraph,
    references: Sequence[Reference] = (),
) -> BoundaryContext:
    """The context of one boundary."""
    state = observed(graph, DOMAIN)
    return BoundaryContext(
        task=task_of(task),
        plan=plan,
        index=index,
        done=index,
        subtask=ground(state, plan.subtasks[index]),
        graph=graph,
        scoped=graph,
        observation=OBSERVATION,
        references=tuple(references),
    )
