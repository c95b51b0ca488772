"""A plan as a py_trees tree of guarded behaviours that goes on with the corrected plan."""

from collections.abc import Callable
from typing import Any

from py_trees.behaviour import Behaviour
from py_trees.common import Access, Status
from py_trees.composites import Sequence
from py_trees.decorators import Decorator

from forestall import Monitor, Plan, Subtask
from guarded_behaviour import Guard


class Corrected(Decorator):
    """The behaviours of a plan, guarded; after an alarm those of the corrected plan instead.

    FAILURE where the monitor has no plan: /forestall/decision on the blackboard says why.
    """

    def __init__(
        self,
        plan: Plan,
        monitor: Monitor,
        look: Callable[..., Any],
        behaviour: Callable[[Subtask], Behaviour],
    ) -> None:
        self.plan, self.monitor, self.look, self.behaviour = plan, monitor, look, behaviour
        super().__init__("corrected plan", self.guarded(plan))
        self.board = self.attach_blackboard_client(namespace="forestall")
        self.board.register_key("decision", Access.READ)

    def guarded(self, plan: Plan) -> Behaviour:
        guards = [Guard(self.behaviour(s), s, self.monitor, self.look) for s in plan.subtasks]
        return Sequence("plan", memory=True, children=guards)

    def initialise(self) -> None:
        self.follow(self.plan)
        self.monitor.start(self.plan)

    def follow(self, plan: Plan) -> None:
        self.decorated = self.guarded(plan)
        self.children, self.decorated.parent = [self.decorated], self

    def update(self) -> Status:
        failed = self.decorated.status is Status.FAILURE
        if failed and (plan := self.board.decision.plan) is not None:
            self.follow(plan)
            return Status.RUNNING
        return self.decorated.status
