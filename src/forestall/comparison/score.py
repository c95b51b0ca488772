"""The paper's similarity of an observed and an expected scene graph (Sec. 3, Eqs. 1-3).

Called by detection, the command line and the benchmark; calls prepare, matching, discrepancy and
the encoder. `compare` is the plain form, one pair at a time; `BatchScorer` computes the same
numbers for one graph against many.
"""

from __future__ import annotations

from dataclasses import dataclass

from forestall.comparison.batch import BatchScorer, named_pairs
from forestall.comparison.discrepancy import differences
from forestall.comparison.matching import match, parts
from forestall.comparison.options import (
    DegreeScale,
    EmptyRule,
    Feature,
    ScoreConfig,
    StructureCount,
)
from forestall.comparison.prepare import LabelTable, prepare
from forestall.domain.model import Domain
from forestall.seams.perceiving import TextEncoder
from forestall.types.graph import SceneGraph
from forestall.types.verdict import Discrepancy, ScoreParts

__all__ = [
    "BatchScorer",
    "Comparison",
    "DegreeScale",
    "EmptyRule",
    "Feature",
    "ScoreConfig",
    "StructureCount",
    "compare",
]


@dataclass(frozen=True, slots=True)
class Comparison:
    """What comparing two graphs says.

    `matches` are (observed id, expected id); `discrepancies` are what keeps the graphs apart.
    """

    parts: ScoreParts
    matches: tuple[tuple[str, str], ...]
    discrepancies: tuple[Discrepancy, ...]


def compare(
    observed: SceneGraph,
    expected: SceneGraph,
    config: ScoreConfig,
    encoder: TextEncoder,
    domain: Domain,
) -> Comparison:
    """Score an observed graph against an expected one and say how they differ."""
    config = config.of(domain)
    table = LabelTable(config, encoder, domain)
    a, b = prepare(observed, config, table), prepare(expected, config, table)
    matching = match(a, b, table.similarities(), config)
    matches = named_pairs(a, b, matching.pairs)
    return Comparison(
        parts(a, b, matching, config),
        matches,
        differences(observed, expected, matches, config, domain),
    )
