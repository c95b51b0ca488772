# mypy: disable-error-code="arg-type, union-attr, index"
"""Metric depth and instance ids on scenes whose answer is known."""

from __future__ import annotations

import numpy as np
import pytest
from room import CAMERA, FORWARD, KINDS, Room, mixed_room, wall

from forestall.types.observation import Intrinsics

BOTH = pytest.mark.parametrize("name", ["embree", "rays"])


def rays() -> np.ndarray:
    u, v = np.meshgrid(np.arange(CAMERA.width), np.arange(CAMERA.height))
    x, y = (u - CAMERA.cx) / CAMERA.fx, (v - CAMERA.cy) / CAMERA.fy
    return np.stack([x, y, np.ones_like(x)], axis=-1)


@BOTH
def test_wall_depth_is_z_depth_not_range(name: str) -> None:
    depth = wall(Room()).build().frame(name).depth_m
    assert depth.dtype == np.float32
    assert np.abs(depth - 2.0).max() < 1e-5


@BOTH
def test_nothing_in_front_is_zero_depth_and_no_instance(name: str) -> None:
    room = Room().add("behind", KINDS.mjGEOM_SPHERE, (0.3,), (-2, 0, 0), instance="Ball-1")
    frame = room.build().frame(name)
    assert (frame.depth_m == 0).all()
    assert frame.instance_ids is not None
    assert (frame.instance_ids == -1).all()
    assert frame.rgb.min() > 40


@BOTH
def test_sphere_depth_follows_the_equation(name: str) -> None:
    room = Room().add("ball", KINDS.mjGEOM_SPHERE, (0.3,), (1.5, 0, 0), instance="Ball-1")
    depth = room.build().frame(name).depth_m
    ray = rays()
    a, b, c = (ray**2).sum(-1), -2 * 1.5 * ray[..., 2], 1.5**2 - 0.3**2
    root = b * b - 4 * a * c
    inside = root > 0.02 * 4 * a * c
    expected = (-b - np.sqrt(np.maximum(root, 0))) / (2 * a)
    assert inside.sum() > 500
    assert np.abs(depth - expected)[inside].max() < 2e-3
    assert (depth[root < -0.01] == 0).all()


@BOTH
def test_tilted_box_depth(name: str) -> None:
    half = np.deg2rad(30) / 2
    room = Room().add("box", KINDS.mjGEOM_BOX, (0.5, 5, 5), (2, 0, 0),
                      quat=(np.cos(half), 0, np.sin(half), 0))  # fmt: skip
    depth = room.build().frame(name).depth_m
    normal = np.array([np.cos(np.deg2rad(30)), 0, -np.sin(np.deg2rad(30))])
    distance = normal @ np.array([2, 0, 0]) - 0.5
    world = rays() @ FORWARD[:3, :3].T
    assert np.abs(depth - distance / (world @ normal)).max() < 2e-4


