"""AI2-THOR's frame in ours, worked by hand."""

import numpy as np
import pytest

from forestall.worlds.ai2thor.frames import (
    angles_to,
    box_from_thor,
    camera_pose,
    point_from_thor,
    point_to_thor,
)


def test_height_is_their_y_and_our_z() -> None:
    assert point_from_thor({"x": 1.0, "y": 2.0, "z": 3.0}) == (1.0, 3.0, 2.0)
    assert point_to_thor((1.0, 3.0, 2.0)) == {"x": 1.0, "y": 2.0, "z": 3.0}


@pytest.mark.parametrize(
    ("yaw", "horizon", "forward", "right"),
    [
        (0.0, 0.0, (0, 1, 0), (1, 0, 0)),  # theirs: along +z, +x to the right
        (90.0, 0.0, (1, 0, 0), (0, -1, 0)),  # clockwise: along +x, -z to the right
        (180.0, 0.0, (0, -1, 0), (-1, 0, 0)),
        (0.0, 90.0, (0, 0, -1), (1, 0, 0)),  # a positive horizon looks down
        (0.0, -90.0, (0, 0, 1), (1, 0, 0)),
    ],
)
def test_a_camera_looks_where_theirs_looks(
    yaw: float, horizon: float, forward: tuple[float, ...], right: tuple[float, ...]
) -> None:
    pose = camera_pose({"x": 1.0, "y": 2.0, "z": 3.0}, yaw, horizon)
    assert pose[:3, 3] == pytest.approx([1.0, 3.0, 2.0])
    assert pose[:3, 2] == pytest.approx(forward)
    assert pose[:3, 0] == pytest.approx(right)
    assert np.linalg.det(pose[:3, :3]) == pytest.approx(1.0)
    assert pose[:3, :3] @ pose[:3, :3].T == pytest.approx(np.eye(3), abs=1e-12)


def test_down_is_down_in_the_picture() -> None:
    assert camera_pose({"x": 0.0, "y": 0.0, "z": 0.0}, 30.0, 0.0)[:3, 1] == pytest.approx(
        [0, 0, -1]
    )


@pytest.mark.parametrize(("yaw", "horizon"), [(0.0, 0.0), (47.0, 20.0), (300.0, -25.0)])
def test_the_angles_to_a_point_are_those_of_the_camera_that_looks_at_it(
    yaw: float, horizon: float
) -> None:
    pose = camera_pose({"x": 0.5, "y": 1.5, "z": -1.0}, yaw, horizon)
    x, y, z = pose[:3, 3] + 2.0 * pose[:3, 2]
    eye = (0.5, -1.0, 1.5)
    assert angles_to(eye, (x, y, z)) == pytest.approx((yaw, horizon))


def test_a_box_keeps_its_height() -> None:
    about = {"center": {"x": 1, "y": 2, "z": 3}, "size": {"x": 0.2, "y": 0.4, "z": 0.6}}
    box = box_from_thor({"axisAlignedBoundingBox": about})
    assert box is not None
    assert box.centre == pytest.approx((1.0, 3.0, 2.0))
    assert box.size == pytest.approx((0.2, 0.6, 0.4))
    assert box_from_thor({"axisAlignedBoundingBox": None}) is None
