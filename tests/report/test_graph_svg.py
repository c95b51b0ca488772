from __future__ import annotations

import re
import xml.etree.ElementTree as ET
from typing import Literal

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from forestall.domain.load import shipped
from forestall.report.drawn import drawn
from forestall.report.graph_layout import text_width
from forestall.report.graph_svg import graph_svg
from forestall.types.facts import GRIPPER
from forestall.types.graph import ObjectNode, Relation, SceneGraph
from forestall.types.plan import Subtask
from forestall.types.verdict import Change, Discrepancy

from . import graphs, records

NS = "{http://www.w3.org/2000/svg}"
SUBTASK = Subtask.parse("put_in(Plate-1, Microwave-1)")
SideName = Literal["observed", "expected"]

DRAWN = drawn("household")


def draw(side: SideName, said: tuple[Discrepancy, ...] = records.DISCREPANCIES) -> ET.Element:
    seen, wanted = graphs.observed_graph(SUBTASK), graphs.expected_graph(SUBTASK)
    mine, other = (seen, wanted) if side == "observed" else (wanted, seen)
    return ET.fromstring(graph_svg(mine, other, graphs.MATCHES, said, side, DRAWN, standalone=True))


def nodes(svg: ET.Element) -> dict[str, str]:
    """Name → class of every drawn box."""
    return {
        (g.find(f"{NS}text").text or ""): g.get("class", "")  # type: ignore[union-attr]
        for g in svg.iter(f"{NS}g")
        if "fg-node" in g.get("class", "").split()
    }


def edges(svg: ET.Element) -> dict[str, str]:
    return {
        (g.find(f"{NS}title").text or ""): g.get("class", "")  # type: ignore[union-attr]
        for g in svg.iter(f"{NS}g")
        if g.get("class", "").startswith(("fg-edge", "fg-lane"))
        and g.find(f"{NS}title") is not None
    }


def boxes(svg: ET.Element) -> list[tuple[float, float, float, float]]:
    found = []
    for rect in svg.iter(f"{NS}rect"):
        if rect.get("class") == "fg-box":
            x, y, w, h = (float(rect.get(k, "nan")) for k in ("x", "y", "width", "height"))
            found.append((x, y, x + w, y + h))
    return found


def assert_apart(svg: ET.Element) -> None:
    width, height = float(svg.get("width", "0")), float(svg.get("height", "0"))
    found = boxes(svg)
    for i, (a, b, c, d) in enumerate(found):
        assert a >= 0
        assert b >= 0
        assert c <= width
        assert d <= height
        for e, f, g, h in found[i + 1 :]:
            assert c <= e or g <= a or d <= f or h <= b


def test_every_node_is_drawn_and_nothing_overlaps() -> None:
    svg = draw("observed")
    assert {n.id for n in graphs.observed_graph().nodes} <= nodes(svg).keys()
    assert_apart(svg)
    assert_apart(draw("expected"))


def test_extra_missing_and_changed_are_marked() -> None:
    seen, wanted = draw("observed"), draw("expected")
    assert "fg-extra" in nodes(seen)["Bowl-1"]
    assert "fg-ghost" in nodes(seen)["no Book-1"]
    assert "fg-missing" in nodes(wanted)["Book-1"]
    assert "fg-haschanged" in nodes(seen)["Mug-1"]
    assert "fg-haschanged" in nodes(wanted)["Mug-1"]
    assert nodes(seen)["Potato-1"] == "fg-node"
    assert "fg-extra" in edges(seen)["Bowl-1 inside Microwave-1"]
    assert "fg-missing" in edges(wanted)["Book-1 on top of CounterTop-1"]
    assert edges(seen)["Plate-1 on top of CounterTop-2"] == "fg-edge"


def test_changed_chips_show_both_values() -> None:
    for side, value in (("observed", "dirty"), ("expected", "clean")):
        svg = draw(side)  # type: ignore[arg-type]
        chips = [
            g.find(f"{NS}text").text  # type: ignore[union-attr]
            for g in svg.iter(f"{NS}g")
            if "fg-changed" in g.get("class", "").split()
        ]
        assert chips == [value]


def test_how_it_was_seen_shows() -> None:
    alone = ET.fromstring(
        graph_svg(graphs.observed_graph(), None, (), (), "observed", DRAWN, standalone=True)
    )
    assert "fg-remembered" in nodes(alone)["Fridge-1"]
    assert "fg-unobserved" in nodes(alone)["Knife-1"]
    text = ET.tostring(alone, encoding="unicode")
    assert "temperature ?" in text
    assert "inside ?" in text
    marks = " ".join([*nodes(alone).values(), *edges(alone).values()])
    assert not re.search("extra|missing|ghost|changed", marks)


def test_near_counts_only_where_a_discrepancy_speaks_of_it() -> None:
    seen = SceneGraph(
        (ObjectNode("Mug-1", "Mug"), ObjectNode("Pan-1", "Pan")),
        (Relation("Mug-1", "near", "Pan-1"), Relation("Mug-1", "left_of", "Pan-1")),
    )
    wanted = SceneGraph(seen.nodes)
    same = (("Mug-1", "Mug-1"), ("Pan-1", "Pan-1"))
    quiet = graph_svg(seen, wanted, same, (), "observed", DRAWN)
    assert "fg-extra" not in quiet
    said = Discrepancy(
        Change.EXTRA_RELATION, "Mug-1", "", "Mug-1 left of Pan-1", "Mug-1 is left of Pan-1"
    )
    loud = graph_svg(seen, wanted, same, (said,), "observed", DRAWN)
    assert "fg-lane fg-extra" in loud


