"""Draws one scene graph, differences to another one marked; see `graph_layout.py` for the places.

A node is a rounded box with its name and its states; support, containment and holding are edges of
a tree that reads downwards; other relations run in lanes at the right. The gripper stands apart
above the tree, the subtask node above that, tied to nothing. The same input gives the same text.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from html import escape
from importlib.resources import files
from typing import Literal

from forestall.report.graph_layout import (
    Lane,
    Side,
    Slot,
    assign_lanes,
    beside,
    changed_states,
    clip,
    differs,
    lanes,
    sides,
    slots,
    text_width,
)
from forestall.types.facts import GRIPPER
from forestall.types.graph import ObjectNode, SceneGraph, Seen
from forestall.types.verdict import Change, Discrepancy

SideName = Literal["observed", "expected"]

_NAME, _CHIP, _EDGE = 13.0, 11.0, 10.5
_BOX, _PITCH, _INDENT, _MARGIN = 28.0, 40.0, 74.0, 6.0
_LANE_LIMIT = 5


@dataclass(frozen=True, slots=True)
class _Chip:
    text: str
    kind: str  # "", "changed" or "unknown"
    hint: str = ""

    @property
    def width(self) -> float:
        return text_width(self.text, _CHIP) + 12


@dataclass(frozen=True, slots=True)
class _Box:
    """A drawn row: a node, or a note that something expected is not there."""

    slot: Slot
    name: str
    kind: str  # "", "missing", "extra", "remembered", "unobserved", "ghost" or "hand"
    chips: tuple[_Chip, ...]
    x: float
    y: float  # top
    hint: str

    @property
    def name_width(self) -> float:
        return text_width(self.name, _NAME) * 1.12 + 5  # names are bold

    @property
    def right(self) -> float:
        return self.x + 18 + self.name_width + sum(c.width + 4 for c in self.chips)

    @property
    def middle(self) -> float:
        return self.y + _BOX / 2


def graph_css() -> str:
    """The style sheet of the drawings; follows the colour scheme of the reader."""
    return files("forestall.report").joinpath("templates/graph.css").read_text(encoding="utf-8")


def graph_svg(
    graph: SceneGraph,
    other: SceneGraph | None,
    matches: Sequence[tuple[str, str]],
    discrepancies: Sequence[Discrepancy],
    side: SideName,
    *,
    standalone: bool = False,
) -> str:
    """Draw `graph` as SVG.

    Args:
        graph: what to draw.
        other: the graph to compare it with, None to draw it unmarked.
        matches: (observed id, expected id) pairs; none: nodes with the same id are the same.
        discrepancies: differences to mark beside those that follow from the matches.
        side: whether `graph` is the observed or the expected one.
        standalone: carry namespace and style sheet along, for a file of its own.

    Returns:
        One `<svg>` element. Both sides of a pair come out with the same size and the same rows.
    """
    observed, expected = (graph, other) if side == "observed" else (other, graph)
    if observed is None:  # an expected graph alone is drawn like any single graph
        observed, expected = graph, None
    left, right = sides(observed, expected, matches)
    rows = slots(left, right)
    top = _top(left, right)
    drawings = [
        _Drawing(me, you, rows, discrepancies, top)
        for me, you in ((left, right), (right, left))
        if me is not None
    ]
    mine = drawings[-1] if side == "expected" and right is not None else drawings[0]
    width = max(d.width for d in drawings)
    height = max(d.height for d in drawings)
    return _element(mine, width, height, side, standalone)


def _top(left: Side, right: Side | None) -> float:
    shown = [s for s in (left, right) if s is not None]
    return _MARGIN + (44 if any(s.graph.subtask is not None for s in shown) else 0)


class _Drawing:
    """The boxes and lanes of one side."""

    def __init__(
        self,
        me: Side,
        you: Side | None,
        rows: Sequence[Slot],
        said: Sequence[Discrepancy],
        top: float,
    ) -> None:
        self.me, self.you, self.said, self.top = me, you, said, top
        self.apart = any(s.path[0] == GRIPPER for s in rows) and any(
            s.path[0] != GRIPPER for s in rows
        )
        self.hand_rows = sum(s.path[0] == GRIPPER for s in rows)
        boxes = [b for s in rows if (b := self._box(s)) is not None]
        self.boxes: Mapping[str, _Box] = {
            i: b for b in boxes if (i := b.slot.node(me.name)) is not None
        }
        self.ghosts = [b for b in boxes if b.slot.node(me.name) is None]
        found = lanes(me, you, said, _LANE_LIMIT)
        self.lanes = assign_lanes(found, {i: b.slot.row for i, b in self.boxes.items()})
        self.hidden = _left_out(me, found)
        self.lane_x = max((b.right for b in boxes), default=_MARGIN) + 22
        self.widths = [
            max(text_width(x.label, _EDGE) for x in self.lanes if x.lane == i) + 12
            for i in range(max((x.lane for x in self.lanes), default=-1) + 1)
        ]
        self.subtask = None if me.graph.subtask is None else f"next: {me.graph.subtask}"
        pill = 0.0 if self.subtask is None else text_width(self.subtask, _NAME) + 40
        note = text_width(self.note, _EDGE) if self.note else 0.0
        self.width = max(self.lane_x + sum(self.widths), pill, note + 20, 260.0) + _MARGIN
        self.bottom = self.row_y(len(rows)) - (_PITCH - _BOX)
        self.height = self.bottom + (26 if self.note else 8)

    @property
    def note(self) -> str:
        """What is in the graph and not in the drawing."""
        count = len(self.hidden)
        return f"{count} more relation{'s' * (count != 1)} not drawn" if count else ""

    def row_y(self, row: int) -> float:
        """Top of a row; the gripper's tree is set apart by a gap."""
        return self.top + row * _PITCH + (14 if self.apart and row >= self.hand_rows else 0)

    def lane_middle(self, lane: Lane) -> float:
        """Where a lane runs."""
        before = sum(self.widths[: lane.lane])
        return self.lane_x + before + self.widths[lane.lane] / 2

    def _box(self, slot: Slot) -> _Box | None:
        x, y = _MARGIN + slot.depth * _INDENT, self.row_y(slot.row)
        node_id = slot.node(self.me.name)
        if node_id is None:
            return self._ghost(slot, x, y)
        node = self.me.graph.get(node_id)
        assert node is not None
        partner = self._partner(node_id)
        chips = _chips(self.me.graph, node, changed_states(node, partner) | self._said(node))
        kind = self._kind(node, partner)
        return _Box(slot, clip(node.id), kind, chips, x, y, _hint(node, kind))

    def _ghost(self, slot: Slot, x: float, y: float) -> _Box | None:
        if self.me.name == "expected" or slot.expected is None:
            return None
        moved = slot.path[-1] in self.me.common.values()
        above = slot.path[:-1]
        if moved and above and above[-1] not in self.me.common.values():
            return None  # it went along with something that is missing anyway
        name = f"{clip(slot.expected)} expected here" if moved else f"no {clip(slot.expected)}"
        return _Box(slot, name, "ghost", (), x, y, "in the demonstration, not in the scene")

    def _partner(self, node_id: str) -> ObjectNode | None:
        if self.you is None:
            return None
        common = self.me.common[node_id]
        theirs = sorted(i for i, c in self.you.common.items() if c == common)
        return self.you.graph.get(theirs[0]) if theirs else None

    def _said(self, node: ObjectNode) -> frozenset[str]:
        """Attributes that a discrepancy names as changed on this node."""
        own = self._partner(node.id)
        names = {node.id} if own is None else {node.id, own.id}
        texts = [
            f"{d.text} {d.expected} {d.observed}"
            for d in self.said
            if d.change is Change.STATE and d.subject in names
        ]
        return frozenset(a for a, v in node.states if v and any(f"{a}=" in t for t in texts))

    def _kind(self, node: ObjectNode, partner: ObjectNode | None) -> str:
        if self.you is not None and partner is None:
            return "extra" if self.me.name == "observed" else "missing"
        if node.id == GRIPPER:
            return "hand"
        return "" if node.seen is Seen.VISIBLE else node.seen.value


