"""Pictures of the stand-in through the real Controller: they show things where they are."""

from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest
from builds import leaves_files_open, needs_package, opened

from forestall.types.observation import Frame
from forestall.types.plan import Subtask
from forestall.worlds.ai2thor.frames import box_from_thor, point_from_thor
from forestall.worlds.ai2thor.link import Server
from forestall.worlds.ai2thor.world import ThorWorld

pytestmark = [needs_package, leaves_files_open]

CM = 0.01


@pytest.fixture(scope="module", params=list(Server), ids=lambda s: s.value)
def any_world(
    request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory
) -> Iterator[ThorWorld]:
    with opened(tmp_path_factory.mktemp("build"), request.param) as world:
        yield world


@pytest.fixture(scope="module")
def world(tmp_path_factory: pytest.TempPathFactory) -> Iterator[ThorWorld]:
    with opened(tmp_path_factory.mktemp("build")) as world:
        yield world


def _points(frame: Frame, name: str) -> Any:
    """(n, 3) points in the world under a thing's mask."""
    assert frame.instance_ids is not None
    rows, columns = np.nonzero(frame.instance_ids == frame.instance_names.index(name))
    k, z = frame.intrinsics, frame.depth_m[rows, columns].astype(float)
    camera = np.stack([(columns - k.cx) / k.fx * z, (rows - k.cy) / k.fy * z, z], axis=1)
    return camera @ frame.camera_to_world[:3, :3].T + frame.camera_to_world[:3, 3]


@pytest.mark.parametrize("step", ["navigate_to_obj(Potato)", "navigate_to_obj(RemoteControl)"])
def test_depth_and_masks_project_back_to_the_metadata(any_world: ThorWorld, step: str) -> None:
    any_world.reset(0)
    any_world.execute(Subtask.parse(step))
    name = f"{Subtask.parse(step).args[0]}-1"
    about = any_world.scene.things[name]
    box, place = box_from_thor(about), point_from_thor(about["position"])
    assert box is not None
    frame = any_world.observe([box.centre]).frames[-1]
    points = _points(frame, name)
    assert len(points) > 20
    assert (points >= np.array(box.low) - CM).all() and (points <= np.array(box.high) + CM).all()
    assert points[:, 2].max() == pytest.approx(box.high[2], abs=CM)
    middle = (points.min(axis=0) + points.max(axis=0)) / 2
    top = points[points[:, 2] > box.high[2] - 0.002]
    middle_of_top = (top.min(axis=0) + top.max(axis=0)) / 2
    assert middle_of_top[:2] == pytest.approx(place[:2], abs=CM)
    assert middle[2] <= box.high[2]


def test_all_that_is_seen_lies_in_the_box_that_the_metadata_gives(any_world: ThorWorld) -> None:
    any_world.reset(1)
    count = 0
    for frame in any_world.scan(thorough=True).frames:
        for name in frame.instance_names:
            box = box_from_thor(any_world.scene.things[name])
            if box is None or name in any_world.scene.basins:
                continue
            points = _points(frame, name)
            assert (points >= np.array(box.low) - CM).all(), name
            assert (points <= np.array(box.high) + CM).all(), name
            count += 1
    assert count > 20


def test_a_scan_sees_the_room_and_leaves_the_robot_as_it_was(world: ThorWorld) -> None:
    world.reset(3)
    before = world.observe()
    scan = world.scan()
    after = world.observe()
    assert np.array_equal(before.frames[0].rgb, after.frames[0].rgb)
    assert before.robot_position_world_m == after.robot_position_world_m
    names = {n for f in scan.frames for n in f.instance_names}
    assert {"Fridge-1", "Sink-1", "CounterTop-1", "DiningTable-1"} <= names
    assert not any("Basin" in n or "Wall" in n for n in names)


def test_what_is_held_is_felt_and_seen(world: ThorWorld) -> None:
    world.reset(0)
    world.execute(Subtask.parse("pick_up(Mug)"))
    seen = world.observe()
    assert seen.gripper.holding == "Mug-1"
    assert "Mug-1" in seen.frames[0].instance_names
    away = np.array(seen.gripper.position_world_m) - np.array(seen.frames[0].camera_to_world[:3, 3])
    assert np.linalg.norm(away) < 1.0
    outcome = world.execute(Subtask.parse("put_on(Mug, CounterTop-1)"))
    assert outcome.hand_world_m is not None
    assert world.observe().gripper.released == "Mug-1"


def test_two_points_apart_are_looked_at_in_two_frames(world: ThorWorld) -> None:
    world.reset(0)
    x, y, _ = world.observe().robot_position_world_m
    seen = world.observe([(x + 1.0, y, 1.0), (x - 1.0, y, 1.0), (x - 1.0, y + 0.05, 1.0)])
    assert len(seen.frames) == 2
    assert seen.frames[0].camera_to_world[0, 2] > 0.5
    assert seen.frames[1].camera_to_world[0, 2] < -0.5
