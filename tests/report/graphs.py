"""Two scene graphs of one kitchen with every kind of difference between them."""

from __future__ import annotations

from typing import Any

from forestall.types.facts import GRIPPER
from forestall.types.graph import Box, ObjectNode, Relation, SceneGraph, Seen
from forestall.types.plan import Subtask


def node(
    name: str, category: str = "", seen: Seen = Seen.VISIBLE, **states: str | None
) -> ObjectNode:
    low = (float(len(name)) / 10, 0.5, 0.9)
    return ObjectNode(
        name,
        category or name.rpartition("-")[0] or name,
        tuple(states.items()),
        centroid_m=low,
        box_m=Box(low, (low[0] + 0.1, 0.6, 1.0)),
        seen=seen,
        pixels=400,
    )


def relations(*texts: str) -> tuple[Relation, ...]:
    return tuple(Relation(*text.split()) for text in texts)


def plate(**states: Any) -> ObjectNode:
    return node(
        "Plate-1", **({"dirty": "clean", "broken": "intact", "temperature": "room"} | states)
    )


def potato(**states: Any) -> ObjectNode:
    return node(
        "Potato-1", **({"sliced": "whole", "cooked": "raw", "temperature": "room"} | states)
    )


def microwave(**states: Any) -> ObjectNode:
    return node("Microwave-1", **({"open": "open", "toggled": "off"} | states))


def observed_graph(subtask: Subtask | None = None, bowl: bool = True) -> SceneGraph:
    """Every kind of node and edge: gripper, remembered, unobserved states, hidden insides."""
    nodes = [
        node(GRIPPER, GRIPPER),
        node("CounterTop-1"),
        node("CounterTop-2"),
        microwave(),
        plate(temperature=None),
        potato(),
        node("Mug-1", filled="empty", dirty="dirty", broken="intact", temperature=None),
        node("Fridge-1", seen=Seen.REMEMBERED, open="closed"),
        node("Knife-1", seen=Seen.UNOBSERVED, temperature=None),
    ]
    edges = [
        "Plate-1 on_top_of CounterTop-2",
        "Potato-1 on_top_of Plate-1",
        "Microwave-1 on_top_of CounterTop-2",
        "Mug-1 on_top_of CounterTop-1",
        "Plate-1 left_of Microwave-1",
        "Microwave-1 right_of Plate-1",
        "Plate-1 near Microwave-1",
        "Mug-1 blocking Fridge-1",
        "Knife-1 inside Fridge-1",
        "CounterTop-1 near Fridge-1",
        "Potato-1 above CounterTop-2",
    ]
    if bowl:
        nodes.append(node("Bowl-1", filled=None, dirty=None, broken="intact", temperature=None))
        edges.append("Bowl-1 inside Microwave-1")
    return SceneGraph(tuple(nodes), relations(*edges), subtask, ("Fridge-1",))


def expected_graph(subtask: Subtask | None = None) -> SceneGraph:
    """What a demonstration saw: no bowl, a clean mug, a book that is not there now."""
    return SceneGraph(
        (
            node(GRIPPER, GRIPPER),
            node("CounterTop-1"),
            node("CounterTop-3"),
            microwave(),
            node("Plate-2", "Plate", dirty="clean", broken="intact", temperature="room"),
            potato(),
            node("Mug-1", filled="empty", dirty="clean", broken="intact", temperature="room"),
            node("Fridge-1", open="closed"),
            node("Book-1", open="closed"),
        ),
        relations(
            "Plate-2 on_top_of CounterTop-3",
            "Potato-1 on_top_of Plate-2",
            "Microwave-1 on_top_of CounterTop-3",
            "Mug-1 on_top_of CounterTop-1",
            "Book-1 on_top_of CounterTop-1",
            "Plate-2 left_of Microwave-1",
            "Plate-2 near Microwave-1",
            "CounterTop-1 near Fridge-1",
        ),
        subtask,
    )


MATCHES = (
    ("CounterTop-1", "CounterTop-1"),
    ("CounterTop-2", "CounterTop-3"),
    ("Fridge-1", "Fridge-1"),
    ("Microwave-1", "Microwave-1"),
    ("Mug-1", "Mug-1"),
    ("Plate-1", "Plate-2"),
    ("Potato-1", "Potato-1"),
    (GRIPPER, GRIPPER),
)
