"""A py_trees decorator that asks forestall before its behaviour starts, and tells it how it ended.

What the monitor last said (outcome, diagnosis, corrected plan, command) is on the blackboard, at
/forestall/decision. `corrected_plan.py` has the corrected plan executed.
"""

from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from typing import Any

from py_trees.behaviour import Behaviour
from py_trees.common import Access, Status
from py_trees.decorators import Decorator

from forestall import Monitor, MonitorDecision, Outcome, Subtask

JUDGES = ThreadPoolExecutor(1)  # one judgement after the other, while the tree goes on ticking


class Guard(Decorator):
    """RUNNING while the monitor judges; then its behaviour, or FAILURE where that may not start.

    `look(points)` gives the scene; of a robot that can, seen by looking at these world points.
    """

    def __init__(
        self, child: Behaviour, subtask: Subtask, monitor: Monitor, look: Callable[..., Any]
    ) -> None:
        super().__init__(f"may {subtask} start?", child)
        self.subtask, self.monitor, self.look = subtask, monitor, look
        self.board = self.attach_blackboard_client(namespace="forestall")
        self.board.register_key("decision", Access.WRITE)

    def initialise(self) -> None:
        self.said: MonitorDecision | None = None
        self.judging = JUDGES.submit(self.judge)

    def judge(self) -> MonitorDecision:
        said = self.monitor.before(self.look(()), self.subtask)
        while said.outcome is Outcome.LOOK:  # the monitor asks for a few looks at most
            said = self.monitor.before(self.look(said.look_at), self.subtask)
        return said

    def tick(self) -> Iterator[Behaviour]:
        acts = self.status is Status.RUNNING and self.said is not None
        yield from super().tick() if acts else Behaviour.tick(self)

    def update(self) -> Status:
        if self.said is None and self.judging.done():
            self.said = self.board.decision = self.judging.result()
            self.feedback_message = str(self.said)
            return Status.RUNNING if self.said.may_start else Status.FAILURE
        ended = self.decorated.status
        if self.said is None or ended is Status.RUNNING:
            return Status.RUNNING
        how = "done" if ended is Status.SUCCESS else "failed"
        told = self.monitor.after(how, self.look(()), self.decorated.feedback_message)
        self.board.decision = told or self.said
        return ended if told is None or told.may_start else Status.FAILURE
