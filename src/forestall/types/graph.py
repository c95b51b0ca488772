"""The 3D scene graph (paper, Sec. 3 "3D Scene Graph Construction").

World frame: right-handed, metres, z up. A graph is frozen; nodes and relations are sorted, so two
equal graphs have equal text, JSON and hashes.
"""

from __future__ import annotations

import base64
import math
from collections import Counter
from collections.abc import Collection
from dataclasses import dataclass, field, fields
from enum import Enum
from operator import attrgetter
from typing import TYPE_CHECKING, Any

from forestall.errors import FileFormatError, InputError
from forestall.reading.fields import Field
from forestall.types.drawing import html_of
from forestall.types.facts import GRIPPER
from forestall.types.observation import Vec3
from forestall.types.plan import Subtask

if TYPE_CHECKING:
    import networkx as nx

GRAPH_FORMAT = 1

MOST_NODES = 2000
MOST_RELATIONS = 20_000
"""How much a graph that is read may hold: a room has a hundred things, and matching is cubic."""


class Seen(Enum):
    """How a node came into the graph."""

    VISIBLE = "visible"  # in a view of this boundary
    REMEMBERED = "remembered"  # seen before; nothing since says that it has gone
    UNOBSERVED = "unobserved"  # known to be somewhere that no view can reach now


@dataclass(frozen=True, slots=True)
class Box:
    """Axis-aligned box in the world, metres."""

    low: Vec3
    high: Vec3

    def __post_init__(self) -> None:
        if not all(a <= b for a, b in zip(self.low, self.high, strict=True)):  # NaN is no order
            raise InputError(f"box corners are out of order: {self.low} > {self.high}")

    @property
    def size(self) -> Vec3:
        """Edge lengths."""
        (a, b, c), (d, e, f) = self.low, self.high
        return (d - a, e - b, f - c)

    @property
    def centre(self) -> Vec3:
        """Midpoint."""
        (a, b, c), (d, e, f) = self.low, self.high
        return ((a + d) / 2, (b + e) / 2, (c + f) / 2)

    def away_m(self, point_m: Vec3) -> float:
        """How far a point is from the box, 0 within."""
        edges = zip(self.low, point_m, self.high, strict=True)
        return math.hypot(*(max(a - p, p - b, 0.0) for a, p, b in edges))


@dataclass(frozen=True, slots=True)
class ObjectNode:
    """One object: stable id, category, states (value None: unobserved), where and how seen.

    `centroid_m` and `box_m` are None when the object was never located. `pixels` counts the mask
    pixels of the newest view that saw it. `feature` is what an image encoder made of its largest
    crop in the newest observation that saw it, as `types/feature.py` quantises it; which encoder
    stands in the record of the perception. `presumed` is what the skills that were carried out
    should have made of states that nobody has read since: plans take it as an assumption, nothing
    else does. `unseen_m2` is how much of its surface, in square metres, no view has shown where
    other things stand in between: who looks for a thing that nobody has seen goes there.
    """

    id: str
    category: str
    states: tuple[tuple[str, str | None], ...] = ()
    centroid_m: Vec3 | None = None
    box_m: Box | None = None
    seen: Seen = Seen.VISIBLE
    pixels: int = 0
    last_seen_s: float = 0.0
    feature: bytes | None = field(default=None, repr=False)
    presumed: tuple[tuple[str, str], ...] = ()
    unseen_m2: float = 0.0

    def __post_init__(self) -> None:
        object.__setattr__(self, "states", tuple(sorted(self.states)))
        object.__setattr__(self, "presumed", tuple(sorted(self.presumed)))
        if self.feature is not None and not any(self.feature):
            raise InputError(f"the image feature of {self.id} is empty or all zero")

    def __hash__(self) -> int:
        return hash(self.id)

    def state(self, attribute: str) -> str | None:
        """The value of an attribute, None when unobserved or not an attribute of this object."""
        return dict(self.states).get(attribute)

    def label(self) -> str:
        """Category with its known states: "Nut (clean, tight)"."""
        known = [v for _, v in self.states if v is not None]
        return f"{self.category} ({', '.join(known)})" if known else self.category


@dataclass(frozen=True, slots=True, order=True)
class Relation:
    """A directed labelled edge."""

    subject: str
    predicate: str
    object: str

    def __str__(self) -> str:
        return f"{self.subject} {self.predicate.replace('_', ' ')} {self.object}"


_OF_A_NODE = tuple(f.name for f in fields(ObjectNode))
"""The keys of a node in JSON, as `_node_json` writes them."""

