"""A scenario's scene is the undisturbed one of the same seed, but for what the scenario changes."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
import pytest

from forestall.domain.load import shipped
from forestall.errors import InputError, SceneError, UnknownNameError
from forestall.tasks.faults import apply_scene_faults, parse_fault
from forestall.tasks.files import load_task
from forestall.types.scene import SceneNeeds
from forestall.worlds.kitchen.catalogue import shipped_catalogue
from forestall.worlds.kitchen.model import build_scene
from forestall.worlds.kitchen.needs import AXES
from forestall.worlds.kitchen.settled import check_settled
from forestall.worlds.kitchen.world import KitchenWorld

DOMAIN = shipped("household")
SEEDS = (40, 41)


def needs_of(task: str, *faults: Mapping[str, object]) -> SceneNeeds:
    scene = load_task(task).task.scene
    return apply_scene_faults(scene, [parse_fault(f) for f in faults], DOMAIN)


def build(needs: SceneNeeds, seed: int) -> KitchenWorld:
    return build_scene(needs, seed, shipped_catalogue())


def things(world: KitchenWorld) -> dict[str, bytes]:
    """Pose of every thing that is there."""
    there = [i.name for i in world.instances if not i.prepared]
    bodies = world.bodies
    return {n: bodies.pose(n).round(9).tobytes() for n in there if bodies.is_thing(n)}


def fixtures(world: KitchenWorld) -> dict[str, object]:
    """Place of every fixture in the room (a stove's burners stand for the stove)."""
    there = [i.name for i in world.instances if not i.prepared]
    shut = [n for n in there if not world.bodies.is_thing(n) and "Drawer" not in n]
    return {n: world.box_world_m(n) for n in shut if "Cabinet" not in n}


def colours(world: KitchenWorld, name: str) -> list[tuple[float, ...]]:
    names = world.appearance.instance_names
    geoms = world.appearance.geom_instance == names.index(name)
    return [tuple(rgba) for rgba in world.model.geom_rgba[geoms].round(6).tolist()]


def moved(one: KitchenWorld, two: KitchenWorld) -> set[str]:
    a, b = things(one), things(two)
    return {n for n in a.keys() | b.keys() if a.get(n) != b.get(n)}


def light(world: KitchenWorld) -> bytes:
    return bytes(world.model.light_pos.tobytes() + world.model.light_diffuse.tobytes())


def start(world: KitchenWorld) -> tuple[float, ...]:
    return (*world.robot_position_world_m, world.robot_yaw_rad)


CHANGES: dict[str, tuple[str, list[Mapping[str, object]], set[str]]] = {
    "occupied": (
        "heat-potato",
        [{"kind": "add_object", "category": "Bowl", "places": ["Microwave"]}],
        {"Bowl-1"},
    ),
    "filled": (
        "make-salad",
        [{"kind": "set_state", "object": "Bowl", "attribute": "filled", "value": "wine"}],
        set(),
    ),
    "moved": (
        "make-coffee",
        [{"kind": "move_object", "object": "Mug", "places": ["CoffeeMachine"]}],
        {"Mug-1"},
    ),
    "missing": ("toast-bread", [{"kind": "remove_object", "object": "Knife"}], {"Knife-1"}),
    "added": (
        "make-salad",
        [{"kind": "add_object", "category": "Apple"}, {"kind": "add_object", "category": "Bowl"}],
        {"Apple-1", "Bowl-2"},
    ),
    "fixture": (
        "water-plant",
        [{"kind": "set_state", "object": "Drawer-1", "attribute": "open", "value": "open"}],
        set(),
    ),
}


@pytest.mark.parametrize("name", sorted(CHANGES))
def test_only_what_a_scenario_names_differs(name: str) -> None:
    task, faults, expected = CHANGES[name]
    for seed in SEEDS:
        before, after = build(needs_of(task), seed), build(needs_of(task, *faults), seed)
        assert moved(before, after) == expected, seed
        assert fixtures(before) == fixtures(after)
        assert start(before) == start(after)
        assert light(before) == light(after)
        for thing in (things(before).keys() & things(after).keys()) - expected:
            if name != "filled" or thing != "Bowl-1":
                assert colours(before, thing) == colours(after, thing), (seed, thing)
        assert colours(before, "CounterTop-1") == colours(after, "CounterTop-1")
        assert check_settled(after) == ()


def test_states_are_changed_and_stay_after_a_reset() -> None:
    world = build(
        needs_of(
            "make-salad",
            {"kind": "set_state", "object": "Bowl", "attribute": "filled", "value": "wine"},
            {"kind": "set_state", "object": "Cabinet-2", "attribute": "open", "value": "open"},
            {"kind": "add_object", "category": "Plate", "states": {"dirty": "dirty"}},
        ),
        SEEDS[0],
    )
    for _ in range(2):
        states = {i.name: dict(i.states) for i in world.instances}
        assert states["Bowl-1"]["filled"] == world.bodies.states["Bowl-1"]["filled"] == "wine"
        assert states["Cabinet-2"]["open"] == world.bodies.states["Cabinet-2"]["open"] == "open"
        assert world.bodies.states["Plate-1"]["dirty"] == "dirty"
        world.show("Cabinet-2", "open", "closed")
        world.reset()


def test_what_is_blocked_moves_no_more_than_it_must_and_nothing_else_of_the_task_does() -> None:
    fault: Mapping[str, object] = {"kind": "add_object", "category": "Pot", "in_front_of": "Knife"}
    ways = []
    for seed in SEEDS:
        before, after = (
            build(needs_of("toast-bread"), seed),
            build(needs_of("toast-bread", fault), seed),
        )
        assert after.blocker("Knife-1") == "Pot-1"
        assert "Bread-1" not in moved(before, after)
        assert fixtures(before) == fixtures(after)
        if before.bodies.parents["Knife-1"] == after.bodies.parents["Knife-1"]:
            way = before.bodies.pose("Knife-1")[:3, 3] - after.bodies.pose("Knife-1")[:3, 3]
            ways.append(float(np.linalg.norm(way)))
    assert len(ways) >= 2
    assert max(ways) < 0.6


def test_clutter_of_an_added_category_gives_way_to_what_is_added() -> None:
    scene = load_task("boil-water").task.scene
    for seed in range(40, 60):
        clutter = things(build(scene, seed)).keys() - {"Pot-1"}
        if any(n.startswith("Mug-") for n in clutter):
            break
    after = build(
        needs_of("boil-water", {"kind": "add_object", "category": "Mug", "places": ["Sink"]}), seed
    )
    assert "Mug-1" in clutter
    assert [n for n in things(after) if n.startswith("Mug-")] == ["Mug-1"]
    assert after.bodies.parents["Mug-1"] == "Sink-1"


def test_each_axis_of_variety_changes_only_itself() -> None:
    task = "make-coffee"
    for seed in SEEDS:
        usual = build(needs_of(task), seed)
        worlds = {
            axis: build(needs_of(task, {"kind": "vary", "axes": [axis], "number": 2}), seed)
            for axis in AXES
        }
        for axis, world in worlds.items():
            same_room = fixtures(world) == fixtures(usual)
            assert same_room == (axis not in ("layout", "furniture")), axis
            assert (light(world) == light(usual)) == (axis not in ("light", "layout")), axis
            tone = colours(world, "Fridge-1") == colours(usual, "Fridge-1")
            assert tone == (axis != "colours"), axis
            if axis in ("colours", "light", "clutter", "furniture"):
                assert start(world)[2:] == start(usual)[2:] or axis == "furniture"
            if axis in ("colours", "light", "start"):
                assert moved(usual, world) == set(), axis
            assert check_settled(world) == ()
        assert start(worlds["start"]) != start(usual)
        assert "Mug-1" not in moved(usual, worlds["clutter"])
        assert moved(usual, worlds["clutter"])
        counters = {n for n in fixtures(usual) if n.startswith("CounterTop")}
        for name in counters:
            assert fixtures(worlds["furniture"])[name] == fixtures(usual)[name]


def test_other_numbers_vary_otherwise_and_more_clutter_leaves_the_rest() -> None:
    one, two = (
        build(needs_of("boil-water", {"kind": "vary", "axes": ["colours"], "number": n}), 40)
        for n in (1, 2)
    )
    assert colours(one, "Fridge-1") != colours(two, "Fridge-1")
    before = build(needs_of("boil-water"), 40)
    after = build(needs_of("boil-water", {"kind": "more_clutter", "count": 3}), 40)
    assert len(things(after)) == len(things(before)) + 3
    assert moved(before, after) == things(after).keys() - things(before).keys()


def test_a_scenario_scene_is_the_same_each_time() -> None:
    needs = needs_of(
        "toast-bread",
        {"kind": "add_object", "category": "Pot", "in_front_of": "Knife"},
        {"kind": "vary", "axes": ["start", "light"], "number": 5},
    )
    one, two = build(needs, 41), build(needs, 41)
    assert one.instances == two.instances
    assert start(one) == start(two)
    assert np.array_equal(one.data.qpos, two.data.qpos)
    assert np.array_equal(one.model.geom_rgba, two.model.geom_rgba)


def test_what_cannot_vary_or_fit_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("forestall.worlds.kitchen.model.LAYOUTS", 1)
    scene = load_task("boil-water").task.scene
    with pytest.raises(UnknownNameError, match="axis of variety 'smell': known: clutter, colours"):
        build(replace(scene, vary=(("smell", 1),)), 40)
    with pytest.raises(SceneError, match="cannot vary 'light' to -1"):
        build(replace(scene, vary=(("light", -1),)), 40)
    with pytest.raises(UnknownNameError, match="axis of variety 'smell'"):
        build(needs_of("boil-water", {"kind": "vary", "axes": ["smell"]}), 40)
    with pytest.raises(InputError, match="axes"):
        needs_of("boil-water", {"kind": "vary", "axes": []})
    mugs: list[Mapping[str, object]] = [
        {"kind": "add_object", "category": "Mug", "places": ["CoffeeMachine"]}
    ] * 2
    with pytest.raises(SceneError, match="no free place for Mug-2"):
        build(needs_of("boil-water", *mugs), 40)
