"""A run as an MCAP file of ROS 2 messages, without ROS (implements `writing.LogWriter`).

Called by the listener; calls the packages mcap and mcap-ros2-support. Topics are named as those of
a RealSense camera whose depth is aligned to colour; colour is rgb8, depth 32FC1 in metres, to the
last bit. A look of several pictures has one camera for each, all at the same stamp.
"""

from __future__ import annotations

import json
from contextlib import ExitStack
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from forestall.errors import InputError
from forestall.files import whole_file
from forestall.logs.messages import schema_name, schema_text
from forestall.logs.needed import needed
from forestall.logs.outlines import box_of, detections_of, layers_of
from forestall.logs.writing import Executed, Head
from forestall.types.observation import Detection, Frame, GripperState, Observation, Vec3

LOOKS, SUBTASKS, OUTCOMES, TRANSFORMS = "/look", "/subtask", "/subtask/outcome", "/tf"
WORLD, BASE = "map", "base_link"
ABOUT = "forestall"
"""Name of the metadata record that says what a run was of."""

COLOUR, INFO = "color/image_raw", "color/camera_info"
DEPTH = "aligned_depth_to_color/image_raw"
DETECTIONS = "detections"


def layer(number: int) -> str:
    """The topic of masks; those that lie on others are on layers of their own."""
    return "masks/image_raw" if number == 0 else f"masks_{number}/image_raw"


