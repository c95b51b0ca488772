"""The planner: from an observed state and a goal to a readable plan.

Called by `replanning/`; calls `relevance`, `translate`, `search`. Driving is not searched for:
`navigate_to_obj` steps are put in afterwards where the next manipulation is at another place.
"""

from __future__ import annotations

import time
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from forestall.planning.domain import Refusal, State, apply
from forestall.planning.problem import Operator, Problem
from forestall.planning.relevance import Conjunction, alternatives, universe
from forestall.planning.search import SearchConfig, SearchOutcome, solve
from forestall.planning.translate import UnsupportedError, translate
from forestall.types.facts import GRIPPER
from forestall.types.plan import Subtask
from forestall.types.task import Goal
from forestall.types.verdict import ReplanOutcome

OUTCOMES = {
    SearchOutcome.SOLVED: ReplanOutcome.SOLVED,
    SearchOutcome.UNSOLVABLE: ReplanOutcome.UNSOLVABLE,
    SearchOutcome.TIMEOUT: ReplanOutcome.TIMEOUT,
}


@dataclass(frozen=True, slots=True)
class Planned:
    """What planning gave: subtasks when solved, the state after them, and what it cost."""

    outcome: ReplanOutcome
    subtasks: tuple[Subtask, ...] = ()
    final: State | None = None
    expanded: int = 0
    seconds: float = 0.0
    note: str = ""


def plan_to(
    state: State,
    goals: Sequence[Conjunction],
    config: SearchConfig | None = None,
    also: Iterable[str] = (),
) -> Planned:
    """Plan from a state to any one of some ground conjunctions."""
    start_s = time.perf_counter()
    if not goals:
        return Planned(ReplanOutcome.UNSOLVABLE, note="nothing that is known can meet the goal")
    kept = universe(state, goals, also)
    try:
        problem = translate(state, goals, kept)
    except UnsupportedError as error:
        return Planned(ReplanOutcome.UNSUPPORTED, note=str(error))
    found = solve(problem, config)
    outcome = OUTCOMES[found.outcome]
    subtasks: tuple[Subtask, ...] = ()
    final, note = None, ""
    if outcome is ReplanOutcome.SOLVED:
        named = {a for goal in goals for x in goal for a in x.args}
        loose = frozenset(x for x in kept.supports if x not in named)
        steps = _gathered(problem, state, [problem.operators[i] for i in found.steps])
        subtasks, final, note = with_driving(state, steps, loose)
        if final is None:
            outcome = ReplanOutcome.REJECTED
    elif outcome is ReplanOutcome.UNSOLVABLE:
        note = _why_not(state, goals)
    else:
        note = f"no plan within the limits ({found.expanded} states expanded)"
    return Planned(outcome, subtasks, final, found.expanded, time.perf_counter() - start_s, note)


def plan_goal(state: State, goal: Goal, config: SearchConfig | None = None) -> Planned:
    """Plan from a state to a task's goal, whatever binding of its variables is nearest."""
    goals = alternatives(state, goal)
    if not goals:
        missing = [c for _, c in goal.variables if not _anywhere(state, c)]
        missing += [a for x in goal.literals for a in x.args if _nowhere(state, a)]
        names = ", ".join(dict.fromkeys(missing)) or "what the goal asks for"
        return Planned(ReplanOutcome.UNSOLVABLE, note=f"{names}: its place is not known")
    return plan_to(state, goals, config)


def pose(state: State, goals: Sequence[Conjunction], also: Iterable[str] = ()) -> Problem:
    """The ground problem of a state and goal alternatives.

    Raises:
        UnsupportedError: no alternative can be expressed.
    """
    return translate(state, goals, universe(state, goals, also))


def _gathered(problem: Problem, state: State, steps: list[Operator]) -> list[Operator]:
    """Turn things on and off where the robot is anyway, if that saves driving.

    A step at a switch moves up behind the last step at its place, where the plan still works.
    """
    for i, step in enumerate(steps):
        if not step.subtask.skill.startswith("toggle"):
            continue
        place = _place(state, step.subtask.args[0])
        near = [j for j in range(i - 1) if _place(state, steps[j].subtask.args[-1]) == place]
        if not near or _place(state, steps[i - 1].subtask.args[-1]) == place:
            continue
        moved = [*steps[: near[-1] + 1], step, *steps[near[-1] + 1 : i], *steps[i + 1 :]]
        if _works(problem, moved):
            steps = moved
    return steps


def _works(problem: Problem, steps: Sequence[Operator]) -> bool:
    bits = problem.initial
    for operator in steps:
        if operator.condition & bits != operator.condition:
            return False
        bits = operator.apply(bits)
    return problem.reached(bits)


def _place(state: State, name: str) -> str | None:
    """Where the robot stands to handle a thing; None for what does not exist yet."""
    if name not in state.kinds:
        return None
    device = state.category(name).device
    if device is not None and device.acts_on is not None and state.targets(name):
        return state.targets(name)[0]
    return state.root(name)


def with_driving(
    state: State, operators: Sequence[Operator], loose: frozenset[str] = frozenset()
) -> tuple[tuple[Subtask, ...], State | None, str]:
    """Insert navigation, executing along; the final state is None if a step does not run.

    A support in `loose` is named by its category: any other of its kind with room would do.
    """
    plan: list[Subtask] = []
    where: str | None = None
    for operator in operators:
        subtask, over = operator.subtask, operator.over
        subject = over or subtask.args[-1]
        place = _place(state, subject)
        steps_here = [subtask]
        if (place != where or over) and subject != state.held:
            landmark = over or _landmark(state, subject)
            steps_here.insert(0, Subtask("navigate_to_obj", (landmark,)))
        where = place
        if place == subject and place in loose and state.instances(state.kinds[place])[0] == place:
            steps_here = [_renamed(s, place, state.kinds[place]) for s in steps_here]
        for step in steps_here:
            after = apply(state, step)
            if isinstance(after, Refusal):
                return tuple(plan), None, f"{step} does not run: {after.reason}"
            state = after
            plan.append(step)
    return tuple(plan), state, ""


def _renamed(subtask: Subtask, old: str, new: str) -> Subtask:
    return Subtask(subtask.skill, tuple(new if a == old else a for a in subtask.args))


def _landmark(state: State, name: str) -> str:
    """What to drive to for a thing: the container that it is inside, else itself."""
    for place in state.chain(name):
        fixture = place.parent == state.root(name) or state.vocabulary.encloses(place.parent)
        if fixture and place.relation == "inside":
            return place.parent
    return name


def _anywhere(state: State, category: str) -> bool:
    return any(x not in state.lost for x in state.matches(category))


def _nowhere(state: State, name: str) -> bool:
    return name != GRIPPER and not name.startswith("?") and not _anywhere(state, name)


def _why_not(state: State, goals: Sequence[Conjunction]) -> str:
    """A reason for a proven dead end, naming what is lost if something is."""
    lost = sorted({a for goal in goals for x in goal for a in x.args if a in state.lost})
    if lost:
        return f"{', '.join(lost)}: its place is not known"
    facts = [x for x in goals[0] if not x.predicate.startswith("not ") and not state.holds(x)]
    return "no sequence of skills leads to " + ", ".join(map(str, facts or goals[0]))
