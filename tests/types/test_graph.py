"""Scene graphs: invariants and round trips."""

import json
from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from forestall.errors import FileFormatError, InputError
from forestall.types.facts import GRIPPER
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


def test_json_round_trip_is_the_identity() -> None:
    graph = kitchen(hidden=("Microwave-1",))
    assert SceneGraph.from_json(json.loads(json.dumps(graph.to_json()))) == graph
    assert "inside of Microwave-1: unobserved" in graph.text()
    assert graph.to_networkx().number_of_edges() == 2


def test_what_is_presumed_survives_json_and_is_not_a_state() -> None:
    plain = kitchen()
    bowl = replace(plain.nodes[0], presumed=(("filled", "water"),))
    graph = replace(plain, nodes=(bowl, *plain.nodes[1:]))
    assert graph != plain and bowl.state("filled") is None
    assert SceneGraph.from_json(json.loads(json.dumps(graph.to_json()))) == graph


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
    with pytest.raises(FileFormatError, match=r"nodes\[0\].feature"):
        SceneGraph.from_json(data)


@pytest.mark.parametrize("feature", [b"", bytes(4)])
def test_a_feature_has_a_direction(feature: bytes) -> None:
    with pytest.raises(InputError, match="the image feature of A-1 is empty or all zero"):
        ObjectNode("A-1", "A", feature=feature)


def test_an_entry_that_no_graph_has_is_refused_with_the_near_one() -> None:
    assert SceneGraph.from_json(kitchen().to_json()) == kitchen()
    data = kitchen().to_json()
    data["hiddne"] = data.pop("hidden")
    with pytest.raises(FileFormatError, match=r"^unknown entry of a scene graph 'hiddne': did you"):
        SceneGraph.from_json(data)


@pytest.mark.parametrize(("meant", "written"), [("seen", "sen"), ("states", "statse")])
def test_an_entry_that_no_node_has_is_refused_with_the_near_one(meant: str, written: str) -> None:
    data = kitchen().to_json()
    data["nodes"][1][written] = data["nodes"][1].pop(meant)
    says = rf"^nodes\[1\]: unknown entry '{written}': did you mean '?{meant}"
    with pytest.raises(FileFormatError, match=says):
        SceneGraph.from_json(data)


@pytest.mark.parametrize(
    ("change", "error", "says"),
    [
        ({"format": 99}, FileFormatError, "format 99"),
        ({"relations": [["Plate-1", "inside", "Oven-1"]]}, InputError, "'Oven-1', which is not"),
        ({"relations": [["Plate-1", "inside"]]}, FileFormatError, r"relations\[0\]: subject, pred"),
        ({"nodes": [{"id": "A-1"}]}, FileFormatError, "category"),
        ({"nodes": 3}, FileFormatError, "nodes: a list is expected, got 3"),
        ({"nodes": [{"id": 300 * "a", "category": "A"}]}, FileFormatError, "id: a name"),
        ({"nodes": [{"id": "", "category": "A"}]}, FileFormatError, "id: a name"),
        ({"nodes": [{"id": "A-1", "category": None}]}, FileFormatError, "category: a name"),
        ({"nodes": [{"id": "A-1", "category": "A", "states": ["x"]}]}, FileFormatError, "states"),
        ({"nodes": [{"id": "A-1", "category": "A", "pixels": -1}]}, FileFormatError, "pixels"),
        (
            {"nodes": [{"id": "A-1", "category": "A", "box_m": [[0, 0, 0]]}]},
            FileFormatError,
            r"nodes\[0\].box_m: two corners",
        ),
        (
            {"nodes": [{"id": "A-1", "category": "A", "box_m": [[1, 0, 0], [0, 1, 1]]}]},
            FileFormatError,
            r"nodes\[0\].box_m: box corners are out of order",
        ),
        (
            {"nodes": [{"id": "A-1", "category": "A", "centroid_m": [1, 2]}]},
            FileFormatError,
            "centroid_m: three numbers",
        ),
        ({"nodes": [{}] * 2001}, FileFormatError, "at most 2000 are read, got 2001"),
        ({"subtask": ["pick_up"]}, FileFormatError, "subtask: cannot read"),
        ({"hidden": ["Oven-1"]}, InputError, "Oven-1"),
    ],
)
def test_broken_graph_files_are_named(
    change: dict[str, object], error: type[Exception], says: str
) -> None:
    with pytest.raises(error, match=says):
        SceneGraph.from_json(kitchen().to_json() | change)


def test_ids_may_be_numbers() -> None:
    graph = SceneGraph.from_json(
        {
            "format": 1,
            "nodes": [{"id": 7, "category": "cup"}, {"id": 8, "category": "table"}],
            "relations": [[7, "on", 8]],
        }
    )
    assert graph.relations == (Relation("7", "on", "8"),)


def test_a_graph_carries_relations_of_any_domain() -> None:
    graph = SceneGraph.from_json(
        kitchen().to_json() | {"relations": [["Plate-1", "eats", "Bowl-1"]]}
    )
    assert graph.relations == (Relation("Plate-1", "eats", "Bowl-1"),)
    assert SceneGraph.from_json(json.loads(json.dumps(graph.to_json()))) == graph


def test_what_is_where_goes_by_the_relations_that_a_domain_names() -> None:
    graph = kitchen()
    assert graph.contents("Microwave-1", ("inside", "on_top_of")) == ("Bowl-1",)
    assert graph.parents("Bowl-1", ("inside", "on_top_of")) == ("Microwave-1",)
    assert graph.contents("Microwave-1", ("threaded_on",)) == ()
    assert graph.parents("Bowl-1", ("threaded_on",)) == ()
    assert graph.in_hands(("gripper",)) == ("Plate-1",)


def test_ids_are_unique_and_boxes_ordered() -> None:
    node = ObjectNode("A-1", "A")
    with pytest.raises(InputError, match="A-1"):
        SceneGraph((node, node))
    with pytest.raises(InputError, match="out of order"):
        Box((1.0, 0.0, 0.0), (0.0, 1.0, 1.0))


RELATIONS = ("blocking", "held_by", "inside", "near", "on_top_of", "threaded_on")
names = st.sampled_from(["A-1", "B-1", "C-2"])


@given(st.lists(st.tuples(names, st.sampled_from(RELATIONS), names), max_size=8))
def test_graphs_do_not_depend_on_order(edges: list[tuple[str, str, str]]) -> None:
    nodes = [ObjectNode(n, n[0]) for n in ("A-1", "B-1", "C-2")]
    one = SceneGraph(tuple(nodes), tuple(Relation(*e) for e in edges))
    two = SceneGraph(tuple(reversed(nodes)), tuple(Relation(*e) for e in reversed(edges)))
    assert one == two
    assert hash(one) == hash(two)
    assert one.text() == two.text()
