from __future__ import annotations

import pytest

from forestall.planning.execute import Refusal, apply
from forestall.planning.state import State
from forestall.planning.validate import GraphValidator, observed, run, unmet
from forestall.types.facts import Literal
from forestall.types.graph import SceneGraph
from forestall.types.plan import Plan, Subtask
from planning.corpus import DOMAIN, GOALS, PLANS, goal, home_of, plan, scene
from planning.wrong_plans import WRONG, Wrong

CHECK = GraphValidator(DOMAIN).check


def spoiled(state: State) -> set[str]:
    return {f[1] for f in state.facts if f[0] == "spoiled"}


def contents(state: State) -> tuple[object, ...]:
    return dict(state.kinds), dict(state.values), set(state.facts), state.at, state.assumed


@pytest.mark.parametrize("task", sorted(PLANS))
def test_right_plans_run_and_reach_their_goal(task: str) -> None:
    check = CHECK(PLANS[task], scene(home_of(task)), GOALS[task])
    assert (check.ok, check.step, check.reason) == (True, None, "")


@pytest.mark.parametrize("case", WRONG, ids=lambda c: c.name)
def test_wrong_plans_are_rejected_for_their_reason(case: Wrong) -> None:
    check = CHECK(case.plan, case.scene, case.goal)
    assert not check.ok
    assert check.step == case.step
    assert case.reason in check.reason
    if case.lacking is not None:
        facts = check.unmet if case.step is None else check.lacking
        assert Literal.parse(case.lacking) in facts


def test_there_are_at_least_twenty_wrong_plans() -> None:
    assert len({c.reason for c in WRONG}) >= 20


def test_empty_scene_is_a_reason_and_not_an_exception() -> None:
    check = CHECK(plan("pick_up(Mug)"), SceneGraph(()), GOALS["make-coffee"])
    assert not check.ok
    assert "no Mug has been seen" in check.reason


def test_empty_plan_leaves_the_goal_unmet() -> None:
    check = CHECK(Plan(()), scene(home_of("make-coffee")), GOALS["make-coffee"])
    assert not check.ok
    assert check.unmet == (Literal("filled", ("Mug-1",), "coffee"),)


def test_unseen_facts_are_assumed_and_listed_only_where_the_plan_relies_on_them() -> None:
    graph = scene(home_of("heat-potato"), "Plate-1 unseen dirty, Mug-1 unseen dirty")
    check = CHECK(PLANS["heat-potato"], graph, GOALS["heat-potato"])
    assert check.ok
    assert check.assumed == (Literal("dirty", ("Plate-1",), "clean"),)


def test_hidden_containers_are_assumed_empty() -> None:
    graph = scene(home_of("heat-potato"), "Microwave-1 hidden")
    check = CHECK(PLANS["heat-potato"], graph, GOALS["heat-potato"])
    assert Literal("vacant", ("Microwave-1",)) in check.assumed


def test_a_thing_never_seen_is_believed_in_the_hidden_container_that_the_plan_opens() -> None:
    graph = scene("Fridge-1 hidden, CounterTop-1, Bowl-1 on CounterTop-1")
    check = CHECK(PLANS["store-egg"], graph, GOALS["store-egg"])
    assert check.ok
    assert Literal("inside", ("Egg-1", "Fridge-1")) in check.assumed
    closed = CHECK(plan("pick_up(Egg)"), graph, GOALS["store-egg"])
    assert "no Egg has been seen" in closed.reason


def test_goal_variables_bind_to_any_instance() -> None:
    graph = scene(home_of("make-coffee"), "Mug-2 on CounterTop-1")
    steps = [t.replace("Mug", "Mug-2") for t in PLANS["make-coffee"].texts()]
    assert CHECK(Plan.parse(steps), graph, GOALS["make-coffee"]).ok


def test_of_two_that_would_do_the_one_that_the_plan_deals_with_is_missed() -> None:
    two = "Toaster-1, BreadSliced-1 on CounterTop-1, BreadSliced-2 in Toaster-1"
    toasted = goal("cooked(?slice)=cooked", slice="BreadSliced")
    turned = CHECK(plan("toggle_on(Toaster-1)\n toggle_off(Toaster-1)"), scene(two), toasted)
    assert turned.ok
    left = CHECK(plan("pick_up(BreadSliced-2)"), scene(two), toasted)
    assert left.unmet == (Literal.parse("cooked(BreadSliced-2)=cooked"),)
    state = observed(scene(two), DOMAIN)
    assert unmet((state,), toasted, {"Toaster-1"}) == left.unmet
    assert unmet((state,), toasted, {"CounterTop-1"})[0].args == ("BreadSliced-1",)


