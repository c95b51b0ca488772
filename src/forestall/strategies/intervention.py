"""What strategies share once something looks wrong: the alarm, the repair and its bounds.

Called by proactive, online and post-hoc; calls replanner and validator, which it is given. When
the alarm is raised is the strategy's own affair; what follows from it is the same for all.
"""

from __future__ import annotations

import time
from dataclasses import dataclass, field, replace

from forestall.domain.brought import came_about
from forestall.domain.facing import way_here
from forestall.domain.looked import missing
from forestall.domain.model import LOCATED, Domain
from forestall.domain.names import as_meant
from forestall.domain.undo import irreversible_skills
from forestall.seams.judging import PlanValidator, Replanner
from forestall.strategies.asked import AskedReplanner, AskedValidator
from forestall.strategies.looking import Looking
from forestall.strategies.relied import relied_on_now
from forestall.types.facts import Literal, Truth
from forestall.types.plan import Plan, Subtask, same_step
from forestall.types.runtime import BoundaryContext, StrategyAnswer
from forestall.types.verdict import (
    Calibration,
    Decision,
    Diagnosis,
    PlanCheck,
    Replan,
    ReplanOutcome,
    Verdict,
)

PLAN_CHECK = "plan check"
GOAL_CHECK = "goal check"
SKILL_STATUS = "skill status"


@dataclass(slots=True)
class Clock:
    """Compute seconds by phase."""

    seconds: dict[str, float] = field(default_factory=dict)
    _last: float = field(default_factory=time.perf_counter)

    def lap(self, name: str) -> None:
        """Book what has passed since the last call under a name."""
        now = time.perf_counter()
        self.seconds[name] = self.seconds.get(name, 0.0) + now - self._last
        self._last = now

    def items(self) -> tuple[tuple[str, float], ...]:
        """Seconds by phase."""
        return tuple(self.seconds.items())


