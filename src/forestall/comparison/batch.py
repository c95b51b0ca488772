"""One observed graph against many expected ones, computed together.

Called by detection; calls prepare, looks and matching. The numbers are those of `score.compare` to
the last bit: the assignment is skipped only where every observed node has one best partner and no
two the same, which makes that the only optimum.
"""

from __future__ import annotations

import math
from collections import OrderedDict
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from forestall.comparison.discrepancy import differences
from forestall.comparison.looks import QUANTUM, Floats, Ints, Looks, joined, seen
from forestall.comparison.matching import assign, match, parts, weights
from forestall.comparison.options import (
    CountedConfig,
    DegreeScale,
    EmptyRule,
    Feature,
    ScoreConfig,
    StructureCount,
)
from forestall.comparison.prepare import (
    LabelTable,
    Prepared,
    Words,
    prepare,
    tie_values,
    widened,
)
from forestall.domain.model import Domain
from forestall.seams.perceiving import TextEncoder
from forestall.types.graph import SceneGraph
from forestall.types.verdict import Calibration, Decision, Reference, ScoreParts, Verdict


@dataclass(frozen=True, slots=True, eq=False)
class _Stack:
    """R prepared graphs, padded to M nodes."""

    graphs: tuple[Prepared, ...]
    nodes: Ints  # (R)
    edges: Ints  # (R)
    labels: Ints  # (R, M), -1 where there is no node
    roles: Ints  # (R, M)
    numbers: Ints  # (R, M)
    around: Words  # (R, M, words)
    degree: Ints  # (R, M)
    largest: Ints  # (R)
    looks: Looks  # of the R * M places
    subtask: Ints  # (R)
    linked: npt.NDArray[np.bool_]  # (R * P * M * M) edge there


@dataclass(frozen=True, slots=True, eq=False)
class BatchScores:
    """Scores of one graph against R; a part is NaN where it does not exist."""

    score: Floats
    node: Floats
    edge: Floats
    structure: Floats