class McapWriter:
    """Writes one run.

    Args:
        path: of the file; it appears when the run is over.

    Raises:
        InputError: a package is missing, or the file is there already.
    """

    def __init__(self, path: Path) -> None:
        needed("mcap", "mcap_ros2")
        if path.exists():
            raise InputError(f"{path} is there already: name a new file")
        self._path, self._open = path, ExitStack()
        self._writer: Any = None
        self._schemas: dict[str, Any] = {}
        self._now_ns = -1
        self._count = 0

    def begin(self, head: Head) -> None:
        """The run begins."""
        from mcap_ros2.writer import Writer

        self._head = head
        self._path.parent.mkdir(parents=True, exist_ok=True)
        self._writer = Writer(self._open.enter_context(whole_file(self._path)))

    def look(self, observation: Observation) -> None:
        """Every picture with its camera, and what the robot felt, all at one stamp."""
        self._now_ns = max(round(observation.time_s * 1e9), self._now_ns + 1)
        names = [f"camera_{i}" for i in range(len(observation.frames))]
        poses = []
        for name, frame in zip(names, observation.frames, strict=True):
            self._frame(name, frame)
            pose = frame.camera_to_world
            poses.append({"camera": name, "camera_to_world": pose.ravel().tolist()})
        self._transforms(names, observation)
        told = [{"name": n, "at": _point(at)} for n, at in observation.told]
        self._write(
            LOOKS,
            "forestall_msgs/Look",
            {
                "header": self._header(WORLD),
                "time_s": observation.time_s,
                "cameras": poses,
                "robot_position": _point(observation.robot_position_world_m),
                "hands": [_hand(h) for h in (observation.gripper, *observation.others)],
                "named": told,
            },
        )

    def executed(self, executed: Executed) -> None:
        """When a subtask began, and how it ended."""
        self._write(SUBTASKS, "std_msgs/String", {"data": str(executed.subtask)})
        why = f": {executed.reason}" if executed.reason else ""
        self._write(OUTCOMES, "std_msgs/String", {"data": f"{executed.status.value}{why}"})

    def finish(self, success: bool | None, why: str) -> None:
        """What the run was of and what came of it; the file appears."""
        head = self._head
        about = {
            "format": "1",
            "name": head.name,
            "task": head.task,
            "scene": head.scene,
            "goal": head.goal,
            "domain": head.domain,
            "success": json.dumps(success),
            "why": why,
        }
        self._writer.add_metadata(ABOUT, about)
        self._writer.finish()
        self._open.close()

    def abandon(self) -> None:
        """Take away what was written."""
        unfinished = InputError("abandoned")
        self._open.__exit__(type(unfinished), unfinished, None)

    def _frame(self, name: str, frame: Frame) -> None:
        depth = frame.depth_m.astype("<f4")
        self._image(f"/{name}/{COLOUR}", name, frame.rgb, "rgb8")
        self._camera(name, frame)
        if not frame.colour_only:
            self._image(f"/{name}/{DEPTH}", name, depth, "32FC1")
        detections = detections_of(frame)
        if detections is None:
            return
        shape = (frame.intrinsics.height, frame.intrinsics.width)
        for number, pixels in enumerate(layers_of(detections, shape)):
            self._image(f"/{name}/{layer(number)}", name, pixels.astype("<u2"), "16UC1")
        said = {"header": self._header(name), "detections": [_detection(d) for d in detections]}
        self._write(f"/{name}/{DETECTIONS}", "vision_msgs/Detection2DArray", said)

    def _camera(self, name: str, frame: Frame) -> None:
        k = frame.intrinsics
        matrix = [k.fx, 0.0, k.cx, 0.0, k.fy, k.cy, 0.0, 0.0, 1.0]
        said = {
            "header": self._header(name),
            "height": k.height,
            "width": k.width,
            "distortion_model": "plumb_bob",
            "d": [0.0] * 5,
            "k": matrix,
            "r": np.eye(3).ravel().tolist(),
            "p": [k.fx, 0.0, k.cx, 0.0, 0.0, k.fy, k.cy, 0.0, 0.0, 0.0, 1.0, 0.0],
        }
        self._write(f"/{name}/{INFO}", "sensor_msgs/CameraInfo", said)

    def _image(self, topic: str, frame_id: str, pixels: npt.NDArray[Any], encoding: str) -> None:
        height, width = pixels.shape[:2]
        data = np.ascontiguousarray(pixels).tobytes()
        said = {
            "header": self._header(frame_id),
            "height": height,
            "width": width,
            "encoding": encoding,
            "is_bigendian": 0,
            "step": len(data) // height,
            "data": data,
        }
        self._write(topic, "sensor_msgs/Image", said)

    def _transforms(self, names: list[str], observation: Observation) -> None:
        """World to robot, to hands and to cameras, for viewers; `LOOKS` has them to the bit."""
        from scipy.spatial.transform import Rotation

        said = [self._transform(BASE, observation.robot_position_world_m, (0.0, 0.0, 0.0, 1.0))]
        said += [
            self._transform(h.name, h.position_world_m, (0.0, 0.0, 0.0, 1.0))
            for h in observation.hands
        ]
        for name, frame in zip(names, observation.frames, strict=True):
            pose = frame.camera_to_world
            turned = Rotation.from_matrix(pose[:3, :3]).as_quat().tolist()
            said.append(self._transform(name, pose[:3, 3].tolist(), turned))
        self._write(TRANSFORMS, "tf2_msgs/TFMessage", {"transforms": said})

    def _transform(self, child: str, at: Any, turned: Any) -> dict[str, Any]:
        rotation = dict(zip("xyzw", turned, strict=True))
        moved = {"translation": _point(at), "rotation": rotation}
        return {"header": self._header(WORLD), "child_frame_id": child, "transform": moved}

    def _header(self, frame_id: str) -> dict[str, Any]:
        seconds, rest = divmod(self._now_ns, 10**9)
        return {"stamp": {"sec": seconds, "nanosec": rest}, "frame_id": frame_id}

    def _write(self, topic: str, message: str, said: dict[str, Any]) -> None:
        schema = self._schemas.get(message)
        if schema is None:
            text = schema_text(message)
            schema = self._writer.register_msgdef(schema_name(message), text)
            self._schemas[message] = schema
        now = max(0, self._now_ns)
        self._writer.write_message(topic, schema, said, now, now, self._count)
        self._count += 1


def _point(at: Any) -> dict[str, float]:
    return {axis: float(v) for axis, v in zip("xyz", at, strict=True)}


def _hand(hand: GripperState) -> dict[str, Any]:
    def points(at: Vec3 | None) -> list[dict[str, float]]:
        return [] if at is None else [_point(at)]

    return {
        "name": hand.name,
        "told": hand.told,
        "holding": hand.holding or "",
        "position": _point(hand.position_world_m),
        "released": hand.released or "",
        "released_at": points(hand.released_world_m),
        "width": [] if hand.width_m is None else [hand.width_m],
    }


def _detection(detection: Detection) -> dict[str, Any]:
    left, top, right, bottom = box_of(detection.mask)
    middle = {"x": (left + right) / 2, "y": (top + bottom) / 2}
    guess = {"class_id": detection.category, "score": detection.score}
    return {
        "results": [{"hypothesis": guess}],
        "bbox": {
            "center": {"position": middle},
            "size_x": right - left,
            "size_y": bottom - top,
        },
        "id": detection.instance or "",
    }