class Intervention:
    """Replans after an alarm and remembers what was tried.

    A cause whose repair did not help after `max_attempts` attempts is left alone, so that a run
    cannot turn in circles. When a fact must change, no plan changes it, and the plan at hand does
    not check out either, the run stops safely.

    Args:
        replanner: makes the corrected plan.
        validator: says whether what is left of a plan runs on what is seen.
        max_attempts: repairs of one cause.
    """

    def __init__(self, replanner: Replanner, validator: PlanValidator, max_attempts: int) -> None:
        self._replanner = AskedReplanner(replanner)
        self._validator = AskedValidator(validator)
        self._max_attempts = max_attempts
        self._resume_left = 0
        self._attempts: dict[tuple[Literal, ...] | Subtask, int] = {}
        self._looking = Looking(validator.domain)

    def begin(self, context: BoundaryContext) -> None:
        """To be called before every subtask: forgets the last episode when a new one begins."""
        if context.replans == 0:
            self._resume_left = len(context.plan)
            if context.index == 0:
                self._attempts.clear()
                self._looking.reset()
        self._looking.begin(context)

    def repairs(self, context: BoundaryContext) -> bool:
        """Whether the subtask belongs to a repair, for which there is no demonstration."""
        return len(context.plan) - context.index > self._resume_left

    def check_rest(self, context: BoundaryContext, clock: Clock) -> StrategyAnswer:
        """Inside a repair: does what is left of the plan still run from what is seen?"""
        check = self.check_plan(context, clock)
        verdict = checked(
            PLAN_CHECK,
            check.ok,
            "a step of the repair: the rest of the plan is checked instead of compared",
        )
        if check.ok:
            unseen = relied_on_now(check, context, self._validator.domain)
            if unseen:
                return look_again(verdict, clock, f"not observed: {', '.join(map(str, unseen))}")
            return StrategyAnswer(Decision.PROCEED, verdict, seconds=clock.items())
        diagnosis = would_not_work(check)
        if context.may_look:
            return look_again(verdict, clock, diagnosis.cause, diagnosis)
        return self.alarm(context, verdict, diagnosis, clock)

    def why_not(self, context: BoundaryContext, clock: Clock) -> Diagnosis | None:
        """Why what is left of the plan would not run from what is seen, None if it would."""
        check = self.check_plan(context, clock)
        return None if check.ok else would_not_work(check)

    def done_already(self, context: BoundaryContext, clock: Clock) -> StrategyAnswer | None:
        """Before the first step: the goal holds on what is seen, so that nothing is left to do."""
        goal = context.task.goal
        if context.index or context.replans or not goal.literals or goal.never:
            return None
        check = self._validator.check(Plan(()), context.graph, goal)
        clock.lap("validate")
        asked = {x.predicate for x in goal.literals}
        if not check.ok or any(x.predicate in asked for x in check.assumed):
            return None
        why = "the goal holds already: nothing is left to do"
        plan = Plan((), context.plan.goal)
        replan = Replan(ReplanOutcome.SOLVED, plan, check, GOAL_CHECK, note=why)
        verdict = checked(GOAL_CHECK, True, why)
        return StrategyAnswer(Decision.REPLAN, verdict, None, replan, why, clock.items())

    def check_plan(self, context: BoundaryContext, clock: Clock) -> PlanCheck:
        """Does what is left of the plan run from what is seen?

        While something is looked for, it is no fault that nobody knows where it is.
        """
        rest = rest_of(context, self._validator.domain)
        check = self._validator.check(rest, context.graph, context.task.goal)
        clock.lap("validate")
        now = len(rest) - len(context.remaining())
        if not check.ok and self._looking.excuses(check, now, self.repairs(context)):
            return replace(check, ok=True)
        return check

    def check_goal(self, context: BoundaryContext, clock: Clock) -> tuple[Verdict, Diagnosis]:
        """Is the task's goal reached on what is seen? Names what of it is not."""
        check = self._validator.check(Plan(()), context.graph, context.task.goal)
        clock.lap("validate")
        verdict = checked(GOAL_CHECK, check.ok, "the plan is finished: its goal is checked")
        missing = ", ".join(map(str, check.unmet))
        return verdict, Diagnosis(
            cause="" if check.ok else f"the goal is not reached: {missing}",
            must_change=check.unmet,
            producer=GOAL_CHECK,
        )

    def refused(
        self, context: BoundaryContext, clock: Clock, lacking: tuple[Literal, ...] = ()
    ) -> StrategyAnswer:
        """The robot refused this very subtask, and nothing about it has changed: another way.

        Args:
            context: what is known.
            clock: books the time.
            lacking: what judges say must change besides.
        """
        _, goal = self.check_goal(context, clock)
        verdict = checked(SKILL_STATUS, False, "the robot has refused this subtask before")
        diagnosis = Diagnosis(
            cause=f"the robot has refused {context.subtask}, and nothing about it has changed",
            must_change=tuple(dict.fromkeys((*lacking, *goal.must_change))),
            culprits=context.subtask.args,
            producer=SKILL_STATUS,
            step=context.subtask,
        )
        return self.alarm(context, verdict, diagnosis, clock)

    def look_for(
        self, context: BoundaryContext, verdict: Verdict, clock: Clock
    ) -> StrategyAnswer | None:
        """An argument is nowhere to be seen, after every look: a plan to look where it may be.

        None where nothing is missing, or no place is left to look in.
        """
        lost = tuple(n for n in context.subtask.args if not context.graph.matches(n))
        if not lost or context.may_look:
            return None
        diagnosis = Diagnosis(
            cause=f"{' and '.join(lost)} has not been seen",
            must_change=tuple(Literal(LOCATED, (n,)) for n in lost),
            producer=PLAN_CHECK,
        )
        alarmed = replace(verdict, decision=Decision.REPLAN)
        answer = self.alarm(context, alarmed, diagnosis, clock)
        return answer if answer.decision is Decision.REPLAN else None

    def alarm(
        self,
        context: BoundaryContext,
        verdict: Verdict,
        diagnosis: Diagnosis,
        clock: Clock,
    ) -> StrategyAnswer:
        """Replan for what must change; `context.index` is where the plan at hand would go on."""
        if diagnosis.refusal and not diagnosis.found:  # no fact would help: something else is done
            _, missed = self.check_goal(context, clock)
            diagnosis = replace(diagnosis, must_change=missed.must_change)
        if not diagnosis.found:
            replan = Replan(ReplanOutcome.NOTHING_TO_CHANGE, producer=self._replanner.name)
            why = f"no cause was found: {diagnosis.cause}"
            return StrategyAnswer(Decision.PROCEED, verdict, diagnosis, replan, why, clock.items())
        key = tuple(sorted(diagnosis.must_change)) or context.subtask  # words have no key
        if self._attempts.get(key, 0) >= self._max_attempts:
            why = f"tried {self._max_attempts} repairs of this already"
            return StrategyAnswer(Decision.PROCEED, verdict, diagnosis, None, why, clock.items())
        if not context.task.goal.literals and self._brought_about(context):
            why = f"what {context.subtask} is to bring about holds already"
            return StrategyAnswer(Decision.PROCEED, verdict, diagnosis, None, why, clock.items())
        replan = self._another_way(context, self._looking.with_places(diagnosis, context))
        if replan.outcome is not ReplanOutcome.SOLVED:
            replan = self._found_first(context, diagnosis, replan)
        clock.lap("replan")
        if _is_the_old(replan.plan, context):  # what must change is nothing that planning knows of
            return self._no_plan(context, verdict, diagnosis, replan, clock)
        if replan.outcome is ReplanOutcome.SOLVED and replan.plan is not None:
            if replan.looking_for:  # another place each time, and there are only so many
                self._looking.seek(replan.looking_for)
            else:
                self._attempts[key] = self._attempts.get(key, 0) + 1
            self._resume_left = min(self._resume_left, _common_suffix(replan.plan, context))
            return StrategyAnswer(
                Decision.REPLAN, verdict, diagnosis, replan, diagnosis.cause, clock.items()
            )
        if context.may_look:
            return StrategyAnswer(
                Decision.LOOK_AGAIN, verdict, diagnosis, replan, replan.note, clock.items()
            )
        return self._no_plan(context, verdict, diagnosis, replan, clock)

    def _another_way(self, context: BoundaryContext, diagnosis: Diagnosis) -> Replan:
        """A plan without what came to nothing time and again; with it where there is no other."""
        if context.vain:
            barred = replace(context, refused=(*context.refused, *context.vain))
            found = self._replanner.replan(barred, diagnosis)
            if found.outcome is ReplanOutcome.SOLVED and not _is_the_old(found.plan, context):
                return found
        return self._replanner.replan(context, diagnosis)

    def _found_first(
        self, context: BoundaryContext, diagnosis: Diagnosis, failed: Replan
    ) -> Replan:
        """Where a repair fails since nobody knows where a thing is: a plan to look for that first.

        What must change is mended when the thing is found. The failed repair where that is not why.
        """
        lacking = () if failed.check is None else failed.check.lacking
        nowhere = missing(diagnosis.must_change, context.graph, self._validator.domain)
        named = (*(x for x in lacking if x.predicate == LOCATED), *nowhere)
        lost = tuple(x for x in dict.fromkeys(named) if x.args[0] not in self._looking.sought)
        if not lost or set(lost) <= set(diagnosis.must_change):
            return failed
        wanted = self._looking.with_places(replace(diagnosis, must_change=lost), context)
        search = self._another_way(context, wanted)
        return search if search.looking_for else failed

    def _brought_about(self, context: BoundaryContext) -> bool:
        """Whether everything holds already that the subtask does whatever else is so."""
        seen = came_about(context.graph, context.subtask, self._validator.domain)
        return seen is Truth.TRUE

    def _no_plan(
        self,
        context: BoundaryContext,
        verdict: Verdict,
        diagnosis: Diagnosis,
        replan: Replan,
        clock: Clock,
    ) -> StrategyAnswer:
        """Go on only if the plan at hand still checks out on what is seen, or there is time yet."""
        check = self.check_plan(context, clock)
        decision, why = Decision.PROCEED, "the plan at hand still checks out"
        if not check.ok and self._may_wait(context, check):
            why = f"there is time yet: {check.reason}"
        elif not check.ok:
            decision, why = Decision.STOP, f"stopped: {check.reason}"
        why = f"no repair found; {why}"
        return StrategyAnswer(decision, verdict, diagnosis, replan, why, clock.items())

    def _may_wait(self, context: BoundaryContext, check: PlanCheck) -> bool:
        """Whether a plan that will fail fails later, and the next subtask takes nothing away.

        It runs from what is seen, can be undone, and brings about nothing that must never be. What
        it shows may be what a repair lacks. Where things are missing one has looked for them.
        """
        domain = self._validator.domain
        now = len(rest_of(context, domain)) - len(context.remaining())
        if check.step is not None and check.step <= now:
            return False
        if check.lacking and all(x.predicate == LOCATED for x in check.lacking):
            return False
        if context.subtask.skill in irreversible_skills(domain):
            return False
        never = replace(context.task.goal, literals=())
        alone = self._validator.check(Plan((context.subtask,)), context.graph, never)
        harmless = alone.step is None and all(x.predicate == LOCATED for x in alone.unmet)
        return harmless and not relied_on_now(alone, context, domain)


