"""A replanner of somebody else's in one file: recipes that are tried before the rest of the plan.

    [project.entry-points."forestall.replanner"]
    recipes = "own_replanner:recipes"

A factory whose first parameter is called `parts` is lent the run's validator: no plan leaves here
that it has not accepted. `--replanner.name recipes --replanner.file recipes.txt`: one recipe a
line, its steps divided by semicolons.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from forestall.errors import InputError
from forestall.kinds import VALIDATOR
from forestall.seams import Parts, PlanValidator
from forestall.types.plan import Plan
from forestall.types.runtime import BoundaryContext
from forestall.types.verdict import Diagnosis, Replan, ReplanOutcome


class RecipeReplanner:
    """Implements `forestall.seams.Replanner`."""

    name = "recipes"

    def __init__(self, validator: PlanValidator, recipes: Sequence[Plan]) -> None:
        self._validator, self._recipes = validator, recipes

    def replan(self, context: BoundaryContext, diagnosis: Diagnosis) -> Replan:
        if not diagnosis.found:
            return Replan(ReplanOutcome.NOTHING_TO_CHANGE, producer=self.name)
        reasons = []
        for recipe in self._recipes:
            plan = Plan((*recipe.subtasks, *context.remaining()), context.plan.goal)
            check = self._validator.check(plan, context.graph, context.task.goal)
            if check.ok:
                return Replan(ReplanOutcome.SOLVED, check.plan or plan, check, self.name)
            reasons.append(check.reason)
        note = "; ".join(reasons) or "there is no recipe"
        return Replan(ReplanOutcome.NOT_FOUND, producer=self.name, note=note)


def recipes(parts: Parts, *, file: Path | None = None) -> RecipeReplanner:
    if file is None:
        raise InputError("the replanner 'recipes' needs the option file")
    lines = [line.strip() for line in file.read_text(encoding="utf-8").splitlines()]
    known = [Plan.parse([s.strip() for s in line.split(";")]) for line in lines if line]
    return RecipeReplanner(parts.part(VALIDATOR), known)
