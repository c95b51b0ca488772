"""Scenes from needs and seeds: complete, settled, reachable, the same each time."""

from __future__ import annotations

from dataclasses import replace

import mujoco
import numpy as np
import pytest

from forestall.domain.load import extend, shipped
from forestall.errors import ForestallError, SceneError, UnknownNameError
from forestall.types.facts import category_of
from forestall.types.scene import ObjectNeed, SceneNeeds
from forestall.worlds.kitchen.catalogue import catalogue, shipped_catalogue
from forestall.worlds.kitchen.model import build_scene
from forestall.worlds.kitchen.placement import footprint_at
from forestall.worlds.kitchen.settled import check_settled
from forestall.worlds.kitchen.world import KitchenWorld

SALAD = SceneNeeds(
    objects=(
        ObjectNeed("Lettuce-1", "Lettuce"),
        ObjectNeed("Potato-1", "Potato"),
        ObjectNeed("Tomato-1", "Tomato"),
        ObjectNeed("Knife-1", "Knife"),
        ObjectNeed("Bowl-1", "Bowl", states=(("filled", "wine"),)),
        ObjectNeed("Egg-1", "Egg", places=("Fridge",)),
        ObjectNeed("Pan-1", "Pan", places=("StoveBurner-4",)),
    )
)
DEVICES = SceneNeeds(
    room="living-room",
    objects=(ObjectNeed("Laptop-1", "Laptop"), ObjectNeed("RemoteControl-1", "RemoteControl")),
    clutter=(1, 3),
)
BLOCKED = SceneNeeds(
    objects=(
        ObjectNeed("Knife-1", "Knife"),
        ObjectNeed("Bread-1", "Bread"),
        ObjectNeed("Pot-1", "Pot", in_front_of="Knife-1"),
    )
)
FIXTURES = {
    "kitchen": {
        *("Sink-1", "Faucet-1", "Fridge-1", "Microwave-1", "CoffeeMachine-1", "Toaster-1"),
        *("Cabinet-1", "Cabinet-2", "Drawer-1", "Drawer-2", "GarbageCan-1", "Shelf-1"),
        *(f"StoveBurner-{k}" for k in range(1, 5)),
        *(f"StoveKnob-{k}" for k in range(1, 5)),
        *("CounterTop-1", "CounterTop-2", "DiningTable-1", "Floor-1"),
    },
    "living-room": {"TVStand-1", "Television-1", "FloorLamp-1", "DiningTable-1", "Shelf-1"},
}


def build(needs: SceneNeeds, seed: int = 0) -> KitchenWorld:
    return build_scene(needs, seed, shipped_catalogue())


@pytest.mark.parametrize("needs", [SALAD, DEVICES], ids=["kitchen", "living-room"])
def test_scenes_of_many_seeds_are_complete_settled_and_workable(needs: SceneNeeds) -> None:
    for seed in range(8):
        world = build(needs, seed)
        assert check_settled(world) == (), seed
        there = {i.name: i for i in world.instances}
        assert FIXTURES[needs.room or "kitchen"] <= set(there), seed
        clutter = [
            i.name
            for i in world.instances
            if i.parent and not i.prepared and i.name not in {n.id for n in needs.objects}
        ]
        assert needs.clutter[0] <= len(clutter) <= needs.clutter[1]
        taken = {n.category for n in needs.objects}
        assert not taken & {category_of(name) for name in clutter}
        for need in needs.objects:
            seconds = world.drive_to(need.id)
            assert seconds >= 0
            assert world.within_reach(need.id), (seed, need.id)
            assert world.blocker(need.id) is None, (seed, need.id)


def test_doors_and_drawers_swing_free_of_everything() -> None:
    for seed in range(8):
        world = build(SALAD, seed)
        for instance in world.instances:
            world.show(instance.name, "open", "open")
        assert check_settled(world) == (), seed


