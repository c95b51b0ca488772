"""Draws one scene graph, differences to another one marked; see `graph_layout.py` for the places.

A node is a rounded box with its name and its states; support, containment and holding are edges of
a tree that reads downwards; other relations run in lanes at the right. The gripper stands apart
above the tree, the subtask node above that, tied to nothing. The same input gives the same text.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from html import escape
from importlib.resources import files
from typing import Literal

from forestall.report.drawn import Drawn
from forestall.report.graph_drawing import (
    BOX,
    EDGE,
    MARGIN,
    NAME,
    Box,
    Drawing,
    head_room,
)
from forestall.report.graph_layout import Lane, differs, sides, slots, text_width
from forestall.types.graph import SceneGraph
from forestall.types.verdict import Discrepancy

SideName = Literal["observed", "expected"]


def graph_css() -> str:
    """The style sheet of the drawings; follows the colour scheme of the reader."""
    return files("forestall.report").joinpath("templates/graph.css").read_text(encoding="utf-8")


def graph_svg(
    graph: SceneGraph,
    other: SceneGraph | None,
    matches: Sequence[tuple[str, str]],
    discrepancies: Sequence[Discrepancy],
    side: SideName,
    drawn: Drawn,
    *,
    done: bool = False,
    standalone: bool = False,
    about: str = "",
    placed: Collection[str] = (),
) -> str:
    """Draw `graph` as SVG.

    Args:
        graph: what to draw.
        other: the graph to compare it with, None to draw it unmarked.
        matches: (observed id, expected id) pairs; none: nodes with the same id are the same.
        discrepancies: differences to mark beside those that follow from the matches.
        side: whether `graph` is the observed or the expected one.
        drawn: which relations are drawn how.
        done: whether the subtask of the graphs is over; otherwise it comes next.
        standalone: carry namespace and style sheet along, for a file of its own.
        about: what tells this drawing from the others on a page, for those who hear it.
        placed: ids of nodes that a picture or a 3D view beside it shows: they can be pointed at.

    Returns:
        One `<svg>` element. Both sides of a pair come out with the same size and the same rows.
    """
    observed, expected = (graph, other) if side == "observed" else (other, graph)
    if observed is None:  # an expected graph alone is drawn like any single graph
        observed, expected = graph, None
    left, right = sides(observed, expected, matches, drawn)
    rows = slots(left, right)
    top = head_room(left, right)
    drawings = [
        Drawing(me, you, rows, discrepancies, top, "done" if done else "next")
        for me, you in ((left, right), (right, left))
        if me is not None
    ]
    mine = drawings[-1] if side == "expected" and right is not None else drawings[0]
    width = max(d.width for d in drawings)
    height = max(d.height for d in drawings)
    words = f"{side} scene graph{f', {about}' if about else ''}"
    return _element(mine, width, height, words, placed, standalone)


def _element(
    drawing: Drawing,
    width: float,
    height: float,
    words: str,
    placed: Collection[str],
    standalone: bool,
) -> str:
    graph = drawing.me.graph
    label = f"{words}: {len(graph.nodes)} nodes, {len(graph.relations)} relations"
    role = "group" if placed else "img"
    space = ' xmlns="http://www.w3.org/2000/svg"' if standalone else ""
    parts = [
        (
            f'<svg{space} class="fg" viewBox="0 0 {_n(width)} {_n(height)}" width="{_n(width)}" '
            f'height="{_n(height)}" role="{role}" '
            f'aria-label="{escape(label)}">'
        )
    ]
    if standalone:
        parts.append(f"<style>{graph_css()}</style>")
    parts += _head(drawing, width)
    parts += [_tree_edge(drawing, i) for i in sorted(drawing.boxes) if i in drawing.me.parents]
    parts += [_ghost_edge(drawing, b) for b in drawing.ghosts if b.slot.depth]
    parts += [part for x in drawing.lanes for part in _lane_line(drawing, x)]
    parts += [_lane_label(drawing, x) for x in drawing.lanes]
    parts += [_node(b, i if i in placed else "") for i, b in sorted(drawing.boxes.items())]
    parts += [_node(b) for b in drawing.ghosts]
    if drawing.note:
        parts.append(
            f'<text class="fg-note" x="{_n(MARGIN)}" y="{_n(drawing.bottom + 18)}">'
            f"{drawing.note}<title>{escape(chr(10).join(drawing.hidden))}</title></text>"
        )
    parts.append("</svg>")
    return "\n".join(p for p in parts if p)


def _head(drawing: Drawing, width: float) -> list[str]:
    parts = []
    if drawing.subtask is not None:
        pill = text_width(drawing.subtask, NAME) + 28
        parts.append(
            f'<g class="fg-subtask"><rect x="{_n(MARGIN)}" y="4" width="{_n(pill)}" height="26" '
            f'rx="13"/><text x="{_n(MARGIN + 14)}" y="21.5">{escape(drawing.subtask)}</text></g>'
        )
    if drawing.apart:
        y = _n(drawing.row_y(drawing.hand_rows) - 13)
        parts.append(
            f'<line class="fg-apart" x1="{_n(MARGIN)}" y1="{y}" '
            f'x2="{_n(width - MARGIN)}" y2="{y}"/>'
        )
    return parts


def _tree_edge(drawing: Drawing, node_id: str) -> str:
    relation = drawing.me.parents[node_id]
    child, parent = drawing.boxes[node_id], drawing.boxes[relation.object]
    mark = ""
    if differs(drawing.me, drawing.you, drawing.said, relation):
        mark = " fg-extra" if drawing.me.name == "observed" else " fg-missing"
    words = relation.predicate.replace("_", " ")
    x, top = parent.x + 13, parent.y + BOX
    middle = (x + child.x) / 2 + 2
    return (
        f'<g class="fg-edge{mark}"><title>{escape(str(relation))}</title>'
        f'<path d="M{_n(x)} {_n(top + 5)}V{_n(child.middle - 6)}q0 6 6 6H{_n(child.x)}"/>'
        f'<path class="fg-head" d="M{_n(x)} {_n(top)}l-4 7h8z"/>'
        f'<text x="{_n(middle)}" y="{_n(child.middle - 4)}">{escape(words)}</text></g>'
    )


def _ghost_edge(drawing: Drawing, ghost: Box) -> str:
    above = next(
        (
            b
            for b in (*drawing.boxes.values(), *drawing.ghosts)
            if b.slot.path == ghost.slot.path[:-1]
        ),
        None,
    )
    if above is None:
        return ""
    x = above.x + 13
    return (
        f'<g class="fg-edge fg-missing"><path d="M{_n(x)} {_n(above.y + BOX)}'
        f'V{_n(ghost.middle - 6)}q0 6 6 6H{_n(ghost.x)}"/></g>'
    )


def _ports(drawing: Drawing, lane: Lane) -> tuple[float, float]:
    """Heights at which a lane leaves its two boxes; several at one box are spread."""
    heights = []
    for end in (lane.subject, lane.object):
        here = [x for x in drawing.lanes if end in (x.subject, x.object)]
        step = min(6.0, 20.0 / max(1, len(here)))
        offset = (here.index(lane) - (len(here) - 1) / 2) * step
        heights.append(drawing.boxes[end].middle + offset)
    return heights[0], heights[1]


def _lane_class(drawing: Drawing, lane: Lane) -> str:
    mark = (" fg-extra" if drawing.me.name == "observed" else " fg-missing") * lane.changed
    named = drawing.me.drawn.strong.replace("_", " ")
    strong = " fg-blocking" if named and named in lane.label else ""
    return f"fg-lane{strong}{mark}"


def _lane_line(drawing: Drawing, lane: Lane) -> list[str]:
    start, end = _ports(drawing, lane)
    from_x = drawing.boxes[lane.subject].right
    to_x = drawing.boxes[lane.object].right
    x = drawing.lane_middle(lane)
    bend = 6 if end > start else -6
    head = f'<path class="fg-head" d="M{_n(to_x)} {_n(end)}l7 -4v8z"/>' if lane.directed else ""
    words = f"{lane.subject} {lane.label} {lane.object}"
    return [
        (
            f'<g class="{_lane_class(drawing, lane)}"><title>{escape(words)}</title>'
            f'<path d="M{_n(from_x)} {_n(start)}H{_n(x - 6)}q6 0 6 {bend}V{_n(end - bend)}'
            f'q0 {bend} -6 {bend}H{_n(to_x + (5 if lane.directed else 0))}"/>{head}</g>'
        )
    ]


def _lane_label(drawing: Drawing, lane: Lane) -> str:
    first, last = sorted(
        (drawing.boxes[lane.subject].slot.row, drawing.boxes[lane.object].slot.row)
    )
    gap = (first + last) // 2
    y = (drawing.row_y(gap) + BOX + drawing.row_y(gap + 1)) / 2
    x, width = drawing.lane_middle(lane), text_width(lane.label, EDGE) + 6
    return (
        f'<g class="{_lane_class(drawing, lane)}"><rect class="fg-paper" x="{_n(x - width / 2)}" '
        f'y="{_n(y - 7)}" width="{_n(width)}" height="14"/>'
        f'<text x="{_n(x)}" y="{_n(y + 3.5)}">{escape(lane.label)}</text></g>'
    )


def _node(box: Box, pointed: str = "") -> str:
    """One box; `pointed` is the id that a picture beside it knows it by."""
    kind = f" fg-{box.kind}" if box.kind else ""
    changed = " fg-haschanged" if any(c.kind == "changed" for c in box.chips) else ""
    width = box.right - box.x
    place = '">'
    if pointed:
        said = escape(box.hint)
        place = (
            f' fg-placed" tabindex="0" role="img" data-node="{escape(pointed)}" '
            f'aria-label="{said}">'
        )
    parts = [
        (
            f'<g class="fg-node{kind}{changed}{place}<title>{escape(box.hint)}</title>'
            f'<rect class="fg-box" x="{_n(box.x)}" y="{_n(box.y)}" width="{_n(width)}" '
            f'height="{_n(BOX)}" rx="7"/>'
            f'<text class="fg-name" x="{_n(box.x + 9)}" y="{_n(box.middle + 4.5)}">'
            f"{escape(box.name)}</text>"
        )
    ]
    x = box.x + 13 + box.name_width
    for chip in box.chips:
        kind = f" fg-{chip.kind}" if chip.kind else ""
        parts.append(
            f'<g class="fg-chip{kind}"><title>{escape(chip.hint)}</title>'
            f'<rect x="{_n(x)}" y="{_n(box.middle - 8.5)}" width="{_n(chip.width)}" '
            f'height="17" rx="8.5"/>'
            f'<text x="{_n(x + chip.width / 2)}" y="{_n(box.middle + 3.8)}">'
            f"{escape(chip.text)}</text></g>"
        )
        x += chip.width + 4
    return "".join(parts) + "</g>"


def _n(value: float) -> str:
    return f"{value:.1f}".removesuffix(".0")
