"""Judging by what always held: in the household's words and in a small domain of the test's own."""

from __future__ import annotations

from dataclasses import replace

import pytest

from forestall.calibration.fitted import CalibrationTable, JudgeThresholds
from forestall.calibration.scores import JudgedBoundary, JudgedRun, Parts, scores_of
from forestall.comparison.corrections import Correction, Corrections
from forestall.comparison.preconditions import MiningConfig
from forestall.detection.preconditions import PreconditionConfig, PreconditionDetector
from forestall.domain.load import shipped
from forestall.errors import InputError
from forestall.types.facts import Literal
from forestall.types.graph import ObjectNode, Relation, SceneGraph
from forestall.types.plan import Subtask
from forestall.types.verdict import Calibration, Decision, Reference

BENCH = shipped("bench")
INSERT = Subtask.parse("insert(RoundPeg-1, RoundHole-1)")


def scene(
    *more: Relation, dirty: str | None = "clean", clutter: int = 0, held: bool = True
) -> SceneGraph:
    nodes = [
        ObjectNode("gripper", "gripper"),
        ObjectNode("RoundPeg-1", "RoundPeg", (("dirt", "clean"),)),
        ObjectNode("RoundHole-1", "RoundHole", (("dirt", dirty),)),
        *(ObjectNode(f"Nut-{i}", "Nut") for i in range(1, clutter + 2)),
    ]
    grip = (Relation("RoundPeg-1", BENCH.roles.holding or "", "gripper"),) if held else ()
    return SceneGraph(tuple(nodes), (*grip, *more), INSERT)


def references(*graphs: SceneGraph) -> list[Reference]:
    return [Reference(f"d{i}", "t", 3, INSERT, 1.0, g) for i, g in enumerate(graphs)]


FOUR = references(*[scene() for _ in range(4)])
IN_THE_HOLE = Relation("Nut-1", "seated_in", "RoundHole-1")


def test_what_always_held_holds() -> None:
    verdict = PreconditionDetector(BENCH).judge(scene(), None, FOUR)
    assert (verdict.decision, verdict.score, verdict.references) == (Decision.PROCEED, 1.0, 4)
    assert verdict.judged


def test_clutter_that_no_demonstration_had_changes_nothing() -> None:
    verdict = PreconditionDetector(BENCH).judge(scene(clutter=20), None, FOUR)
    assert (verdict.decision, verdict.score) == (Decision.PROCEED, 1.0)


@pytest.mark.parametrize(
    ("observed", "named"),
    [
        (scene(IN_THE_HOLE), "free(RoundHole-1)"),
        (scene(dirty="dirty"), "dirt(RoundHole-1)=clean"),
        (scene(held=False), "gripped_by(RoundPeg-1, gripper)"),
    ],
)
def test_one_decisive_fact_is_an_alarm(observed: SceneGraph, named: str) -> None:
    verdict = PreconditionDetector(BENCH).judge(observed, None, FOUR)
    assert verdict.decision is Decision.REPLAN
    assert verdict.score == pytest.approx(1 - 5 / 6)
    assert named in verdict.note and "4 of 4" in verdict.note
    assert verdict.lacking == (Literal.parse(named),)


def test_only_what_is_behind_the_alarm_lacks() -> None:
    detector = PreconditionDetector(BENCH)
    both = detector.judge(scene(IN_THE_HOLE, dirty="dirty"), None, FOUR)
    assert {str(x) for x in both.lacking} == {"free(RoundHole-1)", "dirt(RoundHole-1)=clean"}
    for fine in (scene(), scene(dirty=None)):
        assert detector.judge(fine, None, FOUR).lacking == ()
    seldom = references(scene(), scene(dirty=None), scene(dirty=None), scene(dirty=None))
    careful = PreconditionDetector(BENCH, MiningConfig(1), PreconditionConfig(threshold=0.2))
    one = careful.judge(scene(IN_THE_HOLE, dirty="dirty"), None, seldom)
    assert [str(x) for x in one.lacking] == ["free(RoundHole-1)"]


def test_what_was_not_seen_calls_for_another_look() -> None:
    verdict = PreconditionDetector(BENCH).judge(scene(dirty=None), None, FOUR)
    assert verdict.decision is Decision.LOOK_AGAIN
    assert verdict.note == "not observed: dirt(RoundHole-1)=clean (held in 4 of 4 demonstrations)"


