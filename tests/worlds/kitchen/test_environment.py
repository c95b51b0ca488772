import math

import numpy as np
import pytest
from small_kitchen import SmallKitchen

from forestall.domain.load import extend, shipped
from forestall.errors import ForestallError, SceneError
from forestall.types.episode import SkillStatus
from forestall.types.plan import Subtask
from forestall.types.scene import ObjectNeed, SceneNeeds
from forestall.worlds.kitchen.environment import SCAN_FRAMES, KitchenEnvironment
from forestall.worlds.kitchen.flat_world import flat_environment

NEEDS = SceneNeeds(objects=(ObjectNeed("Mug-1", "Mug"),))


def test_scan_turns_once_around_in_time() -> None:
    env = SmallKitchen().env
    observation = env.scan()
    assert len(observation.frames) == SCAN_FRAMES
    assert observation.time_s == env.time_s == 4.0
    ahead = np.array([f.camera_to_world[:3, 2] for f in observation.frames])
    assert np.allclose(ahead[:, 2], -math.sin(math.radians(25)))
    turns = np.unwrap(np.arctan2(ahead[:, 1], ahead[:, 0]))
    assert np.allclose(np.abs(np.diff(turns)), 2 * math.pi / SCAN_FRAMES)


def test_observe_gives_one_frame_for_each_focus_point_that_points_at_it() -> None:
    env = SmallKitchen().env
    points = [(2.0, 0.5, 1.0), (-3.0, 2.0, 0.4)]
    observation = env.observe(points)
    for point, frame in zip(points, observation.frames, strict=True):
        pose = frame.camera_to_world
        towards = np.array(point) - pose[:3, 3]
        assert np.allclose(pose[:3, 2], towards / np.linalg.norm(towards))
    assert len(env.observe().frames) == 1
    assert env.time_s == 0.0


def test_the_gripper_knows_what_it_holds() -> None:
    kitchen = SmallKitchen("Mug-1@CounterTop-1")
    assert kitchen.env.observe().gripper.holding is None
    kitchen.do("pick_up(Mug)")
    assert kitchen.env.observe().gripper.holding == "Mug-1"


def test_a_second_reset_with_the_same_seed_uses_the_same_world_from_its_start() -> None:
    env = flat_environment(NEEDS, shipped("household"))
    env.reset(4)
    start = env.oracle.truth()
    env.execute(Subtask.parse("pick_up(Mug)"))
    world = env._world
    env.reset(4)
    assert env._world is world
    assert env.oracle.truth() == start
    assert env.oracle.truth().text() == start.text()
    assert env.time_s == 0.0
    env.reset(5)
    assert env._world is not world


def test_before_reset_there_is_a_clear_error() -> None:
    with pytest.raises(ForestallError, match="call reset"):
        KitchenEnvironment(NEEDS, shipped("household")).observe()


def test_closing_and_resetting_again_works() -> None:
    env = flat_environment(NEEDS, shipped("household"))
    env.reset(1)
    env.close()
    with pytest.raises(ForestallError, match="call reset"):
        env.scan()
    env.reset(1)
    assert env.oracle.truth().get("Mug-1") is not None


def test_a_scene_that_cannot_be_built_is_a_scene_error() -> None:
    needs = SceneNeeds(objects=(ObjectNeed("Mug-1", "Mug", ("Toaster",)),))
    with pytest.raises(SceneError, match="Mug-1"):
        flat_environment(needs, shipped("household")).reset(0)


def test_a_running_device_works_from_the_start() -> None:
    needs = SceneNeeds(
        objects=(ObjectNeed("Mug-1", "Mug", ("Sink",)),), fixtures=(("Faucet-1", "toggled", "on"),)
    )
    env = flat_environment(needs, shipped("household"))
    env.reset(0)
    assert env.oracle.states("Mug-1")["filled"] == "water"


def test_a_new_category_from_a_task_file_follows_the_same_rules() -> None:
    teapot = {"tags": ["pickupable"], "attributes": ["filled", "dirty"], "words": "teapot"}
    domain = extend(shipped("household"), {"Teapot": teapot}, {})
    env = flat_environment(SceneNeeds(objects=(ObjectNeed("Teapot-1", "Teapot"),)), domain)
    env.reset(0)
    for step in ("pick_up(Teapot)", "put_in(Teapot, Sink)", "toggle_on(Faucet)"):
        assert env.execute(Subtask.parse(step)).status is SkillStatus.SUCCEEDED
    assert env.oracle.states("Teapot-1")["filled"] == "water"
