"""What an alarm says to the owner: what is, why it would fail, what will be done, who says so."""

from dataclasses import replace

import pytest

from forestall.records.sentences import in_sentences
from forestall.types.decision import Hold, MonitorDecision, Outcome
from forestall.types.facts import Literal
from forestall.types.plan import Plan, Subtask
from forestall.types.runtime import BoundaryContext, StrategyAnswer
from forestall.types.task import Goal
from forestall.types.verdict import (
    Calibration,
    Change,
    Decision,
    Diagnosis,
    Discrepancy,
    Replan,
    ReplanOutcome,
    Verdict,
)
from planning.corpus import DOMAIN, PLANS, scene
from planning.episodes import context

PLAN = Plan.parse(["pick_up(Plate)", "put_in(Plate, Microwave)", "close_obj(Microwave)"])
REST = PLAN.subtasks[1:]
KITCHEN = "Plate-1 held, Bowl-1 in Microwave-1, Microwave-1 is open, CounterTop-1"
REPAIR = Plan((*Plan.parse(["navigate_to_obj(CounterTop)", "put_on(Plate-1, CounterTop)",
    "navigate_to_obj(Bowl-1)", "pick_up(Bowl-1)", "navigate_to_obj(CounterTop)",
    "put_on(Bowl-1, CounterTop)", "pick_up(Plate-1)"]).subtasks, *REST))  # fmt: skip
VACANT = Literal.parse("vacant(Microwave-1)")


def said(decision: Decision, detector: str = "plan check") -> Verdict:
    return Verdict(decision, detector, None, 0.0, Calibration.FIXED)


def before(*facts: str, index: int = 1, plan: Plan = PLAN) -> BoundaryContext:
    assert PLANS
    task = next(iter(PLANS))
    return context(task, plan, index, scene(*(facts or (KITCHEN,))))


def told(
    at: BoundaryContext,
    diagnosis: Diagnosis | None,
    outcome: Outcome = Outcome.REPLAN,
    *watched: Verdict,
    plan: Plan | None = REPAIR,
    detector: str = "plan check",
    why: str = "",
    hold: Hold | None = None,
) -> str:
    verdict = said(Decision.REPLAN, detector)
    replan = None if plan is None else Replan(ReplanOutcome.SOLVED, plan)
    decision = MonitorDecision(
        outcome, False, at.subtask, verdict=verdict, diagnosis=diagnosis, replan=replan,
        plan=plan if outcome is Outcome.REPLAN else None, hold=hold, why=why,
    )  # fmt: skip
    return in_sentences(at, decision, StrategyAnswer(Decision.REPLAN, watched=watched), DOMAIN)


def refusal(fact: Literal, step: str, reason: str) -> Diagnosis:
    return Diagnosis(reason, (fact,), step=Subtask.parse(step), refusal=reason)


FULL = refusal(VACANT, "put_in(Plate-1, Microwave-1)", "Microwave-1 has no room")


def test_what_is_why_it_fails_and_what_is_done() -> None:
    assert told(before(), FULL) == (
        "There is a bowl inside the microwave, so I cannot put the plate into it. "
        "I put the plate and the bowl on the counter and go on. "
        "The alarm is raised by the plan check."
    )


def test_evidence_is_counted_in_demonstrations_and_judges_are_named() -> None:
    others = (
        said(Decision.REPLAN, "preconditions"),
        said(Decision.PROCEED, "scene graph"),
        said(Decision.LOOK_AGAIN, "image"),
        replace(said(Decision.REPLAN, "mute"), calibration=Calibration.UNCALIBRATED),
    )
    text = told(before(), replace(FULL, support=(4, 4)), Outcome.REPLAN, *others)
    assert "put the plate into it; it was empty in all 4 demonstrations." in text
    assert text.endswith(
        "The alarm is raised by the plan check and by the needs known from demonstrations, not by "
        "the comparison with demonstrations; too little was seen for the image."
    )
    once = told(before(), replace(FULL, support=(1, 1)))
    assert "in the only demonstration there is" in once


def test_what_the_domain_does_not_ask_for_only_may_go_wrong() -> None:
    dirty = Diagnosis("", (Literal.parse("dirty(Plate-1)=clean"),), support=(4, 4))
    text = told(before("Plate-1 is dirty, Microwave-1, CounterTop-1, Plate-1 held"), dirty)
    assert text.startswith(
        "The plate is dirty; it was clean in all 4 demonstrations, so it may go wrong when I put "
        "it into the microwave."
    )


def test_what_would_be_missed_and_spoiled_in_the_end() -> None:
    at = before("Plate-1 on CounterTop-1, Plate-1 is dirty, Potato-1 on CounterTop-1, Microwave-1")
    clean, spoiled = Literal.parse("dirty(Plate-1)=clean"), Literal.parse("spoiled(Potato-1)")
    goal = Goal("", literals=(clean,), never=(Literal.parse("spoiled(Potato)"),))
    at = replace(at, task=replace(at.task, goal=goal))
    text = told(at, Diagnosis("", (clean, spoiled), refusal="the plan runs, but"))
    assert text.startswith(
        "The plate is dirty. With the plan as it is, it would not be clean and the potato would be "
        "spoiled."
    )


