"""What a plan costs of the robot's time, and the same done for less."""

from __future__ import annotations

import pytest

from forestall.planning.planner import plan_goal
from forestall.planning.robot_time import robot_time_s
from forestall.planning.state import State
from forestall.planning.thrift import thrifty
from forestall.planning.validate import observed, run
from forestall.types.graph import SceneGraph
from forestall.types.plan import Plan, Subtask
from forestall.types.symbolic import scene_graph
from planning.corpus import DOMAIN, goal

PLACES = {
    "CounterTop-1": 0.0, "Sink-1": 2.0, "Faucet-1": 2.2, "StoveBurner-1": 4.0, "StoveKnob-1": 4.2,
    "DiningTable-1": 8.0, "CounterTop-2": 10.0,
}  # fmt: skip
TURNS_S, M_PER_S, PICK_S, PUT_S = 2.0, 0.25, 4.0, 4.0


def room(things: dict[str, str], **states: dict[str, str]) -> SceneGraph:
    """Fixtures in a row, and things on them: name → place."""
    where = {n: (x, 0.5) for n, x in PLACES.items()}
    where |= {n: (PLACES[p], 0.05) for n, p in things.items()}
    objects = {
        name: {
            "box": [[x - half, -half, 0], [x + half, half, 0.1]],
            **states.get(name.replace("-", "_"), {}),
        }
        for name, (x, half) in where.items()
    }
    takes = {n: DOMAIN.offers(p) for n, p in things.items()}
    return scene_graph(
        {"objects": objects, "relations": [[n, takes[n], p] for n, p in things.items()]}
    )


def start(things: dict[str, str], **states: dict[str, str]) -> State:
    return observed(room(things, **states), DOMAIN)


def steps(*texts: str) -> tuple[Subtask, ...]:
    return Plan.parse(texts).subtasks


def texts(plan: tuple[Subtask, ...]) -> list[str]:
    return [str(s) for s in plan]


def taken(plan: tuple[Subtask, ...], *, own: int = 99, state: State) -> list[str]:
    return texts(thrifty(state, plan, own, lambda *_: True, (0.0, 0.0)))


FETCH = steps(
    "navigate_to_obj(Mug-1)", "pick_up(Mug-1)", "navigate_to_obj(Sink-1)", "put_in(Mug-1, Sink-1)"
)


def test_time_is_ways_turns_and_what_skills_take() -> None:
    state = start({"Mug-1": "CounterTop-1"})
    seconds = robot_time_s(run(state, FETCH), (1.0, 0.0))
    assert seconds == pytest.approx(
        (TURNS_S + 1.0 / M_PER_S) + PICK_S + (TURNS_S + 2.0 / M_PER_S) + PUT_S
    )
    assert robot_time_s(run(state, FETCH)) < seconds, "nobody knows where the robot stands"


def test_a_thing_that_was_moved_is_where_it_was_put() -> None:
    state = start({"Mug-1": "DiningTable-1"})
    again = (*FETCH, *steps("pick_up(Mug-1)", "put_on(Mug-1, CounterTop-1)"))
    more = robot_time_s(run(state, again)) - robot_time_s(run(state, FETCH))
    assert more == pytest.approx(PICK_S + TURNS_S + 2.0 / M_PER_S + PUT_S)


def test_what_is_done_on_the_way_is_done_on_the_way() -> None:
    state = start({"Mug-1": "CounterTop-1", "Apple-1": "CounterTop-1"})
    far = steps("navigate_to_obj(StoveKnob-1)", "toggle_on(StoveKnob-1)")
    off = steps("navigate_to_obj(StoveKnob-1)", "toggle_off(StoveKnob-1)")
    apple = steps("navigate_to_obj(Apple-1)", "pick_up(Apple-1)", "put_on(Apple-1, CounterTop-2)")
    plan = (*FETCH, *off, *apple)
    running = start({"Mug-1": "CounterTop-1", "Apple-1": "CounterTop-1"},
                    StoveBurner_1={"toggled": "on"})  # fmt: skip
    found = texts(thrifty(running, plan, 99, lambda *_: True, (4.2, 0.0)))
    assert found[1] == "toggle_off(StoveKnob-1)", "off before the detour"
    late = taken((*far, *FETCH), state=state)
    assert late[-1] == "toggle_on(StoveKnob-1)", "on when everything else is done"


def test_nothing_passes_what_cannot_be_undone() -> None:
    state = start(
        {"Bread-1": "DiningTable-1", "Knife-1": "DiningTable-1", "Mug-1": "DiningTable-1"}
    )
    cut = steps("navigate_to_obj(Knife-1)", "pick_up(Knife-1)", "slice_obj(Bread-1)",
                "put_on(Knife-1, DiningTable-1)")  # fmt: skip
    plan = (*FETCH, *cut)
    for order in (plan, (*cut, *FETCH)):
        found = taken(order, state=state)
        first = found.index("pick_up(Mug-1)") < found.index("slice_obj(Bread-1)")
        assert first is (order == plan)


def test_a_plan_that_nobody_accepts_stays() -> None:
    state = start({"Mug-1": "CounterTop-1"})
    plan = (*steps("navigate_to_obj(StoveKnob-1)", "toggle_on(StoveKnob-1)"), *FETCH)
    assert thrifty(state, plan, 0, lambda *_: False) == plan


def test_what_is_in_the_way_is_put_down_near_by() -> None:
    for place in ("CounterTop-1", "DiningTable-1"):
        state = start({"Pot-1": place, "Apple-1": place})
        state.remove((DOMAIN.offers(place) or "", "Apple-1", place))
        state.add(("inside", "Apple-1", "Pot-1"))
        planned = plan_goal(state, goal("vacant(Pot-1)", "hand_empty()"))
        assert planned.final is not None
        assert planned.final.root("Apple-1") == place
