# mypy: disable-error-code="arg-type, union-attr, index, list-item"
"""The rules on the real geometry, seen through the real renderer."""

import numpy as np
import pytest

from forestall.domain.load import shipped
from forestall.errors import SceneError
from forestall.testing.conformance import check_environment
from forestall.types.episode import SkillStatus
from forestall.types.observation import Intrinsics
from forestall.types.plan import Subtask
from forestall.types.scene import ObjectNeed, SceneNeeds
from forestall.worlds.kitchen.environment import SCAN_FRAMES, KitchenEnvironment

SMALL = Intrinsics.from_vertical_fov(96, 72, 60.0)
NEEDS = SceneNeeds(
    objects=(
        ObjectNeed("Mug-1", "Mug", ("CounterTop",)),
        ObjectNeed("Egg-1", "Egg", ("CounterTop",)),
        ObjectNeed("Pan-1", "Pan", ("StoveBurner-1",)),
    )
)


def _make() -> KitchenEnvironment:
    return KitchenEnvironment(NEEDS, shipped("household"), intrinsics=SMALL)


@pytest.fixture(scope="module")
def env() -> KitchenEnvironment:
    return _make()


def _do(env: KitchenEnvironment, *steps: str) -> None:
    for step in steps:
        outcome = env.execute(Subtask.parse(step))
        assert outcome.status is SkillStatus.SUCCEEDED, f"{step}: {outcome.reason}"


def test_the_kitchen_conforms() -> None:
    steps = [Subtask.parse(s) for s in ("pick_up(Mug)", "put_in(Mug, Sink)", "open_obj(Fridge)")]
    assert check_environment(_make, 5, steps, shipped("household")) == []


def test_a_scan_looks_all_around_and_leaves_the_robot_as_it_was(env: KitchenEnvironment) -> None:
    env.reset(5)
    before = env.observe()
    scan = env.scan()
    after = env.observe()
    ahead = np.array([f.camera_to_world[:2, 2] for f in scan.frames])
    yaw = np.unwrap(np.arctan2(ahead[:, 1], ahead[:, 0]))
    assert len(yaw) == SCAN_FRAMES
    assert np.allclose(np.diff(yaw), 2 * np.pi / SCAN_FRAMES)
    assert np.array_equal(before.frames[0].rgb, after.frames[0].rgb)
    assert np.array_equal(before.frames[0].camera_to_world, after.frames[0].camera_to_world)
    seen = {f.instance_names[i] for f in scan.frames for i in np.unique(f.instance_ids) if i >= 0}
    assert {"Fridge-1", "Pan-1"} <= seen


def test_truth_has_boxes_where_things_are(env: KitchenEnvironment) -> None:
    env.reset(5)
    truth = env.oracle.truth()
    pan, burner = truth.get("Pan-1"), truth.get("StoveBurner-1")
    assert pan.box_m.low[2] >= burner.box_m.high[2] - 0.01
    assert abs(pan.box_m.centre[0] - burner.box_m.centre[0]) < 0.2


def test_a_held_egg_cracks_into_the_pan_it_is_over(env: KitchenEnvironment) -> None:
    env.reset(5)
    _do(env, "pick_up(Egg)", "navigate_to_obj(Pan)", "crack_obj(Egg)")
    truth = env.oracle.truth()
    assert truth.parents("EggCracked-1", shipped("household").containing) == ("Pan-1",)
    egg, pan = truth.get("EggCracked-1").box_m, truth.get("Pan-1").box_m
    assert pan.low[0] <= egg.centre[0] <= pan.high[0]
    assert pan.low[1] <= egg.centre[1] <= pan.high[1]
    assert truth.get("Egg-1") is None


def test_a_dropped_egg_is_cracked_on_the_floor(env: KitchenEnvironment) -> None:
    env.reset(5)
    _do(env, "pick_up(Egg)", "navigate_to_obj(Fridge)")
    assert env.drop_held() == "Egg-1"
    truth = env.oracle.truth()
    assert truth.parents("EggCracked-1", shipped("household").containing) == ("Floor-1",)
    assert truth.get("EggCracked-1").box_m.high[2] < 0.05


def test_a_dropped_mug_lies_on_the_floor_and_can_be_picked_up(env: KitchenEnvironment) -> None:
    env.reset(5)
    _do(env, "pick_up(Mug)", "navigate_to_obj(Fridge)")
    env.drop_held()
    assert env.oracle.truth().get("Mug-1").box_m.low[2] < 0.02
    _do(env, "pick_up(Mug)", "put_on(Mug, CounterTop)")
    assert env.oracle.truth().get("Mug-1").box_m.low[2] > 0.5


def test_what_is_named_wrongly_at_building_is_a_clear_error() -> None:
    needs = SceneNeeds(objects=(ObjectNeed("Mug-1", "Mug", ("Toaster",)),))
    with pytest.raises(SceneError, match="Toaster does not take a Mug"):
        KitchenEnvironment(needs, shipped("household")).reset(0)


def test_a_robot_that_roves_looks_from_elsewhere_and_says_where_it_is() -> None:
    env = KitchenEnvironment(NEEDS, shipped("household"), intrinsics=SMALL, roves=True)
    env.reset(5)
    where = env.oracle.truth().get("Mug-1").centroid_m
    offered = env.vantages(where)
    assert offered and len(set(offered)) == len(offered)
    before_s = env.time_s
    for place in (offered[0], offered[-1]):
        assert 0.5 < np.hypot(place[0] - where[0], place[1] - where[1]) < 1.5
        seconds = env.look_from(place, where)
        frame = env.observe([where]).frames[-1]
        assert np.allclose(frame.camera_to_world[:3, 3], place)
        ahead = frame.camera_to_world[:3, 2]
        way = np.subtract(where, place)
        assert float(ahead @ way) / np.linalg.norm(way) > 0.99
        assert env.time_s >= before_s + seconds
        before_s = env.time_s
    env.hold()
    assert env.vantages(where) == () and env.look_from(offered[0], where) == 0.0


def test_a_robot_that_does_not_rove_offers_nothing(env: KitchenEnvironment) -> None:
    env.reset(5)
    assert env.vantages((0.0, 0.0, 1.0)) == ()
