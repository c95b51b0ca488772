"""Where the nodes and edges of two scene graphs go, so that equal things share a row.

Called by `graph_svg.py`. Support and containment make a tree that reads downwards (parents above
children, one node a row); both graphs are laid into the union of their trees, so that matched nodes
stand side by side and a difference shows as a gap. Everything else runs beside the tree in lanes.
"""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from forestall.report.drawn import Drawn
from forestall.types.facts import GRIPPER
from forestall.types.graph import ObjectNode, Relation, SceneGraph
from forestall.types.verdict import Change, Discrepancy

_WIDTHS = (
    (0.30, "ijltfI|.,:;'!()[]- "),
    (0.38, 'r"/\\*'),
    (0.70, "ABCDGHKNOQRUVXY&"),
    (0.88, "mwMW@%"),
)

Chain = tuple[str, ...]


@dataclass(frozen=True, slots=True)
class Slot:
    """One row: the node that stands there in each graph (None: not there)."""

    path: Chain
    row: int
    depth: int
    observed: str | None
    expected: str | None

    def node(self, side: str) -> str | None:
        """Id of the node of one side."""
        return self.observed if side == "observed" else self.expected


@dataclass(frozen=True, slots=True)
class Lane:
    """One lateral edge: rows, words, direction and whether only this side has it."""

    subject: str
    object: str
    label: str
    directed: bool
    changed: bool
    lane: int = 0


@dataclass(frozen=True)
class Side:
    """One graph with the ids of its nodes in common terms."""

    name: str
    graph: SceneGraph
    common: Mapping[str, str]  # id → the id shared by matched nodes of both sides
    drawn: Drawn
    parents: Mapping[str, Relation] = field(default_factory=dict)

    def path(self, node_id: str) -> Chain:
        """The chain of common ids from the root of the tree."""
        edge = self.parents.get(node_id)
        head = () if edge is None else self.path(edge.object)
        return (*head, self.common[node_id])


def text_width(text: str, size: float) -> float:
    """Estimated width of a text in a sans-serif face, on the safe side."""
    total = 0.0
    for char in text:
        if unicodedata.east_asian_width(char) in "WF":
            total += 1.05
        elif unicodedata.combining(char):
            continue
        else:
            total += next((w for w, chars in _WIDTHS if char in chars), 0.58)
    return total * size * 1.04


def clip(text: str, limit: int = 30) -> str:
    """A text that is not longer than `limit` characters."""
    return text if len(text) <= limit else text[: limit - 1] + "…"


def sides(
    observed: SceneGraph,
    expected: SceneGraph | None,
    matches: Sequence[tuple[str, str]],
    drawn: Drawn,
) -> tuple[Side, Side | None]:
    """Both graphs in common terms; without matches, nodes with the same id are the same."""
    ids = {n.id: n.id for n in observed.nodes}
    left = Side("observed", observed, ids, drawn, _parents(observed, drawn))
    if expected is None:
        return left, None
    pairs = {e: o for o, e in matches if observed.get(o) and expected.get(e)}
    if not pairs:
        pairs = {n.id: n.id for n in expected.nodes if n.id in ids}
    pairs[GRIPPER] = GRIPPER
    common = {n.id: pairs.get(n.id, f"{n.id} (expected)") for n in expected.nodes}
    return left, Side("expected", expected, common, drawn, _parents(expected, drawn))


def _parents(graph: SceneGraph, drawn: Drawn) -> dict[str, Relation]:
    """For each node the edge to its closest parent; cycles are cut."""
    edges: dict[str, list[Relation]] = {}
    for r in graph.relations:
        if r.predicate in drawn.tree and r.subject != r.object:
            edges.setdefault(r.subject, []).append(r)

    def ancestors(node_id: str) -> set[str]:
        found: set[str] = set()
        todo = [node_id]
        while todo:
            for r in edges.get(todo.pop(), ()):
                if r.object not in found:
                    found.add(r.object)
                    todo.append(r.object)
        return found

    chosen: dict[str, Relation] = {}
    for node_id in sorted(edges):
        best = min(
            edges[node_id],
            key=lambda r: (r.predicate != drawn.holding, -len(ancestors(r.object)), r),
        )
        climb: str | None = best.object
        while climb is not None and climb != node_id:
            climb = chosen[climb].object if climb in chosen else None
        if climb is None:
            chosen[node_id] = best
    return chosen


def slots(left: Side, right: Side | None) -> tuple[Slot, ...]:
    """The rows of both sides, the gripper and what it holds first."""
    places: dict[Chain, dict[str, str]] = {}
    for side in [left] if right is None else [left, right]:
        for n in side.graph.nodes:
            path = side.path(n.id)
            for end in range(1, len(path)):
                places.setdefault(path[:end], {})
            places.setdefault(path, {})[side.name] = n.id
    inner = {path[:-1] for path in places if len(path) > 1}

    def key(path: Chain) -> tuple[tuple[bool, bool, str], ...]:
        return tuple(
            (name != GRIPPER, path[: i + 1] not in inner, name) for i, name in enumerate(path)
        )

    return tuple(
        Slot(path, row, len(path) - 1, places[path].get("observed"), places[path].get("expected"))
        for row, path in enumerate(sorted(places, key=key))
    )


