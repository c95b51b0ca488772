"""Replanning after a subtask: what counts as its failure, and where the plan goes on."""

from dataclasses import replace

import pytest
from scripted import AFTER, HOT, OPEN, PLAN, REPAIRED, Parts, boundary

from forestall.strategies.online import Online
from forestall.types.episode import SkillOutcome, SkillStatus
from forestall.types.facts import Literal
from forestall.types.runtime import When
from forestall.types.verdict import Decision, Replan, ReplanOutcome

FINE = SkillOutcome(SkillStatus.SUCCEEDED, 4.0)
REFUSED = SkillOutcome(SkillStatus.REFUSED, 1.0, "Bowl-7 is inside Microwave-1")
DIRTY = Literal.parse("dirty(Plate)=clean")


def strategy(parts: Parts, *, inherited: bool = False) -> Online:
    return Online(
        parts, parts, parts, parts, parts, lambda graph, subtask: graph, inherited=inherited
    )


def test_nothing_is_judged_before_a_subtask() -> None:
    parts = Parts(Decision.REPLAN, (OPEN,))
    answer = strategy(parts).before_subtask(boundary())
    assert answer.decision is Decision.PROCEED
    assert answer.verdict is None
    assert parts.judged == []


def test_an_outcome_that_fits_is_compared_with_what_was_seen_after_it() -> None:
    parts = Parts(Decision.PROCEED)
    online = strategy(parts)
    online.before_subtask(boundary())
    answer = online.after_subtask(boundary(When.AFTER), FINE)
    assert answer.decision is Decision.PROCEED
    ((reference,),) = parts.judged
    assert reference.demonstration == "one"
    assert reference.graph == AFTER


def test_a_wrong_outcome_is_corrected_and_the_plan_goes_on_behind_it() -> None:
    parts = Parts(Decision.REPLAN, (HOT,), was_so=(OPEN,))
    online = strategy(parts)
    online.before_subtask(boundary())
    answer = online.after_subtask(boundary(When.AFTER), FINE)
    assert answer.decision is Decision.REPLAN
    assert answer.diagnosis is not None and answer.diagnosis.must_change == (HOT,)
    assert parts.replanned_at == 2
    assert dict(answer.seconds).keys() >= {"retrieve", "compare", "diagnose", "replan"}


def test_what_was_wrong_before_is_not_the_outcome() -> None:
    parts = Parts(Decision.REPLAN, (DIRTY,))
    online = strategy(parts)
    online.before_subtask(boundary())
    answer = online.after_subtask(boundary(When.AFTER), FINE)
    assert answer.decision is Decision.PROCEED
    assert answer.replan is not None
    assert answer.replan.outcome is ReplanOutcome.NOTHING_TO_CHANGE
    strict = strategy(parts, inherited=True)
    strict.before_subtask(boundary())
    assert strict.after_subtask(boundary(When.AFTER), FINE).decision is Decision.REPLAN


def test_a_vessel_that_was_wrong_counts_once_something_is_put_into_it() -> None:
    vessel = Literal.parse("dirty(Microwave)=clean")
    online = strategy(Parts(Decision.REPLAN, (DIRTY, vessel)))
    online.before_subtask(boundary())
    answer = online.after_subtask(boundary(When.AFTER), FINE)
    assert answer.diagnosis is not None
    assert answer.diagnosis.must_change == (vessel,)
    assert str(vessel) in answer.diagnosis.cause


def test_a_refused_subtask_is_still_to_be_done() -> None:
    parts = Parts(Decision.PROCEED, (OPEN,))
    online = strategy(parts)
    online.before_subtask(boundary())
    answer = online.after_subtask(boundary(When.AFTER), REFUSED)
    assert answer.decision is Decision.REPLAN
    assert answer.verdict is not None and answer.verdict.detector == "skill status"
    assert parts.replanned_at == 1
    assert [c.when for c in parts.asked] == [When.BEFORE]
    assert "Bowl-7" not in repr(answer)


def test_a_refusal_that_nothing_explains_is_looked_at_again_and_let_go() -> None:
    online = strategy(Parts(Decision.PROCEED))
    online.before_subtask(boundary())
    assert online.after_subtask(boundary(When.AFTER), REFUSED).decision is Decision.LOOK_AGAIN
    again = online.after_subtask(boundary(When.AFTER, looks=2, may_look=False), REFUSED)
    assert again.decision is Decision.PROCEED
    assert again.verdict is not None and again.verdict.decision is Decision.REPLAN


def test_a_refusal_without_reasons_is_explained_by_the_plan_check() -> None:
    online = strategy(Parts(Decision.PROCEED, rest_runs=False))
    online.before_subtask(boundary())
    answer = online.after_subtask(boundary(When.AFTER), REFUSED)
    assert answer.decision is Decision.REPLAN
    assert answer.diagnosis is not None and answer.diagnosis.must_change == (HOT,)


@pytest.mark.parametrize(
    ("runs", "decision"), [(True, Decision.PROCEED), (False, Decision.LOOK_AGAIN)]
)
def test_after_the_steps_of_a_repair_the_rest_is_checked(runs: bool, decision: Decision) -> None:
    parts = Parts(Decision.REPLAN, (HOT,), rest_runs=runs, was_so=(OPEN,))
    online = strategy(parts)
    online.before_subtask(boundary())
    online.after_subtask(boundary(When.AFTER), REFUSED)
    repairing = boundary(plan=REPAIRED, index=0, replans=1, subtask=REPAIRED.subtasks[0])
    online.before_subtask(repairing)
    answer = online.after_subtask(replace(repairing, when=When.AFTER), FINE)
    assert answer.decision is decision
    assert answer.verdict is not None and answer.verdict.detector == "plan check"
    assert parts.plans[-1].subtasks == REPAIRED.subtasks[1:]


def test_one_second_look_then_an_alarm() -> None:
    online = strategy(Parts(Decision.LOOK_AGAIN, (HOT,), was_so=(OPEN,)))
    online.before_subtask(boundary())
    assert online.after_subtask(boundary(When.AFTER), FINE).decision is Decision.LOOK_AGAIN
    second = boundary(When.AFTER, looks=2, may_look=False)
    assert online.after_subtask(second, FINE).decision is Decision.REPLAN


def test_a_cause_whose_repair_does_not_help_is_left_alone() -> None:
    parts = Parts(Decision.PROCEED, (OPEN,))
    online = strategy(parts)
    online.before_subtask(boundary())
    decisions = [online.after_subtask(boundary(When.AFTER), REFUSED).decision for _ in range(3)]
    assert decisions == [Decision.REPLAN, Decision.REPLAN, Decision.PROCEED]


def test_without_a_plan_it_stops_safely() -> None:
    none = Replan(ReplanOutcome.UNSOLVABLE, note="no way")
    online = strategy(Parts(Decision.PROCEED, (OPEN,), none, rest_runs=False))
    online.before_subtask(boundary())
    assert online.after_subtask(boundary(When.AFTER), REFUSED).decision is Decision.LOOK_AGAIN
    second = boundary(When.AFTER, looks=2, may_look=False)
    assert online.after_subtask(second, REFUSED).decision is Decision.STOP


def test_nothing_is_asked_at_the_end_of_the_plan() -> None:
    end = boundary(When.END, index=len(PLAN), looks=2, may_look=False)
    answer = strategy(Parts(Decision.PROCEED, rest_runs=False)).after_episode(end)
    assert answer.decision is Decision.PROCEED
