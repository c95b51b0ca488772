"""Search for a plan: greedy best first with lazy evaluation and helpful operators.

After Richter and Helmert, "Preferred Operators and Deferred Evaluation in Satisficing Planning"
(2009): two queues over the FF heuristic, one for all successors and one for those reached by
helpful operators. Needless steps of the plan that is found are dropped afterwards (action
elimination, Nakhost and Müller 2010). Called by `planner`.
"""

from __future__ import annotations

import heapq
import time
from dataclasses import dataclass
from enum import Enum

from forestall.deadline import Deadline, TimeUp
from forestall.planning.heuristic import RelaxedPlan
from forestall.planning.problem import Problem

BOOST = 4
"""How much more often the queue of helpful successors is served."""


@dataclass(frozen=True, slots=True)
class SearchConfig:
    """Bounds of planning.

    Args:
        time_limit_s: wall-clock limit of everything that one call does: what matters, grounding,
            every search and the shortening of what they find.
        max_expansions: limit on the expanded states of each search.
        whole_limit_s: time for a problem with everything in it, where the narrowed one failed.
    """

    time_limit_s: float = 5.0
    max_expansions: int = 200_000
    whole_limit_s: float = 1.0


class SearchOutcome(Enum):
    """How a search ended."""

    SOLVED = "solved"
    UNSOLVABLE = "unsolvable"  # proven: every reachable state was seen, or none can lead there
    CUT_SHORT = "cut short"  # so many states were expanded; nothing is proven
    TIMEOUT = "timeout"  # the time is over; nothing is proven


@dataclass(frozen=True, slots=True)
class SearchResult:
    """Operator indices of a plan, if one was found, and what it cost."""

    outcome: SearchOutcome
    steps: tuple[int, ...] = ()
    expanded: int = 0
    seconds: float = 0.0


def solve(
    problem: Problem, config: SearchConfig | None = None, deadline: Deadline | None = None
) -> SearchResult:
    """Find a plan to any one of the problem's goals, or prove that there is none.

    A plan that is found shortly before the deadline is not shortened any more.
    """
    config = config or SearchConfig()
    start_s = time.perf_counter()
    deadline = (deadline or Deadline()).within(config.time_limit_s)
    outcome, steps, expanded = _search(problem, config, deadline)
    if outcome is SearchOutcome.SOLVED:
        steps = _shortened(problem, steps, deadline)
    return SearchResult(outcome, tuple(steps), expanded, time.perf_counter() - start_s)


def _search(
    problem: Problem, config: SearchConfig, deadline: Deadline
) -> tuple[SearchOutcome, list[int], int]:
    heuristic = RelaxedPlan(problem, deadline)
    operators = problem.operators
    parents: dict[int, tuple[int, int, int]] = {}  # state → (state before, operator, depth)
    everyone: list[tuple[int, int, int, int, int]] = []
    helpful_only: list[tuple[int, int, int, int, int]] = []
    seen: set[int] = set()
    expanded = order = credit = 0
    best: int | None = None
    entry = (problem.initial, -1, -1, 0)
    while True:
        before, via, _, depth = entry
        state = before if via < 0 else problem.apply(before, operators[via])
        if state not in seen:
            seen.add(state)
            parents[state] = (before, via, depth)
            full = problem.close(state)
            if any(g & full == g for g in problem.goals):
                return SearchOutcome.SOLVED, _path(parents, state), expanded
            try:
                h, helpful = heuristic.evaluate(full)
            except TimeUp:
                return SearchOutcome.TIMEOUT, [], expanded
            if h is not None:
                expanded += 1
                if best is None or h < best:
                    best, credit = h, credit + BOOST * 50
                liked = set(helpful)
                for index, operator in enumerate(operators):
                    if operator.condition & full == operator.condition:
                        order += 1
                        item = (h, depth, order, state, index)
                        heapq.heappush(everyone, item)
                        if index in liked:
                            heapq.heappush(helpful_only, item)
        over = _over(config, deadline, expanded)
        if over is not None:
            return over, [], expanded
        if helpful_only and (credit > 0 or not everyone or order % (BOOST + 1)):
            credit -= 1
            _, depth, _, before, via = heapq.heappop(helpful_only)
        elif everyone:
            _, depth, _, before, via = heapq.heappop(everyone)
        else:
            return SearchOutcome.UNSOLVABLE, [], expanded
        entry = (before, via, 0, depth + 1)


def _over(config: SearchConfig, deadline: Deadline, expanded: int) -> SearchOutcome | None:
    if expanded >= config.max_expansions:
        return SearchOutcome.CUT_SHORT
    return SearchOutcome.TIMEOUT if deadline.over else None


def _path(parents: dict[int, tuple[int, int, int]], state: int) -> list[int]:
    steps: list[int] = []
    while True:
        before, via, _ = parents[state]
        if via < 0:
            return steps[::-1]
        steps.append(via)
        state = before


def _shortened(problem: Problem, steps: list[int], deadline: Deadline) -> list[int]:
    """Drop every step that, with what then cannot run either, the goal does without."""
    position, before = 0, problem.initial  # the state before the step at `position`
    while position < len(steps) and not deadline.over:
        state = before
        kept = []
        for index in steps[position + 1 :]:
            operator = problem.operators[index]
            if not operator.condition & ~problem.close(state):
                kept.append(index)
                state = problem.apply(state, operator)
        if problem.reached(state):
            steps = steps[:position] + kept
        else:
            before = problem.apply(before, problem.operators[steps[position]])
            position += 1
    return steps
