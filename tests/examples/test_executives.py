"""The examples around executives of others: a tree of behaviours that is guarded."""

from __future__ import annotations

import time
from collections.abc import Callable
from threading import Event
from typing import Any

import py_trees
import pytest
from py_trees.behaviour import Behaviour
from py_trees.common import Status

from corrected_plan import Corrected
from forestall import Monitor, Outcome, Plan, Subtask
from guarded_behaviour import Guard
from stranger import GRASP, INSERT, TWELVE, UNSCREW, scene

PLAN = Plan.parse([UNSCREW, GRASP, INSERT])
HOLE = {"unscrew": ("lid", "loose"), "grasp": ("peg", "hand"), "insert": ("peg", "hole")}


class Robot:
    """A robot whose skills are behaviours that take two ticks."""

    def __init__(self, slips: int = 0, **seen: Any) -> None:
        self.seen = {"peg": "tray", "lid": "tight", **seen}
        self.slips, self.did = slips, list[str]()

    def look(self, points: Any = ()) -> dict[str, Any]:
        return scene(**self.seen)

    def behaviour(self, subtask: Subtask) -> Behaviour:
        return Does(self, subtask)


class Does(Behaviour):
    def __init__(self, robot: Robot, subtask: Subtask) -> None:
        super().__init__(str(subtask))
        self.robot, self.subtask = robot, subtask

    def initialise(self) -> None:
        self.ticks = 0
        self.robot.did.append(str(self.subtask))

    def update(self) -> Status:
        self.ticks += 1
        if self.ticks < 2:
            return Status.RUNNING
        if self.subtask.skill == "grasp" and self.robot.slips:
            self.robot.slips -= 1
            self.feedback_message = "the peg slipped"
            return Status.FAILURE
        key, value = HOLE[self.subtask.skill]
        self.robot.seen[key] = value
        return Status.SUCCESS


@pytest.fixture
def monitor() -> Monitor:
    py_trees.blackboard.Blackboard.clear()
    return Monitor.from_demonstrations(TWELVE)


def run(root: Behaviour, until: Callable[[], bool] = lambda: False) -> list[Status]:
    """Ticks as an executive does, until the tree has ended."""
    seen: list[Status] = []
    end = time.monotonic() + 60
    while time.monotonic() < end and not until():
        root.tick_once()
        seen.append(root.status)
        if root.status is not Status.RUNNING:
            return seen
        time.sleep(0.005)
    assert until(), "the tree does not end"
    return seen


def decision() -> Any:
    return py_trees.blackboard.Blackboard.storage["/forestall/decision"]


def test_a_good_run_goes_through(monitor: Monitor) -> None:
    robot = Robot()
    seen = run(Corrected(PLAN, monitor, robot.look, robot.behaviour))
    assert seen[0] is Status.RUNNING and seen[-1] is Status.SUCCESS
    assert robot.did == [UNSCREW, GRASP, INSERT] and monitor.finished
    assert [e.outcome.status.value for e in monitor.executed] == ["succeeded"] * 3


def test_it_is_running_while_it_judges_and_nothing_starts(monitor: Monitor) -> None:
    robot, seen_enough = Robot(), Event()

    def slow(points: Any) -> Any:
        assert seen_enough.wait(60)
        return robot.look()

    monitor.start(PLAN)
    guard = Guard(robot.behaviour(PLAN.subtasks[0]), PLAN.subtasks[0], monitor, slow)
    for _ in range(3):
        guard.tick_once()
        assert guard.status is Status.RUNNING and robot.did == []
    seen_enough.set()
    assert run(guard)[-1] is Status.SUCCESS and robot.did == [UNSCREW]


def test_an_alarm_without_a_way_out_is_a_failure_with_its_diagnosis(monitor: Monitor) -> None:
    robot = Robot(peg="hand", lid="loose", hole="dirty")
    step = Subtask.parse(INSERT)
    monitor.start(Plan((step,)))
    guard = Guard(robot.behaviour(step), step, monitor, robot.look)
    assert run(guard)[-1] is Status.FAILURE
    assert robot.did == [] and guard.decorated.status is Status.INVALID
    assert decision().outcome is Outcome.HOLD and "hole-1 is dirty" in guard.feedback_message
    assert "hole-1 is dirty" in decision().diagnosis.cause


def test_the_corrected_plan_is_executed(monitor: Monitor) -> None:
    robot = Robot(lid="loose")
    plan = Plan.parse([INSERT])
    seen = run(Corrected(plan, monitor, robot.look, robot.behaviour))
    assert seen[-1] is Status.SUCCESS
    assert robot.did == [GRASP, INSERT] and robot.seen["peg"] == "hole"


def test_what_fails_is_told_to_the_monitor_and_done_again(monitor: Monitor) -> None:
    robot = Robot(slips=1)
    seen = run(Corrected(PLAN, monitor, robot.look, robot.behaviour))
    assert seen[-1] is Status.SUCCESS and robot.did == [UNSCREW, GRASP, GRASP, INSERT]
    assert monitor.executed[1].outcome.reason == "the peg slipped"


def test_what_always_slips_ends(monitor: Monitor) -> None:
    robot = Robot(slips=99)
    root = Corrected(PLAN, monitor, robot.look, robot.behaviour)
    assert run(root)[-1] is Status.FAILURE
    assert decision().outcome is Outcome.HOLD and 2 <= robot.did.count(GRASP) < 10


def test_an_interrupted_behaviour_stops_and_can_begin_again(monitor: Monitor) -> None:
    robot = Robot()
    root = Corrected(PLAN, monitor, robot.look, robot.behaviour)
    run(root, until=lambda: robot.did == [UNSCREW])
    root.stop(Status.INVALID)
    assert all(b.status is Status.INVALID for b in root.iterate())
    assert run(root)[-1] is Status.SUCCESS and robot.did == [UNSCREW, UNSCREW, GRASP, INSERT]
