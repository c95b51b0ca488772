"""Scene graphs as the arrays that scoring needs.

Called by score and batch; calls options, looks and the text encoder. Both ways of scoring read the
same arrays and the same table of similarities, so that they agree to the last bit: similarities
are rounded to multiples of 2^-24, which makes every sum of them exact in float64.
"""

from __future__ import annotations

import hashlib
import math
import re
import zlib
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from forestall.comparison.looks import NEVER, QUANTUM, Floats, Ints, Looks, looks_of
from forestall.comparison.options import CountedConfig, Feature
from forestall.domain.model import Domain
from forestall.seams.perceiving import TextEncoder
from forestall.types.facts import GRIPPER, category_of, is_instance
from forestall.types.graph import ObjectNode, SceneGraph

SUPPORT = "support"
_NUMBER = re.compile(r"-\d+\b")

Words = npt.NDArray[np.uint64]

Label = tuple[str, tuple[tuple[str, str], ...], str]
"""Category, known states that count, and the key of an instance category ("" otherwise)."""


def without_numbers(text: str) -> str:
    """Instance numbers taken out of a text: "insert Peg-1 Hole-2" → "insert Peg Hole"."""
    return _NUMBER.sub("", text)


def subtask_text(graph: SceneGraph, domain: Domain) -> str | None:
    """What the subtask node says, without instance numbers."""
    return None if graph.subtask is None else without_numbers(domain.words(graph.subtask))


@dataclass(frozen=True, slots=True, eq=False)
class Prepared:
    """One graph with n compared nodes and e compared edges.

    Args:
        names: (n) an id for each node; a merged support goes by the first of its members.
        members: (n) the ids behind each node.
        labels: (n) row in the label table.
        roles: (n) which argument of the subtask the node is, 0 for none.
        numbers: (n) hash of the id, for ties.
        around: (n, words) uint64 bit set of the node's surroundings, for ties; a bit for each that
            the table has numbered.
        edges: (e, 3) subject, predicate, object as indices.
        degree: (n) compared edges at each node.
        looks: image features of the nodes that have one; nothing unless they are compared.
        subtask: row of the subtask text in the label table, -1 for none.
        order: total order of graphs; the same score whichever is called observed rests on it.
    """

    names: tuple[str, ...]
    members: tuple[tuple[str, ...], ...]
    labels: Ints
    roles: Ints
    numbers: Ints
    around: Words
    edges: Ints
    degree: Ints
    looks: Looks
    subtask: int
    order: str


