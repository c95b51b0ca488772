"""Scene graphs: invariants, three-valued truth, round trips."""

import json
from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from forestall.errors import FileFormatError, InputError
from forestall.types.facts import GRIPPER, RELATIONS, Literal, Truth
from forestall.types.graph import Box, ObjectNode, Relation, SceneGraph, Seen
from forestall.types.plan import Subtask

BOX = Box((0.0, 0.0, 0.0), (1.0, 1.0, 1.0))


def kitchen(*, microwave: str | None = "closed", hidden: tuple[str, ...] = ()) -> SceneGraph:
    return SceneGraph(
        (
            ObjectNode("Plate-1", "Plate", (("dirty", "clean"),), (0.5, 0.5, 0.5), BOX),
            ObjectNode("Bowl-1", "Bowl", (("filled", None),), None, None, Seen.UNOBSERVED),
            ObjectNode("Microwave-1", "Microwave", (("open", microwave),), (0.5, 0.5, 0.5), BOX),
            ObjectNode(GRIPPER, "Gripper"),
        ),
        (
            Relation("Plate-1", "held_by", GRIPPER),
            Relation("Bowl-1", "inside", "Microwave-1"),
        ),
        Subtask.parse("put_in(Plate-1, Microwave-1)"),
        hidden,
    )


@pytest.mark.parametrize(
    ("text", "truth"),
    [
        ("dirty(Plate-1)=clean", Truth.TRUE),
        ("dirty(Plate-1)=dirty", Truth.FALSE),
        ("filled(Bowl-1)=wine", Truth.UNOBSERVED),
        ("open(Microwave-1)=open", Truth.FALSE),
        ("held_by(Plate-1, gripper)", Truth.TRUE),
        ("not held_by(Plate-1, gripper)", Truth.FALSE),
        ("held_by(Bowl-1, gripper)", Truth.FALSE),
        ("hand_empty()", Truth.FALSE),
        ("inside(Bowl, Microwave)", Truth.TRUE),
        ("not inside(Bowl, Microwave)", Truth.FALSE),
        ("vacant(Microwave-1)", Truth.FALSE),
        ("vacant(Plate-1)", Truth.TRUE),
        ("accessible(Bowl-1)", Truth.FALSE),
        ("accessible(Plate-1)", Truth.TRUE),
        ("located(Bowl-1)", Truth.FALSE),
        ("located(Mug-1)", Truth.FALSE),
        ("unblocked(Plate-1)", Truth.TRUE),
        ("dirty(Cup-1)=clean", Truth.UNOBSERVED),
        ("dirty(Cup)=clean", Truth.UNOBSERVED),
        ("spoiled(Bowl-1)", Truth.UNOBSERVED),
    ],
)
def test_truth(text: str, truth: Truth) -> None:
    assert kitchen().truth(Literal.parse(text)) is truth


def test_an_empty_looking_closed_container_is_unobserved() -> None:
    graph = SceneGraph(
        (ObjectNode("Microwave-1", "Microwave", (("open", "closed"),)),), hidden=("Microwave-1",)
    )
    assert graph.truth(Literal.parse("vacant(Microwave-1)")) is Truth.UNOBSERVED


def test_json_round_trip_is_the_identity() -> None:
    graph = kitchen(hidden=("Microwave-1",))
    assert SceneGraph.from_json(json.loads(json.dumps(graph.to_json()))) == graph
    assert "inside of Microwave-1: unobserved" in graph.text()
    assert graph.to_networkx().number_of_edges() == 2


def test_image_features_survive_json_where_there_are_any() -> None:
    plain = kitchen()
    assert all("feature" not in n for n in plain.to_json()["nodes"])
    plate = replace(plain.nodes[2], feature=bytes([127, 0, 200]))
    graph = replace(plain, nodes=(*plain.nodes[:2], plate, *plain.nodes[3:]))
    assert graph != plain
    assert SceneGraph.from_json(json.loads(json.dumps(graph.to_json()))) == graph
    assert graph.to_json(features=False) == plain.to_json()
    assert graph.text() == plain.text()


@pytest.mark.parametrize("feature", ["no base64!", "AA=", 7, ["AAEC"]])
def test_a_feature_that_cannot_be_read(feature: object) -> None:
    data = kitchen().to_json()
    data["nodes"][0]["feature"] = feature
    with pytest.raises(FileFormatError, match="broken scene graph"):
        SceneGraph.from_json(data)


@pytest.mark.parametrize("feature", [b"", bytes(4)])
def test_a_feature_has_a_direction(feature: bytes) -> None:
    with pytest.raises(InputError, match="the image feature of A-1 is empty or all zero"):
        ObjectNode("A-1", "A", feature=feature)


@pytest.mark.parametrize(
    ("change", "error", "says"),
    [
        ({"format": 99}, FileFormatError, "format 99"),
        ({"relations": [["Plate-1", "inside", "Oven-1"]]}, InputError, "'Oven-1', which is not"),
        ({"relations": [["Plate-1", "eats", "Bowl-1"]]}, InputError, "unknown relation 'eats'"),
        ({"relations": [["Plate-1", "inside"]]}, FileFormatError, "broken scene graph"),
        ({"nodes": [{"id": "A-1"}]}, FileFormatError, "category"),
        ({"nodes": 3}, FileFormatError, "broken scene graph"),
        ({"hidden": ["Oven-1"]}, InputError, "Oven-1"),
    ],
)
def test_broken_graph_files_are_named(
    change: dict[str, object], error: type[Exception], says: str
) -> None:
    with pytest.raises(error, match=says):
        SceneGraph.from_json(kitchen().to_json() | change)


def test_ids_are_unique_and_boxes_ordered() -> None:
    node = ObjectNode("A-1", "A")
    with pytest.raises(InputError, match="A-1"):
        SceneGraph((node, node))
    with pytest.raises(InputError, match="out of order"):
        Box((1.0, 0.0, 0.0), (0.0, 1.0, 1.0))


names = st.sampled_from(["A-1", "B-1", "C-2"])


@given(st.lists(st.tuples(names, st.sampled_from(RELATIONS), names), max_size=8))
def test_graphs_do_not_depend_on_order(edges: list[tuple[str, str, str]]) -> None:
    nodes = [ObjectNode(n, n[0]) for n in ("A-1", "B-1", "C-2")]
    one = SceneGraph(tuple(nodes), tuple(Relation(*e) for e in edges))
    two = SceneGraph(tuple(reversed(nodes)), tuple(Relation(*e) for e in reversed(edges)))
    assert one == two
    assert hash(one) == hash(two)
    assert one.text() == two.text()
