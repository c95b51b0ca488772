from __future__ import annotations

import json
import math
from dataclasses import replace
from typing import Any

import pytest

from forestall.report.drawn import drawn
from forestall.report.page import page_html
from forestall.report.space import space_of
from forestall.types.episode import BoundaryRecord
from forestall.types.graph import Box, ObjectNode, Relation, SceneGraph, Seen
from forestall.types.plan import Subtask

from . import records

HOW = drawn("household")


def boxed(name: str, seen: Seen = Seen.VISIBLE, at: float = 0.0) -> ObjectNode:
    box = Box((at, 0.0, 0.0), (at + 0.1, 0.1, 0.1234567))
    return ObjectNode(f"{name}-1", name, box_m=box, seen=seen)


def boundary(*relations: Relation, scoped: tuple[str, ...] = ("Cup-1", "Table-1")) -> Any:
    nodes = (boxed("Cup"), boxed("Table", Seen.REMEMBERED, 1.0), ObjectNode("Fork-1", "Fork"))
    graph = SceneGraph((*nodes, boxed("Shelf", Seen.UNOBSERVED)), relations)
    near = SceneGraph(tuple(n for n in nodes if n.id in scoped), tuple(relations))
    step = Subtask("pick_up", ("Cup-1",))
    return replace(records.boundary(0, step), graph=graph, scoped=near, diagnosis=None)


def test_every_box_is_there_with_what_it_is_to_the_subtask() -> None:
    space = space_of(boundary(), HOW)
    assert space is not None
    looks = {box[0]: box[2] for box in space["boxes"]}
    assert looks == {"Cup-1": "near", "Table-1": "near remembered", "Shelf-1": "unobserved"}
    assert space["boxes"][0][3:] == [0, 0, 0, 0.1, 0.1, 0.123]


def test_what_holds_is_always_drawn_and_what_is_said_twice_once() -> None:
    found = boundary(
        Relation("Cup-1", "on_top_of", "Table-1"),
        Relation("Cup-1", "near", "Table-1"),
        Relation("Table-1", "near", "Cup-1"),
        Relation("Cup-1", "left_of", "Table-1"),
        Relation("Table-1", "right_of", "Cup-1"),
    )
    space = space_of(found, HOW)
    assert space is not None
    said = [(words, always) for _, _, words, always in space["relations"]]
    assert said == [("on top of", True), ("left of", False), ("near", False)]


def test_the_culprit_is_marked_and_the_camera_says_where_to_look() -> None:
    alarm = records.potato_record().boundaries[records.ALARM_INDEX]
    space = space_of(alarm, HOW)
    assert space is not None
    assert [b[0] for b in space["boxes"] if "culprit" in b[2]] == ["Bowl-1"]
    pose = alarm.observation.frames[-1].camera_to_world  # type: ignore[union-attr]
    assert space["yaw"] == pytest.approx(math.atan2(pose[1][2], pose[0][2]), abs=1e-3)


def test_without_a_box_there_is_no_view() -> None:
    empty: BoundaryRecord = replace(
        boundary(), graph=SceneGraph((ObjectNode("Cup-1", "Cup"),)), scoped=SceneGraph(())
    )
    assert space_of(empty, HOW) is None
    whole = records.potato_record()
    alone = replace(whole, boundaries=(replace(empty, index=0),), executed=())
    assert 'class="space"' not in page_html(alone)


def test_a_name_cannot_end_the_data() -> None:
    name = '</script><script>document.title = "taken"</script>'
    found = boundary()
    node = ObjectNode(name, "Cup", box_m=Box((0, 0, 0), (1, 1, 1)))
    odd = replace(found, graph=SceneGraph((node,)), scoped=SceneGraph((node,)))
    whole = records.potato_record()
    page = page_html(replace(whole, boundaries=(replace(odd, index=0),), executed=()))
    data = page.split('<script type="application/json">')[1].partition("</script>")[0]
    assert json.loads(data)["boxes"][0][0] == name