def test_a_step_that_comes_later_is_said_to_be_later() -> None:
    at = before("Bowl-1 in Microwave-1, Microwave-1 is open, Plate-1 on CounterTop-1", index=0)
    assert "so I cannot later put the plate into it" in told(at, FULL)


def test_what_is_held_and_what_is_lost() -> None:
    holding = Literal.parse("held_by(Plate-1, gripper)")
    at = before("Bowl-1 held, Plate-1 on CounterTop-1, Microwave-1 is open")
    diagnosis = refusal(holding, "put_in(Plate-1, Microwave-1)", "Plate-1 is not in the gripper")
    assert told(at, diagnosis).startswith(
        "I am holding the bowl and not the plate, so I cannot put the plate into the microwave."
    )
    lost = Diagnosis("", (Literal.parse("located(Egg)"),))
    opened = Plan((Subtask.parse("open_obj(Microwave-1)"), *REST))
    decision = MonitorDecision(
        Outcome.REPLAN, False, at.subtask, verdict=said(Decision.REPLAN), diagnosis=lost,
        plan=opened, replan=Replan(ReplanOutcome.SOLVED, opened, looking_for=("Egg",)),
    )  # fmt: skip
    assert in_sentences(at, decision, StrategyAnswer(Decision.REPLAN), DOMAIN).startswith(
        "I do not know where the egg is. I open the microwave and look for the egg there."
    )


@pytest.mark.parametrize("counted", ["4 of 4", "4 of 4 demonstrations", "1 of 1 demonstration"])
def test_what_was_not_seen_is_said_so(counted: str) -> None:
    note = f"not observed: open(Microwave-1)=open (held in {counted}), Plate-1"
    verdict = replace(said(Decision.LOOK_AGAIN), note=note)
    at = before()
    decision = MonitorDecision(Outcome.LOOK, False, at.subtask, verdict=verdict)
    assert in_sentences(at, decision, StrategyAnswer(Decision.LOOK_AGAIN), DOMAIN) == (
        "I could not see whether the microwave is open and the plate, so I look again before I put "
        "the plate into the microwave."
    )
    suspected = StrategyAnswer(Decision.LOOK_AGAIN, suspected=FULL)
    assert in_sentences(at, decision, suspected, DOMAIN).endswith(
        "To be sure of that I look again before I put the plate into the microwave."
    )


def test_a_stop_says_so_and_so_does_what_nobody_can_explain() -> None:
    stopped = told(before(), FULL, Outcome.HOLD, plan=None, hold=Hold.STOPPED)
    assert "I found nothing that mends this, so I stop here." in stopped
    at = before()
    differs = Discrepancy(
        Change.STATE, "Plate-1", "dirty=clean", "dirty=dirty", "Plate-1 is dirty; it was clean"
    )
    verdict = replace(said(Decision.REPLAN, "scene graph"), discrepancies=(differs,))
    decision = MonitorDecision(
        Outcome.PROCEED, True, at.subtask, verdict=verdict, diagnosis=Diagnosis("nothing", ())
    )
    assert in_sentences(at, decision, StrategyAnswer(Decision.PROCEED), DOMAIN) == (
        "This is not as in the demonstrations, and I cannot tell what must change: the plate is "
        "dirty. I go on all the same. The alarm is raised by the comparison with demonstrations."
    )


def test_nothing_is_said_where_a_step_goes_on() -> None:
    at = before()
    decision = MonitorDecision(Outcome.PROCEED, True, verdict=said(Decision.PROCEED))
    assert in_sentences(at, decision, StrategyAnswer(Decision.PROCEED), DOMAIN) == ""


def test_long_repairs_are_cut_short_and_what_is_left_out_is_said() -> None:
    on_and_off = ["open_obj(Microwave-1)", "toggle_on(Faucet)", "toggle_off(Faucet)",
                  "close_obj(Cabinet)", "open_obj(Drawer)", "slice_obj(Potato)"]  # fmt: skip
    long = Plan((*Plan.parse(on_and_off).subtasks, *REST))
    assert (
        "I open the microwave, turn the faucet on, turn it off again, close the cabinet, "
        "do 2 more steps, and go on."
    ) in told(before(), FULL, plan=long)
    shorter = Plan(REST[1:])
    assert "I will not put the plate into the microwave, and go on." in told(
        before(), FULL, plan=shorter
    )
    assert "Nothing is left to do." in told(before(), FULL, plan=Plan(()))


def test_strange_facts_of_somebodys_part_are_said_somehow() -> None:
    for fact in (Literal("spins", ()), Literal("glows", ("Thing-9", "x"), "false"),
                 Literal("mood", ("?x",), "good"), Literal("vacant", ("Nowhere-1",))):  # fmt: skip
        for diagnosis in (
            Diagnosis("odd(thing)", (fact,), support=(1, 2)),
            Diagnosis("", (fact,), refusal="?"),
            Diagnosis("", (fact,), step=Subtask("fly", ("Thing-9",)), refusal="{x} (y"),
        ):
            assert told(before(), diagnosis).endswith("plan check.")