def test_same_needs_and_seed_give_the_same_scene_to_the_last_bit() -> None:
    one, two = build(SALAD, 3), build(SALAD, 3)
    assert one.instances == two.instances
    assert one.robot_position_world_m == two.robot_position_world_m
    for name in ("geom_rgba", "geom_size", "geom_pos", "geom_group", "mesh_vert", "light_pos"):
        assert np.array_equal(getattr(one.model, name), getattr(two.model, name)), name

    def work(world: KitchenWorld) -> list[object]:
        out: list[object] = [world.drive_to("Bowl-1")]
        world.hold("Bowl-1")
        out.append(world.drive_to("DiningTable-1"))
        world.place("Bowl-1", "DiningTable-1")
        world.replace("Tomato-1", ["TomatoSliced-1", "TomatoSliced-2", "TomatoSliced-3"])
        world.hold("Potato-1")
        world.drop("Potato-1")
        out += [world.data.qpos.tobytes(), world.model.geom_group.tobytes()]
        return out

    assert work(one) == work(two)


def test_other_seeds_give_other_scenes() -> None:
    one, two = build(SALAD, 1), build(SALAD, 2)
    counters = [w.box_world_m("CounterTop-1") for w in (one, two)]
    assert counters[0] != counters[1]
    assert one.robot_position_world_m != two.robot_position_world_m
    assert not np.array_equal(one.model.light_pos[0], two.model.light_pos[0])


def test_reset_goes_back_to_the_start_bit_for_bit() -> None:
    world = build(SALAD, 4)

    def state() -> tuple[bytes, ...]:
        arrays = (world.data.qpos, world.data.xpos, world.model.geom_group, world.model.geom_rgba)
        robot = np.array(world.robot_position_world_m)
        return (*(a.tobytes() for a in arrays), robot.tobytes())

    before = state()
    world.drive_to("Fridge-1")
    world.show("Fridge-1", "open", "open")
    world.hold("Bowl-1")
    world.drop("Bowl-1")
    world.replace("Egg-1", ["EggCracked-1"])
    assert state() != before
    world.reset()
    assert state() == before
    assert world.held_name is None
    assert world.blocker("Bowl-1") is None


def test_a_blocker_stands_in_front_and_leaves_the_sides_free() -> None:
    for seed in range(8):
        world = build(BLOCKED, seed)
        assert world.blocker("Knife-1") == "Pot-1"
        assert world.blocker("Pot-1") is None
        region, _ = world.bodies.region_of("Knife-1") or (None, 0)
        assert region is not None
        frame = np.linalg.inv(world.bodies.pose(region.carrier))
        knife, pot = (
            footprint_at(world.bodies.forms[n], frame @ world.bodies.pose(n))
            for n in ("Knife-1", "Pot-1")
        )
        assert 0.02 <= pot.y0 - knife.y1 <= 0.06
        assert max(pot.x0 - knife.x0, knife.x1 - pot.x1) > 0.03
        world.hold("Pot-1")
        assert world.blocker("Knife-1") is None


def test_places_and_start_states_are_as_asked() -> None:
    needs = SceneNeeds(
        objects=(
            ObjectNeed("Bowl-1", "Bowl", places=("Microwave",)),
            ObjectNeed("Mug-1", "Mug", places=("SinkBasin",), states=(("dirty", "dirty"),)),
            ObjectNeed("Potato-1", "Potato", places=("Plate-1",)),
            ObjectNeed("Plate-1", "Plate", places=("DiningTable",)),
            ObjectNeed("HousePlant-1", "HousePlant"),
            ObjectNeed("Cup-1", "Cup", places=("Drawer-1", "Cabinet-2")),
        ),
        fixtures=(("Microwave-1", "open", "open"), ("Faucet", "toggled", "on")),
        clutter=(0, 0),
    )
    with pytest.raises(SceneError, match="has no Faucet"):
        build(needs)
    world = build(replace(needs, fixtures=(("Microwave-1", "open", "open"),)), 2)
    parents = {i.name: i.parent for i in world.instances if i.parent}
    assert parents["Bowl-1"] == "Microwave-1"
    assert parents["Mug-1"] == "Sink-1"
    assert parents["Potato-1"] == "Plate-1"
    assert parents["Plate-1"] == "DiningTable-1"
    assert parents["Cup-1"] in ("Drawer-1", "Cabinet-2")
    states = {i.name: dict(i.states) for i in world.instances}
    assert states["Microwave-1"]["open"] == "open"
    assert states["Mug-1"]["dirty"] == "dirty"
    assert check_settled(world) == ()


