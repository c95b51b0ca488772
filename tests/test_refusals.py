"""A robot that refuses for reasons of its own: another drawer, or why there is none."""

from __future__ import annotations

from typing import Any

import pytest

from forestall import Goal, Literal, Monitor, MonitorDecision, Outcome, Plan, Subtask, Task
from forestall.types.scene import SceneNeeds

PLAN = Plan.parse(
    ["pick_up(Book)", "open_obj(Drawer)", "put_in(Book, Drawer)", "close_obj(Drawer)"]
)


class Desk:
    """A desk with drawers, some of which the robot cannot use, and says so."""

    def __init__(self, drawers: int, refuses: tuple[str, ...]) -> None:
        self.drawers = {f"Drawer-{k}": "closed" for k in range(1, drawers + 1)}
        self.refuses = refuses
        self.place: str | None = "Desk-1"
        self.refused: list[str] = []

    def look(self) -> dict[str, Any]:
        held = self.place is None
        on = "held_by" if held else ("inside" if self.place in self.drawers else "on_top_of")
        return {
            "objects": {
                "Book-1": {"box": [[0, 0, 1], [0.2, 0.1, 1.1]]},
                "Desk-1": {"box": [[0, 0, 0], [2, 1, 1]]},
                **{
                    d: {"open": how, "box": [[k, 1, 0], [k + 0.4, 1.5, 0.3]]}
                    for k, (d, how) in enumerate(self.drawers.items())
                },
            },
            "relations": [["Book-1", on, self.place or "gripper"]],
        }

    def do(self, step: Subtask) -> tuple[str, str]:
        thing = step.args[-1]
        if step.skill == "pick_up":
            self.place = None
        elif step.skill == "put_on":
            self.place = "Desk-1"
        elif thing in self.refuses and step.skill == "put_in":
            self.refused.append(thing)
            return "refused", "the drawer is full"
        elif step.skill == "put_in":
            self.place = thing
        elif step.skill in ("open_obj", "close_obj"):
            self.drawers[thing] = "open" if step.skill == "open_obj" else "closed"
        return "done", ""


def task() -> Task:
    goal = Goal(
        "the book is in a drawer",
        (("?drawer", "Drawer"),),
        (Literal.parse("inside(Book, ?drawer)"),),
    )
    return Task("file-book", "File the book", goal, PLAN, SceneNeeds())


def played(desk: Desk, limit: int = 25) -> tuple[Monitor, MonitorDecision | None]:
    shown = Desk(3, ())
    steps = []
    for text in ("pick_up(Book-1)", "open_obj(Drawer-1)", "put_in(Book-1, Drawer-1)"):
        steps.append((text, shown.look()))
        shown.do(Subtask.parse(text))
    steps += [("close_obj(Drawer-1)", shown.look())]
    monitor = Monitor.from_demonstrations(steps, domain="household")
    monitor.start(task())
    decision = None
    for _ in range(limit):
        if monitor.finished:
            break
        decision = monitor.before(desk.look())
        if decision.may_start:
            assert decision.command is not None
            monitor.after(*_said(desk, decision.command))
        elif decision.outcome not in (Outcome.REPLAN, Outcome.LOOK):
            break
    return monitor, decision


def _said(desk: Desk, step: Subtask) -> tuple[Any, ...]:
    outcome, reason = desk.do(step)
    return (outcome, None, reason)


@pytest.mark.parametrize("refuses", [(), ("Drawer-1",), ("Drawer-1", "Drawer-2")])
def test_another_drawer_is_taken(refuses: tuple[str, ...]) -> None:
    desk = Desk(3, refuses)
    monitor, decision = played(desk)
    assert desk.place in set(desk.drawers) - set(refuses), decision
    assert monitor.finished
    assert sorted(desk.refused) == sorted(set(desk.refused))


def test_where_every_drawer_is_refused_it_holds_and_says_why() -> None:
    desk = Desk(2, ("Drawer-1", "Drawer-2"))
    _, decision = played(desk)
    assert decision is not None and decision.outcome is Outcome.HOLD
    assert sorted(desk.refused) == ["Drawer-1", "Drawer-2"]
    assert "refused" in str(decision)