def _is_the_old(plan: Plan | None, context: BoundaryContext) -> bool:
    """Whether a corrected plan is the plan at hand, which an alarm speaks against."""
    left = context.remaining()
    return (
        plan is not None
        and len(plan) == len(left)
        and all(same_step(new, old) for new, old in zip(plan, left, strict=True))
    )


def checked(detector: str, fine: bool, note: str) -> Verdict:
    """A verdict that compares nothing: something was checked, and it is fine or calls an alarm."""
    return Verdict(
        Decision.PROCEED if fine else Decision.REPLAN,
        detector,
        score=None,
        threshold=0.0,
        calibration=Calibration.FIXED,
        note=note,
    )


def would_not_work(check: PlanCheck) -> Diagnosis:
    """Why what is left of a plan would not work, as a check of it says."""
    steps = () if check.plan is None else check.plan.subtasks
    refused = check.step is not None and check.step < len(steps)
    return Diagnosis(
        cause=f"what is left of the plan would not work: {check.reason}",
        must_change=check.lacking or check.unmet,
        producer=PLAN_CHECK,
        step=steps[check.step] if refused and check.step is not None else None,
        refusal=check.reason,
    )


def look_again(
    verdict: Verdict, clock: Clock, why: str = "", suspected: Diagnosis | None = None
) -> StrategyAnswer:
    """Ask for another look before anything is claimed."""
    verdict = replace(verdict, decision=Decision.LOOK_AGAIN)
    return StrategyAnswer(
        Decision.LOOK_AGAIN, verdict, why=why, seconds=clock.items(), suspected=suspected
    )


def rest_of(context: BoundaryContext, domain: Domain) -> Plan:
    """What is left of the plan, with the drive before it and its things as they will be meant."""
    steps, index = context.plan.subtasks, context.index
    before = way_here(steps, index, context.graph, domain)
    rest = as_meant((*before, *steps[index:]), context.meant, context.graph, domain)
    return Plan(rest, context.plan.goal)


def _common_suffix(plan: Plan, context: BoundaryContext) -> int:
    """How many subtasks at the end of a corrected plan are the old plan's own."""
    same = 0
    for new, old in zip(reversed(plan.subtasks), reversed(context.remaining()), strict=False):
        if not same_step(new, old):
            break
        same += 1
    return same
