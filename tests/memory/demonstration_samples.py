"""Small demonstrations of made-up runs."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from forestall.types.demonstration import Demonstration, DemonstrationStep
from forestall.types.facts import GRIPPER, category_of
from forestall.types.graph import Box, ObjectNode, Relation, SceneGraph, Seen
from forestall.types.plan import Subtask


def demonstration(
    task: str, seed: int, subtasks: Sequence[str], name: str = "", image: str | None = None
) -> Demonstration:
    """One step for each subtask; a graph holds the gripper, a counter and the arguments."""
    return Demonstration(
        task=task,
        scene=f"kitchen-{seed}",
        seed=seed,
        steps=tuple(_step(i, Subtask.parse(s), seed, image) for i, s in enumerate(subtasks)),
        perception=(("segmenter", "instance-ids"), ("state_estimator", "oracle")),
        version="0.1.0",
        id=name,
    )


def _step(index: int, subtask: Subtask, seed: int, image: str | None) -> DemonstrationStep:
    where = (0.1 * index, seed + 1 / 3, 0.9)
    nodes = [ObjectNode(GRIPPER, GRIPPER), ObjectNode("CounterTop-1", "CounterTop")]
    for name in dict.fromkeys(subtask.args):
        if name != "CounterTop-1":
            box = Box(where, tuple(x + 0.1 for x in where))  # type: ignore[arg-type]
            states = (("dirty", "clean"), ("filled", None))
            nodes.append(
                ObjectNode(name, category_of(name), states, where, box, Seen.REMEMBERED, 12, 1.5)
            )
    links = tuple(Relation(n.id, "on_top_of", "CounterTop-1") for n in nodes[2:])
    whole = SceneGraph((*nodes, ObjectNode("Cabinet-9", "Cabinet")), links, None, ("Cabinet-9",))
    return DemonstrationStep(index, subtask, SceneGraph(tuple(nodes), links, subtask), whole, image)


def with_id(sample: Demonstration, name: str) -> Demonstration:
    """The same demonstration under an id."""
    return replace(sample, id=name)
