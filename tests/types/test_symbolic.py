"""Scenes as a person writes them."""

from __future__ import annotations

from typing import Any

import pytest

from forestall.errors import InputError
from forestall.types.graph import Relation, Seen
from forestall.types.symbolic import scene_graph


def test_the_short_form() -> None:
    graph = scene_graph(
        {
            "objects": {
                "cup-1": {"Fill Level": "half full", "clean": True, "box": [[0, 0, 0], [1, 1, 1]]},
                "K7": "drill",
                "shelf-1": {"category": "rack", "dusty": None},
            },
            "relations": [["cup-1", "Stands on", "shelf-1"], "K7 held_by gripper"],
            "unseen": ["shelf-1"],
            "hidden": ["shelf-1"],
        }
    )
    cup, drill, shelf = (graph.get(n) for n in ("cup-1", "K7", "shelf-1"))
    assert cup is not None and drill is not None and shelf is not None
    assert cup.states == (("clean", "yes"), ("fill_level", "half_full"))
    assert cup.centroid_m == (0.5, 0.5, 0.5)
    assert (drill.category, shelf.category) == ("drill", "rack")
    assert (cup.seen, shelf.seen) == (Seen.VISIBLE, Seen.UNOBSERVED)
    assert shelf.state("dusty") is None
    assert graph.relations == (
        Relation("K7", "held_by", "gripper"),
        Relation("cup-1", "stands_on", "shelf-1"),
    )
    assert graph.in_hands(("gripper",)) == ("K7",) and graph.hidden == ("shelf-1",)
    assert scene_graph(graph) is graph
    assert scene_graph(graph.to_json()) == graph


def test_ids_may_have_any_form() -> None:
    names = ["Mug|+00.1|-1.2", "кружка", "tool 7", "025_mug"]
    graph = scene_graph({"objects": names, "relations": [[names[0], "near", names[1]]]})
    assert [n.id for n in graph.nodes] == sorted(names)


BAD: list[tuple[Any, str]] = [
    (7, "a scene is a mapping"),
    ({}, "without 'objects'"),
    ({"objects": {}, "relation": []}, "did you mean relations"),
    ({"objects": "cup"}, "objects of a scene is a list"),
    ({"objects": {"cup-1": 3}}, "object 'cup-1': a category or a table"),
    ({"objects": {"cup-1": {"full": 3}}}, "a state is a word"),
    ({"objects": {"cup-1": {"box": [1, 2]}}}, "is not .*in metres"),
    ({"objects": {"cup-1": {"box": [[1, 1, 1], [0, 0, 0]]}}}, "out of order"),
    ({"objects": {" ": {}}}, "empty id"),
    ({"objects": ["a"], "relations": ["a on"]}, "write .subject, relation, object."),
    ({"objects": ["a"], "relations": ["a on b"]}, "names 'b'"),
    ({"objects": ["a"], "relations": [["a", "--", "a"]]}, "has no letter"),
    ({"objects": ["a"], "unseen": ["b"]}, "unseen: 'b' is not among the objects: a"),
    ({"objects": ["a"], "hidden": ["b"]}, "hidden names 'b'"),
]


@pytest.mark.parametrize(("data", "said"), BAD)
def test_what_cannot_be_read_is_named(data: Any, said: str) -> None:
    with pytest.raises(InputError, match=said):
        scene_graph(data)
