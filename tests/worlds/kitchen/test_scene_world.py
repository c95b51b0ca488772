"""What the skills can do with a built world: drive, see, hold, place, drop, replace, show."""

from __future__ import annotations

import mujoco
import numpy as np
import pytest

from forestall.errors import SceneError
from forestall.types.scene import ObjectNeed, SceneNeeds
from forestall.worlds.kitchen.catalogue import shipped_catalogue
from forestall.worlds.kitchen.forms import FLOOR
from forestall.worlds.kitchen.model import build_scene
from forestall.worlds.kitchen.navigation import EYE_HEIGHT_M
from forestall.worlds.kitchen.settled import check_settled
from forestall.worlds.kitchen.world import KitchenWorld

NEEDS = SceneNeeds(
    objects=(
        ObjectNeed("Bowl-1", "Bowl", places=("Microwave",)),
        ObjectNeed("Plate-1", "Plate"),
        ObjectNeed("Potato-1", "Potato"),
        ObjectNeed("Mug-1", "Mug"),
        ObjectNeed("Egg-1", "Egg", places=("Fridge",)),
        ObjectNeed("Bread-1", "Bread"),
        ObjectNeed("Pan-1", "Pan"),
    ),
    clutter=(1, 3),
)
SEEN = np.array([1, 1, 0, 0, 0, 0], dtype=np.uint8)


def build(seed: int = 0, needs: SceneNeeds = NEEDS) -> KitchenWorld:
    return build_scene(needs, seed, shipped_catalogue())


def seen_from_the_head(world: KitchenWorld, name: str) -> bool:
    """Whether a ray from the head to some part of a thing meets it first."""
    low, high = (np.array(c) for c in world.box_world_m(name) or ((0,) * 3,) * 2)
    eye = world.camera_to_world()[:3, 3].copy()
    for share in (0.3, 0.5, 0.7):
        target = low + (high - low) * np.array([0.5, 0.5, share])
        geom = np.full(1, -1, dtype=np.int32)
        mujoco.mj_ray(world.model, world.data, eye, target - eye, SEEN, 1, -1, geom)
        index = world.appearance.geom_instance[geom[0]]
        if index >= 0 and world.appearance.instance_names[index] == name:
            return True
    return False


@pytest.mark.parametrize("seed", range(6))
def test_closed_doors_hide_what_open_doors_show(seed: int) -> None:
    world = build(seed)
    for thing, box in (("Bowl-1", "Microwave-1"), ("Egg-1", "Fridge-1")):
        world.drive_to(box)
        assert not seen_from_the_head(world, thing), (seed, box)
        world.show(box, "open", "open")
        world.drive_to(thing)
        assert world.within_reach(thing)
        assert seen_from_the_head(world, thing), (seed, box)
        world.show(box, "open", "closed")
        assert not seen_from_the_head(world, thing)


def test_driving_takes_time_and_ends_facing_the_target() -> None:
    world = build(1)
    away = [n for n in ("Plate-1", "Mug-1", "Sink-1", "Fridge-1") if not world.within_reach(n)]
    for name in away:
        x, y, _ = world.robot_position_world_m
        seconds = world.drive_to(name)
        nx, ny, _ = world.robot_position_world_m
        assert seconds >= np.hypot(nx - x, ny - y) / 0.25 - 1e-9
        low, high = (np.array(c) for c in world.box_world_m(name) or ((0,) * 3,) * 2)
        ahead = world.camera_to_world()[:2, 2]
        assert np.dot(ahead, ((low + high) / 2)[:2] - [nx, ny]) > 0
        assert world.drive_to(name) == pytest.approx(0.0, abs=1e-6)


def test_the_camera_looks_where_it_is_told_within_the_limits_of_the_neck() -> None:
    world = build(0)
    world.drive_to("Plate-1")
    target = np.array(world.bodies.centre("Plate-1"))
    pose = world.look_at(target.tolist())
    assert pose[2, 3] == EYE_HEIGHT_M
    assert np.allclose(pose[:3, :3].T @ pose[:3, :3], np.eye(3))
    in_camera = np.linalg.inv(pose) @ np.array([*target, 1.0])
    assert np.allclose(in_camera[:2], 0, atol=1e-9)
    assert in_camera[2] > 0
    assert np.linalg.det(pose[:3, :3]) == pytest.approx(1.0)
    straight = world.camera_to_world(0.0, 0.0)
    assert straight[2, 1] == pytest.approx(-1.0)
    left = world.camera_to_world(np.pi, 0.0)
    cosine = float(np.dot(left[:3, 2], straight[:3, 2]))
    assert cosine == pytest.approx(np.cos(np.deg2rad(100)))
    down = world.camera_to_world(0.0, 3.0)
    assert down[2, 2] == pytest.approx(-np.sin(np.deg2rad(75)))


