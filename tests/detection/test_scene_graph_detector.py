from __future__ import annotations

import numpy as np
import pytest

from forestall.comparison.score import BatchScorer, ScoreConfig
from forestall.detection.scene_graph import DetectorConfig, SceneGraphDetector
from forestall.domain.load import shipped
from forestall.embeddings import HashedTextEncoder
from forestall.errors import InputError
from forestall.types.graph import Box, ObjectNode, Relation, SceneGraph, Seen
from forestall.types.observation import Frame, GripperState, Intrinsics, Observation
from forestall.types.plan import Subtask
from forestall.types.verdict import Calibration, Decision, Reference

DOMAIN = shipped("household")
BOX = Box((0.0, 0.0, 0.0), (0.1, 0.1, 0.1))


@pytest.fixture
def observation() -> Observation:
    frame = Frame(
        np.zeros((4, 6, 3), np.uint8),
        np.zeros((4, 6), np.float32),
        Intrinsics(6, 4, 5.0, 5.0, 2.5, 1.5),
        np.eye(4),
    )
    return Observation((frame,), GripperState(None, (0.0, 0.0, 1.0)), 0.0)


def graph(*things: str, links: tuple[Relation, ...] = (), seen: Seen = Seen.VISIBLE) -> SceneGraph:
    nodes = [
        ObjectNode(t, t.split("-")[0], (), BOX.centre, BOX, seen if t == "Mug-1" else Seen.VISIBLE)
        for t in things
    ]
    return SceneGraph(tuple(nodes), links, Subtask("pick_up", ("Mug-1",)))


def reference(expected: SceneGraph, name: str = "d") -> Reference:
    assert expected.subtask is not None
    return Reference(name, "make-coffee", 1, expected.subtask, 1.0, expected)


def detector(threshold: float = 0.9) -> SceneGraphDetector:
    return SceneGraphDetector(
        BatchScorer(ScoreConfig(), HashedTextEncoder(), DOMAIN), DetectorConfig(threshold)
    )


def test_one_fitting_reference_is_enough(observation: Observation) -> None:
    seen = graph("Mug-1", "Sink-1")
    other = graph("Mug-1", "Pan-1", "Pot-1", "Kettle-1")
    verdict = detector().judge(seen, observation, [reference(other), reference(seen, "fits")])
    assert verdict.decision is Decision.PROCEED
    assert verdict.score == 1.0
    assert verdict.nearest is not None
    assert verdict.nearest.demonstration == "fits"
    assert verdict.references == 2
    assert (verdict.detector, verdict.calibration) == ("scene-graph", Calibration.FIXED)


def test_none_fits(observation: Observation) -> None:
    seen = graph("Mug-1", "Pot-1", links=(Relation("Pot-1", "blocking", "Mug-1"),))
    verdict = detector().judge(seen, observation, [reference(graph("Mug-1"))])
    assert verdict.decision is Decision.REPLAN
    assert verdict.threshold == 0.9
    assert verdict.score is not None
    assert verdict.score < 0.9
    assert "Pot-1 stands in front of Mug-1" in verdict.discrepancies[0].text
    assert verdict.matches == (("Mug-1", "Mug-1"),)
    assert detector(0.1).judge(seen, observation, [reference(graph("Mug-1"))]).decision is (
        Decision.PROCEED
    )


def test_no_reference_is_no_claim(observation: Observation) -> None:
    verdict = detector().judge(graph("Mug-1"), observation, [])
    assert verdict.decision is Decision.PROCEED
    assert verdict.score is None
    assert verdict.calibration is Calibration.UNCALIBRATED
    assert "no demonstration has a subtask similar enough to compare with" in verdict.note


@pytest.mark.parametrize(
    "seen", [graph("Sink-1"), graph("Mug-1", "Sink-1", "Pan-1", seen=Seen.UNOBSERVED)]
)
def test_an_argument_out_of_sight_calls_for_another_look(
    seen: SceneGraph, observation: Observation
) -> None:
    verdict = detector().judge(seen, observation, [reference(graph("Mug-1"))])
    assert verdict.decision is Decision.LOOK_AGAIN
    assert "Mug-1" in verdict.note


def test_what_the_demonstrations_had_not_located_is_not_looked_for(
    observation: Observation,
) -> None:
    expected = graph("Mug-1", "Kettle-1", seen=Seen.UNOBSERVED)
    verdict = detector().judge(graph("Sink-1"), observation, [reference(expected)])
    assert verdict.decision is Decision.REPLAN


def test_a_reference_that_had_not_found_the_argument_cannot_judge(
    observation: Observation,
) -> None:
    blind = reference(graph("Sink-1"), "blind")
    verdict = detector().judge(graph("Mug-1", "Sink-1"), observation, [blind])
    assert verdict.decision is Decision.PROCEED
    assert verdict.score is None
    assert verdict.references == 1
    assert verdict.note == "no demonstration had found Mug-1 at this point, so nothing was judged"
    seeing = reference(graph("Mug-1", "Pan-1", "Pot-1"), "seeing")
    verdict = detector().judge(graph("Mug-1", "Sink-1"), observation, [blind, seeing])
    assert verdict.nearest is seeing
    assert verdict.decision is Decision.REPLAN


def test_threshold_is_checked() -> None:
    with pytest.raises(InputError, match="between 0 and 1"):
        DetectorConfig(threshold=90)


def test_several_can_watch_under_their_own_names(observation: Observation) -> None:
    scorer = BatchScorer(ScoreConfig(use_edge=False), HashedTextEncoder(), DOMAIN)
    other = SceneGraphDetector(scorer, name="scene-graph without edges")
    seen = graph("Mug-1", "Pot-1", links=(Relation("Pot-1", "blocking", "Mug-1"),))
    expected = reference(graph("Mug-1", "Pot-1"))
    names = {d.judge(seen, observation, [expected]).detector for d in (detector(), other)}
    assert names == {"scene-graph", "scene-graph without edges"}
    assert SceneGraphDetector.name == "scene-graph"