@pytest.mark.parametrize("value", ["yes", None])
def test_an_argument_with_an_attribute_that_nobody_knows_calls_for_another_look(
    value: str | None,
) -> None:
    plain = scene()
    nodes = {n.id: n for n in plain.nodes}
    for name, decision in (
        ("RoundHole-1", Decision.LOOK_AGAIN),
        ("Nut-1", Decision.PROCEED),
    ):
        more = replace(nodes[name], states=(*nodes[name].states, ("cracked", value)))
        graph = replace(plain, nodes=tuple({**nodes, name: more}.values()))
        verdict = PreconditionDetector(BENCH).judge(graph, None, FOUR)
        assert verdict.decision is decision
        assert ("the attribute cracked" in verdict.note) is (decision is Decision.LOOK_AGAIN)


def test_one_demonstration_raises_an_alarm_that_says_so() -> None:
    verdict = PreconditionDetector(BENCH).judge(scene(IN_THE_HOLE), None, FOUR[:1])
    assert verdict.decision is Decision.REPLAN
    assert verdict.score == pytest.approx(1 / 3)
    assert "1 of 1" in verdict.note
    careful = PreconditionDetector(BENCH, config=PreconditionConfig(threshold=0.25))
    assert careful.judge(scene(IN_THE_HOLE), None, FOUR[:1]).decision is Decision.PROCEED
    assert careful.judge(scene(IN_THE_HOLE), None, FOUR).decision is Decision.REPLAN


def test_a_fact_that_varied_is_no_precondition() -> None:
    varied = references(scene(), scene(dirty="dirty"), scene(), scene())
    assert PreconditionDetector(BENCH).judge(scene(dirty="dirty"), None, varied).score == 1.0


def silenced() -> JudgeThresholds:
    """Thresholds that leave no alarm: every good run had one."""
    alarm = JudgedBoundary("preconditions", INSERT.skill, 0.0)
    runs = [JudgedRun(f"run-{i}", "t", (alarm,)) for i in range(30)]
    return CalibrationTable(scores_of(runs, Parts.NONE, ()), 0.05).of("preconditions", "t")


def test_a_judge_that_a_calibration_silences_has_no_voice() -> None:
    detector = PreconditionDetector(BENCH, thresholds=silenced())
    full = detector.judge(scene(IN_THE_HOLE), None, FOUR)
    assert not full.judged
    assert (full.decision, full.score, full.lacking) == (Decision.PROCEED, None, ())
    assert "too many good runs had one" in full.note and "free(RoundHole-1)" in full.note
    fine = detector.judge(scene(), None, FOUR)
    assert fine.judged and fine.decision is Decision.PROCEED
    unseen = detector.judge(scene(dirty=None), None, FOUR)
    assert unseen.decision is Decision.LOOK_AGAIN


def test_no_calibration_silences_what_a_person_added() -> None:
    fact = Literal.parse("free(?hole)")
    added = Corrections("by hand", (Correction(True, INSERT.skill, fact),))
    detector = PreconditionDetector(BENCH, thresholds=silenced(), corrections=added)
    verdict = detector.judge(scene(IN_THE_HOLE, dirty="dirty"), None, FOUR)
    assert (verdict.decision, verdict.score) == (Decision.REPLAN, 0.0)
    assert [str(x) for x in verdict.lacking] == ["free(RoundHole-1)"]
    assert verdict.note == "violated: free(RoundHole-1) (a correction by hand)"
    assert (verdict.calibration, verdict.p_value) == (Calibration.FIXED, None)
    assert not detector.judge(scene(dirty="dirty"), None, FOUR).judged


def test_without_a_reference_nothing_is_judged() -> None:
    verdict = PreconditionDetector(BENCH).judge(scene(), None, [])
    assert not verdict.judged and verdict.calibration is Calibration.UNCALIBRATED
    no_subtask = replace(scene(), subtask=None)
    assert not PreconditionDetector(BENCH).judge(no_subtask, None, FOUR).judged


def test_where_nothing_always_held_nothing_is_judged() -> None:
    empty = references(SceneGraph((), (), INSERT), SceneGraph((), (), INSERT))
    verdict = PreconditionDetector(BENCH, MiningConfig()).judge(scene(), None, empty)
    assert not verdict.judged or verdict.decision is not Decision.PROCEED


def test_a_threshold_is_a_share() -> None:
    with pytest.raises(InputError, match="threshold 2"):
        PreconditionConfig(threshold=2)
