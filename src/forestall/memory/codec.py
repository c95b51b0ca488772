"""Demonstrations as compressed JSON and back.

Called by the store; calls nothing. The steps of one run share most of their nodes and relations, so
each distinct one is written once, in sorted order, and a graph is lists of rising positions in
them. That makes reading fast: whatever rises is sorted and unique already. What not every run has
(image features of nodes, views of pictures, what was known after the last step) is written where it
is, beside what the graphs share, so files with and without are of one format.
"""

from __future__ import annotations

import base64
import hashlib
import json
import zlib
from dataclasses import dataclass
from itertools import pairwise
from typing import Any, TypeVar

from forestall.errors import ForestallError, InputError
from forestall.reading.documents import parse_json
from forestall.reading.fields import Field
from forestall.reading.files import MOST_BYTES
from forestall.records.verdicts import view_from
from forestall.types.demonstration import Demonstration, DemonstrationStep, View
from forestall.types.feature import whole_numbers
from forestall.types.graph import (
    GRAPH_FORMAT,
    ObjectNode,
    Relation,
    SceneGraph,
    node_from,
    relation_from,
)
from forestall.types.plan import Subtask

T = TypeVar("T")


class DamageError(ForestallError):
    """A stored demonstration that does not say what it said when it was written."""


@dataclass(frozen=True, slots=True)
class EncodedStep:
    """One step as columns of the file."""

    index: int
    subtask: str
    graph: bytes
    whole: bytes
    image: str | None


@dataclass(frozen=True, slots=True)
class Encoded:
    """One demonstration as columns of the file; `digest` is the hash of its content.

    `things` is what the steps share, and what is there of the run but not of each step.
    """

    task: str
    scene: str
    seed: int
    version: str
    perception: str
    things: bytes
    steps: tuple[EncodedStep, ...]

    @property
    def digest(self) -> str:
        """Hash of everything but the id and the time of recording."""
        hasher = hashlib.blake2b(digest_size=16)
        head = [self.task, self.scene, self.seed, self.version, self.perception]
        hasher.update(json.dumps(head).encode())
        hasher.update(self.things)
        for s in self.steps:
            hasher.update(json.dumps([s.index, s.subtask, s.image, len(s.graph)]).encode())
            hasher.update(s.graph)
            hasher.update(s.whole)
        return hasher.hexdigest()


def encode(demonstration: Demonstration) -> Encoded:
    """The columns of a demonstration; equal demonstrations give equal bytes."""
    graphs = [g for s in demonstration.steps for g in (s.graph, s.whole)]
    last = () if demonstration.final is None else (demonstration.final,)
    forms = [g.to_json() for g in (*graphs, *last)]
    node_texts = sorted({(n["id"], _dump(n)) for f in forms for n in f["nodes"]})
    relations = sorted({tuple(r) for f in forms for r in f["relations"]})
    node_at = {text: i for i, (_, text) in enumerate(node_texts)}
    relation_at = {r: i for i, r in enumerate(relations)}
    columns = [
        {
            "subtask": f["subtask"],
            "nodes": [node_at[_dump(n)] for n in f["nodes"]],
            "relations": [relation_at[tuple(r)] for r in f["relations"]],
            "hidden": f["hidden"],
        }
        for f in forms
    ]
    blobs = [_pack(c) for c in columns[: len(graphs)]]
    things: dict[str, Any] = {
        "format": GRAPH_FORMAT,
        "nodes": [json.loads(text) for _, text in node_texts],
        "relations": relations,
    }
    if last:
        things["final"] = columns[-1]
    if any(s.view is not None for s in demonstration.steps):
        things["views"] = [
            None if s.view is None else _view_json(s.view) for s in demonstration.steps
        ]
    if any(s.observation is not None for s in demonstration.steps):
        things["observations"] = [s.observation for s in demonstration.steps]
    return Encoded(
        task=demonstration.task,
        scene=demonstration.scene,
        seed=demonstration.seed,
        version=demonstration.version,
        perception=_dump(list(demonstration.perception)),
        things=_pack(things),
        steps=tuple(
            EncodedStep(s.index, str(s.subtask), blobs[2 * i], blobs[2 * i + 1], s.image)
            for i, s in enumerate(demonstration.steps)
        ),
    )


