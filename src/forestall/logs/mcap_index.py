"""What an MCAP file has: pictures by topic and time, transforms, cameras, subtasks, looks.

Called by `mcap_in`; reads the file once and decodes no picture. Pictures are found again by their
place in the file.
"""

from __future__ import annotations

import struct
from bisect import bisect_left
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any

from forestall.errors import FileFormatError, InputError
from forestall.logs.layout import Layout, Step, Topics, status_of
from forestall.logs.mcap_file import McapFile, Place, Told
from forestall.logs.mcap_out import COLOUR, DEPTH, DETECTIONS, layer
from forestall.logs.outlines import MOST_LAYERS
from forestall.logs.transforms import Transforms

MOST_PICTURES = 500_000
MOST_LOOKS = 10_000
MOST_STEPS = 2_000

IMAGES = ("sensor_msgs/msg/Image", "sensor_msgs/msg/CompressedImage")
_TEXT, _CAMERA = "std_msgs/msg/String", "sensor_msgs/msg/CameraInfo"
_BOXES, _MOVES = "vision_msgs/msg/Detection2DArray", "tf2_msgs/msg/TFMessage"
_STAMP = {0: struct.Struct(">iI"), 1: struct.Struct("<iI")}
_COLOURS = ("/color/image_raw", "/image_raw", "/image_color", "/image_rect_color", "/rgb/image_raw")
_DEPTHS = (f"/{DEPTH}", "/depth_registered/image_raw", "/depth_registered/image_rect")


@dataclass(slots=True)
class Series:
    """The messages of one topic in the order of their stamps."""

    told: Told
    stamps_ns: list[int] = field(default_factory=list)
    logs_ns: list[int] = field(default_factory=list)
    places: list[Place] = field(default_factory=list)

    _by_log: list[tuple[int, int]] = field(default_factory=list)

    def sort(self) -> None:
        """Into the order of stamps; recorders may write a little out of it."""
        rows = sorted(zip(self.stamps_ns, self.logs_ns, self.places, strict=True))
        if rows:
            self.stamps_ns, self.logs_ns, self.places = (list(c) for c in zip(*rows, strict=True))
        self._by_log = sorted((log_ns, n) for n, log_ns in enumerate(self.logs_ns))

    def newest(self, at_ns: int, within_ns: int) -> int | None:
        """Number of what was logged last by a time, None where it is older than that."""
        at = bisect_left(self._by_log, (at_ns + 1, -1)) - 1
        if at < 0 or at_ns - self._by_log[at][0] > within_ns:
            return None
        return self._by_log[at][1]

    def nearest(self, stamp_ns: int, within_ns: int) -> int | None:
        """Number of the message that is nearest to a stamp, None where none is so near."""
        at = bisect_left(self.stamps_ns, stamp_ns)
        near = [i for i in (at - 1, at) if 0 <= i < len(self.stamps_ns)]
        best = min(near, key=lambda i: abs(self.stamps_ns[i] - stamp_ns), default=None)
        if best is None or abs(self.stamps_ns[best] - stamp_ns) > within_ns:
            return None
        return best


@dataclass(slots=True)
class Index:
    """Everything of a log but its pictures.

    Args:
        file: it is in.
        layout: as it is read.
        series: topic → messages that are found again: pictures and detections.
        infos: topic → the first camera_info.
        looks: places of our own looks, by stamp.
        steps: as the topic of subtasks says.
        texts: (log time, what) of the topic `holding`.
        first_ns: time of the first message.
        notes: what could not be read of it.
    """

    file: McapFile
    layout: Layout
    series: dict[str, Series] = field(default_factory=dict)
    infos: dict[str, Any] = field(default_factory=dict)
    looks: dict[int, tuple[Told, Place]] = field(default_factory=dict)
    steps: list[Step] = field(default_factory=list)
    texts: list[tuple[int, str]] = field(default_factory=list)
    transforms: Transforms = field(default_factory=Transforms)
    first_ns: int = 0
    notes: list[str] = field(default_factory=list)

    def cameras(self) -> tuple[Topics, ...]:
        """The cameras that the layout names, else those that the names of topics show.

        Raises:
            FileFormatError: none, or a named topic is missing.
        """
        named = self.layout.mcap.cameras
        found = named if named is not None else tuple(self._guessed())
        if not found:
            told = ", ".join(sorted(self.file.topics())[:20]) or "none"
            raise FileFormatError(
                f"{self.file.path}: no topic looks like the colour of a camera; name it in a "
                f"layout ([[mcap.cameras]] rgb = ...). Topics: {told}"
            )
        for camera in found:
            for topic in (camera.rgb, camera.depth, *camera.masks, camera.detections):
                if topic is not None and topic not in self.series:
                    known = ", ".join(sorted(self.series)[:20]) or "none"
                    raise FileFormatError(
                        f"{self.file.path}: there is no topic {topic} with pictures; there are "
                        f"{known}"
                    )
        return found

    def _guessed(self) -> Iterator[Topics]:
        for topic in sorted(self.series):
            plain = topic.removesuffix("/compressed")
            ending = next((e for e in _COLOURS if plain.endswith(e)), "")
            if not ending or any(w in topic for w in ("depth", "mask", "infra")):
                continue
            root = topic[: topic.rindex(ending)]
            if f"{root}/{COLOUR}" in self.series and ending != f"/{COLOUR}":
                continue
            depths = (d for e in _DEPTHS for d in (root + e, f"{root}{e}/compressedDepth"))
            masks = [f"{root}/{layer(i)}" for i in range(MOST_LAYERS)]
            boxes = f"{root}/{DETECTIONS}"
            yield Topics(
                rgb=topic,
                depth=next((d for d in depths if d in self.series), None),
                masks=tuple(m for m in masks if m in self.series),
                detections=boxes if boxes in self.series else None,
            )

    def info_of(self, camera: Topics) -> Any:
        """The camera_info of a camera.

        Raises:
            FileFormatError: there is none.
        """
        root = camera.rgb.removesuffix("/compressed").rpartition("/")[0]
        topic = camera.info or f"{root}/camera_info"
        if topic not in self.infos:
            known = ", ".join(sorted(self.infos)) or "none"
            raise FileFormatError(
                f"{self.file.path}: there is no camera_info {topic} of {camera.rgb}; there are "
                f"{known}"
            )
        return self.infos[topic]


