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
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

from forestall.errors import ForestallError, InputError
from forestall.types.demonstration import Demonstration, DemonstrationStep, View
from forestall.types.feature import whole_numbers
from forestall.types.graph import GRAPH_FORMAT, Box, ObjectNode, Relation, SceneGraph, Seen
from forestall.types.observation import Vec3
from forestall.types.plan import Subtask


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
    if encoded.digest != digest:
        raise DamageError(f"demonstration {name} is damaged: its content does not fit its hash")
    try:
        things = _unpack(encoded.things)
        if things["format"] != GRAPH_FORMAT:
            raise DamageError(
                f"demonstration {name} has graphs of format {things['format']!r}: "
                f"this version reads {GRAPH_FORMAT}"
            )
        nodes = [_node(n) for n in things["nodes"]]
        relations = [Relation(s, p, o) for s, p, o in things["relations"]]
        subtasks: dict[str, Subtask] = {}
        views = [_view(v) for v in things.get("views", [None] * len(encoded.steps))]
        final = things.get("final")
        steps = tuple(
            DemonstrationStep(
                index=s.index,
                subtask=_subtask(s.subtask, subtasks),
                graph=_graph(_unpack(s.graph), nodes, relations, subtasks),
                whole=_graph(_unpack(s.whole), nodes, relations, subtasks),
                image=s.image,
                view=view,
            )
            for s, view in zip(encoded.steps, views, strict=True)
        )
        last = None if final is None else _graph(final, nodes, relations, subtasks)
        perception = tuple((str(k), str(v)) for k, v in json.loads(encoded.perception))
    except (zlib.error, ValueError, KeyError, IndexError, TypeError, InputError) as error:
        raise DamageError(f"demonstration {name} is damaged: {error!r}") from error
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


def _view_json(view: View) -> dict[str, str | None]:
    image = None if view.image is None else base64.b64encode(view.image).decode("ascii")
    return {
        "image": image,
        "caption": view.caption,
        "encoder": view.encoder,
        "captioner": view.captioner,
    }


def _view(data: dict[str, Any] | None) -> View | None:
    if data is None:
        return None
    texts = (data["caption"], data["encoder"], data["captioner"])
    if not all(isinstance(t, str) for t in texts):
        raise DamageError("a stored view is no view")
    image = data["image"]
    if image is not None:
        image = base64.b64decode(image, validate=True)
        whole_numbers(image)
    return View(image, *texts)


def _node(data: dict[str, Any]) -> ObjectNode:
    box, centroid, feature = data["box_m"], data["centroid_m"], data.get("feature")
    return ObjectNode(
        id=data["id"],
        category=data["category"],
        states=tuple(data["states"].items()),
        centroid_m=None if centroid is None else _vec(centroid),
        box_m=None if box is None else Box(_vec(box[0]), _vec(box[1])),
        seen=Seen(data["seen"]),
        pixels=data["pixels"],
        last_seen_s=data["last_seen_s"],
        feature=None if feature is None else base64.b64decode(feature, validate=True),
    )


def _vec(values: Sequence[float]) -> Vec3:
    x, y, z = values
    return (x, y, z)


def _graph(
    data: dict[str, Any],
    nodes: Sequence[ObjectNode],
    relations: Sequence[Relation],
    subtasks: dict[str, Subtask],
) -> SceneGraph:
    """A graph from rising positions; checks what `SceneGraph` checks, without sorting again."""
    node_positions, relation_positions = data["nodes"], data["relations"]
    _check_rising(node_positions)
    _check_rising(relation_positions)
    mine = tuple([nodes[i] for i in node_positions])
    links = tuple([relations[i] for i in relation_positions])
    hidden = tuple(data["hidden"])
    ids = {n.id for n in mine}
    if len(ids) != len(mine) or not ids.issuperset(hidden):
        raise DamageError("a stored graph contradicts itself")
    if not all(r.subject in ids and r.object in ids for r in links):
        raise DamageError("a stored relation names a node that is not there")
    graph = object.__new__(SceneGraph)
    text = data["subtask"]
    object.__setattr__(graph, "nodes", mine)
    object.__setattr__(graph, "relations", links)
    object.__setattr__(graph, "subtask", None if text is None else _subtask(text, subtasks))
    object.__setattr__(graph, "hidden", hidden)
    return graph


def _check_rising(positions: Sequence[int]) -> None:
    if positions and (positions[0] < 0 or any(a >= b for a, b in pairwise(positions))):
        raise DamageError("a stored graph is out of order")


def _subtask(text: str, known: dict[str, Subtask]) -> Subtask:
    found = known.get(text)
    if found is None:
        found = known[text] = Subtask.parse(text)
    return found


def _dump(data: Any) -> str:
    return json.dumps(data, separators=(",", ":"), sort_keys=True)


def _pack(data: Any) -> bytes:
    return zlib.compress(_dump(data).encode(), 6)


def _unpack(blob: bytes) -> Any:
    return json.loads(zlib.decompress(blob))
