"""The FF heuristic: length of a relaxed plan, and the operators that it would start with.

After Hoffmann and Nebel, "The FF Planning System" (2001); conditional effects, processes and rules
are relaxed as operators of their own, the latter two for nothing. What must not be derivable is
taken for granted. Called by `search`.
"""

from __future__ import annotations

from forestall.deadline import Deadline
from forestall.planning.problem import Problem

_Unit = tuple[int, int, int]

FREE = -1


class RelaxedPlan:
    """Heuristic over one problem; `evaluate` is called for every expanded state.

    It raises TimeUp where the deadline is over.
    """

    def __init__(self, problem: Problem, deadline: Deadline | None = None) -> None:
        self.deadline = deadline or Deadline()
        self.goals = problem.goals
        self.operators = problem.operators
        units: list[_Unit] = []
        for index, operator in enumerate(problem.operators):
            for effect in operator.effects:
                add = problem.full_add(effect)
                if add:
                    units.append((operator.condition | effect.condition, add, index))
        for happening in (h for several in problem.processes for h in several):
            for effect in happening.effects:
                add = problem.full_add(effect)
                if add:
                    units.append((happening.condition | effect.condition, add, FREE))
        self._counts: list[tuple[int, int, int]] = []
        self._granted = 0
        free: list[_Unit] = []
        for stratum in problem.strata:
            for rule in stratum.rules:
                if rule.least:
                    self._counts.append((rule.body, rule.head, rule.least))
                else:
                    free.append((rule.body, rule.head, FREE))
            for _, complement in stratum.complements:
                self._granted |= complement
        self._units, self._rules = units, free

    def evaluate(self, state: int) -> tuple[int | None, tuple[int, ...]]:
        """The relaxed plan's length (None: no goal can be reached), and helpful operators.

        Args:
            state: with complements and derived facts.
        """
        reached = state | self._granted
        waiting, rules, counts = self._units, self._rules, self._counts
        supporter: dict[int, tuple[int, int]] = {}
        goals = self.goals
        goal = next((g for g in goals if g & reached == g), None)
        while goal is None:
            self.deadline.check()
            later: list[_Unit] = []
            fresh, lacking, wait = 0, ~reached, later.append
            for unit in waiting:
                if unit[0] & lacking:
                    wait(unit)
                    continue
                condition, add, index = unit
                new = add & ~(reached | fresh)
                if new:
                    fresh |= new
                    while new:
                        bit = new & -new
                        supporter[bit] = (condition, index)
                        new ^= bit
            reached |= fresh
            more = self._derive(reached, rules, counts, supporter)
            if not fresh and more == reached:
                return None, ()
            reached = more
            waiting = later
            goal = next((g for g in goals if g & reached == g), None)
        return self._extract(state | self._granted, goal, supporter)

    def _derive(
        self,
        reached: int,
        rules: list[_Unit],
        counts: list[tuple[int, int, int]],
        supporter: dict[int, tuple[int, int]],
    ) -> int:
        progress = True
        while progress:
            self.deadline.check()
            progress = False
            for body, head, _ in rules:
                if not head & reached and body & reached == body:
                    reached |= head
                    supporter[head] = (body, FREE)
                    progress = True
            for body, head, least in counts:
                met = body & reached
                if not head & reached and met.bit_count() >= least:
                    reached |= head
                    supporter[head] = (_cheapest(met, least, supporter), FREE)
                    progress = True
        return reached

    def _extract(
        self, state: int, goal: int, supporter: dict[int, tuple[int, int]]
    ) -> tuple[int, tuple[int, ...]]:
        open_atoms = goal & ~state
        closed = 0
        chosen: set[int] = set()
        while open_atoms:
            bit = open_atoms & -open_atoms
            open_atoms ^= bit
            closed |= bit
            condition, index = supporter[bit]
            if index != FREE:
                chosen.add(index)
            open_atoms |= condition & ~state & ~closed
        helpful = tuple(i for i in sorted(chosen) if self.operators[i].condition & ~state == 0)
        return len(chosen), helpful


def _cheapest(met: int, least: int, supporter: dict[int, tuple[int, int]]) -> int:
    """So many facts of those that are met: the ones that hold already first."""
    already, later = 0, 0
    while met:
        bit = met & -met
        met ^= bit
        if bit not in supporter and already.bit_count() < least:
            already |= bit
        else:
            later |= bit
    while already.bit_count() < least:
        bit = later & -later
        later ^= bit
        already |= bit
    return already