def index_of(file: McapFile, layout: Layout) -> Index:
    """Read a file once.

    Raises:
        FileFormatError: a damaged file, a topic that cannot be decoded, or more than is read.
    """
    index = Index(file, layout)
    outcomes: list[tuple[int, str]] = []
    types: dict[int, str] = {}
    first = None
    for told in file.messages():
        first = told.log_ns if first is None else min(first, told.log_ns)
        if told.channel not in types:
            types[told.channel] = file.topics()[told.topic]
        _take(index, told, types[told.channel], outcomes)
    index.first_ns = first or 0
    for series in index.series.values():
        series.sort()
    index.steps.sort(key=lambda step: step.begins_ns)
    _end(index, outcomes)
    return index


def _take(index: Index, told: Told, kind: str, outcomes: list[tuple[int, str]]) -> None:
    names, topic, file = index.layout.mcap, told.topic, index.file
    where = f"{file.path}: topic {topic}"
    if topic in (names.subtasks, names.outcomes, names.holding):
        if kind != _TEXT:
            raise FileFormatError(f"{where} has messages of {kind}; {_TEXT} is expected")
        said = str(file.decoded(told).data)
        if topic == names.outcomes:
            outcomes.append((told.log_ns, said))
        elif topic == names.holding:
            index.texts.append((told.log_ns, said.strip()))
        elif (meant := index.layout.subtask(said, where)) is not None:
            index.steps.append(Step(told.log_ns, meant))
        if max(len(index.steps), len(outcomes)) > MOST_STEPS:
            raise FileFormatError(f"{where} has more than {MOST_STEPS} messages")
    elif topic == names.looks and kind.endswith("/Look"):
        index.looks[_stamp(told)] = (told, told.place)
        if len(index.looks) > MOST_LOOKS:
            raise FileFormatError(f"{where} has more than {MOST_LOOKS} looks")
    elif kind in IMAGES or kind == _BOXES:
        series = index.series.setdefault(topic, Series(Told(topic, 0, b"", (0, 0), told.channel)))
        series.stamps_ns.append(_stamp(told))
        series.logs_ns.append(told.log_ns)
        series.places.append(told.place)
        if len(series.places) > MOST_PICTURES:
            raise FileFormatError(f"{where} has more than {MOST_PICTURES} pictures")
    elif kind == _CAMERA and topic not in index.infos:
        index.infos[topic] = file.decoded(told)
    elif kind == _MOVES:
        _moved(index, file.decoded(told), where)


def _moved(index: Index, message: Any, where: str) -> None:
    for one in message.transforms:
        stamp = one.header.stamp
        at, turned = one.transform.translation, one.transform.rotation
        try:
            index.transforms.add(
                one.header.frame_id,
                one.child_frame_id,
                stamp.sec * 10**9 + stamp.nanosec,
                (at.x, at.y, at.z),
                (turned.x, turned.y, turned.z, turned.w),
            )
        except InputError as error:
            raise FileFormatError(f"{where}: {error}") from error


def _end(index: Index, outcomes: list[tuple[int, str]]) -> None:
    """Each outcome belongs to the step that began last; of several at one time, in their order."""
    taken: set[int] = set()
    for log_ns, said in outcomes:
        status, why = status_of(said, f"{index.file.path}: topic {index.layout.mcap.outcomes}")
        begun = [n for n, s in enumerate(index.steps) if s.begins_ns <= log_ns and n not in taken]
        same = [n for n in begun if index.steps[n].begins_ns == log_ns]
        if not begun:
            index.notes.append(f"outcome {said!r} belongs to no subtask")
            continue
        number = same[0] if same else begun[-1]
        taken.add(number)
        step = index.steps[number]
        index.steps[number] = Step(step.begins_ns, step.subtask, status, why)


def _stamp(told: Told) -> int:
    """The stamp of the header with which a message begins; when it was logged where it is 0."""
    order = _STAMP.get(told.data[1] & 1 if len(told.data) > 11 else -1)
    if order is None:
        return told.log_ns
    seconds, rest = order.unpack_from(told.data, 4)
    return (seconds * 10**9 + rest) or told.log_ns
