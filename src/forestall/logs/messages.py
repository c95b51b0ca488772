"""The ROS 2 messages of our logs, as an MCAP file states them; read by the writer alone.

Fields as in the packages std_msgs, geometry_msgs, sensor_msgs, tf2_msgs (common_interfaces and
geometry2) and vision_msgs 4. What no standard message says (what a hand holds and let go, which
pictures are one look) is one of our own, `forestall_msgs/msg/Look`: a file states its messages,
so that any viewer shows it.
"""

from __future__ import annotations

from collections.abc import Mapping

_FIELDS: Mapping[str, str] = {
    "builtin_interfaces/Time": "int32 sec\nuint32 nanosec",
    "std_msgs/Header": "builtin_interfaces/Time stamp\nstring frame_id",
    "std_msgs/String": "string data",
    "geometry_msgs/Vector3": "float64 x\nfloat64 y\nfloat64 z",
    "geometry_msgs/Point": "float64 x\nfloat64 y\nfloat64 z",
    "geometry_msgs/Quaternion": "float64 x\nfloat64 y\nfloat64 z\nfloat64 w",
    "geometry_msgs/Transform": (
        "geometry_msgs/Vector3 translation\ngeometry_msgs/Quaternion rotation"
    ),
    "geometry_msgs/Pose": "geometry_msgs/Point position\ngeometry_msgs/Quaternion orientation",
    "geometry_msgs/PoseWithCovariance": "geometry_msgs/Pose pose\nfloat64[36] covariance",
    "geometry_msgs/TransformStamped": (
        "std_msgs/Header header\nstring child_frame_id\ngeometry_msgs/Transform transform"
    ),
    "tf2_msgs/TFMessage": "geometry_msgs/TransformStamped[] transforms",
    "sensor_msgs/RegionOfInterest": (
        "uint32 x_offset\nuint32 y_offset\nuint32 height\nuint32 width\nbool do_rectify"
    ),
    "sensor_msgs/CameraInfo": (
        "std_msgs/Header header\nuint32 height\nuint32 width\nstring distortion_model\n"
        "float64[] d\nfloat64[9] k\nfloat64[9] r\nfloat64[12] p\nuint32 binning_x\n"
        "uint32 binning_y\nsensor_msgs/RegionOfInterest roi"
    ),
    "sensor_msgs/Image": (
        "std_msgs/Header header\nuint32 height\nuint32 width\nstring encoding\n"
        "uint8 is_bigendian\nuint32 step\nuint8[] data"
    ),
    "vision_msgs/Point2D": "float64 x\nfloat64 y",
    "vision_msgs/Pose2D": "vision_msgs/Point2D position\nfloat64 theta",
    "vision_msgs/BoundingBox2D": "vision_msgs/Pose2D center\nfloat64 size_x\nfloat64 size_y",
    "vision_msgs/ObjectHypothesis": "string class_id\nfloat64 score",
    "vision_msgs/ObjectHypothesisWithPose": (
        "vision_msgs/ObjectHypothesis hypothesis\ngeometry_msgs/PoseWithCovariance pose"
    ),
    "vision_msgs/Detection2D": (
        "std_msgs/Header header\nvision_msgs/ObjectHypothesisWithPose[] results\n"
        "vision_msgs/BoundingBox2D bbox\nstring id"
    ),
    "vision_msgs/Detection2DArray": (
        "std_msgs/Header header\nvision_msgs/Detection2D[] detections"
    ),
    "forestall_msgs/Hand": (
        "string name\nbool told\nstring holding\ngeometry_msgs/Point position\n"
        "string released\ngeometry_msgs/Point[] released_at\nfloat64[] width"
    ),
    "forestall_msgs/Named": "string name\ngeometry_msgs/Point at",
    "forestall_msgs/CameraPose": "string camera\nfloat64[16] camera_to_world",
    "forestall_msgs/Look": (
        "std_msgs/Header header\nfloat64 time_s\nforestall_msgs/CameraPose[] cameras\n"
        "geometry_msgs/Point robot_position\nforestall_msgs/Hand[] hands\n"
        "forestall_msgs/Named[] named"
    ),
}

_PLAIN = ("bool", "byte", "char", "float", "int", "uint", "string")
_RULE = "=" * 80


def schema_name(message: str) -> str:
    """As ROS 2 names it: "std_msgs/String" is "std_msgs/msg/String"."""
    package, _, name = message.partition("/")
    return f"{package}/msg/{name}"


def schema_text(message: str) -> str:
    """The definition of a message with those that it uses, in the encoding "ros2msg"."""
    texts, waiting = [_FIELDS[message]], [message]
    named: list[str] = []
    while waiting:
        for line in _FIELDS[waiting.pop()].splitlines():
            used = line.split()[0].partition("[")[0]
            if not used.startswith(_PLAIN) and used not in named:
                named.append(used)
                waiting.append(used)
    texts += [f"{_RULE}\nMSG: {name}\n{_FIELDS[name]}" for name in named]
    return "\n".join(texts) + "\n"
