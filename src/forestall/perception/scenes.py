"""Ways in from Python: observations from arrays, boxes, detections of others, or a dict.

Everything is converted into this project's units, axes and names here and nowhere else. Called by
whoever owns a robot; calls `conventions.py`, `domain/words.py` and `boxes.py`. What arrays that are
in order cannot say together is for `gate.py` to find.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, fields
from typing import Any

import numpy as np
import numpy.typing as npt

from forestall.domain.model import Domain
from forestall.domain.words import Names, stated
from forestall.errors import InputError, PerceptionError, UnknownNameError
from forestall.perception.boxes import box_mask
from forestall.perception.conventions import (
    CameraAxes,
    DepthKind,
    MaskKind,
    Up,
    camera_pose,
    mask_of,
    place,
    z_depth,
)
from forestall.types.facts import GRIPPER
from forestall.types.observation import (
    Depth,
    Detection,
    Frame,
    GripperState,
    Intrinsics,
    Mask,
    Observation,
    Rgb,
)


@dataclass(frozen=True, slots=True)
class Conventions:
    """How arrays are to be read; what is left out is as in this project.

    Args:
        depth_unit: "m", "cm", "mm", or the metres of one unit; whole numbers need it.
        depth_kind: "z", along the camera's axis, or "ray".
        camera_axes: "opencv" (x right, y down, z forward), "opengl" or "ros".
        up: which axis of the world points up.
        mask_kind: "bool", "scores", "logits" or "alpha"; soft masks need it.
        mask_threshold: above which a pixel belongs to a soft mask.
    """

    depth_unit: str | float | None = None
    depth_kind: DepthKind = "z"
    camera_axes: CameraAxes = "opencv"
    up: Up = "z"
    mask_kind: MaskKind | None = None
    mask_threshold: float | None = None


OURS = Conventions()


@dataclass(frozen=True, slots=True, eq=False)
class Found:
    """One thing that somebody found in a picture: a category in their words, a mask or a box.

    Args:
        category: "dining table", "025_mug", "Mug": known words are matched, others are things.
        mask: (H, W) of any declared kind.
        box: (x low, y low, x high, y high) in pixels.
        id: theirs, of any form; the same thing has the same one in every picture.
        score: confidence in [0, 1].
        states: attribute → value, of the domain.
    """

    category: str
    mask: npt.ArrayLike | None = None
    box: Sequence[float] | None = None
    id: str | int | None = None
    score: float = 1.0
    states: Mapping[str, str] = field(default_factory=dict)


@dataclass(frozen=True, slots=True, eq=False)
class Hand:
    """What a hand tells: what it holds (an id of whatever form, None: nothing) and where it is."""

    holding: str | None
    position_m: Sequence[float]
    released: str | None = None
    released_m: Sequence[float] | None = None
    name: str = GRIPPER


@dataclass(frozen=True, slots=True, eq=False)
class Picture:
    """One picture with what was found in it.

    Args:
        rgb: (H, W, 3) uint8.
        found: things in it.
        depth: (H, W), None for a colour camera: what needs depth is then unobserved.
        intrinsics: (fx, fy, cx, cy) in pixels of this picture, or a (3, 3) matrix; needed with
            depth.
        camera_to_world: (4, 4) or (3, 4); needed with depth.
    """

    rgb: npt.ArrayLike
    found: Sequence[Found] = ()
    depth: npt.ArrayLike | None = None
    intrinsics: npt.ArrayLike | None = None
    camera_to_world: npt.ArrayLike | None = None


class Scenes:
    """Makes the observations of one run; remembers which thing has which name.

    Args:
        domain: whose words are matched.
        conventions: how arrays are to be read.
    """

    def __init__(self, domain: Domain, conventions: Conventions = OURS) -> None:
        self._domain, self._how = domain, conventions
        self._names = Names(domain)

    def scene(
        self,
        *pictures: Picture,
        hands: Sequence[Hand] | Hand | None = None,
        time_s: float = 0.0,
        robot_m: Sequence[float] | None = None,
    ) -> Observation:
        """An observation of one or more pictures of the same moment, newest last.

        Args:
            pictures: at least one.
            hands: what the robot's hands tell; None or an empty list: nothing is known of them.
            time_s: of the robot's clock.
            robot_m: where it stands; below the last camera where nothing is said.

        Raises:
            InputError: an array of another shape or type, or a value that is not declared.
        """
        if not pictures:
            raise InputError("a scene needs at least one picture")
        told = [hands] if isinstance(hands, Hand) else list(hands or ())
        for picture in pictures:
            for found in picture.found:
                if isinstance(found.id, str):
                    self._names.reserve(found.id)
        frames = tuple(
            self._frame(picture, index, len(pictures) == 1)
            for index, picture in enumerate(pictures)
        )
        grippers = [self._hand(hand) for hand in told]
        x, y, _ = (float(v) for v in frames[-1].camera_to_world[:3, 3])
        robot = (x, y, 0.0) if robot_m is None else place(robot_m, self._how.up)
        first = grippers[0] if grippers else GripperState.untold()
        try:
            return Observation(frames, first, float(time_s), robot, others=tuple(grippers[1:]))
        except PerceptionError as error:
            raise InputError(str(error)) from error

    def from_detections(
        self,
        rgb: npt.ArrayLike,
        detections: Any,
        *,
        depth: npt.ArrayLike | None = None,
        intrinsics: npt.ArrayLike | None = None,
        camera_to_world: npt.ArrayLike | None = None,
        hands: Sequence[Hand] | Hand | None = None,
        time_s: float = 0.0,
        robot_m: Sequence[float] | None = None,
    ) -> Observation:
        """An observation from `supervision.Detections`, or what looks like it.

        Args:
            rgb: (H, W, 3) uint8, red first (not BGR).
            detections: has `xyxy` (n, 4), and `data["class_name"]`; `mask` (n, H, W), `confidence`
                and `tracker_id` (n,) where they are not None.
            depth: see `Picture`, as the next two.
            intrinsics: with depth.
            camera_to_world: with depth.
            hands: see `scene`, as the next two.
            time_s: of the robot's clock.
            robot_m: where it stands.

        Raises:
            InputError: an attribute is missing or of another length.
        """
        picture = Picture(rgb, found_in(detections), depth, intrinsics, camera_to_world)
        return self.scene(picture, hands=hands, time_s=time_s, robot_m=robot_m)

    def reading(self, **conventions: Any) -> Scenes:
        """The same run with other conventions: names go on, arrays are read otherwise.

        Raises:
            UnknownNameError: no such convention.
        """
        said = {f.name: getattr(self._how, f.name) for f in fields(Conventions)}
        for name in conventions:
            if name not in said:
                raise UnknownNameError("convention", name, said)
        other = Scenes(self._domain, Conventions(**(said | conventions)))
        other._names = self._names
        return other

    # --- parts of a scene ------------------------------------------------------------------------

    def _hand(self, hand: Hand) -> GripperState:
        up = self._how.up
        return GripperState(
            None if hand.holding is None else self._names.instance(hand.holding),
            place(hand.position_m, up),
            None if hand.released is None else self._names.instance(hand.released),
            None if hand.released_m is None else place(hand.released_m, up),
            hand.name,
        )

    def _frame(self, picture: Picture, index: int, alone: bool) -> Frame:
        where = "" if alone else f"picture {index}: "
        try:
            rgb = _rgb(picture.rgb)
            located = picture.depth is not None
            camera = _camera(picture.intrinsics, rgb) if located else _sight(rgb)
            depth = self._depth(picture.depth, camera)
            detections = []
            for number, found in enumerate(picture.found):
                try:
                    detections.append(self._detection(found, camera, depth, located, alone))
                except InputError as error:
                    raise InputError(f"thing {number} ({found.category}): {error}") from error
            pose = _UPRIGHT if not located else self._pose(picture.camera_to_world)
            return Frame(
                rgb, depth, camera, pose, detections=tuple(detections), colour_only=not located
            )
        except (InputError, PerceptionError) as error:
            raise InputError(f"{where}{error}") from error

    def _pose(self, matrix: npt.ArrayLike | None) -> npt.NDArray[np.float64]:
        if matrix is None:
            raise InputError("depth needs camera_to_world: where the camera is")
        return camera_pose(matrix, self._how.camera_axes, self._how.up)

    def _depth(self, depth: npt.ArrayLike | None, camera: Intrinsics) -> Depth:
        if depth is None:
            return np.zeros((camera.height, camera.width), dtype=np.float32)
        raw = np.asarray(depth)
        unit = self._how.depth_unit
        if unit is None and raw.dtype.kind in "iu":
            raise InputError(f"depth is whole numbers ({raw.dtype}): declare depth_unit")
        return z_depth(raw, camera, "m" if unit is None else unit, self._how.depth_kind)

    def _detection(
        self, found: Found, camera: Intrinsics, depth: Depth, located: bool, alone: bool
    ) -> Detection:
        category = self._names.words.category(found.category)
        if found.id is not None:
            said = found.id if isinstance(found.id, str) else f"{category}#{found.id}"
            instance: str | None = self._names.instance(said, category)
        else:
            instance = None
        if not 0 <= found.score <= 1:
            raise InputError(f"score must lie in [0, 1], got {found.score}")
        mask = self._mask(found, camera, depth, located)
        if not mask.any():
            raise InputError("nothing of it lies in the picture")
        return Detection(
            category,
            mask,
            instance,
            float(found.score),
            found.mask is not None,
            tuple(sorted(stated(found.states, category, self._domain).items())),
        )

    def _mask(self, found: Found, camera: Intrinsics, depth: Depth, located: bool) -> Mask:
        shape = (camera.height, camera.width)
        if found.mask is not None:
            raw = np.asarray(found.mask)
            return mask_of(raw, shape, self._how.mask_kind, self._how.mask_threshold)
        if found.box is None:
            raise InputError("give a mask or a box")
        return box_mask(found.box, shape, depth if located else None, camera)


_UPRIGHT = np.array([[1.0, 0, 0, 0], [0, 0, 1.0, 0], [0, -1.0, 0, 1.0], [0, 0, 0, 1.0]])
"""A pose for pictures without depth, of which nothing is located."""


def found_in(detections: Any) -> list[Found]:
    """Things in `supervision.Detections`, or what looks like it.

    Raises:
        InputError: an attribute is missing or of another length.
    """
    boxes = np.asarray(getattr(detections, "xyxy", None), dtype=np.float64)
    if boxes.ndim != 2 or boxes.shape[1] != 4:
        raise InputError(f"detections.xyxy must be (n, 4), got the shape {boxes.shape}")
    count = len(boxes)
    data = getattr(detections, "data", None) or {}
    columns: dict[str, Any] = {
        "mask": getattr(detections, "mask", None),
        "confidence": getattr(detections, "confidence", None),
        "tracker_id": getattr(detections, "tracker_id", None),
        'data["class_name"]': data.get("class_name"),
    }
    names = columns['data["class_name"]']
    if names is None and count:
        raise InputError('detections.data["class_name"] is missing: say what each of them is')
    for name, column in columns.items():
        if column is not None and len(column) != count:
            raise InputError(f"detections.{name} has {len(column)} entries for {count} boxes")
    masks, scores, ids = columns["mask"], columns["confidence"], columns["tracker_id"]
    return [
        Found(
            str(names[i]),
            None if masks is None else masks[i],
            [float(v) for v in boxes[i]],
            None if ids is None else int(ids[i]),
            1.0 if scores is None else float(scores[i]),
        )
        for i in range(count)
    ]


def _rgb(given: npt.ArrayLike) -> Rgb:
    rgb = np.asarray(given)
    if rgb.ndim != 3 or rgb.shape[2] != 3 or rgb.dtype != np.uint8 or 0 in rgb.shape:
        raise InputError(f"rgb must be (H, W, 3) uint8, got {rgb.shape} {rgb.dtype}")
    return rgb


def _camera(given: npt.ArrayLike | None, rgb: Rgb) -> Intrinsics:
    if given is None:
        raise InputError("depth needs intrinsics: (fx, fy, cx, cy) in pixels of this picture")
    numbers = np.asarray(given, dtype=np.float64)
    if numbers.shape == (3, 3):
        numbers = np.array([numbers[0, 0], numbers[1, 1], numbers[0, 2], numbers[1, 2]])
    if numbers.shape != (4,) or not bool(np.isfinite(numbers).all()) or min(numbers[:2]) <= 0:
        raise InputError("intrinsics must be fx, fy, cx, cy (fx and fy above 0), or a 3 x 3 matrix")
    fx, fy, cx, cy = (float(v) for v in numbers)
    return Intrinsics(rgb.shape[1], rgb.shape[0], fx, fy, cx, cy)


def _sight(rgb: Rgb) -> Intrinsics:
    return Intrinsics.from_vertical_fov(rgb.shape[1], rgb.shape[0], 60.0)
