"""AI2-THOR's pictures and coordinates in ours: the one place that converts them.

Theirs: left-handed, metres, y up, yaw clockwise from +z, horizon downwards. Ours: right-handed,
metres, z up. Exchanging y and z does both: (x, y, z) there is (x, z, y) here, so that yaw 0 looks
along our +y and yaw 90° along our +x. Called by `world` and `scene`; calls nothing.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from forestall.types.graph import Box
from forestall.types.observation import Frame, Intrinsics, Pose, Vec3

FAR_M = 20.0
"""Of AI2-THOR's camera; what has no surface nearer than this returns nothing."""

Thor = Mapping[str, float]


def point_from_thor(point: Thor) -> Vec3:
    """A point of theirs in our world."""
    return (float(point["x"]), float(point["z"]), float(point["y"]))


def point_to_thor(point_world_m: Vec3) -> dict[str, float]:
    """A point of our world in theirs."""
    x, y, z = point_world_m
    return {"x": float(x), "y": float(z), "z": float(y)}


def box_from_thor(thing: Mapping[str, Any]) -> Box | None:
    """The axis-aligned box of an object in our world, None where it has none."""
    box = thing.get("axisAlignedBoundingBox")
    if not box or not box.get("center") or not box.get("size"):
        return None
    middle, size = point_from_thor(box["center"]), point_from_thor(box["size"])
    low, high = (
        tuple(m + sign * abs(s) / 2 for m, s in zip(middle, size, strict=True)) for sign in (-1, 1)
    )
    return Box((low[0], low[1], low[2]), (high[0], high[1], high[2]))


def camera_pose(eye: Thor, yaw_deg: float, horizon_deg: float) -> Pose:
    """Camera to world, (4, 4): x right, y down, z forward."""
    yaw, down = math.radians(yaw_deg), math.radians(horizon_deg)
    right = np.array([math.cos(yaw), -math.sin(yaw), 0.0])
    flat = np.array([math.sin(yaw), math.cos(yaw), 0.0])
    forward = math.cos(down) * flat - np.array([0.0, 0.0, math.sin(down)])
    pose = np.eye(4)
    pose[:3, 0], pose[:3, 1], pose[:3, 2] = right, np.cross(forward, right), forward
    pose[:3, 3] = point_from_thor(eye)
    return pose


def angles_to(eye_world_m: Vec3, point_world_m: Vec3) -> tuple[float, float]:
    """Yaw and horizon, in degrees as AI2-THOR counts them, from one point towards another."""
    dx, dy, dz = (b - a for a, b in zip(eye_world_m, point_world_m, strict=True))
    yaw = math.degrees(math.atan2(dx, dy)) % 360.0
    return yaw, math.degrees(math.atan2(-dz, math.hypot(dx, dy)))


def frame_from_event(event: Any, name_of: Callable[[str], str | None]) -> Frame:
    """The picture of an `ai2thor.server.Event`.

    Args:
        event: with colour, depth and instance masks.
        name_of: their object id → our instance name, None for what is no thing of the scene.
    """
    about = event.metadata
    width, height = int(about["screenWidth"]), int(about["screenHeight"])
    depth = np.array(event.depth_frame, dtype=np.float32)
    depth[~np.isfinite(depth) | (depth <= 0) | (depth >= FAR_M * 0.999)] = 0.0
    ids = np.full((height, width), -1, dtype=np.int32)
    names: list[str] = []
    for object_id in sorted(event.instance_masks):
        name = name_of(object_id)
        if name is None:
            continue
        if name not in names:
            names.append(name)
        ids[event.instance_masks[object_id]] = names.index(name)
    agent = about["agent"]
    return Frame(
        rgb=np.ascontiguousarray(event.frame),
        depth_m=depth,
        intrinsics=Intrinsics.from_vertical_fov(width, height, float(about["fov"])),
        camera_to_world=camera_pose(
            about["cameraPosition"], float(agent["rotation"]["y"]), float(agent["cameraHorizon"])
        ),
        instance_ids=ids,
        instance_names=tuple(names),
    )