class LabelTable:
    """Distinct labels and their similarities; grows as labels are met."""

    def __init__(self, config: CountedConfig, encoder: TextEncoder, domain: Domain) -> None:
        self.domain = domain
        self._config = config
        self._apart = NEVER if config.feature is Feature.IMAGE else 0.0
        self._encoder = encoder
        self._labels: list[Label | str] = []
        self._index: dict[Label | str, int] = {}
        self._surroundings: dict[tuple[bool, int, str], int] = {}
        self._table: Floats = np.zeros((0, 0))
        self._vectors: dict[str, Floats] = {}
        self._cosines: dict[tuple[str, str], float] = {}

    def __len__(self) -> int:
        return len(self._labels)

    def row(self, label: Label | str) -> int:
        """The index of a label (a plain text is the label of a subtask node)."""
        found = self._index.get(label)
        if found is None:
            found = self._index[label] = len(self._labels)
            self._labels.append(label)
        return found

    def surrounding(self, subject: bool, predicate: int, category: str) -> int:
        """The number of what a node may have around it: being the subject (or object) of an edge.

        Args:
            subject: whether the node is the subject.
            predicate: of the edge.
            category: of the node at the other end.
        """
        return self._surroundings.setdefault(
            (subject, predicate, category), len(self._surroundings)
        )

    def similarities(self) -> Floats:
        """(labels, labels) cosine of text features, 0 below the floor.

        Where the two may not match it is 0, too, or `NEVER` when images are compared.
        """
        old, size = len(self._table), len(self._labels)
        if old == size:
            return self._table
        table = np.zeros((size, size))
        table[:old, :old] = self._table
        for i in range(old, size):
            for j in range(i + 1):
                table[i, j] = table[j, i] = self._similarity(self._labels[i], self._labels[j])
        self._table = table
        return table

    def _similarity(self, a: Label | str, b: Label | str) -> float:
        """Cosine of two features, rounded; 0 or `NEVER` where the two may not match."""
        config = self._config
        if isinstance(a, str) or isinstance(b, str):
            both = isinstance(a, str) and isinstance(b, str)
            cosine = self._cosine(str(a), str(b)) if both else 0.0
            return self._floored(cosine, config.subtask_floor)
        if a[2] != b[2] or (a[0] == GRIPPER) != (b[0] == GRIPPER):
            return self._apart
        common = {k for k, _ in a[1]} & {k for k, _ in b[1]}
        states_a, states_b = ([v for k, v in x[1] if k in common] for x in (a, b))
        if states_a != states_b and not config.state_changes_match:
            return self._apart
        if config.feature is Feature.TEXT:
            texts = (_label_text(a[0], states_a), _label_text(b[0], states_b))
            return self._floored(self._cosine(*texts), config.floor)
        share = config.state_weight
        kind = (1.0 - share) * self._cosine(a[0], b[0])
        if kind + share < config.floor - QUANTUM:
            return 0.0
        states = share * self._cosine(", ".join(states_a), ", ".join(states_b))
        return self._floored(kind + states, config.floor)

    def _floored(self, cosine: float, floor: float) -> float:
        rounded = min(round(cosine / QUANTUM) * QUANTUM, 1.0)
        return rounded if rounded >= floor else 0.0

    def _cosine(self, a: str, b: str) -> float:
        if a == b:
            return 1.0
        key = (a, b) if a < b else (b, a)
        found = self._cosines.get(key)
        if found is None:
            found = self._cosines[key] = float(self._vector(key[0]) @ self._vector(key[1]))
        return found

    def _vector(self, text: str) -> Floats:
        found = self._vectors.get(text)
        if found is None:
            row = self._encoder.encode([text])[0].astype(np.float64)
            found = self._vectors[text] = row / np.linalg.norm(row)
        return found


def _label_text(category: str, states: list[str]) -> str:
    return f"{category} ({', '.join(states)})" if states else category


def prepare(graph: SceneGraph, config: CountedConfig, table: LabelTable) -> Prepared:
    """The arrays of one graph."""
    roles = {} if graph.subtask is None else {a: i + 1 for i, a in enumerate(graph.subtask.args)}
    groups: dict[str, list[ObjectNode]] = {}
    place: dict[str, str] = {}
    for node in graph.nodes:
        merged = config.generic_supports and config.merge_supports and _is_support(node, config)
        key = SUPPORT if merged else f"={node.id}"
        groups.setdefault(key, []).append(node)
        place[node.id] = key
    keys = sorted(groups, key=lambda k: groups[k][0].id)
    position = {key: i for i, key in enumerate(keys)}
    labels = [_label(groups[k][0], config, roles) for k in keys]
    edges = sorted(
        {
            (
                position[place[r.subject]],
                config.predicates.index(r.predicate),
                position[place[r.object]],
            )
            for r in graph.relations
            if r.predicate in config.predicates and place[r.subject] != place[r.object]
        }
    )
    degree = [0] * len(keys)
    around = [0] * len(keys)
    for s, p, o in edges:
        degree[s] += 1
        degree[o] += 1
        around[s] |= 1 << table.surrounding(True, p, labels[o][0])
        around[o] |= 1 << table.surrounding(False, p, labels[s][0])
    rows = [table.row(label) for label in labels]
    features = _features([groups[k][0] for k in keys], config)
    seen = hashlib.blake2b(repr(features).encode()).hexdigest() if any(features) else ""
    text = subtask_text(graph, table.domain) if config.subtask_node else None
    subtask = -1 if text is None else table.row(text)
    role_codes = [max(roles.get(n.id, 0) for n in groups[k]) for k in keys]
    numbers = [zlib.crc32(groups[k][0].id.encode()) for k in keys]
    return Prepared(
        names=tuple(groups[k][0].id for k in keys),
        members=tuple(tuple(n.id for n in groups[k]) for k in keys),
        labels=np.array(rows, dtype=np.int64),
        roles=np.array(role_codes, dtype=np.int64),
        numbers=np.array(numbers, dtype=np.int64),
        around=_words(around),
        edges=np.array(edges, dtype=np.int64).reshape(-1, 3),
        degree=np.array(degree, dtype=np.int64),
        looks=looks_of(features),
        subtask=subtask,
        order=repr(
            (len(keys), labels, text, role_codes, [groups[k][0].id for k in keys], edges, seen)
        ),
    )