def _left_out(me: Side, drawn: Sequence[Lane]) -> list[str]:
    shown = {
        (ends, word.strip())
        for x in drawn
        for ends in ((x.subject, x.object), (x.object, x.subject))
        for word in x.label.split(",")
    }
    return [
        str(r)
        for r in beside(me)
        if ((r.subject, r.object), r.predicate.replace("_", " ")) not in shown
    ]


def _hint(node: ObjectNode, kind: str) -> str:
    how = {"extra": "; not in the demonstration", "missing": "; not in the scene"}.get(kind, "")
    where = ""
    if node.centroid_m is not None:
        where = " at ({:.2f}, {:.2f}, {:.2f}) m".format(*node.centroid_m)
    return f"{node.id}: {node.label()}, {node.seen.value}{where}{how}"


def _chips(graph: SceneGraph, node: ObjectNode, changed: frozenset[str]) -> tuple[_Chip, ...]:
    known = [
        _Chip(clip(v, 18), "changed" if a in changed else "", a)
        for a, v in node.states
        if v is not None
    ]
    unknown = [a for a, v in node.states if v is None]
    if unknown:
        text = "?" if len(unknown) > 2 else ", ".join(f"{clip(a, 18)} ?" for a in unknown)
        known.append(_Chip(text, "unknown", f"not observed: {', '.join(unknown)}"))
    if node.id in graph.hidden:
        known.append(_Chip("inside ?", "unknown", "no view reaches the inside"))
    if node.id == GRIPPER and graph.holding is None:
        known.append(_Chip("empty", "", "holds nothing"))
    return tuple(known)


