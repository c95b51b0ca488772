"""Replanning without a language model: a classical planner on the skill domain.

Called by the proactive strategy; calls `planning`. First it restores what must change and lets the
rest of the current plan run; only where that does not check out it plans anew for the task's goal.
Every plan that leaves here was accepted by the validator on the observed graph.
"""

from __future__ import annotations

import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from forestall.planning.planner import Planned, plan_goal, plan_to
from forestall.planning.relevance import alternatives
from forestall.planning.search import SearchConfig
from forestall.planning.state import State
from forestall.planning.validate import observed, unsupported
from forestall.seams import PlanValidator
from forestall.types.facts import GRIPPER, Literal, category_of
from forestall.types.plan import Plan, Subtask
from forestall.types.runtime import BoundaryContext
from forestall.types.task import Goal
from forestall.types.verdict import Diagnosis, PlanCheck, Replan, ReplanOutcome
from forestall.vocabulary import Vocabulary


@dataclass(slots=True)
class _Attempts:
    """What the attempts of one replanning cost and how they failed."""

    start_s: float
    expanded: int = 0
    timed_out: bool = False
    notes: tuple[str, ...] = ()
    rejected: tuple[Plan, PlanCheck] | None = None

    def count(self, planned: Planned) -> Planned:
        self.expanded += planned.expanded
        self.timed_out |= planned.outcome is ReplanOutcome.TIMEOUT
        if planned.note:
            self.notes = (*self.notes, planned.note)
        return planned


class PlannerReplanner:
    """Implements `Replanner`.

    Args:
        validator: accepts or refuses every plan.
        vocabulary: the categories.
        config: bounds of each single search.
    """

    name = "planner"

    def __init__(
        self, validator: PlanValidator, vocabulary: Vocabulary, config: SearchConfig | None = None
    ) -> None:
        self.validator = validator
        self.vocabulary = vocabulary
        self.config = config or SearchConfig()

    def replan(self, context: BoundaryContext, diagnosis: Diagnosis) -> Replan:
        """Make the corrected plan for the rest of the task, from the observed state."""
        attempts = _Attempts(time.perf_counter())
        if not diagnosis.must_change:
            return self._ended(attempts, ReplanOutcome.NOTHING_TO_CHANGE, diagnosis.cause)
        wanted = [x for x in diagnosis.must_change if not unsupported((x,), self.vocabulary)]
        if not wanted:
            names = ", ".join(map(str, diagnosis.must_change))
            return self._ended(attempts, ReplanOutcome.UNSUPPORTED, f"no skill is about {names}")
        state = observed(context.graph, self.vocabulary)
        repairs: list[Planned] = []
        for repair in self._repairs(attempts, state, context, wanted, diagnosis.must_stay):
            for rest in _rests(context, state, bool(repair.subtasks)):
                accepted = self._checked(attempts, context, (*repair.subtasks, *rest))
                if accepted is not None:
                    return accepted
            repairs.append(repair)
        for repair in (*repairs[:1], Planned(ReplanOutcome.SOLVED, (), state)):
            if repair.final is None:
                continue
            onward = attempts.count(plan_goal(repair.final, context.task.goal, self.config))
            if onward.outcome is ReplanOutcome.SOLVED:
                steps = (*repair.subtasks, *onward.subtasks)
                accepted = self._checked(attempts, context, steps)
                if accepted is not None:
                    return accepted
        return self._failed(attempts, state, wanted)

    def _repairs(
        self,
        attempts: _Attempts,
        state: State,
        context: BoundaryContext,
        wanted: list[Literal],
        must_stay: Sequence[Literal],
    ) -> Iterator[Planned]:
        """Plans to what must change, keeping as much as possible of what should stay."""
        possible = wanted
        hand = _hand(state, wanted)
        safe = _unspoiled(state, context.task.goal, wanted)
        stay = [g for x in must_stay if (g := _as_it_is(state, x)) is not None]
        tried = set()
        for kept in ([*hand, *stay], hand, hand[:1], []):
            facts = tuple(dict.fromkeys((*possible, *kept, *safe)))
            if facts in tried:
                continue
            tried.add(facts)
            planned = self._plan(attempts, state, facts)
            if planned.outcome is ReplanOutcome.SOLVED:
                yield planned
        if len(wanted) > 1:
            possible = [x for x in wanted if self._can(state, x)]
            if possible and len(possible) < len(wanted):
                yield from self._repairs(attempts, state, context, possible, must_stay)

    def _plan(self, attempts: _Attempts, state: State, facts: Sequence[Literal]) -> Planned:
        goals = alternatives(state, Goal("", literals=tuple(facts)))
        planned = attempts.count(plan_to(state, goals, self.config))
        running = _left_running(state, planned, facts)
        if not running:
            return planned
        goals = alternatives(state, Goal("", literals=(*facts, *running)))
        tidy = attempts.count(plan_to(state, goals, self.config))
        return tidy if tidy.outcome is ReplanOutcome.SOLVED else planned

    def _can(self, state: State, literal: Literal) -> bool:
        goals = alternatives(state, Goal("", literals=(literal,)))
        return plan_to(state, goals, self.config).outcome is ReplanOutcome.SOLVED

    def _checked(
        self, attempts: _Attempts, context: BoundaryContext, subtasks: Sequence[Subtask]
    ) -> Replan | None:
        plan = Plan(tuple(subtasks), context.plan.goal or context.task.goal.text)
        check = self.validator.check(plan, context.graph, context.task.goal)
        if not check.ok:
            attempts.rejected = attempts.rejected or (plan, check)
            return None
        return Replan(
            ReplanOutcome.SOLVED,
            plan,
            check,
            self.name,
            attempts.expanded,
            time.perf_counter() - attempts.start_s,
        )

    def _failed(self, attempts: _Attempts, state: State, wanted: list[Literal]) -> Replan:
        lost = [a for x in wanted for a in x.args if a != GRIPPER and _is_lost(state, a)]
        if lost:
            note = f"{', '.join(dict.fromkeys(lost))}: its place is not known"
            return self._ended(attempts, ReplanOutcome.UNSOLVABLE, note)
        note = "; ".join(dict.fromkeys(attempts.notes))
        if attempts.timed_out:
            return self._ended(attempts, ReplanOutcome.TIMEOUT, note)
        if attempts.rejected is not None and not attempts.notes:
            return self._ended(attempts, ReplanOutcome.REJECTED, attempts.rejected[1].reason)
        return self._ended(attempts, ReplanOutcome.UNSOLVABLE, note)

    def _ended(self, attempts: _Attempts, outcome: ReplanOutcome, note: str) -> Replan:
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


