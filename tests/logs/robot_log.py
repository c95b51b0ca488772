"""The log of a robot that knows nothing of this project, written message by message."""

import io
import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image

from forestall.logs.messages import schema_name, schema_text

WIDTH, HEIGHT = 16, 12
COMPRESSED = "std_msgs/Header header\nstring format\nuint8[] data"

Change = Callable[[str, dict[str, Any]], dict[str, Any] | None]
"""Topic and message → what is written instead; None: nothing."""


def rgb_at(number: int) -> np.ndarray:
    random = np.random.default_rng(number)
    return random.integers(0, 256, (HEIGHT, WIDTH, 3), dtype=np.uint8)


def _png(pixels: np.ndarray) -> bytes:
    buffer = io.BytesIO()
    Image.fromarray(pixels).save(buffer, "PNG")
    return buffer.getvalue()


def _same(topic: str, message: dict[str, Any]) -> dict[str, Any]:
    return message


def write_robot_log(
    path: Path,
    steps: tuple[tuple[float, str], ...] = (
        (1.05, "pick_up(Potato)"),
        (2.0, "put_on(Potato, Plate)"),
    ),
    change: Change = _same,
    root: str = "/head",
    seconds: float = 3.0,
    **how: Any,
) -> None:
    """Ten pictures a second in colour (packed) and depth (millimetres), a camera that turns.

    The camera hangs on a head that turns by 90 degrees within the log, under base_link, under
    odom, under map.
    """
    from mcap_ros2.writer import Writer

    with path.open("wb") as file:
        writer = Writer(file, **how)
        schemas: dict[str, Any] = {}

        def tell(topic: str, message: str, said: dict[str, Any], time_s: float) -> None:
            changed = change(topic, said)
            if changed is None:
                return
            if message not in schemas:
                text = COMPRESSED if message.endswith("CompressedImage") else schema_text(message)
                if message.endswith("CompressedImage"):
                    text += schema_text("std_msgs/Header").replace(
                        "builtin_interfaces/Time stamp\nstring frame_id",
                        "\n" + "=" * 80 + "\nMSG: std_msgs/Header\n"
                        "builtin_interfaces/Time stamp\nstring frame_id",
                        1,
                    )
                schemas[message] = writer.register_msgdef(schema_name(message), text)
            now_ns = round(time_s * 1e9) + 1_700_000_000 * 10**9
            writer.write_message(topic, schemas[message], changed, now_ns)

        def header(frame: str, time_s: float) -> dict[str, Any]:
            seconds, rest = divmod(round(time_s * 1e9), 10**9)
            return {"stamp": {"sec": 1_700_000_000 + seconds, "nanosec": rest}, "frame_id": frame}

        def moved(parent: str, child: str, at: Any, turned: Any, time_s: float) -> dict[str, Any]:
            return {
                "header": header(parent, time_s),
                "child_frame_id": child,
                "transform": {
                    "translation": dict(zip("xyz", at, strict=True)),
                    "rotation": dict(zip("xyzw", turned, strict=True)),
                },
            }

        still = (0.0, 0.0, 0.0, 1.0)
        fixed = [
            moved("odom", "base_link", (1.0, 2.0, 0.0), still, 0),
            moved("head", "camera_optical", (0.1, 0.0, 0.2), (-0.5, 0.5, -0.5, 0.5), 0),
            moved("base_link", "hand", (0.5, 0.0, 0.9), still, 0),
        ]
        tell("/tf_static", "tf2_msgs/TFMessage", {"transforms": fixed}, 0)
        waiting = list(steps)
        for number in range(round(seconds * 10)):
            time_s = number / 10
            while waiting and waiting[0][0] <= time_s:
                at, text = waiting.pop(0)
                tell("/subtask", "std_msgs/String", {"data": text}, at)
            if number % 10 == 0:
                angle = time_s / seconds * np.pi / 2
                turned = (0.0, 0.0, np.sin(angle / 2), np.cos(angle / 2))
                here = moved("base_link", "head", (0.0, 0.0, 1.2), turned, time_s)
                place = moved("map", "odom", (0.0, 0.0, 0.0), still, time_s)
                tell("/tf", "tf2_msgs/TFMessage", {"transforms": [here, place]}, time_s)
            tell(
                "/holding", "std_msgs/String", {"data": "Potato-1" if time_s > 1.5 else ""}, time_s
            )
            info = {
                "header": header("camera_optical", time_s),
                "height": HEIGHT,
                "width": WIDTH,
                "k": [20.0, 0.0, 7.5, 0.0, 20.0, 5.5, 0.0, 0.0, 1.0],
            }
            tell(f"{root}/color/camera_info", "sensor_msgs/CameraInfo", info, time_s)
            packed = {
                "header": header("camera_optical", time_s),
                "format": "rgb8; png compressed",
                "data": _png(rgb_at(number)),
            }
            colour = f"{root}/color/image_raw/compressed"
            tell(colour, "sensor_msgs/CompressedImage", packed, time_s)
            depth = np.full((HEIGHT, WIDTH), 1000 + number, "<u2")
            depth[0, 0] = 0
            raw = {
                "header": header("camera_optical", time_s + 0.004),
                "height": HEIGHT,
                "width": WIDTH,
                "encoding": "16UC1",
                "step": 2 * WIDTH,
                "data": depth.tobytes(),
            }
            tell(f"{root}/aligned_depth_to_color/image_raw", "sensor_msgs/Image", raw, time_s)
            ids = np.zeros((HEIGHT, WIDTH), np.uint8)
            ids[2:6, 2:6], ids[6:9, 8:14] = 1, 2
            masks = {**raw, "encoding": "mono8", "step": WIDTH, "data": ids.tobytes()}
            tell(f"{root}/masks/image_raw", "sensor_msgs/Image", masks, time_s)
            boxes = [
                {"id": name, "results": [{"hypothesis": {"class_id": kind, "score": 0.9}}]}
                for name, kind in (("Potato-1", "Potato"), ("", "Plate"))
            ]
            said = {"header": header("camera_optical", time_s), "detections": boxes}
            tell(f"{root}/detections", "vision_msgs/Detection2DArray", said, time_s)
        for at, text in waiting:
            tell("/subtask", "std_msgs/String", {"data": text}, at)
        writer.finish()


def as_json(message: dict[str, Any]) -> str:
    """What a message says, for messages of tests."""
    return json.dumps(message, default=repr)