def _element(
    drawing: _Drawing, width: float, height: float, side: SideName, standalone: bool
) -> str:
    graph = drawing.me.graph
    label = f"{side} scene graph: {len(graph.nodes)} nodes, {len(graph.relations)} relations"
    space = ' xmlns="http://www.w3.org/2000/svg"' if standalone else ""
    parts = [
        f'<svg{space} class="fg" viewBox="0 0 {_n(width)} {_n(height)}" width="{_n(width)}" '
        f'height="{_n(height)}" role="img" aria-label="{escape(label)}">'
    ]
    if standalone:
        parts.append(f"<style>{graph_css()}</style>")
    parts += _head(drawing, width)
    parts += [_tree_edge(drawing, i) for i in sorted(drawing.boxes) if i in drawing.me.parents]
    parts += [_ghost_edge(drawing, b) for b in drawing.ghosts if b.slot.depth]
    parts += [part for x in drawing.lanes for part in _lane_line(drawing, x)]
    parts += [_lane_label(drawing, x) for x in drawing.lanes]
    parts += [_node(b) for _, b in sorted(drawing.boxes.items())]
    parts += [_node(b) for b in drawing.ghosts]
    if drawing.note:
        parts.append(
            f'<text class="fg-note" x="{_n(_MARGIN)}" y="{_n(drawing.bottom + 18)}">'
            f"{drawing.note}<title>{escape(chr(10).join(drawing.hidden))}</title></text>"
        )
    parts.append("</svg>")
    return "\n".join(p for p in parts if p)


def _head(drawing: _Drawing, width: float) -> list[str]:
    parts = []
    if drawing.subtask is not None:
        pill = text_width(drawing.subtask, _NAME) + 28
        parts.append(
            f'<g class="fg-subtask"><rect x="{_n(_MARGIN)}" y="4" width="{_n(pill)}" height="26" '
            f'rx="13"/><text x="{_n(_MARGIN + 14)}" y="21.5">{escape(drawing.subtask)}</text></g>'
        )
    if drawing.apart:
        y = _n(drawing.row_y(drawing.hand_rows) - 13)
        parts.append(
            f'<line class="fg-apart" x1="{_n(_MARGIN)}" y1="{y}" '
            f'x2="{_n(width - _MARGIN)}" y2="{y}"/>'
        )
    return parts


