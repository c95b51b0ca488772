from __future__ import annotations

import re
import xml.etree.ElementTree as ET
from collections.abc import Callable
from dataclasses import replace

import matplotlib as mpl
import pytest

from forestall.report import figures, household_figures, run_figures
from forestall.report.figure_style import COLOURS, inline_svg
from forestall.report.figure_values import (
    Banded,
    Curve,
    Distribution,
    Dot,
    Estimate,
    Lane,
    Shares,
    Spent,
)

pytestmark = pytest.mark.slow

HOSTILE = "<b>&\"'$x_1$ ]]> --"
SOME = Estimate(0.5, 0.3, 0.7, 20)
NONE = Estimate(None)
CURVE = Curve(HOSTILE, ((0.0, 0.0), (0.1, 0.6), (1.0, 1.0)), ((0.9, 0.1, 0.6),), 0.75)
LANE = Lane(HOSTILE, (0.0, 10.0, 20.0), (10.0,), (10.0,), 5.0, 25.0, 30.0, False)

BAND = Banded(HOSTILE, ((1.0, 0.2, 0.1, 0.3), (2.0, 0.4, None, None)), True, (1.0, 0.2))
POINT = Banded("b", (), mark=(0.1, 0.8), span=(0.6, 0.9))

FULL: dict[str, Callable[[], bytes]] = {
    "roc": lambda: figures.roc([("a", [CURVE, Curve("always", ((1.0, 1.0),), single=True)])]),
    "dots": lambda: run_figures.dots([("a", [Dot(HOSTILE, SOME, 0.7), Dot("b", NONE)])], "success"),
    "by_kind": lambda: figures.by_kind([("drop", 3), ("spill", 0)], [(HOSTILE, (SOME, NONE))]),
    "knowability": lambda: figures.knowability([("a", [Shares(HOSTILE, 0.5, 0.2, 0.1, 10)])]),
    "timelines": lambda: run_figures.timelines([LANE]),
    "scores": lambda: figures.scores(
        [Distribution(HOSTILE, (("failing", (0.5, 0.6)), ("harmless", ())), 0.9)]
    ),
    "time_spent": lambda: run_figures.time_spent([Spent(HOSTILE, 100.0, 3.0, 5, 109.2)]),
    "in_time": lambda: household_figures.in_time([("a", [BAND, POINT])]),
    "risk": lambda: household_figures.risk([("a", [BAND, POINT]), ("b", [POINT])]),
    "demonstrations": lambda: household_figures.demonstrations([("a", "b", [BAND])]),
}
EMPTY: dict[str, Callable[[], bytes]] = {
    "roc": lambda: figures.roc([]),
    "dots": lambda: run_figures.dots([], "success"),
    "by_kind": lambda: figures.by_kind([], []),
    "knowability": lambda: figures.knowability([]),
    "timelines": lambda: run_figures.timelines([]),
    "scores": lambda: figures.scores([]),
    "time_spent": lambda: run_figures.time_spent([]),
    "in_time": lambda: household_figures.in_time([]),
    "risk": lambda: household_figures.risk([]),
    "demonstrations": lambda: household_figures.demonstrations([]),
}


def texts(svg: bytes) -> list[str]:
    root = ET.fromstring(svg)
    return ["".join(e.itertext()) for e in root.iter("{http://www.w3.org/2000/svg}text")]


@pytest.mark.parametrize("name", FULL)
def test_names_are_text_and_arrive_unharmed(name: str) -> None:
    shown = " ".join(texts(FULL[name]()))
    assert all(part in shown for part in HOSTILE.split())


@pytest.mark.parametrize("name", FULL)
def test_same_values_give_the_same_bytes(name: str) -> None:
    first = FULL[name]()
    assert first == FULL[name]()
    assert b"<dc:date>" not in first


@pytest.mark.parametrize("name", EMPTY)
def test_nothing_to_draw_is_still_a_drawing(name: str) -> None:
    assert ET.fromstring(EMPTY[name]()).tag.endswith("svg")


