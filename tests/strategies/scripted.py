"""Scripted collaborators of a strategy, and a boundary to call it with."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from forestall.domain.load import shipped
from forestall.types.facts import Literal
from forestall.types.graph import SceneGraph
from forestall.types.observation import Frame, GripperState, Intrinsics, Observation
from forestall.types.plan import Plan, Subtask
from forestall.types.runtime import BoundaryContext, When
from forestall.types.scene import SceneNeeds
from forestall.types.task import Goal, Task
from forestall.types.verdict import (
    Calibration,
    Decision,
    Diagnosis,
    PlanCheck,
    Reference,
    Replan,
    ReplanOutcome,
    Verdict,
)

PLAN = Plan.parse(["pick_up(Plate)", "put_in(Plate, Microwave)", "close_obj(Microwave)"])
OPEN = Literal.parse("open(Microwave-1)=open")
HOT = Literal.parse("temperature(Plate-1)=hot")
BEFORE = SceneGraph((), subtask=PLAN.subtasks[1])
AFTER = SceneGraph((), subtask=PLAN.subtasks[2])
REFERENCES = (
    Reference("one", "heat", 1, PLAN.subtasks[1], 1.0, BEFORE, after=AFTER),
    Reference("two", "heat", 1, PLAN.subtasks[1], 1.0, BEFORE),
)
"""Of the second nobody saw what was after it."""
REPAIRED = Plan((Subtask.parse("open_obj(Microwave-1)"), *PLAN.subtasks[1:]))


class Parts:
    """All collaborators in one scripted double that counts its calls."""

    name = "scripted"

    def __init__(
        self,
        decision: Decision,
        must_change: tuple[Literal, ...] = (),
        replan: Replan | None = None,
        rest_runs: bool = True,
        was_so: tuple[Literal, ...] = (),
    ) -> None:
        self.decision = decision
        self.must_change = must_change
        self.answer = replan or Replan(ReplanOutcome.SOLVED, REPAIRED)
        self.rest_runs = rest_runs
        self.was_so = was_so
        self.replanned = 0
        self.replanned_at = -1
        self.judged: list[tuple[Reference, ...]] = []
        self.asked: list[BoundaryContext] = []
        self.plans: list[Plan] = []
        self.domain = shipped("household")

    def retrieve(self, subtask: Subtask, task: str, done: int) -> Sequence[Reference]:
        return REFERENCES

    def judge(
        self, observed: SceneGraph, observation: Observation | None, references: Sequence[Reference]
    ) -> Verdict:
        self.judged.append(tuple(references))
        return Verdict(self.decision, "scripted", 0.5, 0.9, Calibration.FIXED)

    def diagnose(self, context: BoundaryContext, verdict: Verdict) -> Diagnosis:
        self.asked.append(context)
        facts = self.was_so if context.when is When.BEFORE else self.must_change
        return Diagnosis("the microwave is closed", facts or self.must_change)

    def replan(self, context: BoundaryContext, diagnosis: Diagnosis) -> Replan:
        self.replanned += 1
        self.replanned_at = context.index
        return self.answer

    def check(self, plan: Plan, graph: SceneGraph, goal: Goal) -> PlanCheck:
        self.plans.append(plan)
        unmet = () if self.rest_runs else (HOT,)
        return PlanCheck(self.rest_runs, reason="the microwave is closed", unmet=unmet)


def boundary(when: When = When.BEFORE, **changes: object) -> BoundaryContext:
    """Before put_in(Plate, Microwave), or another moment of it."""
    frame = Frame(
        np.zeros((2, 2, 3), np.uint8),
        np.ones((2, 2), np.float32),
        Intrinsics.from_vertical_fov(2, 2, 60.0),
        np.eye(4),
    )
    context = BoundaryContext(
        task=Task("heat", "Heat", Goal("hot"), PLAN, SceneNeeds()),
        plan=PLAN,
        index=1,
        done=1,
        subtask=PLAN.subtasks[1],
        graph=SceneGraph(()),
        scoped=SceneGraph(()),
        observation=Observation((frame,), GripperState(None, (0.0, 0.0, 0.0)), 0.0),
    )
    return replace(context, when=when, **changes)  # type: ignore[arg-type]