def _tree_edge(drawing: _Drawing, node_id: str) -> str:
    relation = drawing.me.parents[node_id]
    child, parent = drawing.boxes[node_id], drawing.boxes[relation.object]
    mark = ""
    if differs(drawing.me, drawing.you, drawing.said, relation):
        mark = " fg-extra" if drawing.me.name == "observed" else " fg-missing"
    words = relation.predicate.replace("_", " ")
    x, top = parent.x + 13, parent.y + _BOX
    middle = (x + child.x) / 2 + 2
    return (
        f'<g class="fg-edge{mark}"><title>{escape(str(relation))}</title>'
        f'<path d="M{_n(x)} {_n(top + 5)}V{_n(child.middle - 6)}q0 6 6 6H{_n(child.x)}"/>'
        f'<path class="fg-head" d="M{_n(x)} {_n(top)}l-4 7h8z"/>'
        f'<text x="{_n(middle)}" y="{_n(child.middle - 4)}">{words}</text></g>'
    )


def _ghost_edge(drawing: _Drawing, ghost: _Box) -> str:
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
        f'<g class="fg-edge fg-missing"><path d="M{_n(x)} {_n(above.y + _BOX)}'
        f'V{_n(ghost.middle - 6)}q0 6 6 6H{_n(ghost.x)}"/></g>'
    )


def _ports(drawing: _Drawing, lane: Lane) -> tuple[float, float]:
    """Heights at which a lane leaves its two boxes; several at one box are spread."""
    heights = []
    for end in (lane.subject, lane.object):
        here = [x for x in drawing.lanes if end in (x.subject, x.object)]
        step = min(6.0, 20.0 / max(1, len(here)))
        offset = (here.index(lane) - (len(here) - 1) / 2) * step
        heights.append(drawing.boxes[end].middle + offset)
    return heights[0], heights[1]


def _lane_class(drawing: _Drawing, lane: Lane) -> str:
    mark = (" fg-extra" if drawing.me.name == "observed" else " fg-missing") * lane.changed
    strong = " fg-blocking" if "blocking" in lane.label else ""
    return f"fg-lane{strong}{mark}"


def _lane_line(drawing: _Drawing, lane: Lane) -> list[str]:
    start, end = _ports(drawing, lane)
    from_x = drawing.boxes[lane.subject].right
    to_x = drawing.boxes[lane.object].right
    x = drawing.lane_middle(lane)
    bend = 6 if end > start else -6
    head = f'<path class="fg-head" d="M{_n(to_x)} {_n(end)}l7 -4v8z"/>' if lane.directed else ""
    words = f"{lane.subject} {lane.label} {lane.object}"
    return [
        f'<g class="{_lane_class(drawing, lane)}"><title>{escape(words)}</title>'
        f'<path d="M{_n(from_x)} {_n(start)}H{_n(x - 6)}q6 0 6 {bend}V{_n(end - bend)}'
        f'q0 {bend} -6 {bend}H{_n(to_x + (5 if lane.directed else 0))}"/>{head}</g>'
    ]


def _lane_label(drawing: _Drawing, lane: Lane) -> str:
    first, last = sorted(
        (drawing.boxes[lane.subject].slot.row, drawing.boxes[lane.object].slot.row)
    )
    gap = (first + last) // 2
    y = (drawing.row_y(gap) + _BOX + drawing.row_y(gap + 1)) / 2
    x, width = drawing.lane_middle(lane), text_width(lane.label, _EDGE) + 6
    return (
        f'<g class="{_lane_class(drawing, lane)}"><rect class="fg-paper" x="{_n(x - width / 2)}" '
        f'y="{_n(y - 7)}" width="{_n(width)}" height="14"/>'
        f'<text x="{_n(x)}" y="{_n(y + 3.5)}">{lane.label}</text></g>'
    )


def _node(box: _Box) -> str:
    kind = f" fg-{box.kind}" if box.kind else ""
    changed = " fg-haschanged" if any(c.kind == "changed" for c in box.chips) else ""
    width = box.right - box.x
    parts = [
        f'<g class="fg-node{kind}{changed}"><title>{escape(box.hint)}</title>'
        f'<rect class="fg-box" x="{_n(box.x)}" y="{_n(box.y)}" width="{_n(width)}" '
        f'height="{_n(_BOX)}" rx="7"/>'
        f'<text class="fg-name" x="{_n(box.x + 9)}" y="{_n(box.middle + 4.5)}">'
        f"{escape(box.name)}</text>"
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
