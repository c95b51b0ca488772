"""Object-level matching (paper, Sec. 3): are the same kinds of things there, equally many?

Called like every detector at a boundary; reads which things are supports from the comparison.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Sequence

from forestall.detection.baseline import judged
from forestall.detection.scene_graph import DetectorConfig, is_located
from forestall.domain.model import Domain
from forestall.types.facts import GRIPPER
from forestall.types.graph import SceneGraph
from forestall.types.observation import Observation
from forestall.types.verdict import Decision, Reference, Verdict, demonstrations_of, scenes


class ObjectCountDetector:
    """Judges by counts of categories, the best over the references (implements `Detector`).

    The score of two scenes is the number of things that both have over the number that either has:
    sum of min(a, b) over sum of max(a, b) of the counts of each category.

    Counted is what has a box in the graph that is scoped to the subtask, on both sides. So it
    sees the same things as the scene-graph detector (also those that it remembers out of view, and
    without all that has nothing to do with the subtask), and what it lacks is just states and
    relations. Whatever things merely stand on counts as one support, as it does there. Counting
    whatever the camera happens to see would compare whole kitchens, which
    differ from one demonstration to the next.
    """

    name = "objects"

    def __init__(self, domain: Domain, config: DetectorConfig | None = None) -> None:
        self._supports = domain.tagged(domain.roles.support)
        self._config = config or DetectorConfig()

    def noticed(
        self, verdict: Verdict, observed: SceneGraph, observation: Observation | None
    ) -> tuple[str, ...]:
        """What it sees of a mismatch: the two lists of counts."""
        if verdict.nearest is None or verdict.decision is Decision.PROCEED:
            return ()
        both = (counts(g, self._supports) for g in (observed, verdict.nearest.graph))
        now, then = (", ".join(f"{n} {c}" for c, n in sorted(b.items())) for b in both)
        return (f"now: {now or 'nothing'}", f"then: {then or 'nothing'}")

    def judge(
        self, observed: SceneGraph, observation: Observation | None, references: Sequence[Reference]
    ) -> Verdict:
        """Compare the counts of the scoped graph with those of every reference."""
        references = scenes(references)
        mine = counts(observed, self._supports)
        pairs = [(overlap(mine, counts(r.graph, self._supports)), r) for r in references]
        scores = [(round(score, 6), r) for score, r in pairs if score is not None]
        nothing = "neither the scene nor a reference has a located object"
        return judged(self.name, self._config, scores, demonstrations_of(references), nothing)


def counts(graph: SceneGraph, supports: Iterable[str]) -> Counter[str]:
    """How many located objects of each category a graph has; the gripper is none.

    Args:
        graph: scoped.
        supports: categories on which things merely stand; all of them count as one.
    """
    found = Counter(n.category for n in graph.nodes if n.id != GRIPPER and is_located(n))
    if any([found.pop(c, 0) for c in supports]):  # all of them are taken out
        found["support"] = 1
    return found


def overlap(a: Counter[str], b: Counter[str]) -> float | None:
    """Shared share of two counts, None where there is nothing on either side."""
    either = (a | b).total()
    return (a & b).total() / either if either else None
