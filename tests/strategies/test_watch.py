"""Watching: many judges, one observation, no interruption."""

import pytest
from scripted import BEFORE, HOT, OPEN, PLAN, REFERENCES, Parts, boundary

from forestall.domain.load import shipped
from forestall.domain.model import LOCATED
from forestall.errors import InputError
from forestall.strategies.judges import DetectorJudge, PlanJudge, WholeSceneJudge
from forestall.strategies.watch import Watch
from forestall.types.facts import Literal
from forestall.types.graph import ObjectNode, SceneGraph
from forestall.types.plan import Plan
from forestall.types.task import Goal
from forestall.types.verdict import Decision, PlanCheck, Reference


def named(name: str, decision: Decision) -> Parts:
    parts = Parts(decision, (OPEN,))
    parts.name = name
    return parts


def test_an_alarm_is_recorded_and_nothing_comes_of_it() -> None:
    primary, other = named("a", Decision.REPLAN), named("b", Decision.PROCEED)
    answer = Watch(primary, primary, [DetectorJudge(other)], primary).before_subtask(boundary())
    assert answer.decision is Decision.PROCEED
    assert answer.verdict is not None and answer.verdict.decision is Decision.REPLAN
    assert answer.diagnosis is not None and answer.diagnosis.must_change == (OPEN,)
    assert answer.replan is None
    assert [v.decision for v in answer.watched] == [Decision.REPLAN, Decision.PROCEED]
    assert answer.watched[0] is answer.verdict
    assert primary.judged == other.judged


def test_the_primary_judge_looks_again_whenever_it_wants() -> None:
    unsure, sure = named("a", Decision.LOOK_AGAIN), named("b", Decision.PROCEED)
    watch = Watch(unsure, unsure, [DetectorJudge(sure)], unsure)
    for _ in range(4):
        assert watch.before_subtask(boundary()).decision is Decision.LOOK_AGAIN
    assert sure.judged == []
    again = watch.before_subtask(boundary(looks=2, may_look=False))
    assert again.decision is Decision.PROCEED
    assert again.verdict is not None and again.verdict.decision is Decision.REPLAN


def test_every_other_judge_looks_again_until_an_alarm_of_its_stands() -> None:
    unsure, sure = named("b", Decision.LOOK_AGAIN), named("a", Decision.PROCEED)
    watch = Watch(sure, sure, [DetectorJudge(unsure)], sure)
    asked = [watch.before_subtask(boundary(index=k)).decision for k in range(3)]
    assert asked == [Decision.LOOK_AGAIN] * 3
    last = watch.before_subtask(boundary(index=2, looks=2, may_look=False))
    assert last.decision is Decision.PROCEED
    assert last.diagnosis is None
    assert watch.before_subtask(boundary(index=3)).decision is Decision.PROCEED, "it stands"
    assert watch.before_subtask(boundary(index=0)).decision is Decision.LOOK_AGAIN, "a new run"


def test_judges_must_be_told_apart() -> None:
    parts = Parts(Decision.PROCEED)
    with pytest.raises(InputError, match="several judges are called scripted"):
        Watch(parts, parts, [DetectorJudge(parts)], parts)


def test_a_judge_has_references_of_its_own() -> None:
    judged, others = Parts(Decision.PROCEED), Parts(Decision.PROCEED)
    others.retrieve = lambda *_: REFERENCES[:1]  # type: ignore[method-assign]
    verdict = DetectorJudge(judged, others, "few").judge(boundary(references=REFERENCES))
    assert verdict.detector == "few"
    assert judged.judged == [REFERENCES[:1]]


def test_whole_scenes_are_compared_with_whole_scenes() -> None:
    far = ObjectNode("Cup-1", "Cup")
    whole = SceneGraph((far,))
    seen: list[SceneGraph] = []
    compared: list[Reference] = []

    class Looking(Parts):
        def judge(self, observed, observation, references):  # type: ignore[no-untyped-def]
            seen.append(observed)
            compared.extend(references)
            return super().judge(observed, observation, references)

    wholes = {(r.demonstration, r.index): whole for r in REFERENCES}
    judge = WholeSceneJudge(Looking(Decision.PROCEED), wholes, "all of it")
    context = boundary(graph=whole, scoped=SceneGraph((), subtask=PLAN.subtasks[1]))
    verdict = judge.judge(context)
    assert verdict.detector == "all of it"
    assert compared == [], "the run retrieved nothing"
    judge.judge(boundary(graph=whole, scoped=BEFORE, references=REFERENCES))
    assert [g.nodes for g in seen] == [(far,), (far,)]
    assert seen[1].subtask == PLAN.subtasks[1]
    assert [r.graph.nodes for r in compared] == [(far,), (far,)]
    assert [r.graph.subtask for r in compared] == [BEFORE.subtask, BEFORE.subtask]


def test_the_plan_check_says_what_lacks_after_another_look() -> None:
    judge = PlanJudge(Parts(Decision.PROCEED, rest_runs=False), "plan check")
    assert judge.judge(boundary()).decision is Decision.LOOK_AGAIN
    verdict = judge.judge(boundary(looks=2, may_look=False))
    assert (verdict.decision, verdict.score, verdict.lacking) == (Decision.REPLAN, 0.0, (HOT,))
    fine = PlanJudge(Parts(Decision.PROCEED), "plan check").judge(boundary())
    assert (fine.decision, fine.score, fine.lacking) == (Decision.PROCEED, 1.0, ())


def test_what_has_not_been_seen_weighs_less_than_what_is_seen() -> None:
    located, dirty = Literal(LOCATED, ("Egg",)), Literal("dirty", ("Pan-1",), "clean")

    def score(*lacking: Literal, ok: bool = False) -> float | None:
        check = PlanCheck(ok, None, "", lacking)
        judge = PlanJudge(Says(check), "plan check")
        return judge.judge(boundary(looks=2, may_look=False)).score

    assert 0 < (unseen := score(located) or 0.0) < 0.5
    assert score(located, Literal(LOCATED, ("Pan",))) == unseen
    assert (score(located, dirty), score(dirty), score(), score(ok=True)) == (0.0, 0.0, 0.0, 1.0)


class Says:
    """A validator with one answer."""

    def __init__(self, check: PlanCheck) -> None:
        self._check, self.domain = check, shipped("household")

    def check(self, plan: Plan, graph: SceneGraph, goal: Goal) -> PlanCheck:
        return self._check