def _hand(state: State, wanted: Sequence[Literal]) -> list[Literal]:
    """What the hand holds, and what lies in or on that, should stay so."""
    if any(x.predicate in ("held_by", "hand_empty") for x in wanted):
        return []
    if state.held is None:
        return [Literal("hand_empty", ())]
    facts = [Literal("held_by", (state.held, GRIPPER))]
    concerned = {a for x in wanted if x.predicate == "vacant" for a in x.args}
    if state.held not in concerned:
        for name in state.contents(state.held):
            facts.append(Literal(state.places[name].relation, (name, state.held)))
    return facts


def _as_it_is(state: State, literal: Literal) -> Literal | None:
    """A literal that holds, with category names replaced by the instances that make it hold."""
    if unsupported((literal,), state.vocabulary) or not state.holds(literal):
        return None
    if literal.value == "false":
        return literal
    for position, name in enumerate(literal.args):
        if name == GRIPPER or name in state.kinds:
            continue
        for instance in state.matches(name):
            ground = literal.bind({literal.args[position]: instance})
            if state.holds(ground):
                literal = ground
                break
    return literal


def _unspoiled(state: State, goal: Goal, wanted: Sequence[Literal]) -> list[Literal]:
    """What the repair handles and must not spoil, since the goal forbids it for good."""
    kinds = dict(goal.variables)
    guarded = {kinds.get(a, category_of(a)) for x in goal.never for a in x.args}
    handled = {a for x in wanted for a in x.args if a in state.kinds}
    handled |= {state.held} if state.held is not None else set()
    handled |= {y for x in handled for y in state.contents(x)}
    return [
        Literal("spoiled", (x,), "false")
        for x in sorted(handled)
        if state.kinds[x] in guarded and x not in state.spoiled
    ]


def _left_running(state: State, planned: Planned, facts: Sequence[Literal]) -> list[Literal]:
    """Devices that a repair would leave on although they were off and nothing asks for it."""
    if planned.final is None:
        return []
    asked = {x.args[0] for x in facts if x.predicate == "toggled"}
    return [
        Literal("toggled", (name,), "off")
        for name in sorted(state.kinds)
        if state.value(name, "toggled") == "off"
        and planned.final.value(name, "toggled") == "on"
        and name not in asked
    ]


def _rests(
    context: BoundaryContext, state: State, repaired: bool
) -> tuple[tuple[Subtask, ...], ...]:
    """What is left of the current plan, with the drive that led to its first step.

    First with categories of which there are several bound to the thing that the robot deals with
    now, then as it stands.
    """
    rest = context.plan.subtasks[context.index :]
    before = context.plan.subtasks[context.index - 1 : context.index] if context.index else ()
    if repaired and before and before[0].skill == "navigate_to_obj":
        rest = (*before, *rest)
    bound = {}
    for name in (*context.subtask.args, *([state.held] if state.held else [])):
        kind = state.kinds.get(name)
        if kind is None or state.category(name).fixture:
            continue
        if len(state.instances(kind)) > 1:
            bound[kind] = name
    named = tuple(Subtask(s.skill, tuple(bound.get(a, a) for a in s.args)) for s in rest)
    return (named,) if named == rest else (named, rest)


def _is_lost(state: State, name: str) -> bool:
    return all(x in state.lost for x in state.matches(name))
