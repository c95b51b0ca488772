"""Planning anew for the goal, whatever the cause: what is left where nothing is known of it.

Called where a replanner can stand, together with the reasoner that gives no cause (the ablation of
paper, Table 2: "uninformed replanning"); calls `planning`. Nothing of the old plan is kept.
"""

from __future__ import annotations

import time

from forestall.deadline import Deadline
from forestall.domain.model import Domain
from forestall.planning.planner import plan_goal
from forestall.planning.refused import denial, is_refused, no_other, unexplained
from forestall.planning.search import SearchConfig
from forestall.planning.validate import as_checked, observed
from forestall.seams.judging import PlanValidator
from forestall.types.plan import Plan
from forestall.types.runtime import BoundaryContext
from forestall.types.verdict import Diagnosis, Replan, ReplanOutcome


class GoalReplanner:
    """Plans from what is seen to the task's goal (implements `Replanner`).

    Args:
        validator: accepts or refuses the plan.
        domain: what is planned in.
        config: bounds of the search.
    """

    name = "goal planner"

    def __init__(
        self, validator: PlanValidator, domain: Domain, config: SearchConfig | None = None
    ) -> None:
        self.validator = validator
        self.domain = domain
        self.config = config or SearchConfig()

    def replan(
        self, context: BoundaryContext, diagnosis: Diagnosis, deadline: Deadline | None = None
    ) -> Replan:
        """A plan for the goal; of the diagnosis only counts whether anything must change.

        Until the deadline, however much time `config` gives; without what the robot has refused.
        """
        start_s = time.perf_counter()
        if not diagnosis.must_change:
            outcome = ReplanOutcome.NOTHING_TO_CHANGE
            return Replan(outcome, producer=self.name, note=diagnosis.cause)
        goal = context.task.goal
        state = observed(context.graph, self.domain)
        refused = unexplained(state, context.refused)
        planned = plan_goal(state, goal, self.config, deadline, refused)
        plan, check, outcome, note = None, None, planned.outcome, planned.note
        if outcome is ReplanOutcome.SOLVED:
            plan = Plan(planned.subtasks, context.plan.goal or goal.text)
            check = self.validator.check(plan, context.graph, goal)
            denied = is_refused(check.plan or plan, refused)
            if denied is not None:
                outcome, note = ReplanOutcome.REJECTED, denial(denied, context.vain)
            elif check.ok:
                plan = as_checked(plan, check, state)
            else:
                outcome, note = ReplanOutcome.REJECTED, check.reason
        if outcome is not ReplanOutcome.SOLVED:
            note = "; ".join((*no_other(state, refused, context.vain), note))
        return Replan(
            outcome,
            plan,
            check,
            self.name,
            planned.expanded,
            time.perf_counter() - start_s,
            note,
        )
