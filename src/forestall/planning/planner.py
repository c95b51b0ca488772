"""The planner: from an observed state and a goal to a readable plan.

Called by `replanning`; calls `relevance`, `ground`, `number`, `search`, `driving`. First on what
matters for the goal, and where that has no plan on everything; only then is something unsolvable.
"""

from __future__ import annotations

import time
from collections import OrderedDict
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from math import inf

from forestall.planning.drafts import Grounding
from forestall.planning.driving import gathered, with_driving
from forestall.planning.goals import (
    Alternatives,
    Conjunction,
    alternatives,
    negated,
    shown,
)
from forestall.planning.ground import TooLargeError, ground
from forestall.planning.grounder import Universe
from forestall.planning.number import UnsupportedError, number
from forestall.planning.problem import Problem
from forestall.planning.relevance import everything, narrowed
from forestall.planning.search import SearchConfig, SearchOutcome, solve
from forestall.planning.state import State
from forestall.planning.validate import unmet
from forestall.types.facts import Literal
from forestall.types.plan import Subtask
from forestall.types.task import Goal
from forestall.types.verdict import ReplanOutcome

OUTCOMES = {
    SearchOutcome.SOLVED: ReplanOutcome.SOLVED,
    SearchOutcome.UNSOLVABLE: ReplanOutcome.NOT_FOUND,
    SearchOutcome.CUT_SHORT: ReplanOutcome.NOT_FOUND,
    SearchOutcome.TIMEOUT: ReplanOutcome.TIMEOUT,
}

_RECENT = 16
SHORTEST_S = 0.2
"""Grounding is given at least so long, whatever the time limit of the search."""


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
    goals: Alternatives,
    config: SearchConfig | None = None,
    also: Iterable[str] = (),
    widen: bool = True,
) -> Planned:
    """Plan from a state to any one of some ground conjunctions.

    Args:
        state: the first state.
        goals: what to reach.
        config: bounds of the search.
        also: further things to keep in the narrowed problem.
        widen: go on with everything where the narrowed problem has no plan.
    """
    start_s = time.perf_counter()
    config = config or SearchConfig()
    if not goals.conjunctions:
        return Planned(ReplanOutcome.UNSOLVABLE, note="nothing that is known can meet the goal")
    kept = narrowed(state, goals.conjunctions, also)
    planned = Planned(ReplanOutcome.NOT_FOUND)
    for careful in (True, False):
        tried = _attempt(state, goals, kept, config, careful)
        planned = replace(tried, expanded=planned.expanded + tried.expanded)
        if planned.outcome in (ReplanOutcome.SOLVED, ReplanOutcome.UNSUPPORTED):
            break
        if planned.outcome is ReplanOutcome.TIMEOUT:
            break
    failed = planned.outcome in (ReplanOutcome.NOT_FOUND, ReplanOutcome.REJECTED)
    if failed and widen and planned.expanded < config.max_expansions:
        planned = _on_everything(state, goals, config, planned)
    return replace(planned, seconds=time.perf_counter() - start_s)


def _on_everything(
    state: State, goals: Alternatives, config: SearchConfig, before: Planned
) -> Planned:
    """The search that proves something, or finds what narrowing has hidden."""
    limits = replace(config, time_limit_s=min(config.time_limit_s, config.whole_limit_s))
    tried = _attempt(state, goals, everything(state), limits, careful=False)
    if tried.outcome is ReplanOutcome.TIMEOUT and limits.time_limit_s < config.time_limit_s:
        tried = replace(tried, outcome=ReplanOutcome.NOT_FOUND)
    return replace(tried, expanded=before.expanded + tried.expanded)


