"""Replanning without a language model: a classical planner on the skill domain.

Called by the proactive strategy; calls `planning`. First it restores what must change and lets the
rest of the current plan run; only where that does not check out it plans anew for the task's goal.
Every plan that leaves here was accepted by the validator on the observed graph.
"""

from __future__ import annotations

import time
from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import replace

from forestall.deadline import Deadline, TimeUp
from forestall.domain.looked import made_of, made_of_what_is_there, searched
from forestall.domain.model import Domain
from forestall.planning.goals import alternatives
from forestall.planning.planner import Planned, plan_goal, plan_to
from forestall.planning.refused import denial, is_refused, no_other, unexplained
from forestall.planning.search import SearchConfig
from forestall.planning.state import State
from forestall.planning.validate import as_checked, observed, run, unmet, unsupported
from forestall.replanning.attempts import Attempts
from forestall.replanning.cheaper import Asked, cheaper, less_of_time
from forestall.replanning.hidden import (
    IN_VAIN,
    hiding_places,
    in_vain,
    is_shut_place,
    sought,
)
from forestall.replanning.kept import as_it_is, hand, left_running, rests_of, unspoiled
from forestall.replanning.searching import as_usual, with_shutting, without
from forestall.replanning.waiting import first_empty
from forestall.seams.judging import PlanValidator
from forestall.types.facts import Literal
from forestall.types.plan import Plan, Subtask
from forestall.types.runtime import BoundaryContext
from forestall.types.task import Goal
from forestall.types.verdict import Diagnosis, Replan, ReplanOutcome


