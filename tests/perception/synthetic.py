"""A tiny analytic ray caster: axis-aligned boxes, upright cylinders and open vessels."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np

from forestall.types.observation import Frame, GripperState, Intrinsics, Observation

CAMERA = Intrinsics.from_vertical_fov(320, 240, 60.0)


@dataclass(frozen=True)
class Solid:
    """A box (`radius` None) or an upright cylinder in the box; `id` names the instance."""

    id: str
    low: tuple[float, float, float]
    high: tuple[float, float, float]
    round: bool = False

    def moved(self, offset: Sequence[float]) -> Solid:
        (x, y, z), (to_x, to_y, to_z), (dx, dy, dz) = self.low, self.high, offset
        return replace(self, low=(x + dx, y + dy, z + dz), high=(to_x + dx, to_y + dy, to_z + dz))


def at(
    name: str, x: float, y: float, z: float, size: Sequence[float], round: bool = False
) -> Solid:
    """A solid that stands at (x, y) with its foot at z."""
    w, d, h = size
    return Solid(name, (x - w / 2, y - d / 2, z), (x + w / 2, y + d / 2, z + h), round)


def hollow(
    name: str,
    low: Sequence[float],
    high: Sequence[float],
    wall: float = 0.01,
    open_side: str = "top",
) -> list[Solid]:
    """A box without one side: "top" or "front" (low y)."""
    (x0, y0, z0), (x1, y1, z1) = low, high
    sides = {
        "bottom": ((x0, y0, z0), (x1, y1, z0 + wall)),
        "top": ((x0, y0, z1 - wall), (x1, y1, z1)),
        "left": ((x0, y0, z0), (x0 + wall, y1, z1)),
        "right": ((x1 - wall, y0, z0), (x1, y1, z1)),
        "front": ((x0, y0, z0), (x1, y0 + wall, z1)),
        "back": ((x0, y1 - wall, z0), (x1, y1, z1)),
    }
    return [Solid(name, a, b) for side, (a, b) in sides.items() if side != open_side]


def looking(eye: Sequence[float], target: Sequence[float]) -> np.ndarray:
    """Camera-to-world pose, x right, y down, z forward."""
    forward = np.asarray(target, float) - np.asarray(eye, float)
    forward /= np.linalg.norm(forward)
    right = np.cross(forward, [0.0, 0.0, 1.0])
    right /= np.linalg.norm(right)
    pose = np.eye(4)
    pose[:3, :3] = np.stack([right, np.cross(forward, right), forward], axis=1)
    pose[:3, 3] = eye
    return pose


def _distances(solid: Solid, eye: np.ndarray, rays: np.ndarray) -> np.ndarray:
    with np.errstate(divide="ignore", invalid="ignore"):
        near = (np.asarray(solid.low) - eye) / rays
        far = (np.asarray(solid.high) - eye) / rays
    enter, leave = np.fmin(near, far), np.fmax(near, far)
    if solid.round:
        centre = (np.asarray(solid.low) + np.asarray(solid.high))[:2] / 2
        radius = (solid.high[0] - solid.low[0]) / 2
        offset = eye[:2] - centre
        a = (rays[:, :2] ** 2).sum(axis=1)
        b = rays[:, :2] @ offset
        root = b**2 - a * (offset @ offset - radius**2)
        hit = root > 0
        spread = np.sqrt(np.where(hit, root, 0.0)) / a
        enter = np.stack([np.where(hit, -b / a - spread, np.inf), enter[:, 2]], axis=1)
        leave = np.stack([np.where(hit, -b / a + spread, -np.inf), leave[:, 2]], axis=1)
    first, last = enter.max(axis=1), leave.min(axis=1)
    return np.where((first < last) & (first > 0.01), first, np.inf)


def picture(solids: Sequence[Solid], pose: np.ndarray, camera: Intrinsics = CAMERA) -> Frame:
    """Depth and instance ids of a scene; the colour tells ids apart. Each is drawn once."""
    pose = np.asarray(pose, dtype=np.float64)
    frame = _drawn(tuple(solids), pose.tobytes(), camera)
    ids = frame.instance_ids
    assert ids is not None, "every picture is drawn with its ids"
    return replace(
        frame, rgb=frame.rgb.copy(), depth_m=frame.depth_m.copy(), instance_ids=ids.copy()
    )


@lru_cache(maxsize=128)
def _drawn(solids: tuple[Solid, ...], place: bytes, camera: Intrinsics) -> Frame:
    pose = np.frombuffer(place, dtype=np.float64).reshape(4, 4).copy()
    v, u = np.mgrid[0 : camera.height, 0 : camera.width]
    local = np.stack(
        [(u - camera.cx) / camera.fx, (v - camera.cy) / camera.fy, np.ones(u.shape)], axis=-1
    ).reshape(-1, 3)
    rays = local @ pose[:3, :3].T
    names = tuple(sorted({s.id for s in solids}))
    depth = np.full(len(rays), np.inf)
    ids = np.full(len(rays), -1, dtype=np.int32)
    for solid in solids:
        distance = _distances(solid, pose[:3, 3], rays)
        closer = distance < depth
        depth[closer] = distance[closer]
        ids[closer] = names.index(solid.id)
    depth[~np.isfinite(depth)] = 0.0
    shape = (camera.height, camera.width)
    shade = ((ids + 1) * 37 % 256).astype(np.uint8).reshape(shape)
    return Frame(
        rgb=np.repeat(shade[:, :, None], 3, axis=2),
        depth_m=depth.astype(np.float32).reshape(shape),
        intrinsics=camera,
        camera_to_world=pose,
        instance_ids=ids.reshape(shape),
        instance_names=names,
    )


def observed(
    solids: Sequence[Solid],
    *poses: np.ndarray,
    holding: str | None = None,
    hand: tuple[float, float, float] = (0.0, -0.5, 1.2),
    time_s: float = 0.0,
    camera: Intrinsics = CAMERA,
) -> Observation:
    """An observation of a scene from one or more cameras."""
    eye = poses[-1][:3, 3]
    return Observation(
        frames=tuple(picture(solids, p, camera) for p in poses),
        gripper=GripperState(holding, hand),
        time_s=time_s,
        robot_position_world_m=(float(eye[0]), float(eye[1]), 0.0),
    )
