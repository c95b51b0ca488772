"""Watching: many detectors, one observation, no interruption."""

import pytest
from scripted import OPEN, Parts, boundary

from forestall.errors import InputError
from forestall.strategies.watch import Watch
from forestall.types.verdict import Decision


def named(name: str, decision: Decision) -> Parts:
    parts = Parts(decision, (OPEN,))
    parts.name = name
    return parts


def test_an_alarm_is_recorded_and_nothing_comes_of_it() -> None:
    primary, other = named("a", Decision.REPLAN), named("b", Decision.PROCEED)
    answer = Watch(primary, [primary, other], primary).before_subtask(boundary())
    assert answer.decision is Decision.PROCEED
    assert answer.verdict is not None and answer.verdict.decision is Decision.REPLAN
    assert answer.diagnosis is not None and answer.diagnosis.must_change == (OPEN,)
    assert answer.replan is None
    assert [v.decision for v in answer.watched] == [Decision.REPLAN, Decision.PROCEED]
    assert answer.watched[0] is answer.verdict
    assert primary.judged == other.judged


def test_only_the_primary_detector_looks_again() -> None:
    unsure, sure = named("a", Decision.LOOK_AGAIN), named("b", Decision.PROCEED)
    first = Watch(unsure, [unsure, sure], unsure)
    assert first.before_subtask(boundary()).decision is Decision.LOOK_AGAIN
    assert sure.judged == []
    again = first.before_subtask(boundary(looks=2, may_look=False))
    assert again.decision is Decision.PROCEED
    assert again.verdict is not None and again.verdict.decision is Decision.REPLAN
    second = Watch(unsure, [sure, unsure], unsure).before_subtask(boundary())
    assert second.decision is Decision.PROCEED
    assert second.diagnosis is None


def test_detectors_must_be_told_apart() -> None:
    parts = Parts(Decision.PROCEED)
    with pytest.raises(InputError, match="several detectors are called scripted"):
        Watch(parts, [parts, parts], parts)
    with pytest.raises(InputError, match="at least one"):
        Watch(parts, [], parts)
