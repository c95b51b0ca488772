"""What a skill may have changed, and nothing else."""

from dataclasses import replace

from forestall.planning.altered import altered
from forestall.planning.validate import GraphValidator
from forestall.types.facts import Change, Literal
from forestall.types.plan import Plan, Subtask
from forestall.types.task import Goal
from planning.corpus import DOMAIN, scene

SINK = "Mug-1 in Sink-1, Faucet-1, Cup-1 on CounterTop-1, CounterTop-1, Fridge-1"


def after(step: str, *more: str) -> set[tuple[str, str]]:
    found = altered(scene(SINK, *more), Subtask.parse(step), DOMAIN)
    return {(c.thing, c.attribute) for c in found}


def test_a_tap_fills_what_stands_below_it() -> None:
    found = after("toggle_on(Faucet-1)", "Mug-1 is dirty")
    assert {("Faucet-1", "toggled"), ("Mug-1", "filled"), ("Mug-1", "dirty")} <= found
    assert not any(name == "Cup-1" for name, _ in found)


def test_a_drive_changes_no_state() -> None:
    assert after("navigate_to_obj(Fridge-1)") == set()


def test_a_thing_that_is_put_down_is_where_it_was_put_and_what_is_picked_up_nowhere() -> None:
    held = scene("Mug-1 held, Sink-1, Faucet-1, CounterTop-1")
    put = altered(held, Subtask.parse("put_in(Mug-1, Sink-1)"), DOMAIN)
    assert Change("Mug-1", "inside", "", "Sink-1") in put
    taken = altered(scene(SINK), Subtask.parse("pick_up(Cup-1)"), DOMAIN)
    assert not any(change.attribute in DOMAIN.containing for change in taken)


def test_what_could_not_run_or_is_not_known_changes_nothing_that_is_known() -> None:
    assert after("open_obj(Mug-1)") == set()
    assert after("polish(Mug-1)") == set()


def test_the_scene_is_left_as_it_was() -> None:
    graph = scene(SINK)
    altered(graph, Subtask.parse("toggle_on(Faucet-1)"), DOMAIN)
    assert graph == scene(SINK)


def test_what_nobody_has_read_since_is_assumed_to_be_what_it_was_meant_to_become() -> None:
    graph = scene("Mug-1 on CounterTop-1, CounterTop-1, Sink-1, Faucet-1")
    was = graph.get("Mug-1")
    assert was is not None
    unread = tuple((a, None if a == "filled" else v) for a, v in was.states)
    plan = Plan((Subtask.parse("pick_up(Mug-1)"),))
    goal = Goal("a mug of water", literals=(Literal("filled", ("Mug-1",), "water"),))
    for presumed, ok in (((), False), ((("filled", "water"),), True)):
        mug = replace(was, states=unread, presumed=presumed)
        nodes = tuple(mug if n.id == mug.id else n for n in graph.nodes)
        check = GraphValidator(DOMAIN).check(plan, replace(graph, nodes=nodes), goal)
        assert check.ok is ok
        assert "filled" in {x.predicate for x in check.assumed}, "assumed, and said to be"