LONG = "scene graph without structural matching (stand-in: words)"
MANY = [replace(CURVE, label=LONG)] * 5 + [Curve(LONG, ((1.0, 1.0),), single=True)] * 5
CROWDED: dict[str, Callable[[], bytes]] = {
    **FULL,
    "roc, one panel": lambda: figures.roc([("a", MANY)]),
    "roc, two panels": lambda: figures.roc([("a", MANY), ("b", MANY[:5])]),
    "kinds": lambda: figures.by_kind([("drop", 3)] * 12, [(LONG, (SOME,) * 12)] * 4),
    "knowability": lambda: figures.knowability([("a", [Shares(LONG, 1, 0, 0, 9)] * 4)] * 3),
    "sets": lambda: run_figures.dots([("a", [Dot(LONG, SOME, 1.0)] * 4)] * 4, "success"),
}


@pytest.mark.parametrize("name", CROWDED)
def test_no_text_begins_outside_the_drawing(name: str) -> None:
    root = ET.fromstring(CROWDED[name]())
    _, _, width, height = map(float, root.attrib["viewBox"].split())
    found = list(root.iter("{http://www.w3.org/2000/svg}text"))
    assert found
    for text in found:
        place = re.search(r"translate\(([-\d.]+) ([-\d.]+)\)", text.get("transform", ""))
        x, y = map(float, place.groups() if place else (text.attrib["x"], text.attrib["y"]))
        assert 0 <= x <= width and 0 <= y <= height, "".join(text.itertext())


def test_drawing_leaves_matplotlib_as_it_was() -> None:
    before = dict(mpl.rcParams)
    FULL["roc"]()
    assert dict(mpl.rcParams) == before


def test_a_users_settings_change_nothing() -> None:
    plain = FULL["dots"]()
    with mpl.rc_context({"font.size": 30, "axes.facecolor": "red", "svg.fonttype": "path"}):
        assert FULL["dots"]() == plain


def test_the_areas_and_thresholds_of_a_curve_are_written_out() -> None:
    shown = texts(FULL["roc"]())
    assert any("area 0.75" in t for t in shown)
    assert "0.90" in shown


def test_estimates_say_of_how_many_and_where_there_is_none() -> None:
    shown = texts(FULL["dots"]())
    assert "50 % of 20" in shown
    assert "no run" in shown
    assert "the paper, on its own scenes" in shown


def test_the_paper_is_in_the_key_only_where_it_has_a_value() -> None:
    shown = texts(run_figures.dots([("a", [Dot("b", SOME)])], "success"))
    assert "the paper, on its own scenes" not in shown


def test_marks_that_share_a_place_are_named_together() -> None:
    marks = ((0.9, 0.1, 0.6), (0.85, 0.1, 0.6), (0.8, 0.0, 0.2))
    curve = Curve("a", ((0.0, 0.0), (1.0, 1.0)), marks)
    shown = texts(figures.roc([("a", [curve])]))
    assert "0.90, 0.85" in shown
    assert "0.80" in shown


def test_a_lane_says_how_it_ended() -> None:
    reached = Lane("a", (0.0,), (), (), None, None, 9.0, True)
    assert "not reached" in texts(run_figures.timelines([LANE]))
    shown = texts(run_figures.timelines([reached]))
    assert "reached" in shown
    assert "not reached" not in shown


def test_inside_a_page_colours_are_variables_and_ids_its_own() -> None:
    svg = FULL["roc"]()
    text = inline_svg(svg, "roc", 'a "label" & more')
    root = ET.fromstring(text)
    assert root.attrib["aria-label"] == 'a "label" & more'
    ids = re.findall(r'\bid="([^"]+)"', text)
    assert ids and all(i.startswith("roc-") for i in ids)
    used = set(re.findall(r'href="#([^"]+)"|url\(#([^)]+)\)', text))
    assert used and all((a or b) in ids for a, b in used)
    left = {light for light, _ in COLOURS.values()}.intersection(re.findall(r"#[0-9a-f]{6}", text))
    assert left == set()
    assert "var(--f-s1)" in text
    assert "<?xml" not in text and "<!DOCTYPE" not in text and "<metadata" not in text


def test_colours_of_roles_differ() -> None:
    for shade in (0, 1):
        used = [pair[shade] for pair in COLOURS.values()]
        assert len(set(used)) == len(used)