def _attempt(
    state: State, goals: Alternatives, kept: Universe, config: SearchConfig, careful: bool
) -> Planned:
    start_s = time.perf_counter()
    deadline_s = start_s + max(config.time_limit_s, SHORTEST_S)
    try:
        grounding = _grounding(state, kept, deadline_s)
        problem = number(grounding, state, goals.conjunctions, careful)
    except UnsupportedError as error:
        return Planned(ReplanOutcome.UNSUPPORTED, note=str(error))
    except TooLargeError:
        note = f"{len(kept.things)} things are too many for the time"
        return Planned(ReplanOutcome.TIMEOUT, note=note)
    found = solve(problem, config)
    outcome = OUTCOMES[found.outcome]
    subtasks: tuple[Subtask, ...] = ()
    final, note = None, ""
    if outcome is ReplanOutcome.SOLVED:
        loose = frozenset(x for x in kept.supports if x not in goals.names)
        steps = gathered(problem, state, [problem.operators[i] for i in found.steps])
        subtasks, final, note = with_driving(state, steps, loose)
        if final is None:
            outcome = ReplanOutcome.REJECTED
    elif found.outcome is SearchOutcome.UNSOLVABLE:
        whole = kept.purposeful is None and goals.complete and not problem.bounded and not careful
        outcome = ReplanOutcome.UNSOLVABLE if whole else ReplanOutcome.NOT_FOUND
        note = _why_not(state, goals.conjunctions)
    else:
        note = f"no plan within the limits ({found.expanded} states expanded)"
    return Planned(outcome, subtasks, final, found.expanded, time.perf_counter() - start_s, note)


def plan_goal(state: State, goal: Goal, config: SearchConfig | None = None) -> Planned:
    """Plan from a state to a task's goal, whatever binding of its variables is nearest."""
    goals = alternatives(state, goal)
    if not goals.conjunctions:
        goals = alternatives(state, goal, whole=True)
    if not goals.conjunctions:
        missing = [c for _, c in goal.variables if not _anywhere(state, c)]
        missing += [a for x in goal.literals for a in x.args if _nowhere(state, a)]
        names = ", ".join(dict.fromkeys(missing)) or "what the goal asks for"
        return Planned(ReplanOutcome.UNSOLVABLE, note=f"{names}: its place is not known")
    planned = _met(plan_to(state, goals, config, widen=False), goal)
    if planned.outcome in (ReplanOutcome.NOT_FOUND, ReplanOutcome.REJECTED):
        bounds = config or SearchConfig()
        if planned.expanded < bounds.max_expansions:
            goals = alternatives(state, goal, whole=True)
            return _met(_on_everything(state, goals, bounds, planned), goal)
    return planned


def _met(planned: Planned, goal: Goal) -> Planned:
    """A plan that names what it makes otherwise than the goal does is none."""
    if planned.final is None:
        return planned
    missing = unmet((planned.final,), goal)
    if not missing:
        return planned
    note = "the plan that was found does not reach " + ", ".join(map(str, missing))
    return replace(planned, outcome=ReplanOutcome.REJECTED, subtasks=(), final=None, note=note)


def pose(
    state: State, goals: Alternatives, also: Iterable[str] = (), whole: bool = False
) -> Problem:
    """The ground problem of a state and goal alternatives.

    Raises:
        UnsupportedError: no alternative can be expressed.
    """
    kept = everything(state) if whole else narrowed(state, goals.conjunctions, also)
    return number(_grounding(state, kept), state, goals.conjunctions, not whole)


def _grounding(state: State, kept: Universe, deadline_s: float = inf) -> Grounding:
    """What can happen among the kept things; the several searches of one replanning share it."""
    known = frozenset(kept.things)
    hands = state.domain.robot.hands
    facts = frozenset(f for f in state.facts if all(a in known or a in hands for a in f[1:]))
    key = (
        tuple((x, state.kinds[x]) for x in kept.things),
        tuple(sorted(state.kinds.items())),
        facts,
        state.lost,
        tuple(sorted(kept.made.items())),
        kept.purposeful,
        kept.supports,
    )
    recent = state.domain.__dict__.setdefault("_groundings", OrderedDict())
    found = recent.get(key)
    if found is None:
        found = recent[key] = ground(state, kept, deadline_s)
        if len(recent) > _RECENT:
            recent.popitem(last=False)
    return found  # type: ignore[no-any-return]


def _anywhere(state: State, category: str) -> bool:
    return any(x not in state.lost for x in state.matches(category))


def _nowhere(state: State, name: str) -> bool:
    hands = state.domain.robot.hands
    return name not in hands and not name.startswith("?") and not _anywhere(state, name)


def _why_not(state: State, goals: Sequence[Conjunction]) -> str:
    """A reason for a dead end, naming what is lost if something is."""
    names = Alternatives(tuple(goals)).names
    lost = sorted(names & state.lost)
    if lost:
        return f"{', '.join(lost)}: its place is not known"
    facts: list[Literal | str] = [
        x for x in goals[0] if isinstance(x, Literal) and negated(x) is None and not state.holds(x)
    ]
    return "no sequence of skills leads to " + ", ".join(
        map(str, facts or [shown(x) for x in goals[0]])
    )