_IN_ORDER = attrgetter("subject", "predicate", "object")


@dataclass(frozen=True, slots=True)
class SceneGraph:
    """Objects, the gripper, relations, and one subtask node tied to nothing.

    Args:
        nodes: object nodes; the gripper is the node "gripper" when present.
        relations: edges between nodes; what is held has one to the hand.
        subtask: the subtask that this graph was made for.
        hidden: ids of containers whose inside no view could reach; what is in them is unobserved.
            Also of things in sight that nothing locates: where they are is unobserved, too.

    Raises:
        InputError: an id twice, an edge to a node that is not there.
    """

    nodes: tuple[ObjectNode, ...]
    relations: tuple[Relation, ...] = ()
    subtask: Subtask | None = None
    hidden: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        object.__setattr__(self, "nodes", tuple(sorted(self.nodes, key=lambda n: n.id)))
        object.__setattr__(self, "relations", tuple(sorted(set(self.relations), key=_IN_ORDER)))
        object.__setattr__(self, "hidden", tuple(sorted(set(self.hidden))))
        ids = {n.id for n in self.nodes}
        if len(ids) != len(self.nodes):
            twice = sorted(i for i, n in Counter(n.id for n in self.nodes).items() if n > 1)
            raise InputError(f"node ids must be unique; twice: {', '.join(twice)}")
        for r in self.relations:
            for end in (r.subject, r.object):
                if end not in ids:
                    raise InputError(f"relation '{r}' names {end!r}, which is not a node")
        for h in self.hidden:
            if h not in ids:
                raise InputError(f"hidden names {h!r}, which is not a node")

    def _repr_html_(self) -> str:
        return html_of(self)

    def get(self, node_id: str) -> ObjectNode | None:
        """The node with this id, or None."""
        return next((n for n in self.nodes if n.id == node_id), None)

    def of_category(self, category: str) -> tuple[ObjectNode, ...]:
        """Every node of a category, in id order."""
        return tuple(n for n in self.nodes if n.category == category)

    def places(self) -> dict[str, Vec3 | None]:
        """Id → where it is believed to be, None where nobody knows."""
        return {n.id: n.centroid_m for n in self.nodes}

    def nearest(self, category: str, point_m: Vec3, within_m: float = math.inf) -> str | None:
        """The node of a category whose box is nearest to a point; of several its middle.

        Args:
            category: of the node.
            point_m: in the world.
            within_m: how far its box may be from the point.
        """
        found = [
            (away, math.dist(n.box_m.centre, point_m), n.id)
            for n in self.of_category(category)
            if n.box_m is not None and (away := n.box_m.away_m(point_m)) <= within_m
        ]
        return min(found, default=(0.0, 0.0, None))[2]

    def in_hands(self, hands: Collection[str]) -> tuple[str, ...]:
        """Ids of what hands hold: what is related to them, in whatever words of the domain.

        A domain names its hands: `Domain.robot.hands`.
        """
        return tuple(r.subject for r in self.relations if r.object in hands)

    def contents(self, node_id: str, containing: Collection[str]) -> tuple[str, ...]:
        """Ids of what is directly in, on or at a node, by the relations that say where things are.

        A domain has them: `Domain.containing`.
        """
        return tuple(
            r.subject for r in self.relations if r.object == node_id and r.predicate in containing
        )

    def parents(self, node_id: str, containing: Collection[str]) -> tuple[str, ...]:
        """Ids of what a node is directly in, on or at."""
        return tuple(
            r.object for r in self.relations if r.subject == node_id and r.predicate in containing
        )

    def matches(self, name: str) -> tuple[str, ...]:
        """Ids that a name can mean: the instance itself, or every node of that category."""
        if self.get(name) is not None:
            return (name,)
        return tuple(n.id for n in self.nodes if n.category == name)

    def text(self) -> str:
        """Readable text, one fact a line, sorted."""
        lines = [] if self.subtask is None else [f"subtask: {self.subtask}"]
        for n in self.nodes:
            if n.id != GRIPPER:
                how = "" if n.seen is Seen.VISIBLE else f" [{n.seen.value}]"
                lines.append(f"{n.id}: {n.label()}{how}")
        lines += [str(r) for r in self.relations]
        lines += [f"inside of {h}: unobserved" for h in self.hidden]
        return "\n".join(lines)

    def to_json(self, *, features: bool = True) -> dict[str, Any]:
        """Plain data for JSON.

        Args:
            features: write image features (base64) where nodes have them. Records of runs leave
                them out: graphs would grow by half, and those of a record are not compared again.
        """
        return {
            "format": GRAPH_FORMAT,
            "subtask": None if self.subtask is None else str(self.subtask),
            "nodes": [_node_json(n, features) for n in self.nodes],
            "relations": [[r.subject, r.predicate, r.object] for r in self.relations],
            "hidden": list(self.hidden),
        }

    @classmethod
    def from_json(cls, data: Any) -> SceneGraph:
        """Read what `to_json` wrote.

        Raises:
            FileFormatError: not a scene graph, another format version, a broken field, or one that
                no graph has.
            InputError: a dangling relation, or an id twice.
        """
        field = Field(data)
        if not isinstance(data, dict) or "nodes" not in data:
            raise FileFormatError("not a scene graph: an object with 'nodes' is expected")
        if data.get("format") != GRAPH_FORMAT:
            raise FileFormatError(
                f"scene graph format {data.get('format')!r}: this version reads {GRAPH_FORMAT}"
            )
        field.only(("format", *(f.name for f in fields(cls))), "entry of a scene graph")
        nodes = field["nodes"].at_most(MOST_NODES, lambda f: node_from(f.only(_OF_A_NODE)))
        relations = field.optional("relations", lambda f: f.at_most(MOST_RELATIONS, relation_from))
        return cls(
            nodes=nodes,
            relations=relations or (),
            subtask=field.optional("subtask", lambda f: f.parsed(Subtask.parse)),
            hidden=field.optional("hidden", lambda f: f.tuple_of(Field.name)) or (),
        )

    def to_networkx(self) -> nx.MultiDiGraph:
        """The same graph for networkx; attributes as in the JSON form."""
        import networkx as nx

        graph = nx.MultiDiGraph(subtask=None if self.subtask is None else str(self.subtask))
        for n in self.nodes:
            graph.add_node(n.id, category=n.category, states=dict(n.states), seen=n.seen.value)
        for r in self.relations:
            graph.add_edge(r.subject, r.object, key=r.predicate, predicate=r.predicate)
        return graph


