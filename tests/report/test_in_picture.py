from __future__ import annotations

import numpy as np
import pytest

from forestall.report.in_picture import framed
from forestall.types.episode import StoredFrame
from forestall.types.graph import Box, ObjectNode, SceneGraph, Seen
from forestall.types.observation import Intrinsics

CAMERA = Intrinsics(200, 100, 100.0, 100.0, 100.0, 50.0)
HERE = tuple(map(tuple, np.eye(4).tolist()))


def thing(name: str, x: float, y: float, z: float, **how: object) -> ObjectNode:
    box = Box((x - 0.1, y - 0.1, z - 0.1), (x + 0.1, y + 0.1, z + 0.1))
    more = {"pixels": 50, **how}
    return ObjectNode(name, "Thing", box_m=box, **more)  # type: ignore[arg-type]


def test_a_box_ahead_is_framed_where_the_camera_shows_it() -> None:
    (found,) = framed(SceneGraph((thing("Mug-1", 0.0, 0.0, 1.1),)), StoredFrame(CAMERA, HERE), ())
    assert found.left == pytest.approx(45.0) and found.width == pytest.approx(10.0)
    assert found.top == pytest.approx(40.0) and found.height == pytest.approx(20.0)
    assert not found.culprit


def test_a_camera_that_moved_shows_it_elsewhere() -> None:
    pose = np.eye(4)
    pose[0, 3] = 0.5
    frame = StoredFrame(CAMERA, tuple(map(tuple, pose.tolist())))
    (found,) = framed(SceneGraph((thing("Mug-1", 0.0, 0.0, 1.1),)), frame, ("Mug-1",))
    assert found.left + found.width / 2 < 30
    assert found.culprit


def test_what_the_picture_does_not_show_is_not_framed() -> None:
    nodes = (
        thing("Behind-1", 0.0, 0.0, -1.0),
        thing("Around-1", 0.0, 0.0, 0.05),
        thing("Aside-1", 9.0, 0.0, 1.0),
        thing("Remembered-1", 0.0, 0.0, 1.0, seen=Seen.REMEMBERED),
        thing("Hidden-1", 0.0, 0.0, 1.0, pixels=0),
        ObjectNode("Nowhere-1", "Thing", pixels=9),
    )
    assert framed(SceneGraph(nodes), StoredFrame(CAMERA, HERE), ()) == ()


def test_what_reaches_over_the_edge_is_cut_there_and_the_largest_comes_first() -> None:
    nodes = (thing("A-1", 0.0, 0.0, 2.0), thing("B-1", 1.0, 0.0, 1.1))
    first, second = framed(SceneGraph(nodes), StoredFrame(CAMERA, HERE), ())
    assert (first.node, second.node) == ("B-1", "A-1")
    assert first.left + first.width == pytest.approx(100.0)
