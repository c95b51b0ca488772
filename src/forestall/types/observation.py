"""What the robot sees and feels at one moment.

World frame everywhere: right-handed, metres, z up. Camera frame: x right, y down, z forward.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from forestall.errors import PerceptionError
from forestall.types.checks import (
    check_array,
    check_edge,
    check_name,
    check_number,
    check_point,
    check_several,
)
from forestall.types.facts import GRIPPER

if TYPE_CHECKING:
    from forestall.types.graph import SceneGraph

Rgb = npt.NDArray[np.uint8]
Depth = npt.NDArray[np.float32]
Pose = npt.NDArray[np.float64]
Mask = npt.NDArray[np.bool_]
Vec3 = tuple[float, float, float]


@dataclass(frozen=True, slots=True)
class Intrinsics:
    """Pinhole intrinsics in pixels."""

    width: int
    height: int
    fx: float
    fy: float
    cx: float
    cy: float

    def __post_init__(self) -> None:
        check_edge("the width of a picture", self.width)
        check_edge("the height of a picture", self.height)
        for name in ("fx", "fy", "cx", "cy"):
            check_number(name, getattr(self, name))

    @classmethod
    def from_vertical_fov(cls, width: int, height: int, fov_deg: float) -> Intrinsics:
        """Square pixels, principal point at the image centre."""
        f = 0.5 * height / float(np.tan(np.deg2rad(fov_deg) / 2))
        return cls(width, height, f, f, (width - 1) / 2, (height - 1) / 2)


@dataclass(frozen=True, slots=True, eq=False)
class Detection:
    """One instance mask: what a segmenter found.

    `mask` is (H, W) bool. `instance` is a name that stays the same over frames when the segmenter
    tracks instances (for example "Mug-1"), otherwise None. `score` is in [0, 1]. `outlined` is
    False for a mask that was made of a box: where the thing ends is not known. `states` are
    (attribute, value) that whoever found it knows of it.
    """

    category: str
    mask: Mask
    instance: str | None = None
    score: float = 1.0
    outlined: bool = True
    states: tuple[tuple[str, str], ...] = ()

    def __post_init__(self) -> None:
        check_name("the category of a detection", self.category)
        if self.instance is not None:
            check_name("the instance of a detection", self.instance)
        check_array("a mask", self.mask, "biuf")
        check_number("the score of a detection", self.score)
        if not 0 <= self.score <= 1:
            raise PerceptionError(f"the score of a detection is 0 to 1, got {self.score}")


@dataclass(frozen=True, slots=True, eq=False)
class Frame:
    """One RGB-D picture.

    Args:
        rgb: (H, W, 3) uint8.
        depth_m: (H, W) float32 z-depth in metres, 0 where nothing returned.
        intrinsics: pinhole camera.
        camera_to_world: (4, 4) float64.
        instance_ids: optional (H, W) int32, index into `instance_names`, -1 for none. This is an
            instance *segmentation* (as simulators and trackers deliver); it carries names and
            categories of what is in view and no state of it.
        instance_names: instance names such as "Mug-1", by index; or "Mug" where nobody tracks, and
            an index then means a thing of this picture alone.
        detections: masks that came with the frame from outside, if any.
        colour_only: nothing measured depth; `depth_m` is 0 everywhere, and whatever needs depth is
            unobserved.

    Raises:
        PerceptionError: a shape, type or value that cannot be used.
    """

    rgb: Rgb
    depth_m: Depth
    intrinsics: Intrinsics
    camera_to_world: Pose
    instance_ids: npt.NDArray[np.int32] | None = None
    instance_names: tuple[str, ...] = ()
    detections: tuple[Detection, ...] | None = None
    colour_only: bool = False

    def __post_init__(self) -> None:
        self._check_types()
        size = (self.intrinsics.height, self.intrinsics.width)
        if self.rgb.shape != (*size, 3) or self.rgb.dtype != np.uint8:
            raise PerceptionError(
                f"rgb must be {(*size, 3)} uint8, got {self.rgb.shape} {self.rgb.dtype}"
            )
        if self.depth_m.shape != size or self.depth_m.dtype != np.float32:
            raise PerceptionError(
                f"depth_m must be {size} float32, got {self.depth_m.shape} {self.depth_m.dtype}"
            )
        if not bool(np.isfinite(self.depth_m).all()):
            bad = int((~np.isfinite(self.depth_m)).sum())
            raise PerceptionError(
                f"depth_m has {bad} NaN or infinite values; write 0 where nothing returned"
            )
        if bool((self.depth_m < 0).any()):
            raise PerceptionError("depth_m has negative values; z-depth is metres in front")
        if self.camera_to_world.shape != (4, 4) or not np.isfinite(self.camera_to_world).all():
            raise PerceptionError("camera_to_world must be a finite (4, 4) matrix")
        rotation = self.camera_to_world[:3, :3]
        if not np.allclose(rotation @ rotation.T, np.eye(3), atol=1e-4):
            raise PerceptionError("camera_to_world has no rotation matrix in its upper left")
        if float(np.linalg.det(rotation)) < 0:
            raise PerceptionError(
                "camera_to_world is left-handed: a mirror image of the world, not a turn of it"
            )
        if self.colour_only and bool(self.depth_m.any()):
            raise PerceptionError("a frame of colour alone has depth_m 0 everywhere")
        if self.instance_ids is not None and self.instance_ids.shape != size:
            raise PerceptionError(f"instance_ids must be {size}, got {self.instance_ids.shape}")
        for d in self.detections or ():
            if d.mask.shape != size or d.mask.dtype != np.bool_:
                raise PerceptionError(
                    f"the mask of {d.instance or d.category} must be {size} bool, "
                    f"got {d.mask.shape} {d.mask.dtype}"
                )

    def _check_types(self) -> None:
        if not isinstance(self.intrinsics, Intrinsics):
            raise PerceptionError("intrinsics must be Intrinsics")
        check_array("rgb", self.rgb, "biuf")
        check_array("depth_m", self.depth_m, "biuf")
        check_array("camera_to_world", self.camera_to_world, "iuf")
        if self.detections is not None:
            check_several("detections", self.detections, Detection)
        check_several("instance_names", self.instance_names, str)
        if self.instance_ids is not None:
            check_array("instance_ids", self.instance_ids, "iu")


@dataclass(frozen=True, slots=True)
class GripperState:
    """The robot's own sense of its hand.

    `holding` is the instance name of what is held as the robot knows it, or only its category where
    it does not know more; None for an empty hand.
    `position_world_m` is where the hand is. `released` is what the subtask just executed let go on
    purpose, `released_world_m` where: the arm knows it, whether or not the camera sees it.
    `name` is the hand's node in the graph, one of the domain's hands. `told` is False for a robot
    without a hand, or one that does not tell: then nothing is known of what it holds.
    `width_m` is how far its fingers are apart, None where it does not measure that: `holding` is
    what the robot meant to take, the width belongs to what it has.
    """

    holding: str | None
    position_world_m: Vec3
    released: str | None = None
    released_world_m: Vec3 | None = None
    name: str = GRIPPER
    told: bool = True
    width_m: float | None = None

    def __post_init__(self) -> None:
        for what, name in (("holding", self.holding), ("released", self.released)):
            if name is not None:
                check_name(what, name)
        check_name("the name of a hand", self.name)
        check_point("the position of the hand", self.position_world_m)
        if self.released_world_m is not None:
            check_point("where the hand let go", self.released_world_m)

    @classmethod
    def untold(cls) -> GripperState:
        """No hand, or none that tells."""
        return cls(None, (0.0, 0.0, 0.0), told=False)


@dataclass(frozen=True, slots=True, eq=False)
class Observation:
    """What was seen and felt at one boundary.

    Args:
        frames: taken at this boundary, newest last; empty where a graph was given instead.
        gripper: the robot's own sense of its hand.
        time_s: of the world's clock.
        robot_position_world_m: where the robot stands.
        graph: what is in view as a scene graph, from a source that needs no pictures.
        others: further hands.
        told: names that somebody has given to things by pointing at them: the thing, of the name's
            category, at a point in the world bears this name.

    Raises:
        PerceptionError: neither a frame nor a graph.
    """

    frames: tuple[Frame, ...]
    gripper: GripperState
    time_s: float
    robot_position_world_m: Vec3 = (0.0, 0.0, 0.0)
    graph: SceneGraph | None = None
    others: tuple[GripperState, ...] = ()
    told: tuple[tuple[str, Vec3], ...] = ()

    def __post_init__(self) -> None:
        check_several("frames", self.frames, Frame)
        check_several("hands", (self.gripper, *self.others), GripperState)
        check_number("time_s", self.time_s)
        check_point("robot_position_world_m", self.robot_position_world_m)
        for name, point in self.told:
            check_name("a name that somebody gave", name)
            check_point(f"where {name} was pointed at", point)
        if not self.frames and self.graph is None:
            raise PerceptionError("an observation needs at least one frame, or a scene graph")
        names = [hand.name for hand in self.hands]
        if len(set(names)) != len(names):
            raise PerceptionError(f"two hands have the same name: {', '.join(names)}")

    @property
    def hands(self) -> tuple[GripperState, ...]:
        """Every hand that tells, the first one first."""
        return tuple(hand for hand in (self.gripper, *self.others) if hand.told)