def _node_json(node: ObjectNode, features: bool) -> dict[str, Any]:
    data = {
        "id": node.id,
        "category": node.category,
        "states": dict(node.states),
        "centroid_m": node.centroid_m,
        "box_m": None if node.box_m is None else [node.box_m.low, node.box_m.high],
        "seen": node.seen.value,
        "pixels": node.pixels,
        "last_seen_s": node.last_seen_s,
    }
    if features and node.feature is not None:
        data["feature"] = base64.b64encode(node.feature).decode("ascii")
    if node.presumed:
        data["presumed"] = dict(node.presumed)
    if node.unseen_m2:
        data["unseen_m2"] = round(node.unseen_m2, 4)
    return data


def node_from(field: Field) -> ObjectNode:
    """An object of a graph as `SceneGraph.to_json` wrote it.

    Raises:
        FileFormatError: a value that cannot be, with its place.
    """
    pixels, seen_s = field.optional("pixels", Field.whole), field.find("last_seen_s")
    unseen_m2 = field.find("unseen_m2")
    return ObjectNode(
        id=field["id"].name(),
        category=field["category"].name(),
        states=field.optional("states", lambda f: f.pairs(_value)) or (),
        centroid_m=field.optional("centroid_m", Field.vector),
        box_m=field.optional("box_m", _box),
        seen=field.optional("seen", lambda f: f.member(Seen)) or Seen.VISIBLE,
        pixels=pixels or 0,
        last_seen_s=0.0 if seen_s is None else seen_s.number(),
        feature=field.optional("feature", _feature),
        presumed=field.optional("presumed", lambda f: f.pairs(Field.name)) or (),
        unseen_m2=0.0 if unseen_m2 is None else unseen_m2.number(),
    )


def _value(field: Field) -> str | None:
    return None if field.value is None else field.name()


def _box(field: Field) -> Box:
    corners = field.tuple_of(Field.vector)
    if len(corners) != 2:
        field.fail("two corners, the low one and the high one,")
    return field.parsed(lambda _: Box(*corners))


def _feature(field: Field) -> bytes:
    field.text()
    feature: bytes = field.parsed(lambda text: base64.b64decode(text, validate=True))
    if not any(feature):
        field.fail("base64 of bytes that are not all zero")
    return feature


def relation_from(field: Field) -> Relation:
    """A relation: [subject, predicate, object]."""
    return Relation(*field.triple())