def test_both_sides_have_the_same_size_and_matched_nodes_the_same_row() -> None:
    seen, wanted = draw("observed"), draw("expected")
    assert seen.get("viewBox") == wanted.get("viewBox")

    def rows(svg: ET.Element) -> dict[str, str]:
        return {
            (g.find(f"{NS}text").text or ""): g.find(f"{NS}rect").get("y", "")  # type: ignore[union-attr]
            for g in svg.iter(f"{NS}g")
            if "fg-node" in g.get("class", "").split()
        }

    for here, there in graphs.MATCHES:
        assert rows(seen)[here] == rows(wanted)[there]


def test_parents_stand_above_children_and_the_gripper_apart() -> None:
    graph = SceneGraph(
        (
            ObjectNode(GRIPPER, GRIPPER),
            graphs.plate(),
            graphs.potato(),
            ObjectNode("CounterTop-1", "CounterTop"),
        ),
        graphs.relations("Plate-1 held_by gripper", "Potato-1 on_top_of Plate-1"),
        SUBTASK,
    )
    svg = ET.fromstring(graph_svg(graph, None, (), (), "observed", DRAWN, standalone=True))
    order = list(nodes(svg))
    tops = {
        (g.find(f"{NS}text").text or ""): float(g.find(f"{NS}rect").get("y", ""))  # type: ignore[union-attr]
        for g in svg.iter(f"{NS}g")
        if "fg-node" in g.get("class", "").split()
    }
    assert len(order) == 4
    assert tops["gripper"] < tops["Plate-1"] < tops["Potato-1"] < tops["CounterTop-1"]
    assert svg.find(f"{NS}line") is not None
    subtask = next(g for g in svg.iter(f"{NS}g") if g.get("class") == "fg-subtask")
    assert subtask.find(f"{NS}text").text == "next: put_in(Plate-1, Microwave-1)"  # type: ignore[union-attr]
    assert not any("put_in" in title for title in edges(svg))


def test_a_thing_that_moved_is_expected_at_its_old_place() -> None:
    table, shelf = ObjectNode("Table-1", "Table"), ObjectNode("Shelf-1", "Shelf")
    mug = ObjectNode("Mug-1", "Mug")
    seen = SceneGraph((table, shelf, mug), graphs.relations("Mug-1 on_top_of Table-1"))
    wanted = SceneGraph((table, shelf, mug), graphs.relations("Mug-1 on_top_of Shelf-1"))
    svg = ET.fromstring(graph_svg(seen, wanted, (), (), "observed", DRAWN, standalone=True))
    assert "fg-ghost" in nodes(svg)["Mug-1 expected here"]
    assert edges(svg)["Mug-1 on top of Table-1"] == "fg-edge fg-extra"


def test_odd_names_are_escaped_and_long_ones_cut() -> None:
    name = 'A<b>&"quoted" and far too long to be drawn in one piece'
    graph = SceneGraph((ObjectNode(name, name, (("filled", "<wine>"),)),))
    text = graph_svg(graph, None, (), (), "observed", DRAWN)
    svg = ET.fromstring(text)
    assert "<b>" not in text
    assert name in (svg.find("g/title").text or "")  # type: ignore[union-attr]
    assert (svg.find("g/text").text or "").endswith("…")  # type: ignore[union-attr]


def test_empty_graphs_and_an_expected_graph_alone() -> None:
    empty = SceneGraph(())
    assert (
        nodes(ET.fromstring(graph_svg(empty, empty, (), (), "observed", DRAWN, standalone=True)))
        == {}
    )
    alone = graph_svg(graphs.expected_graph(), None, (), (), "expected", DRAWN, standalone=True)
    assert "expected scene graph" in alone
    assert "Book-1" in nodes(ET.fromstring(alone))


@pytest.mark.parametrize("wide", ["熱い鍋", "mmmm"])
def test_wide_letters_count_as_wide(wide: str) -> None:
    assert text_width(wide, 13) > text_width("i" * len(wide), 13) * 2


names = st.sampled_from([f"{c}-{i}" for c in ("Mug", "Plate", "CounterTop") for i in range(1, 6)])


@st.composite
def any_graph(draw_from: st.DrawFn) -> SceneGraph:
    ids = sorted(draw_from(st.sets(names, min_size=1, max_size=15)))
    some = st.sampled_from(ids)
    edge = st.builds(Relation, some, st.sampled_from(sorted(shipped("household").relations)), some)
    states = st.sampled_from([("dirty", "clean"), ("dirty", "dirty"), ("filled", None)])
    return SceneGraph(
        tuple(ObjectNode(i, i.split("-")[0], (draw_from(states),)) for i in ids),
        tuple(draw_from(st.lists(edge, max_size=30))),
        draw_from(st.none() | st.just(SUBTASK)),
    )


@given(any_graph(), any_graph())
@settings(max_examples=60, deadline=None)
def test_any_pair_is_drawn_without_overlap_and_the_same_each_time(
    seen: SceneGraph, wanted: SceneGraph
) -> None:
    for side, mine, other in (("observed", seen, wanted), ("expected", wanted, seen)):
        text = graph_svg(mine, other, (), (), side, DRAWN, standalone=True)  # type: ignore[arg-type]
        svg = ET.fromstring(text)
        assert {n.id for n in mine.nodes} <= nodes(svg).keys()
        assert_apart(svg)
        assert text == graph_svg(mine, other, (), (), side, DRAWN, standalone=True)  # type: ignore[arg-type]
