from __future__ import annotations

import pytest
from baseline_samples import graph, node, observation, reference

from forestall.detection.objects import ObjectCountDetector, counts
from forestall.detection.scene_graph import DetectorConfig
from forestall.domain.load import shipped
from forestall.seams import Detector
from forestall.types.graph import ObjectNode, Relation, SceneGraph, Seen
from forestall.types.verdict import Decision

DOMAIN = shipped("household")
SUPPORTS = DOMAIN.tagged(DOMAIN.roles.support)
EXPECTED = graph("Mug-1", "Sink-1", "Sink-2")


def judged(observed: SceneGraph, *expected: SceneGraph, threshold: float = 0.9) -> float | None:
    detector: Detector = ObjectCountDetector(DOMAIN, DetectorConfig(threshold))
    references = [reference(str(i), expected=g) for i, g in enumerate(expected)]
    verdict = detector.judge(observed, observation(), references)
    fits = verdict.score is None or verdict.score >= threshold
    assert verdict.decision is (Decision.PROCEED if fits else Decision.REPLAN)
    assert verdict.references == len(expected)
    assert verdict.detector == "objects"
    return verdict.score


def test_equal_counts_fit_whatever_the_things_are_called() -> None:
    assert judged(graph("Mug-4", "Sink-1", "Sink-3"), EXPECTED, threshold=1.0) == 1.0


@pytest.mark.parametrize(
    ("things", "score"),
    [
        (("Mug-1", "Sink-1"), 2 / 3),
        (("Mug-1", "Sink-1", "Sink-2", "Pan-1"), 3 / 4),
        (("Mug-1", "Mug-2", "Sink-1", "Pan-1"), 2 / 5),
        (("Pan-1",), 0.0),
        ((), 0.0),
    ],
)
def test_shared_share(things: tuple[str, ...], score: float) -> None:
    assert judged(graph(*things), EXPECTED) == pytest.approx(score, abs=1e-6)


def test_the_best_reference_counts() -> None:
    assert judged(graph("Mug-1"), EXPECTED, graph("Mug-2"), graph("Pan-1")) == 1.0


def test_states_and_relations_do_not_count() -> None:
    links = (Relation("Pot-1", "blocking", "Mug-1"),)
    changed = graph(node("Mug-1", dirty="dirty"), "Pot-1", links=links)
    assert judged(changed, graph(node("Mug-1", dirty="clean"), "Pot-1")) == 1.0


def test_counted_is_what_has_a_box() -> None:
    mixed = graph(
        "Mug-1",
        node("Mug-2", Seen.REMEMBERED),
        node("Egg-1", Seen.UNOBSERVED),
        ObjectNode("Pan-1", "Pan"),
    )
    assert counts(mixed, SUPPORTS) == {"Mug": 2}


def test_nothing_anywhere_is_not_judged() -> None:
    assert judged(graph()) is None
    assert judged(graph(), graph()) is None
    assert judged(graph(), graph(), EXPECTED) == 0.0
