"""One-to-one matching of nodes (Hungarian) and the parts of the score, for one pair of graphs.

Called by score and, for the matching itself, by batch; calls prepare and looks.
"""

from __future__ import annotations

from dataclasses import dataclass

import lap
import numpy as np

from forestall.comparison.looks import QUANTUM, Floats, Ints, seen
from forestall.comparison.options import (
    CountedConfig,
    DegreeScale,
    EmptyRule,
    Feature,
    StructureCount,
)
from forestall.comparison.prepare import Prepared, ties
from forestall.types.verdict import ScoreParts

TIE_SPAN = 2.0**16
"""Ties of up to 64 nodes together weigh less than the smallest step of a similarity."""


@dataclass(frozen=True, slots=True)
class Matching:
    """Matched pairs of indices with their similarities, and the similarity of the subtask nodes."""

    pairs: tuple[tuple[int, int], ...]
    similarities: tuple[float, ...]
    subtask: float | None  # None: not both there, or below the floor


def weights(similarities: Floats, tie_values: Floats) -> Floats:
    """Whole numbers whose order is that of similarities first and tie values second."""
    weighted: Floats = similarities * (TIE_SPAN / QUANTUM) + tie_values
    return np.where(similarities > 0, weighted, 0.0)


def assign(weight: Floats, observed: Prepared, expected: Prepared) -> tuple[Ints, Ints]:
    """Rows and columns of the best assignment.

    Equal optima are settled by solving from the side of the graph that comes first in a fixed
    order, so that exchanging the graphs exchanges the matching.
    """
    if observed.order <= expected.order:
        return _solved(weight)
    columns, rows = _solved(weight.T)
    order = np.argsort(rows)
    return rows[order], columns[order]


def _solved(weight: Floats) -> tuple[Ints, Ints]:
    """Rows and columns of largest total weight, by rows.

    The solver takes costs of up to a million for no way at all, hence weights of at most 1; divided
    by a power of two whole numbers lose nothing.
    """
    if not weight.size:
        none = np.zeros(0, dtype=np.int64)
        return none, none
    scale = 2.0 ** np.ceil(np.log2(max(float(weight.max()), 1.0)))
    _, column_of, _ = lap.lapjv(-weight / scale, extend_cost=True)
    rows = np.flatnonzero(column_of >= 0)
    return rows, column_of[rows].astype(np.int64)


def match(observed: Prepared, expected: Prepared, table: Floats, config: CountedConfig) -> Matching:
    """Maximum total similarity, ties decided by surroundings; pairs below the floor are dropped."""
    similarity = table[np.ix_(observed.labels, expected.labels)]
    if config.feature is Feature.IMAGE:
        similarity = seen(similarity, observed.looks, expected.looks, config.image_floor)
    rows, columns = assign(weights(similarity, ties(observed, expected)), observed, expected)
    found = sorted(
        (int(i), int(j), float(similarity[int(i), int(j)]))
        for i, j in zip(rows, columns, strict=True)
    )
    found = [f for f in found if f[2] > 0]
    subtask = None
    if observed.subtask >= 0 and expected.subtask >= 0:
        subtask = float(table[observed.subtask, expected.subtask]) or None
    return Matching(tuple((i, j) for i, j, _ in found), tuple(s for _, _, s in found), subtask)


def parts(
    observed: Prepared, expected: Prepared, matching: Matching, config: CountedConfig
) -> ScoreParts:
    """Eqs. 1-3 for one matching."""
    node, union = _node(observed, expected, matching, config)
    values = (
        node if config.use_node else None,
        _edge(observed, expected, matching, config) if config.use_edge else None,
        _structure(observed, expected, matching, config, union) if config.use_structure else None,
    )
    known = [v for v in values if v is not None]
    total = 0.0
    for value in known:
        total += value
    return ScoreParts(total / len(known) if known else 1.0, *values)


def _zero_by_zero(config: CountedConfig) -> float | None:
    return 1.0 if config.empty is EmptyRule.ONE else None


def _node(
    observed: Prepared, expected: Prepared, matching: Matching, config: CountedConfig
) -> tuple[float | None, int]:
    """S_node (Eq. 1) and |V_exp ∪ V_obs|."""
    matched = len(matching.pairs) + (matching.subtask is not None)
    nodes = len(observed.names) + len(expected.names)
    union = nodes + (observed.subtask >= 0) + (expected.subtask >= 0) - matched
    if union == 0:
        return _zero_by_zero(config), 0
    return (sum(matching.similarities) + (matching.subtask or 0.0)) / union, union


def _edge(
    observed: Prepared, expected: Prepared, matching: Matching, config: CountedConfig
) -> float | None:
    """S_edge (Eq. 2): the same predicate between matched nodes."""
    partner = dict(matching.pairs)
    wanted = {tuple(e) for e in expected.edges.tolist()}
    found = sum(
        (partner.get(s), p, partner.get(o)) in wanted for s, p, o in observed.edges.tolist()
    )
    union = len(observed.edges) + len(expected.edges) - found
    return found / union if union else _zero_by_zero(config)


def _structure(
    observed: Prepared, expected: Prepared, matching: Matching, config: CountedConfig, union: int
) -> float | None:
    """S_struc (Eq. 3); the pair of subtask nodes has no edges and differs by nothing."""
    if union == 0:
        return _zero_by_zero(config)
    matched = len(matching.pairs) + (matching.subtask is not None)
    largest = max(1, int(observed.degree.max(initial=0)), int(expected.degree.max(initial=0)))
    nodes = max(1, max(len(observed.names), len(expected.names)) - 1)
    total = 0.0
    for i, j in matching.pairs:
        a, b = int(observed.degree[i]), int(expected.degree[j])
        scale = {
            DegreeScale.LARGEST: largest,
            DegreeScale.PAIR: max(a, b, 1),
            DegreeScale.NODES: nodes,
        }[config.degree_scale]
        total += round(min(abs(a - b) / scale, 1.0) / QUANTUM) * QUANTUM
    if config.structure_count is StructureCount.UNION:
        return 1.0 - (total + (union - matched)) / union
    return 1.0 - total / matched if matched else 0.0
