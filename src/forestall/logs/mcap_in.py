"""Looks of an MCAP file: pictures, depth, masks, cameras and hands as observations.

Called by `mcap_data`; calls `mcap_index` for where things are. One look is in memory at a time.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

import numpy as np

from forestall.errors import FileFormatError, ForestallError, InputError
from forestall.logs.layout import LOOK_AGE_S, Step, Topics
from forestall.logs.mcap_index import Index
from forestall.logs.mcap_out import COLOUR
from forestall.logs.moments import Moment, chosen, moments_of
from forestall.logs.outlined import labelled, outlined
from forestall.logs.pixels import colour_of, depth_of, one_channel
from forestall.types.observation import (
    Detection,
    Frame,
    GripperState,
    Intrinsics,
    Observation,
    Pose,
    Vec3,
)
from forestall.types.recorded import Look

SYNC_NS = 50_000_000
"""How far the stamps of colour and depth of one moment may be apart."""


@dataclass(frozen=True, slots=True)
class Looking:
    """How the looks of one file are made.

    Args:
        index: of the file.
        cameras: in the order of their names.
        steps: that were carried out.
    """

    index: Index
    cameras: tuple[Topics, ...]
    steps: Sequence[Step]

    @property
    def whole(self) -> bool:
        """Whether the file says itself which pictures are one look."""
        return bool(self.index.looks)

    @property
    def stamps_ns(self) -> list[int]:
        """When any camera took a picture."""
        return sorted({n for c in self.cameras for n in self.index.series[c.rgb].logs_ns})

    def moments(self) -> list[Moment]:
        """Every look, with the subtasks between them."""
        if self.whole:
            return moments_of(sorted(self.index.looks), self.steps, LOOK_AGE_S)
        layout = self.index.layout
        return moments_of(chosen(self.stamps_ns, self.steps, layout), self.steps, layout.stale_s)

    def looks(self) -> Iterator[Look]:
        """Each look with its pictures.

        Raises:
            FileFormatError: a picture, a camera or a transform that cannot be used.
        """
        for moment in self.moments():
            at = moment.at_ns
            seen = None
            if at is not None:
                seen = self._look(at) if self.whole else self._seen(at)
            yield Look(seen, moment.before, moment.done, moment.succeeded, moment.unshown)

    def _look(self, stamp_ns: int) -> Observation:
        """One of our own looks, as it was."""
        file = self.index.file
        told, place = self.index.looks[stamp_ns]
        message = file.decoded(told, file.read(place))
        with _named(f"{file.path}: topic {told.topic}"):
            cameras = {c.rgb.removesuffix(f"/{COLOUR}").lstrip("/"): c for c in self.cameras}
            frames = []
            for one in message.cameras:
                if one.camera not in cameras:
                    raise InputError(f"no topic /{one.camera}/{COLOUR}")
                pose = np.array(one.camera_to_world, np.float64).reshape(4, 4)
                frames.append(self._frame(cameras[one.camera], stamp_ns, pose))
            hands = [_hand(h) for h in message.hands] or [GripperState.untold()]
            return Observation(
                frames=tuple(frames),
                gripper=hands[0],
                time_s=float(message.time_s),
                robot_position_world_m=_point(message.robot_position),
                others=tuple(hands[1:]),
                told=tuple((n.name, _point(n.at)) for n in message.named),
            )

    def _seen(self, at_ns: int) -> Observation:
        """What every camera showed last, at a time of the log."""
        index, frames = self.index, []
        stamp_ns = at_ns
        for camera in self.cameras:
            series = index.series[camera.rgb]
            number = series.newest(at_ns, int(index.layout.stale_s * 1e9))
            if number is None:
                continue
            stamp_ns = series.stamps_ns[number]
            where = f"{index.file.path}: topic {camera.rgb}"
            with _named(where):
                frames.append(self._frame(camera, stamp_ns, None))
        if not frames:
            raise FileFormatError(f"{index.file.path}: no camera shows anything at {at_ns} ns")
        return Observation(
            frames=tuple(frames),
            gripper=self._gripper(at_ns, stamp_ns),
            time_s=(at_ns - index.first_ns) / 1e9,
            robot_position_world_m=self._stands(frames[-1], stamp_ns),
        )

    def _frame(self, camera: Topics, stamp_ns: int, pose: Pose | None) -> Frame:
        index = self.index
        message = self._at(camera.rgb, stamp_ns)
        if message is None:
            raise InputError(f"{camera.rgb} has no picture at {stamp_ns} ns")
        rgb = colour_of(message)
        depth = None
        if camera.depth is not None and (found := self._at(camera.depth, stamp_ns)) is not None:
            with _named(f"topic {camera.depth}"):
                depth = depth_of(found)
        intrinsics = _intrinsics(index.info_of(camera), rgb.shape[:2])
        if depth is not None and depth.shape != rgb.shape[:2]:
            raise InputError(
                f"{camera.depth} has pictures of {depth.shape[::-1]}, {camera.rgb} of "
                f"{rgb.shape[1::-1]}: depth has to be aligned to colour"
            )
        if pose is None:
            frame_id = camera.frame or message.header.frame_id
            pose = index.transforms.pose(frame_id, self._world(), stamp_ns)
        return Frame(
            rgb,
            np.zeros(rgb.shape[:2], np.float32) if depth is None else depth,
            intrinsics,
            pose,
            detections=self._detections(camera, stamp_ns, (rgb.shape[0], rgb.shape[1])),
            colour_only=depth is None,
        )

    def _detections(
        self, camera: Topics, stamp_ns: int, shape: tuple[int, int]
    ) -> tuple[Detection, ...] | None:
        if not camera.masks and camera.detections is None:
            return None
        layers = []
        for topic in camera.masks:
            found = self._at(topic, stamp_ns)
            if found is not None:
                with _named(f"topic {topic}"):
                    layers.append(one_channel(found))
        if camera.detections is None:
            return labelled(layers, camera.labels, shape)
        message = self._at(camera.detections, stamp_ns)
        if message is None:
            return ()
        said = []
        for one in message.detections:
            best = max(one.results, key=lambda r: r.hypothesis.score, default=None)
            middle, box = one.bbox.center.position, one.bbox
            corners = (
                middle.x - box.size_x / 2,
                middle.y - box.size_y / 2,
                middle.x + box.size_x / 2,
                middle.y + box.size_y / 2,
            )
            said.append(
                (
                    "" if best is None else best.hypothesis.class_id,
                    one.id,
                    1.0 if best is None else best.hypothesis.score,
                    corners,
                )
            )
        return outlined(said, layers, shape)

    def _at(self, topic: str, stamp_ns: int) -> Any:
        """The message of a topic at a stamp, None where there is none near it."""
        series = self.index.series[topic]
        number = series.nearest(stamp_ns, 0 if self.whole else SYNC_NS)
        if number is None:
            return None
        file = self.index.file
        return file.decoded(series.told, file.read(series.places[number]))

    def _world(self) -> str:
        named = self.index.layout.mcap.world or self.index.transforms.world()
        if named is None:
            raise InputError(
                "no frame is called map, world or odom: name the world in a layout "
                "([mcap] world = ...)"
            )
        return named

    def _gripper(self, at_ns: int, stamp_ns: int) -> GripperState:
        names, index = self.index.layout.mcap, self.index
        if names.hand is None:
            return GripperState.untold()
        at = index.transforms.pose(names.hand, self._world(), stamp_ns)[:3, 3]
        said = [text for log_ns, text in index.texts if log_ns <= at_ns]
        holding = (said[-1] or None) if said else None
        told = names.holding is not None and bool(said)
        return GripperState(holding, (float(at[0]), float(at[1]), float(at[2])), told=told)

    def _stands(self, frame: Frame, stamp_ns: int) -> Vec3:
        """Where the robot stands; below its camera where no frame says it."""
        base = self.index.layout.mcap.base
        if base in self.index.transforms:
            at = self.index.transforms.pose(base, self._world(), stamp_ns)[:3, 3]
            return (float(at[0]), float(at[1]), float(at[2]))
        x, y, _ = (float(v) for v in frame.camera_to_world[:3, 3])
        return (x, y, 0.0)


@contextmanager
def _named(where: str) -> Iterator[None]:
    """Say of a fault where in the log it is."""
    try:
        yield
    except ForestallError as error:
        if str(error).startswith(where):
            raise
        raise FileFormatError(f"{where}: {error}") from error


def _intrinsics(info: Any, shape: tuple[int, ...]) -> Intrinsics:
    """The pinhole camera of a picture.

    Raises:
        InputError: of another size, distorted, or no camera.
    """
    if (info.height, info.width) != shape:
        raise InputError(
            f"camera_info is of {info.width} x {info.height} pixels, the picture of "
            f"{shape[1]} x {shape[0]}"
        )
    if any(abs(v) > 1e-9 for v in info.d):
        raise InputError("its camera_info says that pictures are distorted: rectify them first")
    fx, _, cx, _, fy, cy = (float(v) for v in info.k[:6])
    if not fx > 0 or not fy > 0:
        raise InputError(f"its camera_info has the focal lengths {fx:g} and {fy:g}")
    return Intrinsics(info.width, info.height, fx, fy, cx, cy)


def _point(point: Any) -> Vec3:
    return (float(point.x), float(point.y), float(point.z))


def _hand(hand: Any) -> GripperState:
    return GripperState(
        hand.holding or None,
        _point(hand.position),
        released=hand.released or None,
        released_world_m=_point(hand.released_at[0]) if hand.released_at else None,
        name=hand.name,
        told=bool(hand.told),
        width_m=float(hand.width[0]) if hand.width else None,
    )
