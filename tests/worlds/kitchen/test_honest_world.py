"""The built kitchen under a robot that errs: where it stands, lets go, leaves doors and vessels."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from honest_rates import blank_kitchen, count, report

from forestall.strategies.none import NoReplanning
from forestall.strategies.retry import RetryOnce
from forestall.testing.conformance import check_environment
from forestall.types.episode import SkillStatus
from forestall.types.plan import Subtask
from forestall.worlds.kitchen.environment import KitchenEnvironment
from forestall.worlds.kitchen.honest_world import AJAR, GRIPPER_OPENS_M, HonestWorld
from forestall.worlds.kitchen.imperfection import PERFECT, STAND_EVENT, Rates
from forestall.worlds.kitchen.world import KitchenWorld


def built(task: str, seed: int = 10000, **ways: float) -> KitchenEnvironment:
    """The kitchen of a task in which only the named ways go wrong."""
    kitchen = blank_kitchen(task, replace(PERFECT, **ways), drawn=False)
    kitchen.reset(seed)
    return kitchen


def world_of(kitchen: KitchenEnvironment) -> HonestWorld:
    world = kitchen._stage
    assert isinstance(world, HonestWorld)
    return world


def do(kitchen: KitchenEnvironment, *steps: str) -> None:
    for step in steps:
        outcome = kitchen.execute(Subtask.parse(step))
        assert outcome.status is SkillStatus.SUCCEEDED, f"{step}: {outcome.reason}"


def test_the_kind_kitchen_has_the_geometry_that_it_had() -> None:
    kitchen = blank_kitchen("boil-water", None, drawn=False)
    kitchen.reset(10000)
    assert type(kitchen._stage) is KitchenWorld


def test_the_scene_of_a_seed_is_the_same_in_both_profiles() -> None:
    kind = blank_kitchen("boil-water", None, drawn=False)
    kind.reset(10000)
    assert built("boil-water").oracle.truth() == kind.oracle.truth()


@cache
def _standings(place_sd_m: float, turn_sd_deg: float) -> list[tuple[float, ...]]:
    kitchen = built("boil-water", place_sd_m=place_sd_m, turn_sd_deg=turn_sd_deg)
    found: list[tuple[float, ...]] = []
    for name in ("Fridge", "Sink", "Microwave", "DiningTable", "Fridge", "Sink"):
        do(kitchen, f"navigate_to_obj({name})")
        at = world_of(kitchen).standing
        found.append((at.x, at.y, at.yaw_rad))
    return found


def test_places_are_reached_with_an_error_of_its_size() -> None:
    meant, reached = np.array(_standings(0.0, 0.0)), np.array(_standings(0.02, 2.0))
    away = np.abs(reached - meant)
    assert away[:, :2].max() <= 0.041
    assert away[:, 2].max() <= np.deg2rad(4.1)
    assert away[:, :2].max() > 0.005
    assert np.array_equal(meant[0], meant[4])
    assert not np.array_equal(reached[0], reached[4])


def test_a_robot_that_roams_reaches_what_it_drove_to_from_several_places() -> None:
    kitchen, places = built("boil-water", roam=0.6), set()
    for name in ("Fridge", "Pot", "Fridge", "Pot", "Fridge"):
        do(kitchen, f"navigate_to_obj({name})")
        assert world_of(kitchen).within_reach(f"{name}-1")
        places.add((name, world_of(kitchen).standing))
    assert len(places) > 2


def test_where_it_stands_is_told_to_the_truth() -> None:
    kitchen = built("boil-water", place_sd_m=0.02, turn_sd_deg=2.0)
    do(kitchen, "navigate_to_obj(Fridge)", "navigate_to_obj(Sink)")
    told = [e.text for e in kitchen.oracle.events() if e.kind == STAND_EVENT]
    assert len(told) == 2
    assert all("mm" in t and "degrees" in t for t in told)


def test_what_is_let_go_of_lands_where_the_hand_is() -> None:
    kitchen = built("boil-water")
    do(kitchen, "pick_up(Pot)", "navigate_to_obj(DiningTable)")
    outcome = kitchen.execute(Subtask.parse("put_on(Pot, DiningTable)"))
    assert outcome.hand_world_m == kitchen._stage.position_world_m("Pot-1")
    hand = kitchen._stage.gripper_position_world_m
    assert outcome.hand_world_m is not None
    assert np.hypot(outcome.hand_world_m[0] - hand[0], outcome.hand_world_m[1] - hand[1]) < 0.5


def test_the_gripper_feels_a_width_and_the_kind_one_does_not() -> None:
    kitchen = built("boil-water")
    assert kitchen.observe().gripper.width_m == 0.0
    do(kitchen, "pick_up(Pot)")
    assert kitchen.observe().gripper.width_m == GRIPPER_OPENS_M
    kind = blank_kitchen("boil-water", None, drawn=False)
    kind.reset(10000)
    assert kind.observe().gripper.width_m is None


@pytest.mark.parametrize(("start", "step", "share"), [
    ((), "open_obj(Fridge)", AJAR),
    (("open_obj(Fridge)",), "close_obj(Fridge)", AJAR),
])  # fmt: skip
def test_a_door_left_ajar_stands_a_little_open(
    start: tuple[str, ...], step: str, share: float
) -> None:
    kitchen = built("cook-egg")
    world = world_of(kitchen)
    (address, _, values), *_ = world.bodies.compiled.motions["Fridge-1", "open"]
    do(kitchen, *start)
    state = kitchen.oracle.states("Fridge-1")["open"]
    kitchen._acting.household.leave_ajar("Fridge-1", "open" if state == "closed" else "closed")
    wanted = values["closed"] + share * (values["open"] - values["closed"])
    assert world.data.qpos[address] == pytest.approx(wanted)
    assert kitchen.oracle.states("Fridge-1")["open"] == state
    do(kitchen, step)
    other = kitchen.oracle.states("Fridge-1")["open"]
    assert other != state
    assert world.data.qpos[address] == values[other]


def test_a_new_start_forgets_what_was_left_ajar() -> None:
    kitchen = built("cook-egg", ajar=1.0)
    start = world_of(kitchen).data.qpos.copy()
    do(kitchen, "open_obj(Fridge)")
    assert not np.array_equal(world_of(kitchen).data.qpos, start)
    kitchen.reset(10000)
    assert np.array_equal(world_of(kitchen).data.qpos, start)


def test_a_vessel_on_its_side_lies_on_its_support_and_stands_again_when_it_is_put_down() -> None:
    kitchen = built("make-coffee", tip=1.0)
    world = world_of(kitchen)
    do(kitchen, "pick_up(Mug)", "put_on(Mug, DiningTable)")
    form, pose = world.bodies.forms["Mug-1"], world.bodies.pose("Mug-1")
    assert abs(pose[2, 2]) < 1e-6
    assert np.allclose(pose[:3, :3] @ pose[:3, :3].T, np.eye(3))
    assert np.linalg.det(pose[:3, :3]) == pytest.approx(1.0)
    low, high = world.bodies.box("Mug-1")
    table = world.bodies.forms["DiningTable-1"].regions[0].z_m
    assert low[2] == pytest.approx(table, abs=0.02)
    assert high[2] - low[2] == pytest.approx(form.footprint.size[1], abs=0.02)
    do(kitchen, "pick_up(Mug)")
    assert world.bodies.pose("Mug-1")[2, 2] == pytest.approx(1.0)


def test_the_honest_kitchen_conforms() -> None:
    def make() -> KitchenEnvironment:
        return blank_kitchen("make-coffee", replace(Rates(), tip=0.4, slip=0.3), drawn=True)

    from forestall.domain.load import shipped

    steps = ("pick_up(Mug)", "put_in(Mug, Sink)", "open_obj(Fridge)", "pick_up(Mug)")
    plan = [Subtask.parse(s) for s in (*steps, "put_on(Mug, CounterTop)")]
    for seed in (10000, 10001):
        assert check_environment(make, seed, plan, shipped("household")) == []


def test_the_same_seed_ends_the_same_to_the_last_bit() -> None:
    def run() -> tuple[object, bytes]:
        kitchen = blank_kitchen("store-egg", Rates(), drawn=True)
        kitchen.reset(10003)
        from forestall.tasks.files import load_task

        for subtask in load_task("store-egg").task.plan:
            kitchen.execute(subtask)
        return kitchen.oracle.events(), world_of(kitchen).data.qpos.tobytes()

    assert run() == run()


def test_the_counting_script_counts() -> None:
    strategies = (NoReplanning(), RetryOnce())
    kind = count("switch-devices", range(10000, 10003), PERFECT, False, strategies)
    assert (kind.won["none"], kind.won["retry-once"]) == (3, 3)
    assert (kind.failed, kind.ways, kind.unexplained) == (0, {}, [])
    missing = replace(PERFECT, miss=0.999)
    lost = count("switch-devices", range(10000, 10003), missing, False, strategies)
    assert lost.won["none"] == 0
    assert lost.ways["miss"] == lost.failed >= 3
    lines = report({"switch-devices": lost}, 3, ["none", "retry-once"])
    assert lines[1].split() == ["switch-devices", "0", "of", "3", "0", "of", "3"]
