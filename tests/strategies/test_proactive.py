"""The proactive strategy: when it goes on, looks again, replans, and stops."""

from dataclasses import replace

import pytest
from scripted import OPEN, REPAIRED, Parts, boundary

from forestall.strategies.proactive import Proactive
from forestall.types.facts import Literal
from forestall.types.graph import ObjectNode, SceneGraph
from forestall.types.plan import Plan
from forestall.types.runtime import BoundaryContext
from forestall.types.task import Goal
from forestall.types.verdict import Decision, PlanCheck, Replan, ReplanOutcome

RESTING = Literal.parse("toggled(Microwave-1)=off")
SHUT = Literal.parse("open(Microwave-1)=closed")
DIRTY = Literal.parse("dirty(Microwave-1)=dirty")


def strategy(parts: Parts) -> Proactive:
    return Proactive(parts, parts, parts, parts, parts)


@pytest.fixture
def context() -> BoundaryContext:
    return boundary()


def test_a_scene_that_fits_goes_on_without_diagnosis(context: BoundaryContext) -> None:
    parts = Parts(Decision.PROCEED)
    answer = strategy(parts).before_subtask(context)
    assert answer.decision is Decision.PROCEED
    assert answer.diagnosis is None
    assert parts.replanned == 0


def test_an_alarm_with_nothing_to_change_is_recorded_and_goes_on(context: BoundaryContext) -> None:
    parts = Parts(Decision.REPLAN)
    answer = strategy(parts).before_subtask(context)
    assert answer.decision is Decision.PROCEED
    assert answer.verdict is not None and answer.verdict.decision is Decision.REPLAN
    assert answer.replan is not None
    assert answer.replan.outcome is ReplanOutcome.NOTHING_TO_CHANGE
    assert parts.replanned == 0


def test_an_alarm_with_a_cause_replans(context: BoundaryContext) -> None:
    answer = strategy(Parts(Decision.REPLAN, (OPEN,))).before_subtask(context)
    assert answer.decision is Decision.REPLAN
    assert answer.replan is not None and answer.replan.plan == REPAIRED
    assert dict(answer.seconds).keys() >= {"retrieve", "compare", "diagnose", "replan"}


@pytest.mark.parametrize(
    ("runs", "decision"), [(True, Decision.PROCEED), (False, Decision.LOOK_AGAIN)]
)
def test_steps_of_a_repair_are_checked_instead_of_compared(
    context: BoundaryContext, runs: bool, decision: Decision
) -> None:
    parts = Parts(Decision.REPLAN, (OPEN,), rest_runs=runs)
    proactive = strategy(parts)
    proactive.before_subtask(context)
    repairing = replace(context, plan=REPAIRED, index=0, replans=1)
    answer = proactive.before_subtask(repairing)
    assert answer.decision is decision
    assert answer.verdict is not None and answer.verdict.detector == "plan check"
    if not runs:
        again = proactive.before_subtask(replace(repairing, looks=2, may_look=False))
        assert again.diagnosis is not None
        assert "the microwave is closed" in again.diagnosis.cause


class Assuming(Parts):
    """A validator whose plans run only as long as something holds that nobody saw."""

    assumed: tuple[Literal, ...] = ()

    def check(self, plan: Plan, graph: SceneGraph, goal: Goal) -> PlanCheck:
        return replace(super().check(plan, graph, goal), assumed=self.assumed)


@pytest.mark.parametrize("may_look", [True, False])
@pytest.mark.parametrize(
    ("assumed", "decision"),
    [
        ((), Decision.PROCEED),
        ((RESTING,), Decision.LOOK_AGAIN),
        ((SHUT, DIRTY), Decision.PROCEED),  # opening has nothing to do with them
    ],
)
def test_a_step_of_a_repair_does_not_start_on_what_nobody_saw(
    context: BoundaryContext, assumed: tuple[Literal, ...], decision: Decision, may_look: bool
) -> None:
    parts = Assuming(Decision.REPLAN, (OPEN,))
    proactive = strategy(parts)
    proactive.before_subtask(context)
    parts.assumed = assumed
    opening = REPAIRED.subtasks[0]
    graph = SceneGraph((ObjectNode("Microwave-1", "Microwave"),))
    repairing = replace(
        context, plan=REPAIRED, subtask=opening, index=0, replans=1, graph=graph, may_look=may_look
    )
    answer = proactive.before_subtask(repairing)
    assert answer.decision is decision
    assert ("not observed" in answer.why) == (decision is Decision.LOOK_AGAIN)


def test_after_the_repair_demonstrations_count_again(context: BoundaryContext) -> None:
    proactive = strategy(Parts(Decision.REPLAN, (OPEN,)))
    proactive.before_subtask(context)
    resumed = replace(context, plan=REPAIRED, index=1, replans=1)
    assert proactive.before_subtask(resumed).decision is Decision.REPLAN


def test_a_cause_whose_repair_does_not_help_is_left_alone(context: BoundaryContext) -> None:
    parts = Parts(Decision.REPLAN, (OPEN,))
    proactive = strategy(parts)
    proactive.before_subtask(context)
    resumed = replace(context, plan=REPAIRED, index=1, replans=1)
    decisions = [proactive.before_subtask(resumed).decision for _ in range(4)]
    assert decisions == [Decision.REPLAN] + [Decision.PROCEED] * 3
    assert parts.replanned == 2


def test_one_second_look_then_an_alarm(context: BoundaryContext) -> None:
    proactive = strategy(Parts(Decision.LOOK_AGAIN, (OPEN,)))
    assert proactive.before_subtask(context).decision is Decision.LOOK_AGAIN
    again = proactive.before_subtask(replace(context, looks=2, may_look=False))
    assert again.decision is Decision.REPLAN


@pytest.mark.parametrize(("runs", "decision"), [(True, Decision.PROCEED), (False, Decision.STOP)])
def test_without_a_repair_only_a_plan_that_checks_out_goes_on(
    context: BoundaryContext, runs: bool, decision: Decision
) -> None:
    none = Replan(ReplanOutcome.UNSOLVABLE, note="the place of Mug-1 is not known")
    proactive = strategy(Parts(Decision.REPLAN, (OPEN,), none, runs))
    assert proactive.before_subtask(context).decision is Decision.LOOK_AGAIN
    answer = proactive.before_subtask(replace(context, looks=2, may_look=False))
    assert answer.decision is decision
    assert answer.replan is none