def test_running_water_cleans_and_fills_what_is_empty_and_leaves_wine() -> None:
    graph = scene(
        "Sink-1, Faucet-1, Mug-1 in Sink-1, Mug-1 is dirty, Bowl-1 in Sink-1, Bowl-1 is wine"
    )
    trace = run(observed(graph, DOMAIN), [Subtask("toggle_on", ("Faucet",))])
    assert trace.final.value("Mug-1", "dirty") == "clean"
    assert trace.final.value("Mug-1", "filled") == "water"
    assert trace.final.value("Bowl-1", "filled") == "wine"


def test_microwave_heats_bread_without_toasting_it() -> None:
    graph = scene("Microwave-1, BreadSliced-1 in Microwave-1")
    after = apply(observed(graph, DOMAIN), Subtask("toggle_on", ("Microwave",)))
    assert not isinstance(after, Refusal)
    assert after.value("BreadSliced-1", "temperature") == "hot"
    assert after.value("BreadSliced-1", "cooked") == "raw"


def test_ready_food_is_spoiled_by_dirt_and_raw_whole_food_is_not() -> None:
    graph = scene("CounterTop-1, Plate-1 on CounterTop-1, Plate-1 is dirty, BreadSliced-1 held")
    put = Subtask("put_on", ("BreadSliced", "Plate"))
    after = apply(observed(graph, DOMAIN), put)
    assert not isinstance(after, Refusal)
    assert spoiled(after) == {"BreadSliced-1"}
    graph = scene("CounterTop-1, Plate-1 on CounterTop-1, Plate-1 is dirty, Potato-1 held")
    after = apply(observed(graph, DOMAIN), Subtask("put_on", ("Potato", "Plate")))
    assert not isinstance(after, Refusal)
    assert spoiled(after) == set()


def test_contents_travel_with_their_container() -> None:
    graph = scene(home_of("heat-potato"), "Potato-1 on Plate-1")
    steps = plan("pick_up(Plate)\nput_on(Plate, DiningTable)").subtasks
    final = run(observed(graph, DOMAIN), steps).final
    assert final.root("Potato-1") == "DiningTable-1"


def test_apply_leaves_the_given_state_alone() -> None:
    state = observed(scene(home_of("toast-bread"), "Knife-1 held"), DOMAIN)
    before = contents(state)
    after = apply(state, Subtask("slice_obj", ("Bread",)))
    assert not isinstance(after, Refusal)
    assert contents(state) == before
    assert after.instances("BreadSliced") == ("BreadSliced-1", "BreadSliced-2", "BreadSliced-3")
    assert "Bread-1" not in after.kinds


def test_category_names_mean_the_held_then_the_free_then_the_lowest() -> None:
    graph = scene(
        home_of("make-coffee"),
        "Mug-1 in Fridge-1, Mug-2 on CounterTop-1, Cup-1 blocks Mug-2, Mug-10 on CounterTop-1",
        "Mug-3 on CounterTop-2",
    )
    final = run(observed(graph, DOMAIN), [Subtask("pick_up", ("Mug",))]).final
    assert final.held == "Mug-3"


def test_receptacle_category_means_one_with_room() -> None:
    graph = scene(home_of("boil-water"), "Pan-1 on StoveBurner-1, Pot-1 held")
    final = run(observed(graph, DOMAIN), [Subtask("put_on", ("Pot", "StoveBurner"))]).final
    place = final.place("Pot-1")
    assert place is not None and place.parent == "StoveBurner-2"


def test_never_counts_what_happened_in_between() -> None:
    wanted = goal("toggled(Faucet-1)=off", never=("filled(Mug-1)=water",))
    graph = scene(home_of("make-coffee"), "Mug-1 in Sink-1")
    check = CHECK(plan("toggle_on(Faucet)\ntoggle_off(Faucet)"), graph, wanted)
    assert not check.ok
    assert check.unmet == (Literal("filled", ("Mug-1",), "water"),)


def test_a_plan_is_checked_with_instances_and_unknown_steps_are_named() -> None:
    graph = scene(
        home_of("make-coffee"), "Mug-2 on CounterTop-2, Mug-1 on CounterTop-1, Pot-1 blocks Mug-1"
    )
    check = CHECK(plan("pick_up(Mug)\nput_on(Mug, CounterTop)"), graph, goal("hand_empty()"))
    assert check.ok and check.plan is not None
    assert check.plan.texts() == ["pick_up(Mug-2)", "put_on(Mug-2, CounterTop-1)"]
    wrong = CHECK(plan("pick_up(Mug)\npick_up(Spaceship)"), graph, goal("hand_empty()"))
    assert (wrong.ok, wrong.step) == (False, 1)