class BatchScorer:
    """Scores a graph against every reference (implements `GraphScorer`).

    Reference graphs are prepared once and remembered, as are stacks of them.

    Args:
        config: the options of the score.
        encoder: embeds node labels and subtask texts.
        domain: which relations, states and categories count, and the words of skills.
        cache_size: how many prepared graphs are remembered.
    """

    def __init__(
        self, config: ScoreConfig, encoder: TextEncoder, domain: Domain, cache_size: int = 8192
    ) -> None:
        self.config = config.of(domain)
        self._domain = domain
        self._encoder = encoder
        self._table = LabelTable(self.config, encoder, domain)
        self._cache_size = cache_size
        self._prepared: OrderedDict[int, tuple[SceneGraph, Prepared]] = OrderedDict()
        self._stacks: OrderedDict[tuple[int, ...], tuple[tuple[SceneGraph, ...], _Stack]] = (
            OrderedDict()
        )

    def scores(self, observed: SceneGraph, expected: Sequence[SceneGraph]) -> list[ScoreParts]:
        """The score and its parts against each expected graph."""
        if not expected:
            return []
        result = self._batch(self._prepare(observed), self._stack(expected))
        columns = (result.score, result.node, result.edge, result.structure)
        return [
            ScoreParts(score, *(None if math.isnan(v) else v for v in rest))
            for score, *rest in zip(*(c.tolist() for c in columns), strict=True)
        ]

    def best(self, observed: SceneGraph, references: Sequence[Reference]) -> Verdict | None:
        """The nearest reference with its score; the decision is left to a detector.

        Among equal scores the reference that was retrieved first wins. The verdict says PROCEED at
        threshold 0, which every score reaches.
        """
        if not references:
            return None
        graphs = [r.graph for r in references]
        stack = self._stack(graphs)
        prepared = self._prepare(observed)
        winner = int(np.argmax(self._batch(prepared, stack).score))
        nearest = references[winner]
        other = stack.graphs[winner]
        matching = match(prepared, other, self._table.similarities(), self.config)
        return Verdict(
            decision=Decision.PROCEED,
            detector="score",
            score=(scored := parts(prepared, other, matching, self.config)).score,
            threshold=0.0,
            calibration=Calibration.UNCALIBRATED,
            parts=scored,
            nearest=nearest,
            matches=named_pairs(prepared, other, matching.pairs),
            discrepancies=differences(
                observed,
                nearest.graph,
                named_pairs(prepared, other, matching.pairs),
                self.config,
                self._domain,
            ),
            references=len(references),
        )

    def _prepare(self, graph: SceneGraph) -> Prepared:
        entry = self._prepared.get(id(graph))
        if entry is not None:
            self._prepared.move_to_end(id(graph))
            return entry[1]
        prepared = prepare(graph, self.config, self._table)
        self._prepared[id(graph)] = (graph, prepared)
        if len(self._prepared) > self._cache_size:
            self._prepared.popitem(last=False)
        return prepared

    def _stack(self, graphs: Sequence[SceneGraph]) -> _Stack:
        key = tuple(map(id, graphs))
        entry = self._stacks.get(key)
        if entry is not None:
            self._stacks.move_to_end(key)
            return entry[1]
        stack = _stacked([self._prepare(g) for g in graphs], len(self.config.predicates))
        self._stacks[key] = (tuple(graphs), stack)
        if len(self._stacks) > 32:
            self._stacks.popitem(last=False)
        return stack

    def _batch(self, observed: Prepared, stack: _Stack) -> BatchScores:
        table = self._table.similarities()
        padded = np.zeros((len(table), len(table) + 1))
        padded[:, :-1] = table
        partner, total = _partners(observed, stack, padded, self.config)
        matched = (partner >= 0).sum(axis=1)
        subtasks = (
            padded[observed.subtask, stack.subtask]
            if observed.subtask >= 0
            else np.zeros(len(stack.graphs))
        )
        matched = matched + (subtasks > 0)
        union = (
            len(observed.names)
            + stack.nodes
            + (observed.subtask >= 0)
            + (stack.subtask >= 0)
            - matched
        )
        config = self.config
        nothing = 1.0 if config.empty is EmptyRule.ONE else np.nan
        off = np.full(len(stack.graphs), np.nan)
        node = edge = structure = off
        if config.use_node:
            node = np.where(union > 0, (total + subtasks) / np.maximum(union, 1), nothing)
        if config.use_edge:
            found = _found_edges(observed, stack, partner, len(config.predicates))
            either = len(observed.edges) + stack.edges - found
            edge = np.where(either > 0, found / np.maximum(either, 1), nothing)
        if config.use_structure:
            structure = _structure(observed, stack, partner, matched, union, config)
            structure = np.where(union > 0, structure, nothing)
        return BatchScores(_mean(node, edge, structure), node, edge, structure)


def named_pairs(
    observed: Prepared, expected: Prepared, pairs: Sequence[tuple[int, int]]
) -> tuple[tuple[str, str], ...]:
    """Matched ids (observed, expected); merged supports are paired in the order of their ids."""
    return tuple(
        (a, b)
        for i, j in pairs
        for a, b in zip(observed.members[i], expected.members[j], strict=False)
    )


def _stacked(graphs: Sequence[Prepared], predicates: int) -> _Stack:
    nodes = np.array([len(g.names) for g in graphs], dtype=np.int64)
    size = int(nodes.max(initial=1)) or 1
    labels = np.full((len(graphs), size), -1, dtype=np.int64)
    roles, numbers, degree = (np.zeros((len(graphs), size), dtype=np.int64) for _ in range(3))
    words = max((g.around.shape[1] for g in graphs), default=1)
    around = np.zeros((len(graphs), size, words), dtype=np.uint64)
    linked = np.zeros((len(graphs), predicates, size, size), dtype=np.bool_)
    for r, g in enumerate(graphs):
        n = len(g.names)
        labels[r, :n], roles[r, :n], numbers[r, :n] = g.labels, g.roles, g.numbers
        around[r, :n], degree[r, :n] = widened(g.around, words), g.degree
        linked[r, g.edges[:, 1], g.edges[:, 0], g.edges[:, 2]] = True
    return _Stack(
        graphs=tuple(graphs),
        nodes=nodes,
        edges=np.array([len(g.edges) for g in graphs], dtype=np.int64),
        labels=labels,
        roles=roles,
        numbers=numbers,
        around=around,
        degree=degree,
        largest=degree.max(axis=1, initial=1),
        looks=joined([g.looks for g in graphs], size),
        subtask=np.array([g.subtask for g in graphs], dtype=np.int64),
        linked=linked.ravel(),
    )


