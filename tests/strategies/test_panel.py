"""Several judges heard together: who decides, what is kept, and what must change."""

from dataclasses import replace

import pytest
from scripted import HOT, OPEN, Parts, boundary

from forestall.domain.load import shipped
from forestall.planning.validate import GraphValidator
from forestall.strategies.judges import DetectorJudge
from forestall.strategies.panel import Agree, Panel, plan_verdict, together
from forestall.strategies.proactive import Proactive
from forestall.types.facts import GRIPPER, Literal
from forestall.types.plan import Plan, Subtask
from forestall.types.task import Goal
from forestall.types.verdict import Calibration, Decision, Diagnosis, PlanCheck, Verdict
from planning.corpus import DOMAIN, home_of, scene
from planning.episodes import OBSERVATION

GO, LOOK, ALARM = Decision.PROCEED, Decision.LOOK_AGAIN, Decision.REPLAN
STEP = Subtask.parse("put_in(Plate-1, Microwave-1)")
REFUSED = PlanCheck(False, 0, "Microwave-1 is closed", (OPEN,), plan=Plan((STEP,)))


def verdict(decision: Decision, detector: str = "a", judged: bool = True) -> Verdict:
    calibration = Calibration.FIXED if judged else Calibration.UNCALIBRATED
    return Verdict(decision, detector, None, 0.5, calibration)


@pytest.mark.parametrize(
    ("agree", "said", "decided"),
    [
        (Agree.ANY, (GO, ALARM), ALARM), (Agree.ANY, (GO, GO), GO),
        (Agree.ANY, (GO, LOOK), LOOK), (Agree.ANY, (ALARM, LOOK), LOOK),
        (Agree.ANY, (GO, Decision.STOP), Decision.STOP), (Agree.ALL, (GO, Decision.STOP), GO),
        (Agree.ALL, (GO, ALARM), GO), (Agree.ALL, (ALARM, ALARM), ALARM),
        (Agree.ALL, (GO, LOOK), GO), (Agree.ALL, (ALARM, LOOK), LOOK),
    ],
)  # fmt: skip
def test_any_or_all_decide(agree: Agree, said: tuple[Decision, ...], decided: Decision) -> None:
    verdicts = [verdict(d, str(k)) for k, d in enumerate(said)]
    assert Panel((), agree=agree).decide(verdicts).decision is decided


def test_who_has_not_judged_has_no_voice() -> None:
    said = [verdict(GO, "mute", judged=False), verdict(ALARM)]
    assert Panel((), agree=Agree.ALL).decide(said).detector == "a"
    assert Panel(()).decide([verdict(GO, "mute", judged=False)]).judged is False


def test_an_alarm_counts_where_nobody_can_look_again() -> None:
    said = [verdict(ALARM, "a"), verdict(LOOK, "b")]
    assert Panel(()).once_more(said).detector == "a"
    assert Panel(()).once_more([verdict(GO), verdict(LOOK, "b")]).detector == "b"


def test_the_plan_check_asks_for_a_look_before_it_alarms_and_for_what_was_not_seen() -> None:
    domain, context = shipped("household"), boundary()
    assert plan_verdict(context, REFUSED, domain).decision is LOOK
    last = replace(context, may_look=False)
    alarm = plan_verdict(last, REFUSED, domain)
    assert alarm.decision is ALARM and alarm.lacking == (OPEN,)
    unseen = plan_verdict(last, PlanCheck(True), domain)
    assert unseen.decision is LOOK and unseen.note == "not observed: Plate, Microwave"


def test_refusals_and_violated_facts_must_change_together() -> None:
    mined = Diagnosis("the plate is cold", (OPEN, HOT), (Literal.parse("vacant(Sink-1)"),),
                      ("Plate-1",), "preconditions", support=(4, 4))  # fmt: skip
    both = together(REFUSED, mined)
    assert both.must_change == (OPEN, HOT) and both.step == STEP
    assert both.support == (4, 4) and both.culprits == ("Plate-1",)
    other = together(REFUSED, replace(mined, must_change=(HOT,)))
    assert other.must_change == (OPEN, HOT) and other.support is None
    assert together(REFUSED, Diagnosis("unexplained", ())).must_change == (OPEN,)
    assert together(None, mined) is mined


def strategy(parts: Parts, panel: Panel) -> Proactive:
    return Proactive(parts, parts, parts, parts, parts, panel=panel)


def test_proactive_keeps_what_every_judge_said_and_repairs_what_all_say() -> None:
    parts = Parts(ALARM, (OPEN,), rest_runs=False)
    panel = Panel((DetectorJudge(parts),), checks_plan=True)
    first = strategy(parts, panel).before_subtask(boundary())
    assert first.decision is LOOK and first.suspected is not None
    answer = strategy(parts, panel).before_subtask(boundary(may_look=False, looks=2))
    assert answer.decision is ALARM and answer.diagnosis is not None
    assert answer.diagnosis.must_change == (HOT, OPEN)
    assert [v.detector for v in answer.watched] == ["scripted", "plan check"]
    assert answer.verdict is not None and answer.verdict.detector == "plan check"


def test_one_that_lets_the_step_pass_decides_where_all_must_agree() -> None:
    parts = Parts(ALARM, (OPEN,))
    calm = Parts(GO)
    panel = Panel((DetectorJudge(parts), DetectorJudge(calm, name="calm")), agree=Agree.ALL)
    answer = strategy(parts, panel).before_subtask(boundary())
    assert answer.decision is GO and parts.replanned == 0
    assert [v.decision for v in answer.watched] == [ALARM, GO]


def test_what_the_robot_refused_is_replanned_with_what_the_judges_lack() -> None:
    parts = Parts(GO, rest_runs=False)
    panel = Panel((), checks_plan=True)
    context = boundary(may_look=False)
    answer = strategy(parts, panel).before_subtask(replace(context, refused=(context.subtask,)))
    assert answer.diagnosis is not None and answer.diagnosis.producer == "skill status"
    assert answer.diagnosis.must_change == (HOT,)
    assert [v.detector for v in answer.watched] == ["plan check"]


def test_a_place_that_nobody_saw_into_is_no_empty_one() -> None:
    graph = scene(home_of("heat-potato"), "Plate-1 held, Microwave-1 is open, Microwave-1 hidden")
    step = Subtask.parse("put_in(Plate-1, Microwave-1)")
    context = replace(boundary(), graph=graph, subtask=step)
    check = GraphValidator(DOMAIN).check(Plan((step,)), graph, Goal(""))
    assert check.ok, "it is assumed to be empty"
    verdict = plan_verdict(context, check, DOMAIN)
    assert (verdict.decision, verdict.note) == (LOOK, "not observed: vacant(Microwave-1)")


def test_a_hand_that_tells_nothing_is_no_empty_one() -> None:
    graph = scene(home_of("heat-potato"))
    without = replace(graph, nodes=tuple(n for n in graph.nodes if n.id != GRIPPER))
    mute = replace(OBSERVATION, gripper=replace(OBSERVATION.gripper, told=False))
    step = Subtask.parse("pick_up(Plate-1)")
    for known, seen, decision in ((graph, OBSERVATION, GO), (without, mute, LOOK)):
        context = replace(boundary(), graph=known, observation=seen, subtask=step)
        check = GraphValidator(DOMAIN).check(Plan((step,)), known, Goal(""))
        assert plan_verdict(context, check, DOMAIN).decision is decision
