"""A scene as a world: what a task needs in it, what faults do to it, what it remembers."""

from collections.abc import Iterator, Mapping
from functools import partial
from pathlib import Path
from typing import Any

import pytest
from builds import DRY_SCENE, SCENE, at_home, build, leaves_files_open, needs_package, opened

from forestall.domain.load import shipped
from forestall.errors import SceneError, UnknownNameError
from forestall.perception.oracle import OracleStateEstimator
from forestall.perception.perceiver import GraphPerceiver
from forestall.perception.segmenters import InstanceSegmenter
from forestall.testing.conformance import check_environment
from forestall.testing.levels import Level
from forestall.types.episode import SkillStatus
from forestall.types.facts import Literal
from forestall.types.plan import Subtask
from forestall.types.scene import ObjectNeed, SceneNeeds
from forestall.worlds.ai2thor.rooms import scenes
from forestall.worlds.ai2thor.world import ThorWorld

pytestmark = [needs_package, leaves_files_open]

DOMAIN = shipped("ai2thor")


@pytest.fixture(scope="module")
def world(tmp_path_factory: pytest.TempPathFactory) -> Iterator[ThorWorld]:
    with opened(tmp_path_factory.mktemp("build")) as world:
        yield world


@pytest.fixture
def staged(tmp_path: Path) -> Iterator[Any]:
    """Makes a world with these needs, at its start."""
    made: list[ThorWorld] = []

    def make(needs: SceneNeeds, scene: str = SCENE) -> ThorWorld:
        made.append(ThorWorld(build(tmp_path), needs, DOMAIN, scene))
        made[-1].reset(0)
        return made[-1]

    with at_home(tmp_path):
        yield make
    for world in made:
        world.close()


def _states(made: list[ThorWorld], name: str) -> Mapping[str, str]:
    return made[0].oracle.states(name)


def _at(world: ThorWorld, name: str) -> str | None:
    return next((r.object for r in world.oracle.truth().relations if r.subject == name), None)


def _do(world: ThorWorld, *steps: str) -> None:
    for step in steps:
        outcome = world.execute(Subtask.parse(step))
        assert outcome.status is SkillStatus.SUCCEEDED, f"{step}: {outcome.reason}"


def test_what_a_task_needs_is_where_and_as_it_is_needed(staged: Any) -> None:
    needs = SceneNeeds(
        objects=(
            ObjectNeed("Plate-1", "Plate", ("DiningTable",), (("dirty", "dirty"),)),
            ObjectNeed("Bowl-4", "Bowl", ("Microwave",), (("filled", "wine"),)),
            ObjectNeed("Potato-1", "Potato", ("CounterTop",), (("cooked", "cooked"),)),
        ),
        fixtures=(("Fridge", "open", "open"), ("StoveBurner-2", "toggled", "on")),
    )
    world = staged(needs)
    assert (_at(world, "Plate-1"), _at(world, "Bowl-4")) == ("DiningTable-1", "Microwave-1")
    assert _at(world, "Potato-1") == "CounterTop-1"
    says = world.oracle.states
    assert says("Plate-1")["dirty"] == "dirty" and says("Bowl-4")["filled"] == "wine"
    assert says("Potato-1")["cooked"] == "cooked"
    assert says("Microwave-1")["open"] == "closed"  # it was opened for the bowl, and closed again
    assert says("Fridge-1")["open"] == "open"
    assert says("StoveBurner-2")["toggled"] == "on" and says("StoveBurner-1")["toggled"] == "off"
    assert says("Pan-1")["temperature"] == "hot"
    assert world.oracle.events() == () and world.time_s == 0.0


def test_one_thing_stands_before_another(staged: Any) -> None:
    front = ObjectNeed("Mug-1", "Mug", ("CounterTop",), in_front_of="Bread")
    world = staged(SceneNeeds(objects=(front,)))
    things = world.scene.things
    mug, bread = things["Mug-1"]["position"], things["Bread-1"]["position"]
    assert _at(world, "Mug-1") == _at(world, "Bread-1")
    assert mug["z"] < bread["z"]  # the floor is on that side
    assert abs(mug["x"] - bread["x"]) < 0.15


def test_a_scene_that_has_not_what_is_needed_does_not_do(tmp_path: Path) -> None:
    needs = SceneNeeds(objects=(ObjectNeed("Kettle-1", "Kettle"),))
    world = ThorWorld(build(tmp_path), needs, DOMAIN, SCENE)
    with (
        at_home(tmp_path),
        pytest.raises(SceneError, match="FloorPlan1: this scene has no Kettle for Kettle-1"),
    ):
        world.reset(0)
    world.close()


def test_the_scenes_of_a_room_begin_with_the_seed_s() -> None:
    assert scenes("", 4)[:2] == ["FloorPlan5", "FloorPlan6"]
    assert scenes("living-room", 29)[:2] == ["FloorPlan230", "FloorPlan201"]
    assert len(set(scenes("kitchen", 11))) == 30
    with pytest.raises(UnknownNameError, match="unknown room 'garage'"):
        scenes("garage", 0)


def test_seeds_start_the_robot_at_different_places(world: ThorWorld) -> None:
    starts = set()
    for seed in range(4):
        world.reset(seed)
        starts.add(world.observe().robot_position_world_m)
    assert len(starts) > 1
    world.reset(3)
    assert world.observe().robot_position_world_m in starts


