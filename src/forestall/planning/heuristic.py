"""The FF heuristic: length of a relaxed plan, and the operators that it would start with.

After Hoffmann and Nebel, "The FF Planning System" (2001); conditional effects are relaxed as
operators of their own. Called by `search`.
"""

from __future__ import annotations

from forestall.planning.problem import Problem


class RelaxedPlan:
    """Heuristic over one problem; `evaluate` is called for every expanded state."""

    def __init__(self, problem: Problem) -> None:
        self.goals = problem.goals
        self._units: list[tuple[int, int, int]] = []
        self.operators = problem.operators
        for index, operator in enumerate(problem.operators):
            for effect in operator.effects:
                if effect.add:
                    self._units.append((operator.condition | effect.condition, effect.add, index))

    def evaluate(self, state: int) -> tuple[int | None, tuple[int, ...]]:
        """The relaxed plan's length (None: no goal can be reached), and helpful operators."""
        reached = state
        waiting = self._units
        supporter: dict[int, tuple[int, int, int]] = {}
        layer = 0
        goal = next((g for g in self.goals if g & reached == g), None)
        while goal is None:
            layer += 1
            later, fresh = [], 0
            for unit in waiting:
                condition, add, index = unit
                if condition & reached != condition:
                    later.append(unit)
                    continue
                new = add & ~(reached | fresh)
                if new:
                    fresh |= new
                    while new:
                        bit = new & -new
                        supporter[bit] = (condition, index, layer)
                        new ^= bit
            if not fresh:
                return None, ()
            reached |= fresh
            waiting = later
            goal = next((g for g in self.goals if g & reached == g), None)
        return self._extract(state, goal, supporter)

    def _extract(
        self, state: int, goal: int, supporter: dict[int, tuple[int, int, int]]
    ) -> tuple[int, tuple[int, ...]]:
        open_atoms = goal & ~state
        closed = 0
        chosen: set[int] = set()
        while open_atoms:
            bit = open_atoms & -open_atoms
            open_atoms ^= bit
            closed |= bit
            condition, index, _ = supporter[bit]
            chosen.add(index)
            open_atoms |= condition & ~state & ~closed
        helpful = tuple(i for i in sorted(chosen) if self.operators[i].condition & ~state == 0)
        return len(chosen), helpful
