"""How long comparing takes: random graphs from a seed, one scored against many.

Called by `forestall bench speed`; calls batch. Nothing is asserted here.
"""

from __future__ import annotations

import time
import zlib
from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from forestall.comparison.batch import BatchScorer
from forestall.comparison.options import Feature, ScoreConfig
from forestall.domain.model import Domain
from forestall.errors import InputError
from forestall.seams.perceiving import TextEncoder
from forestall.types.facts import GRIPPER
from forestall.types.feature import quantised
from forestall.types.graph import ObjectNode, Relation, SceneGraph
from forestall.types.plan import Subtask


class DirectionEncoder:
    """Gives each text a random direction of its own, the same each time (a test double)."""

    name = "directions"

    def encode(self, texts: Sequence[str]) -> npt.NDArray[np.float32]:
        """(n, 64) float32 rows of unit length."""
        rows = np.empty((len(texts), 64), dtype=np.float32)
        for i, text in enumerate(texts):
            row = np.random.default_rng(zlib.crc32(text.encode())).standard_normal(64)
            rows[i] = row / np.linalg.norm(row)
        return rows


def random_graph(
    n_nodes: int,
    rng: np.random.Generator,
    domain: Domain,
    feature_size: int = 0,
) -> SceneGraph:
    """A graph of `n_nodes` nodes (gripper included) with one relation for nearly every object.

    Categories and states are drawn from the domain; a state is unobserved one time in ten. With
    a `feature_size` objects have image features of that many numbers: a direction of the category
    and at most as much noise; one in ten has none.
    """
    names = sorted(domain.categories)
    nodes = [ObjectNode(GRIPPER, GRIPPER)]
    seen: dict[str, int] = {}
    for category in rng.choice(names, size=n_nodes - 1).tolist():
        seen[category] = seen.get(category, 0) + 1
        states = tuple(
            (a, None if rng.random() < 0.1 else str(rng.choice(domain.values(a))))
            for a in domain[category].attributes
        )
        look = random_feature(category, rng, feature_size) if feature_size else None
        nodes.append(ObjectNode(f"{category}-{seen[category]}", category, states, feature=look))
    places = [n for n in nodes[1:] if domain.offers(n.category) is not None]
    roles, skill = domain.roles, next(s for s in domain.skills.values() if len(s.parameters) == 2)
    relations = []
    for i, node in enumerate(nodes[1:]):
        if i == 0:
            relations.append(Relation(node.id, roles.holding or "", GRIPPER))
        elif places and domain.is_a(node.category, roles.movable):
            place = places[int(rng.integers(len(places)))]
            relation = domain.offers(place.category)
            if place.id != node.id and relation is not None:
                relations.append(Relation(node.id, relation, place.id))
        other = nodes[1 + int(rng.integers(n_nodes - 1))]
        if rng.random() < 0.1 and other.id != node.id:
            relations.append(Relation(node.id, roles.blocking or "", other.id))
    subtask = Subtask(skill.name, (nodes[1].id, nodes[2].id)) if n_nodes > 2 else None
    return SceneGraph(tuple(nodes), tuple(relations), subtask)


def random_feature(category: str, rng: np.random.Generator, size: int) -> bytes | None:
    """An image feature whose cosine with another one of its category is about a half or more."""
    middle = np.random.default_rng(zlib.crc32(category.encode())).standard_normal(size)
    look = middle + rng.uniform(0.2, 1.0) * rng.standard_normal(size)
    return None if rng.random() < 0.1 else quantised(look)


def score_times(
    n_references: int,
    n_nodes: int,
    seed: int,
    domain: Domain,
    repeat: int = 10,
    encoder: TextEncoder | None = None,
    feature: Feature = Feature.PARTS,
    feature_size: int = 128,
) -> list[float]:
    """Seconds of each of `repeat` comparisons of a new graph with the same references.

    The references were compared once before, as they are from the second boundary on.

    Args:
        n_references: how many reference graphs.
        n_nodes: nodes of each graph.
        seed: of the graphs.
        domain: what the graphs speak of.
        repeat: how many new graphs are compared.
        encoder: embeds labels; random directions by default.
        feature: what nodes are compared by.
        feature_size: numbers of an image feature, where images are compared.

    Raises:
        InputError: fewer than one reference or two nodes.
    """
    if n_references < 1 or n_nodes < 2:
        raise InputError("timing needs at least one reference and two nodes")
    rng = np.random.default_rng(seed)
    size = feature_size if feature is Feature.IMAGE else 0
    references = [
        random_graph(n_nodes, rng, domain, feature_size=size) for _ in range(n_references)
    ]
    scorer = BatchScorer(ScoreConfig(feature=feature), encoder or DirectionEncoder(), domain)
    scorer.scores(random_graph(n_nodes, rng, domain, feature_size=size), references)
    times = []
    for _ in range(repeat):
        observed = random_graph(n_nodes, rng, domain, feature_size=size)
        started = time.perf_counter()
        scorer.scores(observed, references)
        times.append(time.perf_counter() - started)
    return times