def decode(encoded: Encoded, name: str, digest: str) -> Demonstration:
    """The demonstration behind the columns.

    Args:
        encoded: as read.
        name: its id.
        digest: what its content should hash to.

    Raises:
        DamageError: the content is not what was written.
    """
    _check_types(encoded, name)
    if encoded.digest != digest:
        raise DamageError(f"demonstration {name} is damaged: its content does not fit its hash")
    try:
        things = Field(_unpack(encoded.things), "things")
        if things["format"].value != GRAPH_FORMAT:
            raise DamageError(
                f"demonstration {name} has graphs of format {things['format'].value!r}: "
                f"this version reads {GRAPH_FORMAT}"
            )
        shared = _Shared(
            things["nodes"].tuple_of(node_from), things["relations"].tuple_of(relation_from), {}
        )
        views = things.find("views")
        looks = [None] * len(encoded.steps) if views is None else views.tuple_of(_view)
        if len(looks) != len(encoded.steps):
            raise DamageError(f"it has {len(encoded.steps)} steps and {len(looks)} views")
        kept = things.find("observations")
        seen = [None] * len(encoded.steps) if kept is None else kept.tuple_of(_hash)
        if len(seen) != len(encoded.steps):
            raise DamageError(f"it has {len(encoded.steps)} steps and {len(seen)} observations")
        steps = tuple(
            DemonstrationStep(
                index=s.index,
                subtask=shared.subtask(s.subtask),
                graph=_graph(Field(_unpack(s.graph), f"step {s.index}"), shared),
                whole=_graph(Field(_unpack(s.whole), f"step {s.index}, whole"), shared),
                image=s.image,
                view=view,
                observation=observation,
            )
            for s, view, observation in zip(encoded.steps, looks, seen, strict=True)
        )
        last = things.optional("final", lambda f: _graph(f, shared))
        perception = Field(parse_json(encoded.perception), "perception").tuple_of(_pair)
    except (zlib.error, InputError, DamageError) as error:
        raise DamageError(f"demonstration {name} is damaged: {error}") from error
    return Demonstration(
        task=encoded.task,
        scene=encoded.scene,
        seed=encoded.seed,
        steps=steps,
        perception=perception,
        version=encoded.version,
        id=name,
        final=last,
    )


def _check_types(encoded: Encoded, name: str) -> None:
    """A file that is no longer what was written may have anything in a column."""
    columns: list[tuple[str, Any, type | tuple[type, ...]]] = [
        (key, getattr(encoded, key), str) for key in ("task", "scene", "version", "perception")
    ]
    columns += [("seed", encoded.seed, int), ("things", encoded.things, bytes)]
    for s in encoded.steps:
        columns += [
            ("number", s.index, int),
            ("subtask", s.subtask, str),
            ("graph", s.graph, bytes),
        ]
        columns += [("whole", s.whole, bytes), ("image", s.image, (str, type(None)))]
    for column, value, kind in columns:
        if not isinstance(value, kind):
            raise DamageError(
                f"demonstration {name} is damaged: its column {column} holds a "
                f"{type(value).__name__}"
            )


def _view_json(view: View) -> dict[str, str | None]:
    image = None if view.image is None else base64.b64encode(view.image).decode("ascii")
    return {
        "image": image,
        "caption": view.caption,
        "encoder": view.encoder,
        "captioner": view.captioner,
    }


def _view(field: Field) -> View | None:
    view = None if field.value is None else view_from(field)
    if view is not None and view.image is not None:
        whole_numbers(view.image)
    return view


def _hash(field: Field) -> str | None:
    return None if field.value is None else field.text()


def _pair(field: Field) -> tuple[str, str]:
    both = field.items()
    if len(both) != 2:
        field.fail("a pair")
    return both[0].text(), str(both[1].value)


@dataclass(frozen=True, slots=True)
class _Shared:
    """What the graphs of one run share."""

    nodes: tuple[ObjectNode, ...]
    relations: tuple[Relation, ...]
    subtasks: dict[str, Subtask]

    def subtask(self, text: str) -> Subtask:
        found = self.subtasks.get(text)
        if found is None:
            found = self.subtasks[text] = Subtask.parse(text)
        return found


def _graph(field: Field, shared: _Shared) -> SceneGraph:
    """A graph from rising positions; checks what `SceneGraph` checks, without sorting again."""
    mine = _at(field["nodes"], shared.nodes)
    links = _at(field["relations"], shared.relations)
    hidden = field["hidden"].tuple_of(Field.name)
    ids = {n.id for n in mine}
    if len(ids) != len(mine) or not ids.issuperset(hidden):
        raise DamageError("a stored graph contradicts itself")
    if not all(r.subject in ids and r.object in ids for r in links):
        raise DamageError("a stored relation names a node that is not there")
    graph = object.__new__(SceneGraph)
    object.__setattr__(graph, "nodes", mine)
    object.__setattr__(graph, "relations", links)
    subtask = field.maybe("subtask", lambda f: shared.subtask(f.text()))
    object.__setattr__(graph, "subtask", subtask)
    object.__setattr__(graph, "hidden", hidden)
    return graph


def _at(field: Field, things: tuple[T, ...]) -> tuple[T, ...]:
    """The things at rising positions."""
    positions = field.value
    if not isinstance(positions, list) or not all(type(p) is int for p in positions):
        field.fail("a list of positions")
    if positions and (positions[0] < 0 or positions[-1] >= len(things)):
        raise DamageError("a stored graph names what is not there")
    if any(a >= b for a, b in pairwise(positions)):
        raise DamageError("a stored graph is out of order")
    return tuple([things[i] for i in positions])


def _dump(data: Any) -> str:
    return json.dumps(data, separators=(",", ":"), sort_keys=True)


def _pack(data: Any) -> bytes:
    return zlib.compress(_dump(data).encode(), 6)


def _unpack(blob: bytes) -> Any:
    """What `_pack` packed; never more than a document may have, whatever it would unpack to."""
    unpacking = zlib.decompressobj()
    data = unpacking.decompress(blob, MOST_BYTES)
    if unpacking.unconsumed_tail or not unpacking.eof:
        raise DamageError(f"it is cut off, or unpacks to more than {MOST_BYTES} bytes")
    try:
        return parse_json(data.decode("utf-8"))
    except UnicodeDecodeError as error:
        raise DamageError("it is no text") from error
