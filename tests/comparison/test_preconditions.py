from __future__ import annotations

from dataclasses import replace

import pytest
from graph_pairs import scene

from forestall.comparison.lifting import evaluate
from forestall.comparison.preconditions import MiningConfig, lift, mine, violations
from forestall.domain.load import shipped
from forestall.errors import InputError
from forestall.types.facts import Literal, Truth
from forestall.types.graph import SceneGraph
from forestall.types.plan import Subtask
from forestall.types.verdict import Reference

DOMAIN = shipped("household")


def references(task: str, index: int, *graphs: SceneGraph) -> list[Reference]:
    found = []
    for i, graph in enumerate(graphs):
        assert graph.subtask is not None
        found.append(Reference(f"{task}-{i}", task, index, graph.subtask, 1.0, graph))
    return found


def put_plate(
    microwave: str = "open=open", plate: str = "dirty=clean", more: str = ""
) -> SceneGraph:
    return scene(
        "gripper; Potato-1 cooked=raw; Bowl-1; "
        f"Plate-1 {plate}; Microwave-1 {microwave} toggled=off",
        f"Plate-1 held_by gripper; Potato-1 on_top_of Plate-1{more}",
        "put_in(Plate-1, Microwave-1)",
    )


def broken(refs: list[Reference], graph: SceneGraph, task: str | None = None) -> dict[str, Truth]:
    assert graph.subtask is not None
    mined = mine(refs, DOMAIN, subtask=graph.subtask, task=task)
    return {str(v.literal): v.truth for v in violations(mined, graph, graph.subtask, DOMAIN)}


HEAT = references("heat-potato", 8, *[put_plate() for _ in range(4)])


def test_lifted_literals() -> None:
    graph = put_plate()
    assert graph.subtask is not None
    assert {str(x) for x in lift(graph, graph.subtask, DOMAIN)} == {
        "accessible(?object)",
        "dirty(?object)=clean",
        "held_by(?object, gripper)",
        "not inside(?object, ?target)",
        "on_top_of(Potato, ?object)",
        "open(?target)=open",
        "toggled(?target)=off",
        "vacant(?target)",
    }


def test_nothing_in_front_is_lifted_where_the_skill_needs_the_way_clear() -> None:
    graph = scene("gripper; Mug-1; Sink-1", "", "pick_up(Mug-1)")
    for text, lifted in (("pick_up(Mug-1)", True), ("put_in(Mug-1, Sink-1)", False)):
        found = {str(x) for x in lift(graph, Subtask.parse(text), DOMAIN)}
        assert ("unblocked(?object)" in found) is lifted


def test_counters_and_fridges_are_never_vacant() -> None:
    for name in ("CounterTop-1", "Fridge-1", "Sink-1"):
        graph = scene(f"gripper; Mug-1; {name}", "", f"put_on(Mug-1, {name})")
        assert graph.subtask is not None
        assert "vacant(?target)" not in {str(x) for x in lift(graph, graph.subtask, DOMAIN)}


def test_what_else_the_hand_holds_goes_by_category() -> None:
    graph = scene(
        "gripper; Lettuce-2; Bowl-1", "Lettuce-2 held_by gripper", "navigate_to_obj(Bowl-1)"
    )
    assert graph.subtask is not None
    lifted = {str(x) for x in lift(graph, graph.subtask, DOMAIN)}
    assert "held_by(Lettuce, gripper)" in lifted
    assert "hand_empty()" not in lifted


def test_driving_does_not_care_whether_the_target_is_open() -> None:
    graph = scene("gripper; Microwave-1 open=open", "", "navigate_to_obj(Microwave-1)")
    assert graph.subtask is not None
    lifted = {x.predicate for x in lift(graph, graph.subtask, DOMAIN)}
    assert "open" not in lifted
    assert "vacant" in lifted


def test_an_argument_that_is_only_a_category_is_unobserved() -> None:
    graph = scene("gripper; Mug-1; Mug-2", "", "pick_up(Mug)")
    assert graph.subtask is not None
    assert {str(x) for x in lift(graph, graph.subtask, DOMAIN)} == {"hand_empty()"}
    literal = Literal("unblocked", ("?object",))
    assert evaluate(literal, graph, graph.subtask, DOMAIN) is Truth.UNOBSERVED


def test_nothing_is_violated_where_nothing_changed() -> None:
    assert broken(HEAT, put_plate()) == {}


def test_closed_microwave() -> None:
    assert broken(HEAT, put_plate("open=closed")) == {"open(Microwave-1)=open": Truth.FALSE}


def test_bowl_in_the_microwave() -> None:
    graph = put_plate(more="; Bowl-1 inside Microwave-1")
    assert broken(HEAT, graph) == {"vacant(Microwave-1)": Truth.FALSE}


def test_what_cannot_be_seen_comes_last_and_is_unobserved() -> None:
    graph = put_plate("open=closed")
    graph = SceneGraph(graph.nodes, graph.relations, graph.subtask, ("Microwave-1",))
    assert list(broken(HEAT, graph).items()) == [
        ("open(Microwave-1)=open", Truth.FALSE),
        ("vacant(Microwave-1)", Truth.UNOBSERVED),
    ]


def test_dirty_plate() -> None:
    assert broken(HEAT, put_plate(plate="dirty=dirty")) == {"dirty(Plate-1)=clean": Truth.FALSE}


def test_filled_bowl() -> None:
    demos = [
        scene("gripper; Bowl-1 filled=empty dirty=clean", "", "pick_up(Bowl-1)") for _ in range(4)
    ]
    graph = scene("gripper; Bowl-3 filled=wine dirty=clean", "", "pick_up(Bowl-3)")
    refs = references("make-salad", 28, *demos)
    assert broken(refs, graph) == {"filled(Bowl-3)=empty": Truth.FALSE}
    assert broken(refs, graph, task="heat-potato") == {}, "a salad's needs are not this task's"


