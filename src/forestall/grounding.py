"""Which instance a category name in a plan means, from what the robot has seen.

Used by the episode loop before each subtask. It reads the fused scene graph and never the
simulator. A name that fits nothing observed stays a category name: the environment then resolves
it, as a robot would that opens a fridge to look for "the egg".
"""

from __future__ import annotations

import math
from collections.abc import Mapping

from forestall.types.facts import Literal, Truth, is_instance
from forestall.types.graph import ObjectNode, SceneGraph
from forestall.types.observation import Vec3
from forestall.types.plan import SKILLS, Subtask
from forestall.vocabulary import Vocabulary


def ground_subtask(
    subtask: Subtask,
    graph: SceneGraph,
    vocabulary: Vocabulary,
    robot_world_m: Vec3,
    bound: Mapping[str, str],
) -> Subtask:
    """Replace category names by instance names.

    An instance name stays. Otherwise, in this order: the held object when it is of the category
    (for a placed or poured object); the instance that the category was bound to before; the
    nearest located one that is not inside something closed, ties by name.

    Args:
        subtask: as the plan has it.
        graph: the whole fused graph.
        vocabulary: for aliases.
        robot_world_m: where the robot stands.
        bound: category → instance, from earlier subtasks of the same episode.
    """
    names = []
    for role, raw in zip(SKILLS[subtask.skill], subtask.args, strict=True):
        name = vocabulary.canonical(raw)
        if is_instance(name) or vocabulary.find(name) is None:
            names.append(name)
            continue
        category = vocabulary[name].name
        nodes = graph.of_category(category)
        held = graph.get(graph.holding) if graph.holding else None
        places = role == "object" and subtask.skill != "pick_up"
        if held is not None and held.category == category and (places or len(nodes) == 1):
            names.append(held.id)
        elif bound.get(category) in {n.id for n in nodes} and not is_open_support(
            vocabulary, category
        ):
            names.append(bound[category])
        else:
            names.append(_nearest(nodes, graph, robot_world_m) or category)
    return Subtask(subtask.skill, tuple(names))


def is_open_support(vocabulary: Vocabulary, name: str) -> bool:
    """Whether any instance of a category will do as a place (counters, tables, shelves)."""
    category = vocabulary.find(name)
    return (
        category is not None
        and category.fixture
        and category.receptacle is not None
        and category.receptacle.relation == "on_top_of"
        and category.receptacle.capacity is None
    )


def executable(subtask: Subtask, planned: Subtask, vocabulary: Vocabulary) -> Subtask:
    """The subtask to send to the robot: grounded, but open supports as the plan names them.

    "On a counter" leaves it to the robot's controller which counter has room.
    """
    return Subtask(
        subtask.skill,
        tuple(
            raw if is_open_support(vocabulary, raw) and not is_instance(raw) else name
            for name, raw in zip(subtask.args, planned.args, strict=True)
        ),
    )


def _nearest(nodes: tuple[ObjectNode, ...], graph: SceneGraph, robot_world_m: Vec3) -> str | None:
    def key(node: ObjectNode) -> tuple[bool, bool, float, str]:
        closed = graph.truth(Literal("accessible", (node.id,))) is not Truth.TRUE
        if node.centroid_m is None:
            return (True, closed, 0.0, node.id)
        gap = math.dist(node.centroid_m[:2], robot_world_m[:2])
        return (False, closed, round(gap, 3), node.id)

    best = min(nodes, key=key, default=None)
    return None if best is None else best.id