def test_a_plate_moves_with_its_potato() -> None:
    world = build(2)
    world.drive_to("Potato-1")
    world.hold("Potato-1")
    assert world.held_name == "Potato-1"
    hand = np.array(world.gripper_position_world_m)
    assert np.linalg.norm(np.array(world.bodies.centre("Potato-1")) - hand) < 0.15
    world.drive_to("Plate-1")
    world.place("Potato-1", "Plate-1")
    assert world.held_name is None
    world.hold("Plate-1")
    world.drive_to("DiningTable-1")
    world.place("Plate-1", "DiningTable-1")
    plate, potato = (np.array(world.box_world_m(n)) for n in ("Plate-1", "Potato-1"))
    assert np.all(potato[0][:2] >= plate[0][:2]) and np.all(potato[1][:2] <= plate[1][:2])
    assert potato[0][2] >= plate[0][2]
    assert check_settled(world) == ()


@pytest.mark.parametrize("seed", range(6))
def test_what_is_dropped_lies_on_the_floor_and_can_be_picked_up(seed: int) -> None:
    world = build(seed)
    world.drive_to("Mug-1")
    world.hold("Mug-1")
    world.drive_to("CoffeeMachine-1")
    world.drop("Mug-1")
    assert world.held_name is None
    low, high = (np.array(c) for c in world.box_world_m("Mug-1") or ((0,) * 3,) * 2)
    assert low[2] == pytest.approx(0.0, abs=0.005)
    assert high[2] < 0.12
    x, y, _ = world.robot_position_world_m
    middle = (low + high) / 2
    assert 0.3 <= np.hypot(middle[0] - x, middle[1] - y) <= 0.9
    assert check_settled(world) == ()
    world.drive_to("Mug-1")
    assert world.within_reach("Mug-1")
    assert seen_from_the_head(world, "Mug-1")
    assert world.bodies.parents["Mug-1"] == FLOOR


def test_single_spots_hold_one_thing() -> None:
    world = build(3)
    assert not world.has_room("Potato-1", "Microwave-1")
    with pytest.raises(SceneError, match="Microwave-1 has no room"):
        world.place("Potato-1", "Microwave-1")
    world.hold("Bowl-1")
    assert world.has_room("Potato-1", "Microwave-1")
    assert not world.has_room("Bread-1", "Mug-1")
    world.place("Pan-1", "StoveBurner-2")
    assert not world.has_room("Bowl-1", "StoveBurner-2")
    world.place("Mug-1", "CoffeeMachine-1")
    assert check_settled(world) == ()


def test_slices_take_the_place_of_the_whole_and_go_where_slices_go() -> None:
    for seed in range(4):
        world = build(seed)
        start = np.array(world.bodies.centre("Bread-1"))
        slices = ["BreadSliced-1", "BreadSliced-2", "BreadSliced-3"]
        assert not any(n in world.bodies.present for n in slices)
        world.replace("Bread-1", slices)
        assert "Bread-1" not in world.bodies.present
        for name in slices:
            assert np.linalg.norm(np.array(world.bodies.centre(name)) - start) < 0.5
            world.drive_to(name)
            assert world.within_reach(name) and world.blocker(name) is None
        world.place(slices[0], "Toaster-1")
        low, high = (np.array(c) for c in world.box_world_m(slices[0]) or ((0,) * 3,) * 2)
        assert high[2] - low[2] == pytest.approx(0.10, abs=0.01)
        assert not world.has_room(slices[1], "Toaster-1")
        world.place(slices[1], "Plate-1")
        assert check_settled(world) == ()


