"""What the needs of a subtask ask about, of what nobody saw."""

from __future__ import annotations

import pytest

from forestall.domain.asked import asked_of, is_asked
from forestall.domain.load import shipped
from forestall.types.facts import Literal
from forestall.types.graph import Box, ObjectNode, Relation, SceneGraph
from forestall.types.plan import Subtask

DOMAIN = shipped("household")
BOX = Box((0.0, 0.0, 0.0), (0.1, 0.1, 0.1))


def scene(drawer: str | None, relation: str = "held_by", place: str = "gripper") -> SceneGraph:
    things = (("Book-1", None), ("Drawer-1", drawer), ("Drawer-2", None))
    nodes = [
        ObjectNode(name, name[:-2], (("open", how),), centroid_m=BOX.centre, box_m=BOX)
        for name, how in things
    ]
    gripper = ObjectNode("gripper", "gripper")
    return SceneGraph((*nodes, gripper), (Relation("Book-1", relation, place),))


@pytest.mark.parametrize(
    ("drawer", "fact", "asked"),
    [
        (None, "open(Drawer-1)=open", True),
        ("open", "open(Drawer-1)=open", False),
        (None, "open(Drawer-2)=open", False),
        (None, "dirty(Drawer-1)=dirty", False),
        ("open", "open(Book-1)=closed", False),
    ],
)
def test_only_what_leaves_a_need_open_is_asked(drawer: str | None, fact: str, asked: bool) -> None:
    needs = asked_of(scene(drawer), Subtask.parse("put_in(Book-1, Drawer-1)"), DOMAIN)
    assert is_asked(Literal.parse(fact), needs) is asked


def test_a_need_of_whatever_holds_a_thing_asks_about_the_holder() -> None:
    needs = asked_of(scene(None, "inside", "Drawer-2"), Subtask.parse("pick_up(Book-1)"), DOMAIN)
    assert is_asked(Literal.parse("open(Drawer-2)=open"), needs)
