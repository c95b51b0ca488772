"""Replanning at the end: nothing interrupts, the failure is located, one correction is made."""

from dataclasses import replace

from scripted import HOT, OPEN, PLAN, REPAIRED, Parts, boundary

from forestall.strategies.post_hoc import PostHoc
from forestall.types.episode import SkillOutcome, SkillStatus
from forestall.types.runtime import When
from forestall.types.verdict import Decision

REFUSED = SkillOutcome(SkillStatus.REFUSED, 1.0, "Bowl-7 is inside Microwave-1")
END = boundary(When.END, index=len(PLAN), looks=2, may_look=False)


def strategy(parts: Parts, max_attempts: int = 1) -> PostHoc:
    return PostHoc(parts, parts, parts, parts, parts, max_attempts)


def test_nothing_interrupts_and_the_score_is_kept() -> None:
    parts = Parts(Decision.REPLAN, (OPEN,))
    post_hoc = strategy(parts)
    answer = post_hoc.before_subtask(boundary())
    assert answer.decision is Decision.PROCEED
    assert answer.verdict is not None
    assert (answer.verdict.decision, answer.verdict.score) == (Decision.PROCEED, 0.5)
    assert post_hoc.after_subtask(boundary(), REFUSED).decision is Decision.PROCEED
    assert parts.replanned == len(parts.asked) == 0


def test_a_goal_that_is_reached_needs_nothing() -> None:
    parts = Parts(Decision.REPLAN, (OPEN,))
    post_hoc = strategy(parts)
    post_hoc.before_subtask(boundary())
    answer = post_hoc.after_episode(END)
    assert answer.decision is Decision.PROCEED
    assert answer.verdict is not None and answer.verdict.decision is Decision.PROCEED
    assert parts.replanned == 0


def test_the_failure_is_the_first_scene_that_the_reasoner_explains() -> None:
    post_hoc = strategy(Parts(Decision.REPLAN, (OPEN,), rest_runs=False))
    post_hoc.before_subtask(boundary())
    post_hoc.after_subtask(boundary(), REFUSED)
    answer = post_hoc.after_episode(END)
    assert answer.decision is Decision.REPLAN
    assert answer.diagnosis is not None
    assert answer.diagnosis.cause == (
        "located at step 2, put_in(Plate, Microwave): the microwave is closed"
    )
    assert answer.diagnosis.must_change == (HOT,)
    assert answer.replan is not None and answer.replan.plan == REPAIRED


def test_otherwise_it_is_the_first_subtask_that_was_refused() -> None:
    post_hoc = strategy(Parts(Decision.PROCEED, rest_runs=False))
    post_hoc.before_subtask(boundary())
    post_hoc.after_subtask(boundary(), REFUSED)
    answer = post_hoc.after_episode(END)
    assert answer.diagnosis is not None
    assert "step 2, put_in(Plate, Microwave): it was refused" in answer.diagnosis.cause
    assert "Bowl-7" not in repr(answer)


def test_otherwise_it_is_the_missed_goal() -> None:
    post_hoc = strategy(Parts(Decision.PROCEED, rest_runs=False))
    post_hoc.before_subtask(boundary())
    answer = post_hoc.after_episode(END)
    assert answer.diagnosis is not None
    assert answer.diagnosis.cause == f"the goal is not reached: {HOT}"


def test_it_looks_twice_before_it_says_so() -> None:
    post_hoc = strategy(Parts(Decision.PROCEED, rest_runs=False))
    post_hoc.before_subtask(boundary())
    first = post_hoc.after_episode(replace(END, looks=1, may_look=True))
    assert first.decision is Decision.LOOK_AGAIN


def test_one_correction_and_no_more() -> None:
    parts = Parts(Decision.REPLAN, (OPEN,), rest_runs=False)
    post_hoc = strategy(parts)
    post_hoc.before_subtask(boundary())
    post_hoc.after_episode(END)
    corrected = boundary(plan=REPAIRED, index=0, replans=1)
    assert post_hoc.before_subtask(corrected).verdict is None
    answer = post_hoc.after_episode(replace(END, plan=REPAIRED, replans=1))
    assert answer.decision is Decision.PROCEED
    assert answer.verdict is not None and answer.verdict.decision is Decision.REPLAN
    assert "1 correction made" in answer.why
    assert parts.replanned == 1


def test_a_new_episode_starts_without_what_the_last_one_left() -> None:
    parts = Parts(Decision.REPLAN, (OPEN,), rest_runs=False)
    post_hoc = strategy(parts)
    post_hoc.before_subtask(boundary())
    parts.decision = Decision.PROCEED
    post_hoc.before_subtask(boundary(index=0))
    answer = post_hoc.after_episode(END)
    assert answer.diagnosis is not None
    assert "located" not in answer.diagnosis.cause