class PlannerReplanner:
    """Implements `Replanner`.

    Args:
        validator: accepts or refuses every plan.
        domain: what is planned in.
        config: bounds of one replanning, whatever it tries; of the states those of each search.
    """

    name = "planner"

    def __init__(
        self, validator: PlanValidator, domain: Domain, config: SearchConfig | None = None
    ) -> None:
        self.validator = validator
        self.domain = domain
        self.config = config or SearchConfig()

    def replan(
        self, context: BoundaryContext, diagnosis: Diagnosis, deadline: Deadline | None = None
    ) -> Replan:
        """Make the corrected plan for the rest of the task, from the observed state.

        Args:
            context: what is known; what the robot has refused, though the state allows it, is not
                tried again.
            diagnosis: what must change.
            deadline: when to stop, however much time there is by itself; it may be cancelled from
                another thread, and the answer then comes within milliseconds.
        """
        limit = (deadline or Deadline()).within(self.config.time_limit_s)
        attempts = Attempts(time.perf_counter(), limit)
        try:
            return self._replan(attempts, context, diagnosis)
        except TimeUp as late:
            return self._ended(attempts, ReplanOutcome.TIMEOUT, str(late))

    def _replan(self, attempts: Attempts, context: BoundaryContext, diagnosis: Diagnosis) -> Replan:
        if not diagnosis.must_change:
            return self._ended(attempts, ReplanOutcome.NOTHING_TO_CHANGE, diagnosis.cause)
        lost = sought(diagnosis.must_change, context.graph)
        if set(lost) - made_of_what_is_there(lost, context.graph, self.domain):
            search = self._search(attempts, context, lost, diagnosis.must_stay)
            if search is not None:
                return search
            attempts.notes = in_vain(lost, diagnosis.must_stay, self.domain)
        found = self._changed(attempts, context, diagnosis, lost)
        if found.outcome is ReplanOutcome.SOLVED or not lost or attempts.notes:
            return found
        return self._search(attempts, context, lost, diagnosis.must_stay) or found

    def _changed(
        self,
        attempts: Attempts,
        context: BoundaryContext,
        diagnosis: Diagnosis,
        lost: tuple[str, ...],
    ) -> Replan:
        """The plan in which what must change has changed; what is `lost` may have to be made."""
        wanted = [x for x in diagnosis.must_change if not unsupported((x,), self.domain)]
        if not wanted:
            names = ", ".join(map(str, diagnosis.must_change))
            return self._ended(attempts, ReplanOutcome.UNSUPPORTED, f"no skill is about {names}")
        state = observed(context.graph, self.domain)
        attempts.refused, attempts.vain = unexplained(state, context.refused), context.vain
        repairs: list[Planned] = []
        stay = [x for x in diagnosis.must_stay if not set(lost) & set(x.args)]
        for repair in self._repairs(attempts, state, context, wanted, stay):
            rests = rests_of(context, state, bool(repair.subtasks))
            if context.refused and repair.final and not unmet((repair.final,), context.task.goal):
                rests = ((), *rests)  # what was wanted was all that is left to do
            for rest in rests:
                accepted = self._checked(attempts, context, state, (*repair.subtasks, *rest))
                if accepted is not None:
                    now = self._shortened(attempts, context, state, accepted, len(rest), wanted)
                    later = self._later(attempts, context, diagnosis, state, wanted, stay)
                    return less_of_time(now, later, state, _stands_at(context))
            repairs.append(repair)
        for repair in (*repairs[:1], Planned(ReplanOutcome.SOLVED, (), state)):
            if repair.final is None or not context.task.goal.literals:
                continue  # without a goal there is nothing to plan for but what was left
            onward = attempts.count(
                plan_goal(
                    repair.final,
                    context.task.goal,
                    self.config,
                    attempts.deadline,
                    attempts.refused,
                )
            )
            if onward.outcome is ReplanOutcome.SOLVED:
                steps = (*repair.subtasks, *onward.subtasks)
                accepted = self._checked(attempts, context, state, steps)
                if accepted is not None:
                    return self._shortened(attempts, context, state, accepted, 0, wanted)
        return self._failed(attempts, state, wanted)

    def _later(
        self,
        attempts: Attempts,
        context: BoundaryContext,
        diagnosis: Diagnosis,
        state: State,
        wanted: list[Literal],
        stay: Sequence[Literal],
    ) -> Replan | None:
        """The repair once the hands are empty, where that is soon enough and nothing is refused."""
        rest = context.remaining()
        due = None if context.refused else diagnosis.step
        waits = first_empty(state, rest, due, diagnosis.must_change)
        if waits is None:
            return None
        done, then = waits
        with suppress(TimeUp):  # the plan that mends it now will do
            for repair in self._repairs(attempts, then, context, wanted, stay):
                steps = (*rest[:done], *repair.subtasks, *rest[done:])
                accepted = self._checked(attempts, context, state, steps)
                if accepted is not None:
                    left = len(rest) - done
                    return self._shortened(attempts, context, state, accepted, left, wanted)
        return None

    def _search(
        self,
        attempts: Attempts,
        context: BoundaryContext,
        lost: tuple[str, ...],
        known: Sequence[Literal],
    ) -> Replan | None:
        """Go where something may be that nobody has seen, open what is shut; None: there is none.

        What was left of the plan follows as it stands: it cannot be checked before the thing is
        found, and is then.
        """
        state = observed(context.graph, self.domain)
        attempts.refused, attempts.vain = unexplained(state, context.refused), context.vain
        origins = made_of(lost, context.graph, self.domain)
        for name in (*origins, *lost):
            empty = searched(name, known, self.domain)
            places = hiding_places(
                name,
                context.graph,
                self.domain,
                context.references,
                _stands_at(context),
                context.task.plan,
            )
            opened = [p for p in empty if self.domain.encloses(state.kinds.get(p, p))]
            shutting = self._to(attempts, state, as_usual(state, opened)).subtasks if opened else ()
            for place in (p for p in places if p not in empty):
                found = self._look_into(attempts, context, state, place, shutting)
                if found is None or found.plan is None:
                    continue
                after = run(state, found.plan.subtasks).final
                again = (
                    as_usual(after, (place,)) if self.domain.encloses(state.kinds[place]) else ()
                )
                closing = self._to(attempts, after, again).subtasks if again else ()
                rest = without(context.remaining(), shutting, self.domain)
                opening = found.plan.subtasks
                rest = with_shutting(rest, opening, closing, name, self.domain)
                plan = Plan((*opening, *rest), found.plan.goal)
                note = f"looking for {name} in {place}"
                return replace(found, plan=plan, note=note, looking_for=(*lost, *origins))
        return None

    def _look_into(
        self,
        attempts: Attempts,
        context: BoundaryContext,
        state: State,
        place: str,
        shutting: tuple[Subtask, ...],
    ) -> Replan | None:
        """Steps that go to a place and open it where it is shut, after those that shut others."""
        start, driving = run(state, shutting).final, self.domain.driving()
        shut, node = self.domain.roles.shut, context.graph.get(place)
        if shut is None or node is None or not is_shut_place(node, self.domain):
            if driving is None:
                return None
            steps = (*shutting, Subtask(driving.name, (place,)))
            return self._checked(attempts, context, state, steps, Goal(""))
        opened = Literal(shut, (place,), "false")
        for kept in (hand(start, [opened]), []):
            planned = self._to(attempts, start, (opened, *kept))
            if planned.subtasks:
                steps = (*shutting, *planned.subtasks)
                found = self._checked(attempts, context, state, steps, Goal(""))
                if found is not None:
                    return found
        return None

    def _repairs(
        self,
        attempts: Attempts,
        state: State,
        context: BoundaryContext,
        wanted: list[Literal],
        must_stay: Sequence[Literal],
    ) -> Iterator[Planned]:
        """Plans to what must change, keeping as much as possible of what should stay.

        Among everything, and not only what matters, is searched where nothing else was found.
        """
        possible = wanted
        held = hand(state, wanted)
        safe = unspoiled(state, context.task.goal, wanted)
        stay = [g for x in must_stay if (g := as_it_is(state, x)) is not None]
        tried: set[tuple[Literal, ...]] = set()
        solved = False
        for kept in ([*held, *stay], held, held[:1], []):
            facts = tuple(dict.fromkeys((*possible, *kept, *safe)))
            if facts in tried:
                continue
            tried.add(facts)
            planned = self._plan(attempts, state, facts)
            if planned.outcome is ReplanOutcome.SOLVED:
                solved = True
                yield planned
        if len(wanted) > 1 and not solved:
            possible = [x for x in wanted if self._can(attempts, state, x)]
            if possible and len(possible) < len(wanted):
                yield from self._repairs(attempts, state, context, possible, must_stay)
                return
        if not solved:
            planned = self._plan(attempts, state, (*wanted, *safe), widen=True)
            if planned.outcome is ReplanOutcome.SOLVED:
                yield planned

    def _plan(
        self,
        attempts: Attempts,
        state: State,
        facts: Sequence[Literal],
        widen: bool = False,
    ) -> Planned:
        planned = attempts.count(self._to(attempts, state, facts, widen))
        running = left_running(state, planned, facts)
        if not running:
            return planned
        tidy = attempts.count(self._to(attempts, state, (*facts, *running)))
        return tidy if tidy.outcome is ReplanOutcome.SOLVED else planned

    def _to(
        self, attempts: Attempts, state: State, facts: Sequence[Literal], widen: bool = False
    ) -> Planned:
        share = attempts.share()
        goals = alternatives(state, Goal("", literals=tuple(facts)), deadline=share)
        return plan_to(
            state, goals, self.config, widen=widen, deadline=share, refused=attempts.refused
        )

    def _can(self, attempts: Attempts, state: State, literal: Literal) -> bool:
        return self._to(attempts, state, (literal,)).outcome is ReplanOutcome.SOLVED

    def _checked(
        self,
        attempts: Attempts,
        context: BoundaryContext,
        state: State,
        subtasks: Sequence[Subtask],
        goal: Goal | None = None,
    ) -> Replan | None:
        plan = Plan(tuple(subtasks), context.plan.goal or context.task.goal.text)
        attempts.deadline.check()
        check = self.validator.check(plan, context.graph, goal or context.task.goal)
        denied = is_refused(check.plan or plan, attempts.refused)
        if denied is not None:
            check = replace(check, ok=False, reason=denial(denied, attempts.vain))
        if not check.ok:
            attempts.rejected = attempts.rejected or (plan, check)
            return None
        return Replan(
            ReplanOutcome.SOLVED,
            as_checked(plan, check, state),
            check,
            self.name,
            attempts.expanded,
            time.perf_counter() - attempts.start_s,
        )

    def _shortened(
        self,
        attempts: Attempts,
        context: BoundaryContext,
        state: State,
        found: Replan,
        rest: int,
        wanted: Sequence[Literal],
    ) -> Replan:
        """The plan that takes the robot less, its last `rest` steps being the old plan's."""
        asked = Asked(
            state,
            tuple(wanted),
            lambda steps: self._checked(attempts, context, state, steps),
            lambda start, facts: self._to(attempts, start, facts).subtasks,
            _stands_at(context),
            keeps_rest=not context.task.goal.literals,
        )
        return cheaper(asked, found, rest)

    def _failed(self, attempts: Attempts, state: State, wanted: list[Literal]) -> Replan:
        hands = self.domain.robot.hands
        lost = [a for x in wanted for a in x.args if a not in hands and _is_lost(state, a)]
        if lost:
            vain = [n for n in attempts.notes if n.endswith(IN_VAIN)]
            note = f"{', '.join(dict.fromkeys(lost))}: its place is not known"
            return self._ended(attempts, ReplanOutcome.UNSOLVABLE, "; ".join((*vain, note)))
        note = "; ".join(
            dict.fromkeys((*no_other(state, attempts.refused, attempts.vain), *attempts.notes))
        )
        if attempts.timed_out:
            return self._ended(attempts, ReplanOutcome.TIMEOUT, note)
        if attempts.rejected is not None and not attempts.notes:
            return self._ended(attempts, ReplanOutcome.REJECTED, attempts.rejected[1].reason)
        if attempts.unproven:
            return self._ended(attempts, ReplanOutcome.NOT_FOUND, note)
        return self._ended(attempts, ReplanOutcome.UNSOLVABLE, note)

    def _ended(self, attempts: Attempts, outcome: ReplanOutcome, note: str) -> Replan:
        plan, check = attempts.rejected or (None, None)
        rejected = outcome is ReplanOutcome.REJECTED
        return Replan(
            outcome,
            plan if rejected else None,
            check,
            self.name,
            attempts.expanded,
            time.perf_counter() - attempts.start_s,
            note,
        )


def _stands_at(context: BoundaryContext) -> tuple[float, float] | None:
    """Where the robot stands, as far as it says so."""
    if context.observation is None:
        return None
    return context.observation.robot_position_world_m[:2]


def _is_lost(state: State, name: str) -> bool:
    return all(x in state.lost for x in state.matches(name))