def test_blocked_knife() -> None:
    demos = [scene("gripper; Knife-1; Bread-1", "", "pick_up(Knife-1)") for _ in range(4)]
    graph = scene("gripper; Knife-1; Pot-1", "Pot-1 blocking Knife-1", "pick_up(Knife-1)")
    assert broken(references("toast-bread", 1, *demos), graph) == {
        "unblocked(Knife-1)": Truth.FALSE
    }


def test_dropped_mug() -> None:
    things = "gripper; Mug-1 filled=empty; CoffeeMachine-1; Floor-1"
    subtask = "put_in(Mug-1, CoffeeMachine-1)"
    demos = [scene(things, "Mug-1 held_by gripper", subtask) for _ in range(4)]
    graph = scene(things, "Mug-1 on_top_of Floor-1", subtask)
    assert broken(references("make-coffee", 9, *demos), graph) == {
        "held_by(Mug-1, gripper)": Truth.FALSE
    }


def test_literals_carry_over_to_other_instances_and_the_sister_skill() -> None:
    demos = [
        scene(
            "gripper; Pot-1; StoveBurner-1", "Pot-1 held_by gripper", "put_on(Pot-1, StoveBurner-1)"
        )
        for _ in range(2)
    ]
    graph = scene(
        "gripper; Pot-2; StoveBurner-4; Pan-1",
        "Pot-2 held_by gripper; Pan-1 on_top_of StoveBurner-4",
        "put_in(Pot-2, StoveBurner-4)",
    )
    assert broken(references("boil-water", 8, *demos), graph) == {
        "vacant(StoveBurner-4)": Truth.FALSE
    }


def test_a_literal_that_was_false_once_is_no_precondition() -> None:
    refs = references("heat-potato", 8, *[put_plate()] * 3, put_plate("open=closed"))
    assert "open" not in {p.literal.predicate for p in mine(refs, DOMAIN)}


def test_unobserved_counts_neither_for_nor_against() -> None:
    refs = references("heat-potato", 8, put_plate(), put_plate(), put_plate("open=?"))
    found = {str(p.literal): p for p in mine(refs, DOMAIN)}
    assert (found["open(?target)=open"].support, found["open(?target)=open"].total) == (2, 3)
    assert found["open(?target)=open"].weight == pytest.approx(3 / 4), "two observed, both open"


def test_one_demonstration_is_enough_and_counts_as_one() -> None:
    found = mine(HEAT[:1], DOMAIN)
    assert {(p.support, p.total) for p in found} == {(1, 1)}
    assert "vacant(?target)" in {str(p.literal) for p in found}
    context = {"on_top_of(Potato, ?object)"}  # what is no argument needs more than one
    assert not context & {str(p.literal) for p in found}
    assert mine([], DOMAIN) == ()


def test_two_steps_of_one_run_are_one_demonstration() -> None:
    twice = [HEAT[0], replace(HEAT[0], index=3)]
    assert {(p.support, p.total) for p in mine(twice, DOMAIN)} == {(1, 1)}
    found = mine([*twice, HEAT[1]], DOMAIN)
    assert {(p.support, p.total) for p in found} == {(2, 2)}


def test_other_kinds_of_arguments_teach_only_what_the_skill_needs() -> None:
    refs = references(
        "heat-potato", 1, *[scene("gripper; Plate-1 dirty=clean", "", "pick_up(Plate-1)")] * 4
    )
    graph = scene("gripper; Cup-1 dirty=dirty; Pot-1", "Pot-1 blocking Cup-1", "pick_up(Cup-1)")
    assert broken(refs, graph, "heat-potato") == {"unblocked(Cup-1)": Truth.FALSE}


def test_the_hand_is_judged_by_the_same_step_of_the_same_task() -> None:
    drive = scene("gripper; Bowl-1; Egg-1", "Egg-1 held_by gripper", "navigate_to_obj(Bowl-1)")
    empty = scene("gripper; Bowl-1; Egg-1", "", "navigate_to_obj(Bowl-1)")
    here = references("store-egg", 9, drive, drive, drive)
    assert broken(here, empty) == {"held_by(Egg, gripper)": Truth.FALSE}
    assert broken(here, empty, "make-salad") == {}
    assert broken(here[:2] + references("store-egg", 13, drive), empty) == {}
    assert broken(here + references("make-salad", 5, empty), empty, "store-egg") == {
        "held_by(Egg, gripper)": Truth.FALSE
    }


def test_other_skills_are_passed_over() -> None:
    graph = put_plate("open=closed")
    closing = Subtask.parse("close_obj(Microwave-1)")
    assert violations(mine(HEAT, DOMAIN), graph, closing, DOMAIN) == ()


def test_support_is_asked_for() -> None:
    dirty = references("heat-potato", 8, put_plate(plate="dirty=dirty"), put_plate())
    shown = {str(p.literal) for p in mine(dirty, DOMAIN, MiningConfig(minimum_support=4))}
    assert "vacant(?target)" in shown and "dirty(?object)=clean" not in shown
    with pytest.raises(InputError):
        MiningConfig(minimum_support=0)
    one = MiningConfig(minimum_support=1, contextual_support=1)
    assert "vacant(?target)" in {str(p.literal) for p in mine(HEAT[:1], DOMAIN, one)}


def test_mining_does_not_depend_on_the_order_of_equals() -> None:
    shuffled = [replace(r, demonstration=f"x{i}") for i, r in enumerate(reversed(HEAT))]
    assert mine(HEAT, DOMAIN) == mine(shuffled, DOMAIN)
