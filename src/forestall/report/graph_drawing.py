"""The boxes and lanes of one drawn graph, with their sizes; `graph_svg.py` turns them into SVG."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from forestall.report.graph_layout import (
    Lane,
    Side,
    Slot,
    assign_lanes,
    beside,
    changed_states,
    clip,
    lanes,
    text_width,
)
from forestall.types.facts import GRIPPER
from forestall.types.graph import ObjectNode, SceneGraph, Seen
from forestall.types.verdict import Change, Discrepancy

NAME, CHIP, EDGE = 13.0, 11.0, 10.5
BOX, PITCH, INDENT, MARGIN = 28.0, 40.0, 78.0, 6.0
_LANE_LIMIT = 5


@dataclass(frozen=True, slots=True)
class Chip:
    """One state of a node."""

    text: str
    kind: str  # "", "changed" or "unknown"
    hint: str = ""

    @property
    def width(self) -> float:
        """Of the pill."""
        return text_width(self.text, CHIP) + 12


@dataclass(frozen=True, slots=True)
class Box:
    """A drawn row: a node, or a note that something expected is not there."""

    slot: Slot
    name: str
    kind: str  # "", "missing", "extra", "remembered", "unobserved", "ghost" or "hand"
    chips: tuple[Chip, ...]
    x: float
    y: float  # top
    hint: str

    @property
    def name_width(self) -> float:
        """Of the name alone."""
        return text_width(self.name, NAME) * 1.12 + 5  # names are bold

    @property
    def right(self) -> float:
        """The right edge."""
        return self.x + 18 + self.name_width + sum(c.width + 4 for c in self.chips)

    @property
    def middle(self) -> float:
        """Half way down."""
        return self.y + BOX / 2


def head_room(left: Side, right: Side | None) -> float:
    """Where the rows begin: below the subtask node where one side has it."""
    shown = [s for s in (left, right) if s is not None]
    return MARGIN + (44 if any(s.graph.subtask is not None for s in shown) else 0)


class Drawing:
    """The boxes and lanes of one side."""

    def __init__(
        self,
        me: Side,
        you: Side | None,
        rows: Sequence[Slot],
        said: Sequence[Discrepancy],
        top: float,
        moment: str = "next",
    ) -> None:
        self.me, self.you, self.said, self.top = me, you, said, top
        self.apart = any(s.path[0] == GRIPPER for s in rows) and any(
            s.path[0] != GRIPPER for s in rows
        )
        self.hand_rows = sum(s.path[0] == GRIPPER for s in rows)
        boxes = [b for s in rows if (b := self._box(s)) is not None]
        self.boxes: Mapping[str, Box] = {
            i: b for b in boxes if (i := b.slot.node(me.name)) is not None
        }
        self.ghosts = [b for b in boxes if b.slot.node(me.name) is None]
        found = lanes(me, you, said, _LANE_LIMIT)
        self.lanes = assign_lanes(found, {i: b.slot.row for i, b in self.boxes.items()})
        self.hidden = _left_out(me, found)
        self.lane_x = max((b.right for b in boxes), default=MARGIN) + 22
        self.widths = [
            max(text_width(x.label, EDGE) for x in self.lanes if x.lane == i) + 12
            for i in range(max((x.lane for x in self.lanes), default=-1) + 1)
        ]
        self.subtask = None if me.graph.subtask is None else f"{moment}: {me.graph.subtask}"
        pill = 0.0 if self.subtask is None else text_width(self.subtask, NAME) + 40
        note = text_width(self.note, EDGE) if self.note else 0.0
        self.width = max(self.lane_x + sum(self.widths), pill, note + 20, 260.0) + MARGIN
        self.bottom = self.row_y(len(rows)) - (PITCH - BOX)
        self.height = self.bottom + (26 if self.note else 8)

    @property
    def note(self) -> str:
        """What is in the graph and not in the drawing."""
        count = len(self.hidden)
        return f"{count} more relation{'s' * (count != 1)} not drawn" if count else ""

    def row_y(self, row: int) -> float:
        """Top of a row; the gripper's tree is set apart by a gap."""
        return self.top + row * PITCH + (14 if self.apart and row >= self.hand_rows else 0)

    def lane_middle(self, lane: Lane) -> float:
        """Where a lane runs."""
        before = sum(self.widths[: lane.lane])
        return self.lane_x + before + self.widths[lane.lane] / 2

    def _box(self, slot: Slot) -> Box | None:
        x, y = MARGIN + slot.depth * INDENT, self.row_y(slot.row)
        node_id = slot.node(self.me.name)
        if node_id is None:
            return self._ghost(slot, x, y)
        node = self.me.graph.get(node_id)
        assert node is not None
        partner = self._partner(node_id)
        chips = _chips(self.me.graph, node, changed_states(node, partner) | self._said(node))
        kind = self._kind(node, partner)
        return Box(slot, clip(node.id), kind, chips, x, y, _hint(node, kind))

    def _ghost(self, slot: Slot, x: float, y: float) -> Box | None:
        if self.me.name == "expected" or slot.expected is None:
            return None
        moved = slot.path[-1] in self.me.common.values()
        above = slot.path[:-1]
        if moved and above and above[-1] not in self.me.common.values():
            return None  # it went along with something that is missing anyway
        name = f"{clip(slot.expected)} expected here" if moved else f"no {clip(slot.expected)}"
        return Box(slot, name, "ghost", (), x, y, "in the demonstration, not in the scene")

    def _partner(self, node_id: str) -> ObjectNode | None:
        if self.you is None:
            return None
        common = self.me.common[node_id]
        theirs = sorted(i for i, c in self.you.common.items() if c == common)
        return self.you.graph.get(theirs[0]) if theirs else None

    def _said(self, node: ObjectNode) -> frozenset[str]:
        """Attributes that a discrepancy names as changed on this node."""
        partner = self._partner(node.id)
        if partner is None:
            return frozenset()
        observed = node.id if self.me.name == "observed" else partner.id
        texts = [
            f"{d.text} {d.expected} {d.observed}"
            for d in self.said
            if d.change is Change.STATE and d.subject == observed
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


def _chips(graph: SceneGraph, node: ObjectNode, changed: frozenset[str]) -> tuple[Chip, ...]:
    known = [
        Chip(clip(v, 18), "changed" if a in changed else "", a)
        for a, v in node.states
        if v is not None
    ]
    unknown = [a for a, v in node.states if v is None]
    if unknown:
        text = "?" if len(unknown) > 2 else ", ".join(f"{clip(a, 18)} ?" for a in unknown)
        known.append(Chip(text, "unknown", f"not observed: {', '.join(unknown)}"))
    if node.id in graph.hidden:
        known.append(Chip("inside ?", "unknown", "no view reaches the inside"))
    if node.id == GRIPPER and not graph.in_hands((GRIPPER,)):
        known.append(Chip("empty", "", "holds nothing"))
    return tuple(known)