def test_an_egg_cracks_into_the_pan_and_a_bowl_takes_a_salad() -> None:
    needs = SceneNeeds(
        objects=tuple(
            ObjectNeed(f"{c}-1", c) for c in ("Lettuce", "Potato", "Tomato", "Bowl", "Egg", "Pan")
        ),
        clutter=(0, 1),
    )
    world = build(5, needs)
    world.hold("Egg-1")
    world.replace("Egg-1", ["EggCracked-1"])
    assert world.held_name == "EggCracked-1"
    world.place("EggCracked-1", "Pan-1")
    assert world.bodies.parents["EggCracked-1"] == "Pan-1"
    for whole in ("Lettuce", "Potato", "Tomato"):
        slices = [f"{whole}Sliced-{k}" for k in (1, 2, 3)]
        world.replace(f"{whole}-1", slices)
        for name in slices:
            assert world.has_room(name, "Bowl-1")
            world.place(name, "Bowl-1")
    assert check_settled(world) == ()
    world.hold("Bowl-1")
    world.show("Fridge-1", "open", "open")
    world.place("Bowl-1", "Fridge-1")
    assert check_settled(world) == ()
    world.drive_to("Bowl-1")
    assert seen_from_the_head(world, "TomatoSliced-3")


def test_a_drawer_takes_its_contents_along() -> None:
    needs = SceneNeeds(objects=(ObjectNeed("Cup-1", "Cup", places=("Drawer-1",)),), clutter=(0, 0))
    world = build(1, needs)
    world.drive_to("Drawer-1")
    closed = np.array(world.bodies.centre("Cup-1"))
    assert not seen_from_the_head(world, "Cup-1")
    world.show("Drawer-1", "open", "open")
    moved = np.array(world.bodies.centre("Cup-1")) - closed
    assert np.linalg.norm(moved) == pytest.approx(0.36, abs=1e-6)
    world.drive_to("Cup-1")
    assert seen_from_the_head(world, "Cup-1")
    assert check_settled(world) == ()


LOOKS = [
    ("Mug-1", "filled", "coffee"),
    ("Mug-1", "dirty", "dirty"),
    ("Plate-1", "dirty", "dirty"),
    ("Plate-1", "broken", "broken"),
    ("Potato-1", "cooked", "cooked"),
    ("Faucet-1", "toggled", "on"),
    ("StoveBurner-3", "toggled", "on"),
    ("Microwave-1", "toggled", "on"),
    ("CoffeeMachine-1", "toggled", "on"),
    ("Toaster-1", "toggled", "on"),
    ("Fridge-1", "open", "open"),
    ("Cabinet-2", "open", "open"),
]


@pytest.mark.parametrize(("name", "attribute", "value"), LOOKS)
def test_states_change_what_is_drawn_and_back(name: str, attribute: str, value: str) -> None:
    world = build(0)

    def looks() -> bytes:
        shown = world.model.geom_group < 3
        rgba = np.where(shown[:, None], world.model.geom_rgba, 0)
        return b"".join(a.tobytes() for a in (shown, rgba, world.data.geom_xpos))

    before, start = looks(), world.bodies.states[name][attribute]
    world.show(name, attribute, value)
    changed = looks()
    assert changed != before
    world.show(name, attribute, start)
    assert looks() == before
    world.show(name, "temperature", "hot")
    world.show(name, "nonsense", value)
    world.show("Nothing-9", attribute, value)
    assert looks() == before


def test_a_burner_turns_its_own_knob() -> None:
    world = build(0)
    dial = world.model.joint("StoveKnob-2/dial").qposadr[0]
    world.show("StoveBurner-1", "toggled", "on")
    assert world.data.qpos[dial] == 0
    world.show("StoveBurner-2", "toggled", "on")
    assert world.data.qpos[dial] != 0


def test_living_room_devices_light_up_and_the_laptop_folds() -> None:
    needs = SceneNeeds(room="living-room", objects=(ObjectNeed("Laptop-1", "Laptop"),))
    world = build(0, needs)
    tall = np.array(world.box_world_m("Laptop-1"))
    world.show("Laptop-1", "open", "closed")
    flat = np.array(world.box_world_m("Laptop-1"))
    assert tall[1][2] - tall[0][2] > 0.15
    assert flat[1][2] - flat[0][2] < 0.05
    world.drive_to("Laptop-1")
    world.hold("Laptop-1")
    world.drive_to("TVStand-1")
    world.place("Laptop-1", "TVStand-1")
    assert check_settled(world) == ()
    for name in ("Television-1", "FloorLamp-1"):
        bright = float(world.model.geom_rgba[world.model.geom_group < 3][:, :3].sum())
        world.show(name, "toggled", "on")
        assert float(world.model.geom_rgba[world.model.geom_group < 3][:, :3].sum()) > bright + 0.5
