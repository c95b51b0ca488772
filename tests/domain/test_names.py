"""Which instance a category name means."""

import pytest

from forestall.domain.load import shipped
from forestall.domain.names import executable, ground_subtask
from forestall.types.facts import GRIPPER
from forestall.types.graph import Box, ObjectNode, Relation, SceneGraph
from forestall.types.plan import Subtask


def at(name: str, category: str, x: float, **states: str) -> ObjectNode:
    box = Box((x, 0.0, 0.0), (x + 0.1, 0.1, 0.1))
    return ObjectNode(name, category, tuple(states.items()), box.centre, box)


GRAPH = SceneGraph(
    (
        at("Bowl-1", "Bowl", 1.0),
        at("Bowl-2", "Bowl", 3.0),
        at("CounterTop-1", "CounterTop", 5.0),
        at("CounterTop-2", "CounterTop", 2.0),
        at("Fridge-1", "Fridge", 0.2, open="closed"),
        at("Egg-1", "Egg", 0.2),
        at("Egg-2", "Egg", 4.0),
        ObjectNode("Mug-1", "Mug"),
        ObjectNode(GRIPPER, "Gripper"),
    ),
    (Relation("Bowl-2", "held_by", GRIPPER), Relation("Egg-1", "inside", "Fridge-1")),
)


@pytest.mark.parametrize(
    ("text", "bound", "grounded"),
    [
        ("put_on(Bowl, CounterTop)", {}, "put_on(Bowl-2, CounterTop-2)"),
        ("pick_up(Bowl)", {}, "pick_up(Bowl-1)"),
        ("pick_up(Bowl)", {"Bowl": "Bowl-2"}, "pick_up(Bowl-2)"),
        ("open_obj(CounterTop)", {"CounterTop": "CounterTop-1"}, "open_obj(CounterTop-2)"),
        ("pick_up(Egg)", {}, "pick_up(Egg-2)"),
        ("pick_up(Mug)", {}, "pick_up(Mug-1)"),
        ("pick_up(Knife)", {}, "pick_up(Knife)"),
        ("put_in(Bowl-1, SinkBasin)", {}, "put_in(Bowl-1, Sink)"),
        ("pick_up(Unicorn)", {}, "pick_up(Unicorn)"),
    ],
)
def test_grounding(text: str, bound: dict[str, str], grounded: str) -> None:
    here = (0.0, 0.0, 0.0)
    found = ground_subtask(Subtask.parse(text), GRAPH, shipped("household"), here, bound)
    assert str(found) == grounded


def test_open_supports_are_left_to_the_robot() -> None:
    planned = Subtask.parse("put_on(Bowl, CounterTop)")
    ground = Subtask.parse("put_on(Bowl-2, CounterTop-2)")
    assert str(executable(ground, planned, shipped("household"))) == "put_on(Bowl-2, CounterTop)"
    exact = Subtask.parse("put_on(Bowl, CounterTop-1)")
    ground = Subtask.parse("put_on(Bowl-2, CounterTop-1)")
    assert str(executable(ground, exact, shipped("household"))) == "put_on(Bowl-2, CounterTop-1)"