def _partners(
    observed: Prepared, stack: _Stack, padded: Floats, config: CountedConfig
) -> tuple[Ints, Floats]:
    """(R, n) index of each observed node's partner or -1, and (R) their summed similarity."""
    size = len(observed.names)
    count = len(stack.graphs)
    if size == 0:
        return np.zeros((count, 0), dtype=np.int64), np.zeros(count)
    similarity = padded[observed.labels][:, stack.labels]  # (n, R, M)
    if config.feature is Feature.IMAGE:
        flat = similarity.reshape(size, -1)
        similarity = seen(flat, observed.looks, stack.looks, config.image_floor).reshape(
            similarity.shape
        )
    similarity = similarity.transpose(1, 0, 2)  # (R, n, M)
    r, i, j = np.nonzero(similarity)
    role = (observed.roles[i] == stack.roles[r, j]) & (observed.roles[i] > 0)
    same = observed.numbers[i] == stack.numbers[r, j]
    tie = tie_values(role, observed.around[i], stack.around[r, j], same)
    weight = np.zeros(similarity.shape)
    weight[r, i, j] = weights(similarity[r, i, j], tie)
    best = weight.max(axis=2)
    partner = np.where(best > 0, weight.argmax(axis=2), -1)
    unsure = (((weight == best[..., None]).sum(axis=2) > 1) & (best > 0)).any(axis=1)
    ordered = np.sort(partner, axis=1)
    unsure |= ((ordered[:, 1:] == ordered[:, :-1]) & (ordered[:, 1:] >= 0)).any(axis=1)
    for k in np.flatnonzero(unsure).tolist():
        expected = stack.graphs[k]
        rows, columns = assign(weight[k, :, : len(expected.names)], observed, expected)
        partner[k] = -1
        partner[k, rows] = np.where(weight[k, rows, columns] > 0, columns, -1)
    chosen = np.take_along_axis(similarity, np.maximum(partner, 0)[..., None], axis=2)[..., 0]
    return partner, np.where(partner >= 0, chosen, 0.0).sum(axis=1)


def _found_edges(observed: Prepared, stack: _Stack, partner: Ints, predicates: int) -> Ints:
    subject = partner[:, observed.edges[:, 0]]
    target = partner[:, observed.edges[:, 2]]
    size = stack.labels.shape[1]
    first = np.arange(len(stack.graphs))[:, None] * predicates + observed.edges[:, 1]
    code = (first * size + np.maximum(subject, 0)) * size + np.maximum(target, 0)
    there: npt.NDArray[np.bool_] = stack.linked[code] & (subject >= 0) & (target >= 0)
    found: Ints = there.sum(axis=1)
    return found


def _structure(
    observed: Prepared,
    stack: _Stack,
    partner: Ints,
    matched: Ints,
    union: Ints,
    config: CountedConfig,
) -> Floats:
    theirs = np.take_along_axis(stack.degree, np.maximum(partner, 0), axis=1)
    ours = observed.degree[None, :]
    if config.degree_scale is DegreeScale.LARGEST:
        scale = np.maximum(stack.largest, int(observed.degree.max(initial=1)))[:, None]
    elif config.degree_scale is DegreeScale.PAIR:
        scale = np.maximum(np.maximum(ours, theirs), 1)
    else:
        scale = np.maximum(np.maximum(stack.nodes, len(observed.names)) - 1, 1)[:, None]
    gap = np.round(np.minimum(np.abs(ours - theirs) / scale, 1.0) / QUANTUM) * QUANTUM
    total = np.where(partner >= 0, gap, 0.0).sum(axis=1)
    if config.structure_count is StructureCount.UNION:
        whole: Floats = 1.0 - (total + (union - matched)) / np.maximum(union, 1)
        return whole
    result: Floats = np.where(matched > 0, 1.0 - total / np.maximum(matched, 1), 0.0)
    return result


def _mean(*columns: Floats) -> Floats:
    total = np.zeros_like(columns[0])
    known = np.zeros_like(columns[0])
    for column in columns:
        there = ~np.isnan(column)
        total = total + np.where(there, column, 0.0)
        known = known + there
    return np.where(known > 0, total / np.maximum(known, 1.0), 1.0)