def test_food_comes_with_its_slices_and_a_task_file_may_add_categories() -> None:
    more = {
        "Teapot": {
            "tags": ["pickupable"],
            "attributes": ["filled"],
            "size_m": [0.14, 0.14, 0.12],
            "world": {"shape": {"kind": "vessel", "handle": True}},
        },
        "Gizmo": {"tags": ["pickupable"]},
        "Carrot": {"tags": ["pickupable", "food"], "slices": 2, "slices_into": ["PotatoSliced"]},
    }
    added = catalogue(extend(shipped("household"), more, {}))
    objects = tuple(ObjectNeed(f"{c}-1", c) for c in more)
    world = build_scene(SceneNeeds(objects=objects, clutter=(0, 0)), 0, added)
    assert check_settled(world) == ()
    made = [i for i in world.instances if i.prepared]
    assert [(i.name, i.made_from) for i in made] == [
        ("PotatoSliced-1", "Carrot-1"),
        ("PotatoSliced-2", "Carrot-1"),
    ]
    world.replace("Carrot-1", ["PotatoSliced-1", "PotatoSliced-2"])
    assert check_settled(world) == ()


MUG = ObjectNeed("Mug-1", "Mug")


@pytest.mark.parametrize(
    ("needs", "message"),
    [
        (SceneNeeds(objects=(MUG, MUG)), "Mug-1 is needed twice"),
        (SceneNeeds(objects=(ObjectNeed("Cup-1", "Mug"),)), "must be named Mug-1"),
        (SceneNeeds(objects=(ObjectNeed("Sink-2", "Sink"),)), "is a fixture"),
        (SceneNeeds(objects=(replace(MUG, places=("TVStand",)),)), "needs TVStand"),
        (SceneNeeds(objects=(replace(MUG, places=("Knife",)),)), "nothing can be put on"),
        (SceneNeeds(objects=(replace(MUG, places=("Toaster",)),)), "does not take a Mug"),
        (SceneNeeds(objects=(replace(MUG, states=(("sliced", "whole"),)),)), "no attribute"),
        (SceneNeeds(objects=(replace(MUG, states=(("filled", "tea"),)),)), "cannot be 'tea'"),
        (SceneNeeds(objects=(replace(MUG, in_front_of="Cup-1"),)), "not among the needed"),
        (SceneNeeds(fixtures=(("Television-1", "toggled", "on"),)), "has no Television-1"),
        (SceneNeeds(clutter=(3, 1)), "smallest and a largest"),
        (SceneNeeds(clutter=(90, 90)), "room for this scene"),
        (
            SceneNeeds(
                objects=tuple(ObjectNeed(f"Bowl-{k}", "Bowl", ("Microwave",)) for k in (1, 2))
            ),
            "no free place for Bowl-2",
        ),
    ],
)
def test_impossible_needs_are_refused_in_words(
    needs: SceneNeeds, message: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("forestall.worlds.kitchen.model.LAYOUTS", 1)
    with pytest.raises(SceneError, match=message):
        build(needs)


def test_unknown_categories_and_rooms_are_named() -> None:
    with pytest.raises(UnknownNameError, match="unknown room 'garage': known: kitchen, living"):
        build(SceneNeeds(room="garage"))
    with pytest.raises(UnknownNameError, match="Mugg"):
        build(SceneNeeds(objects=(ObjectNeed("Mugg-1", "Mugg"),)))
    assert issubclass(UnknownNameError, ForestallError)


def test_the_settled_check_sees_what_goes_through_something() -> None:
    world = build(SALAD, 0)
    pose = world.bodies.pose("Potato-1")
    pose[2, 3] -= 0.02
    world.bodies.move("Potato-1", pose)
    assert any("Potato-1" in line for line in check_settled(world))
    world.reset()
    assert check_settled(world) == ()
    pose = world.bodies.pose("Bowl-1").copy()
    pose[:2, 3] = world.bodies.pose("Tomato-1")[:2, 3]
    pose[2, 3] = world.bodies.pose("Tomato-1")[2, 3]
    world.bodies.move("Bowl-1", pose)
    assert any("Bowl-1 and Tomato-1" in line for line in check_settled(world))


def test_a_scene_stays_light() -> None:
    world = build(replace(SALAD, clutter=(6, 6)), 1)
    assert world.model.ngeom <= 600
    assert int(world.model.mesh_facenum.sum()) < 20000
    shown = world.model.geom_group < 3
    mesh = world.model.geom_type == int(mujoco.mjtGeom.mjGEOM_MESH)
    assert shown[mesh].any()
    assert len(world.appearance.texture) == world.model.ngeom