def test_driving_takes_a_second_for_a_quarter_metre_and_for_a_quarter_turn(
    world: ThorWorld,
) -> None:
    world.reset(0)
    world.execute(Subtask.parse("navigate_to_obj(Fridge)"))
    here = world.observe().robot_position_world_m
    outcome = world.execute(Subtask.parse("navigate_to_obj(StoveKnob-1)"))
    there = world.observe().robot_position_world_m
    steps = (abs(here[0] - there[0]) + abs(here[1] - there[1])) / 0.25
    assert steps > 4
    assert steps - 0.01 <= outcome.duration_s <= steps + 4.0 + 2.0


def test_what_falls_lies_on_the_floor_and_an_egg_is_cracked(world: ThorWorld) -> None:
    world.reset(0)
    assert world.drop_held() is None
    _do(world, "pick_up(Mug)")
    assert world.drop_held(hard=True) == "Mug-1"
    assert world.scene.held is None
    assert world.oracle.states("Mug-1")["broken"] == "broken"
    assert world.scene.things["Mug-1"]["position"]["y"] == pytest.approx(0.0, abs=0.01)
    _do(world, "pick_up(Egg)")
    assert world.drop_held() == "Egg-1"
    assert "Egg-1" not in world.scene and "EggCracked-1" in world.scene


def test_somebody_rearranges_and_alters_things(world: ThorWorld) -> None:
    world.reset(0)
    assert world.rearrange("Potato", "Microwave")
    assert _at(world, "Potato-1") == "Microwave-1"
    assert world.oracle.states("Microwave-1")["open"] == "closed"
    assert not world.rearrange("Potato", "Microwave")  # it is there
    assert not world.rearrange("Potato", "Potato")
    assert not world.rearrange("Fridge", "CounterTop")
    assert world.rearrange("Mug", "gripper") and world.scene.held == "Mug-1"
    assert not world.rearrange("Plate", "gripper")
    assert world.alter("Plate", "dirty", "dirty") and not world.alter("Plate", "dirty", "dirty")
    assert not world.alter("Plate", "temperature", "hot")  # AI2-THOR has no action for it
    assert not world.alter("Sofa", "dirty", "dirty")
    told = [e.text for e in world.oracle.events()]
    assert "inside(Potato-1, Microwave-1)" in told and "dirty(Plate-1)=dirty" in told


def test_water_that_misses_is_made_up_for(staged: Any) -> None:
    world = staged(SceneNeeds(), DRY_SCENE)
    world.alter("Mug", "dirty", "dirty")
    _do(world, "pick_up(Mug)", "put_in(Mug, Sink)", "toggle_on(Faucet)")
    assert world.oracle.states("Mug-1")["filled"] == "water"
    assert world.oracle.states("Mug-1")["dirty"] == "clean"


def test_what_is_spoiled_stays_spoiled(world: ThorWorld) -> None:
    world.reset(0)
    world.alter("Plate", "dirty", "dirty")
    _do(world, "pick_up(Potato)", "put_on(Potato, Plate)", "pick_up(Plate)")
    assert world.oracle.history() == frozenset()
    assert world.rearrange("Bowl", "DiningTable")
    assert world.alter("Microwave", "open", "open")
    _do(world, "put_in(Plate, Microwave)", "close_obj(Microwave)", "toggle_on(Microwave)")
    assert world.oracle.history() == {Literal("spoiled", ("Potato-1",))}
    _do(world, "toggle_off(Microwave)")
    world.alter("Plate", "dirty", "clean")
    assert world.oracle.history() == {Literal("spoiled", ("Potato-1",))}


def test_food_in_wine_and_coffee_on_water_are_spoiled(world: ThorWorld) -> None:
    world.reset(0)
    world.alter("Bowl", "filled", "wine")
    _do(world, "pick_up(Potato)", "put_in(Potato, Bowl)")
    assert world.oracle.history() == {
        Literal("spoiled", ("Bowl-1",)), Literal("spoiled", ("Potato-1",)),
    }  # fmt: skip
    world.reset(0)
    world.alter("Mug", "filled", "water")
    _do(world, "pick_up(Mug)", "put_in(Mug, CoffeeMachine)", "toggle_on(CoffeeMachine)")
    assert world.oracle.states("Mug-1")["filled"] == "water"
    assert world.oracle.history() == {Literal("spoiled", ("Mug-1",))}


STEPS = [Subtask.parse(s) for s in ("pick_up(Mug)", "put_in(Mug, Sink)", "open_obj(Microwave)")]


def test_the_world_conforms_at_its_level_and_perception_sees_what_was_done(tmp_path: Path) -> None:
    made: list[ThorWorld] = []

    def make() -> ThorWorld:
        made.append(ThorWorld(build(tmp_path), SceneNeeds(), DOMAIN, SCENE))
        return made[-1]

    estimator = OracleStateEstimator(partial(_states, made), DOMAIN)
    perceiver = GraphPerceiver(InstanceSegmenter(), estimator, DOMAIN)
    with at_home(tmp_path):
        found = check_environment(make, 2, STEPS, DOMAIN, Level.TOLERANCE, perceiver=perceiver)
    assert found == []


def test_the_stand_in_repeats_to_the_last_bit(tmp_path: Path) -> None:
    def make() -> ThorWorld:
        return ThorWorld(build(tmp_path), SceneNeeds(), DOMAIN, SCENE)

    with at_home(tmp_path):
        assert check_environment(make, 5, STEPS[:2], DOMAIN) == []
