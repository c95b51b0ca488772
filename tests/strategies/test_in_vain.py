"""What comes to nothing is tried once more, and then another way is taken where there is one."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import pytest

from forestall import Goal, Literal, Monitor, Plan, Subtask
from forestall.domain.brought import brings_about, came_about
from forestall.domain.load import shipped
from forestall.types.facts import GRIPPER, Truth
from forestall.types.graph import ObjectNode, SceneGraph
from forestall.types.symbolic import scene_graph
from planning.playing import begun, played

DOMAIN = shipped("household")
GOAL = Goal("a mug is on the table", (), (Literal.parse("on_top_of(Mug, DiningTable)"),))
PLAN = Plan.parse(["pick_up(Mug-1)", "navigate_to_obj(DiningTable)", "put_on(Mug-1, DiningTable)"])


class Kitchen:
    """A mug, and another in a shut cabinet; the hand closes on nothing, and does not say so."""

    def __init__(self, slips: int = 0, second: bool = True) -> None:
        self.at = {"Mug-1": "CounterTop-1", **({"Mug-2": "Cabinet-1"} if second else {})}
        self.slips, self.cabinet = slips, "closed"
        self.done: list[str] = []

    def look(self) -> SceneGraph:
        states: dict[str, dict[str, Any]] = {
            **{mug: {"dirty": "clean"} for mug in self.at},
            "Cabinet-1": {"open": self.cabinet},
            "CounterTop-1": {},
            "DiningTable-1": {},
            "Television-1": {"toggled": ("on", "off")[len(self.done) % 2]},
        }
        objects = {
            name: {**of, "box": [[k, 0, 0.9], [k + 0.3, 0.3, 1.2]]}
            for k, (name, of) in enumerate(states.items())
        }
        how = {"gripper": "held_by", "Cabinet-1": "inside"}
        places = [[x, how.get(place, "on_top_of"), place] for x, place in self.at.items()]
        scene = scene_graph({"objects": objects, "relations": places})
        hand = () if scene.get(GRIPPER) else (ObjectNode(GRIPPER, GRIPPER),)
        return replace(scene, nodes=(*scene.nodes, *hand))

    def do(self, step: Subtask) -> str:
        self.done.append(str(step))
        match step.skill:
            case "open_obj":
                self.cabinet = "open"
            case "pick_up" if step.args[0] == "Mug-1" and self.slips:
                self.slips -= 1
            case "pick_up":
                self.at[step.args[0]] = "gripper"
            case "put_on":
                held = next(x for x, place in self.at.items() if place == "gripper")
                self.at[held] = "DiningTable-1"
        return "done"


def play(kitchen: Kitchen) -> Monitor:
    return played(begun(GOAL, PLAN, "pick_up(Mug-1)", "Mug-1"), kitchen)


def times(kitchen: Kitchen, step: str) -> int:
    return sum(done == step for done in kitchen.done)


def test_after_two_tries_in_vain_another_thing_is_taken() -> None:
    kitchen = Kitchen(slips=99)
    monitor = play(kitchen)
    assert monitor.finished and kitchen.at["Mug-2"] == "DiningTable-1"
    assert times(kitchen, "pick_up(Mug-1)") == 2


def test_a_single_slip_is_mended_with_the_same_thing() -> None:
    kitchen = Kitchen(slips=1)
    monitor = play(kitchen)
    assert monitor.finished and kitchen.at["Mug-1"] == "DiningTable-1"
    assert kitchen.cabinet == "closed"


def test_what_went_well_in_between_is_not_in_vain() -> None:
    kitchen = Kitchen()
    kitchen.at["Mug-1"] = "gripper"
    monitor = begun(GOAL, PLAN, "pick_up(Mug-1)", "Mug-1")
    for ended in ("failed", "done", "failed"):
        step = "navigate_to_obj(DiningTable)"
        assert monitor.before(kitchen.look(), step).may_start
        kitchen.done.append(step)
        monitor.after(ended)
        monitor._run.position = 1
    assert monitor._run.vain() == ()
    assert monitor.before(kitchen.look(), step).may_start
    monitor.after("failed")
    assert [s.skill for s in monitor._run.vain()] == ["navigate_to_obj"]


def test_where_there_is_no_other_it_is_tried_again() -> None:
    kitchen = Kitchen(slips=2, second=False)
    monitor = play(kitchen)
    assert monitor.finished and kitchen.at["Mug-1"] == "DiningTable-1"
    assert times(kitchen, "pick_up(Mug-1)") == 3


@pytest.mark.parametrize(
    ("step", "states", "seen"),
    [
        ("toggle_on(CoffeeMachine-1)", {"toggled": "on"}, Truth.TRUE),
        ("toggle_on(CoffeeMachine-1)", {"toggled": "off"}, Truth.FALSE),
        ("toggle_on(CoffeeMachine-1)", {}, Truth.UNOBSERVED),
        ("navigate_to_obj(CoffeeMachine-1)", {"toggled": "off"}, Truth.UNOBSERVED),
    ],
)
def test_what_came_of_a_step_is_what_is_seen(
    step: str, states: dict[str, str], seen: Truth
) -> None:
    scene = scene_graph({"objects": {"CoffeeMachine-1": states}})
    assert came_about(scene, Subtask.parse(step), DOMAIN) is seen


def test_a_knob_stands_for_what_it_turns() -> None:
    scene = scene_graph({"objects": {"StoveBurner-2": {"toggled": "off"}, "StoveKnob-2": {}}})
    facts = brings_about(scene, Subtask.parse("toggle_on(StoveKnob-2)"), DOMAIN)
    assert facts == (Literal.parse("toggled(StoveBurner-2)=on"),)
