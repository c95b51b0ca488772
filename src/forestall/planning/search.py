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
PATIENCE = 60_000
"""Of so many operators it is asked before a goal is tried thing by thing."""


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

    What the first states do not lead to is tried thing by thing, and then with all patience. A plan
    that is found shortly before the deadline is not shortened any more.
    """
    config = config or SearchConfig()
    start_s = time.perf_counter()
    deadline = (deadline or Deadline()).within(config.time_limit_s)
    patience = PATIENCE // (1 + len(problem.operators)) + 200
    limit = min(config.max_expansions, patience)
    outcome, steps, expanded = _search(problem, limit, deadline)
    if outcome is SearchOutcome.CUT_SHORT and limit < config.max_expansions:
        found, more = _piecewise(problem, patience, config.max_expansions - expanded, deadline)
        outcome, steps, expanded = SearchOutcome.SOLVED, found or [], expanded + more
        if found is None:
            left = config.max_expansions - expanded
            outcome, steps, more = _search(problem, left, deadline)
            expanded += more
    if outcome is SearchOutcome.SOLVED:
        steps = _shortened(problem, steps, deadline)
    return SearchResult(outcome, tuple(steps), expanded, time.perf_counter() - start_s)


def _piecewise(
    problem: Problem, patience: int, limit: int, deadline: Deadline
) -> tuple[list[int] | None, int]:
    """A goal for one thing after the other: no plan where that leads nowhere.

    What is reached is not touched again, or, where that does not do, only holds again afterwards.
    The goal is the one of which the fewest facts lack, the first of several.
    """
    full = problem.close(problem.initial)
    goal = min(problem.goals, key=lambda g: (g & ~full).bit_count())
    steps: list[int] = []
    state, expanded = problem.initial, 0
    while (full := problem.close(state)) & goal != goal:
        kept = goal & full
        nearer = tuple(kept | part for part in _parts(problem, goal) if part & ~full)
        every = range(len(problem.operators))
        harmless = [
            i for i in every if not any(e.delete & kept for e in problem.operators[i].effects)
        ]
        for allowed in (harmless, every):
            piece = problem.posed(state, nearer, allowed)
            outcome, found, more = _search(piece, min(limit - expanded, patience), deadline)
            expanded += more
            if outcome is SearchOutcome.SOLVED:
                break
        else:
            return None, expanded
        for index in found:
            steps.append(allowed[index])
            state = problem.apply(state, problem.operators[allowed[index]])
    return steps, expanded


def _parts(problem: Problem, goal: int) -> list[int]:
    """The facts of a goal by the thing that they are about."""
    parts: dict[str, int] = {}
    while goal:
        bit = goal & -goal
        goal ^= bit
        atom = problem.atoms[bit.bit_length() - 1]
        about = atom[1:3] if atom[0] == "not" else atom[:2]
        parts[about[-1]] = parts.get(about[-1], 0) | bit
    return list(parts.values())


def _search(
    problem: Problem, limit: int, deadline: Deadline
) -> tuple[SearchOutcome, list[int], int]:
    heuristic = RelaxedPlan(problem, deadline)
    queues, conditions = _Queues(), [o.condition for o in problem.operators]
    parents: dict[int, tuple[int, int, int]] = {}  # state → (state before, operator, depth)
    expanded = 0
    best: int | None = None
    before, via, depth = problem.initial, -1, 0
    while True:
        state = before if via < 0 else problem.apply(before, problem.operators[via])
        if state not in parents:
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
                    best = h
                    queues.credit += BOOST * 50
                lacking = ~full
                ready = [i for i, c in enumerate(conditions) if not c & lacking]
                queues.add(h, depth, state, ready, set(helpful))
        if expanded >= limit:
            return SearchOutcome.CUT_SHORT, [], expanded
        if deadline.over:
            return SearchOutcome.TIMEOUT, [], expanded
        entry = queues.next()
        if entry is None:
            return SearchOutcome.UNSOLVABLE, [], expanded
        before, via, depth = entry


class _Queues:
    """Steps that wait: all of them, and those that are helpful; nearest first."""

    def __init__(self) -> None:
        self.everyone: list[tuple[int, int, int, int, int]] = []
        self.helpful: list[tuple[int, int, int, int, int]] = []
        self.order = self.credit = 0

    def add(self, h: int, depth: int, state: int, ready: list[int], helpful: set[int]) -> None:
        """The steps that can be taken in a state."""
        for index in ready:
            self.order += 1
            item = (h, depth, self.order, state, index)
            heapq.heappush(self.everyone, item)
            if index in helpful:
                heapq.heappush(self.helpful, item)

    def next(self) -> tuple[int, int, int] | None:
        """The state, the step and the depth to which it leads; None when none is left."""
        if self.helpful and (self.credit > 0 or not self.everyone or self.order % (BOOST + 1)):
            self.credit -= 1
            _, depth, _, state, index = heapq.heappop(self.helpful)
        elif self.everyone:
            _, depth, _, state, index = heapq.heappop(self.everyone)
        else:
            return None
        return state, index, depth + 1


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