def lanes(side: Side, other: Side | None, said: Sequence[Discrepancy], limit: int) -> list[Lane]:
    """Edges beside the tree: all that differ, what stands in the way, then others up to `limit`."""
    lanes: dict[tuple[str, str], Lane] = {}
    for relation in sorted(beside(side), key=lambda r: (rank(side, other, said, r), r)):
        changed = differs(side, other, said, relation)
        pair = (relation.subject, relation.object)
        back = (relation.object, relation.subject)
        words = relation.predicate.replace("_", " ")
        directed = relation.predicate not in side.drawn.symmetric
        place = pair if pair in lanes or directed or back not in lanes else back
        known = lanes.get(place)
        if known is not None and known.changed == changed:
            lanes[place] = Lane(
                *place, f"{known.label}, {words}", known.directed or directed, changed
            )
        elif known is None and (
            changed or relation.predicate == side.drawn.strong or len(lanes) < limit
        ):
            lanes[pair] = Lane(*pair, words, directed, changed)
    return list(lanes.values())


def rank(side: Side, other: Side | None, said: Sequence[Discrepancy], relation: Relation) -> int:
    """Which lateral edges are drawn first."""
    if differs(side, other, said, relation):
        return 0
    if relation.predicate == side.drawn.strong:
        return 1
    return 2 if relation.predicate in side.drawn.containing else 3


def beside(side: Side) -> list[Relation]:
    """Relations that are not edges of the tree, each said once, without what the tree implies."""
    tree = {(r.subject, r.object) for r in side.parents.values()}
    found: set[Relation] = set()
    for r in side.graph.relations:
        if (r.subject, r.object) in tree or r.subject == r.object:
            continue
        if r.predicate in side.drawn.mirror:
            r = Relation(r.object, side.drawn.mirror[r.predicate], r.subject)  # noqa: PLW2901
        elif r.predicate in side.drawn.symmetric and r.subject > r.object:
            r = Relation(r.object, r.predicate, r.subject)  # noqa: PLW2901
        line = {r.subject, r.object}
        implied = r.predicate != side.drawn.strong and any(
            line <= set(_chain(side, end)) for end in sorted(line)
        )
        if not implied:
            found.add(r)
    return sorted(found)


def _chain(side: Side, node_id: str) -> list[str]:
    chain = [node_id]
    while (edge := side.parents.get(chain[-1])) is not None:
        chain.append(edge.object)
    return chain


def differs(
    side: Side, other: Side | None, said: Sequence[Discrepancy], relation: Relation
) -> bool:
    """Whether an edge is missing on the other side in a way that matters.

    Support, containment, holding and blocking count by themselves; the others only where a
    discrepancy speaks of them, because they differ between any two rooms.
    """
    if other is None:
        return False
    if relation.predicate in (*side.drawn.tree, side.drawn.strong):
        theirs = {
            (other.common[r.subject], r.predicate, other.common[r.object])
            for r in other.graph.relations
        }
        common = side.common
        return (common[relation.subject], relation.predicate, common[relation.object]) not in theirs
    kind = Change.EXTRA_RELATION if side.name == "observed" else Change.MISSING_RELATION
    return any(_speaks_of(d, relation, side.drawn) for d in said if d.change is kind)


def _speaks_of(discrepancy: Discrepancy, relation: Relation, drawn: Drawn) -> bool:
    text = f"{discrepancy.text} {discrepancy.observed} {discrepancy.expected}".replace("_", " ")
    names = (relation.subject, relation.object)
    mirrored = [k for k, v in drawn.mirror.items() if v == relation.predicate]
    words = [p.replace("_", " ") for p in (relation.predicate, *mirrored)]
    return any(w in text for w in words) and all(
        re.search(rf"(?<![\w-]){re.escape(n.replace('_', ' '))}(?![\w-])", text) for n in names
    )


def changed_states(node: ObjectNode, partner: ObjectNode | None) -> frozenset[str]:
    """Attributes whose values are known on both sides and differ."""
    if partner is None:
        return frozenset()
    theirs = dict(partner.states)
    return frozenset(a for a, v in node.states if v is not None and theirs.get(a) not in (None, v))


def assign_lanes(found: Sequence[Lane], rows: Mapping[str, int]) -> list[Lane]:
    """Give each lateral edge a lane in which nothing else crosses its rows, short edges first."""
    taken: list[list[tuple[int, int]]] = []
    result = []

    def span(lane: Lane) -> tuple[int, int]:
        a, b = rows[lane.subject], rows[lane.object]
        return (min(a, b), max(a, b))

    for lane in sorted(found, key=lambda x: (span(x)[1] - span(x)[0], span(x), x.label)):
        low, high = span(lane)
        free = next(
            (i for i, spans in enumerate(taken) if all(high < s or low > e for s, e in spans)),
            len(taken),
        )
        if free == len(taken):
            taken.append([])
        taken[free].append((low, high))
        result.append(
            Lane(lane.subject, lane.object, lane.label, lane.directed, lane.changed, free)
        )
    return result