@BOTH
@pytest.mark.parametrize("kind", ["mjGEOM_CYLINDER", "mjGEOM_CAPSULE"])
def test_upright_round_bodies_are_closed(name: str, kind: str) -> None:
    room = Room().add("post", getattr(KINDS, kind), (0.2, 0.4), (1.5, 0, 0), instance="Post-1")
    frame = room.build().frame(name)
    middle = CAMERA.height // 2
    assert frame.depth_m[middle, CAMERA.width // 2] == pytest.approx(1.3, abs=2e-3)
    ids = frame.instance_ids
    assert ids is not None
    column = ids[:, CAMERA.width // 2] == 0
    assert column.sum() == column.nonzero()[0].max() - column.nonzero()[0].min() + 1
    assert column.sum() > 60


def test_mesh_is_drawn_where_it_is() -> None:
    room = Room()
    mesh = room.spec.add_mesh(name="wedge")
    mesh.uservert = [0, -0.5, -0.5, 0, 0.5, -0.5, 0, 0, 0.5, 0.4, 0, -0.1]
    mesh.userface = [0, 2, 1, 0, 1, 3, 1, 2, 3, 2, 0, 3]
    room.add("wedge", KINDS.mjGEOM_MESH, (), (1.5, 0, 0), instance="Wedge-1", mesh="wedge")
    scene = room.build()
    by_embree, by_rays = scene.frame("embree"), scene.frame("rays")
    assert by_embree.depth_m[60, 80] == pytest.approx(1.5, abs=1e-4)
    assert np.abs(by_embree.depth_m - by_rays.depth_m).max() < 1e-3


@BOTH
def test_instance_ids_name_what_is_there(name: str) -> None:
    frame = mixed_room().build().frame(name)
    ids = frame.instance_ids
    assert ids is not None
    assert ids.dtype == np.int32
    assert {frame.instance_names[i] for i in np.unique(ids[ids >= 0])} == {
        "Ball-1", "Can-1", "Egg-1", "Table-1",
    }  # fmt: skip
    assert frame.instance_names[ids[75, 62]] == "Can-1"
    assert ids[5, 5] == -1


@BOTH
def test_hidden_groups_and_clear_geoms_are_not_drawn(name: str) -> None:
    room = wall(Room())
    room.add("collision", KINDS.mjGEOM_BOX, (0.2, 0.2, 0.2), (1, 0, 0), group=3, instance="A-1")
    room.add("clear", KINDS.mjGEOM_BOX, (0.2, 0.2, 0.2), (1, 0, 0), rgba=(1, 0, 0, 0))
    room.add("visible", KINDS.mjGEOM_BOX, (0.1, 0.1, 0.1), (1, 0.6, 0), group=2, instance="B-1")
    frame = room.build().frame(name)
    assert frame.depth_m[60, 80] == pytest.approx(2.0, abs=1e-5)
    assert frame.instance_ids is not None
    assert (frame.instance_ids == frame.instance_names.index("A-1")).sum() == 0
    assert (frame.instance_ids == frame.instance_names.index("B-1")).sum() > 50


def test_both_ray_casters_agree() -> None:
    camera = Intrinsics.from_vertical_fov(320, 240, 60.0)
    scene = mixed_room().build()
    one, two = scene.frame("embree", camera), scene.frame("rays", camera)
    assert one.instance_ids is not None
    assert two.instance_ids is not None
    assert (one.instance_ids == two.instance_ids).mean() >= 0.995
    assert (np.abs(one.depth_m - two.depth_m) <= 2e-3).mean() >= 0.995


@BOTH
def test_changes_show_at_once_and_only_where_they_are(name: str) -> None:
    scene = mixed_room().build()
    renderer = scene.renderer(name)
    before = renderer.render(scene.data, FORWARD)
    can = before.instance_names.index("Can-1")
    scene.data.joint(0).qpos[1] -= 0.12
    scene.refresh()
    moved = renderer.render(scene.data, FORWARD)
    changed = before.instance_ids != moved.instance_ids
    assert changed.any()
    assert ((before.instance_ids == can) | (moved.instance_ids == can))[changed].all()
    scene.model.geom("can").group[:] = 4
    hidden = renderer.render(scene.data, FORWARD)
    assert not (hidden.instance_ids == can).any()
    scene.model.geom("can").group[:] = 0
    scene.data.joint(0).qpos[1] += 0.12
    scene.refresh()
    back = renderer.render(scene.data, FORWARD)
    assert np.array_equal(back.instance_ids, before.instance_ids)
    assert np.array_equal(back.rgb, before.rgb)


def test_size_and_fixture_changes_are_noticed() -> None:
    room = wall(Room())
    room.add("level", KINDS.mjGEOM_CYLINDER, (0.2, 0.05), (1.2, 0, 0), instance="Cup-1")
    scene = room.build()
    renderer = scene.renderer()
    low = renderer.render(scene.data, FORWARD)
    scene.model.geom("level").size[1] = 0.3
    high = renderer.render(scene.data, FORWARD)
    assert (high.instance_ids == 0).sum() > 3 * (low.instance_ids == 0).sum()
    scene.model.geom("wall").pos[0] += 1.0
    scene.refresh()
    far = renderer.render(scene.data, FORWARD)
    assert far.depth_m[0, 0] == pytest.approx(3.0, abs=1e-5)


def test_infinite_plane_reaches_far() -> None:
    room = Room().add("floor", KINDS.mjGEOM_PLANE, (0, 0, 1), (0, 0, -1))
    depth = room.build().frame().depth_m
    row = CAMERA.height - 1
    assert depth[row, 80] == pytest.approx(CAMERA.fy / (row - CAMERA.cy), rel=1e-4)
    assert depth[65, 80] == pytest.approx(CAMERA.fy / (65 - CAMERA.cy), rel=1e-3)