def _is_support(node: ObjectNode, config: CountedConfig) -> bool:
    return node.category in config.supports


def _features(nodes: Sequence[ObjectNode], config: CountedConfig) -> list[bytes | None]:
    """Image features that count: not those of supports that compare as one category."""
    if config.feature is not Feature.IMAGE:
        return []
    apart = not config.generic_supports
    return [n.feature if apart or not _is_support(n, config) else None for n in nodes]


def _label(node: ObjectNode, config: CountedConfig, roles: dict[str, int]) -> Label:
    category = node.category
    if node.id == GRIPPER:
        category = GRIPPER
    elif config.generic_supports and _is_support(node, config):
        return (SUPPORT, (), "")
    ignored = config.ignored_attributes
    states = tuple((a, v) for a, v in node.states if v is not None and a not in ignored)
    key = ""
    if category in config.instance_categories:
        role = roles.get(node.id, 0)
        number = node.id[len(category_of(node.id)) + 1 :] if is_instance(node.id) else node.id
        key = f"argument {role}" if role else f"number {number}"
    return (category, states, key)


def _words(sets: Sequence[int]) -> Words:
    """(n, words) of sets of bits, as many words as the largest needs."""
    size = max(1, math.ceil(max((x.bit_length() for x in sets), default=0) / 64))
    whole = b"".join(x.to_bytes(8 * size, "little") for x in sets)
    return np.frombuffer(whole, dtype="<u8").reshape(-1, size).astype(np.uint64)


def widened(words: Words, size: int) -> Words:
    """The same sets in (..., size) words, or in as many as they have."""
    lacking = max(0, size - words.shape[-1])
    return np.pad(words, [(0, 0)] * (words.ndim - 1) + [(0, lacking)]) if lacking else words


def ties(observed: Prepared, expected: Prepared) -> Floats:
    """(n_obs, n_exp) values that decide between equally similar nodes, see `tie_values`."""
    role = (observed.roles[:, None] == expected.roles) & (expected.roles > 0)
    same = observed.numbers[:, None] == expected.numbers
    return tie_values(role, observed.around[:, None], expected.around[None, :], same)


def tie_values(
    role: npt.NDArray[np.bool_], ours: Words, theirs: Words, same: npt.NDArray[np.bool_]
) -> Floats:
    """Whole numbers below 1024: the same argument first, then alike surroundings, then the id.

    Args:
        role: (...) whether both are the same argument of the subtask.
        ours: (..., words) surroundings of the one.
        theirs: (..., words) of the other; their numbers of words may differ.
        same: (...) whether both have the same id.
    """
    size = max(ours.shape[-1], theirs.shape[-1])
    ours, theirs = widened(ours, size), widened(theirs, size)
    both = np.bitwise_count(ours & theirs).sum(axis=-1, dtype=np.int64)
    either = np.bitwise_count(ours | theirs).sum(axis=-1, dtype=np.int64)
    alike = (255 * (both + 1)) // (either + 1)
    values: Floats = (512 * role + 2 * alike + same).astype(np.float64)
    return values
