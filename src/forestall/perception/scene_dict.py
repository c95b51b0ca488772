"""An observation from plain data: the document of `docs/observation-format.md` with arrays in it.

Called by whoever gets scenes as dicts (messages, notebooks); calls `scenes.py`.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import fields
from typing import Any

from forestall.errors import InputError, UnknownNameError
from forestall.perception.scenes import Conventions, Found, Hand, Picture, Scenes
from forestall.types.facts import GRIPPER
from forestall.types.observation import Observation

_HOW = tuple(f.name for f in fields(Conventions))
_FRAME = ("rgb", "depth", "intrinsics", "camera_to_world", "detections")
_SCENE = ("format", "time_s", "gripper", "robot_position_m", "frames")
_DETECTION = ("category", "instance", "mask", "box", "score", "states")
_HAND = ("holding", "position_m", "released", "released_m", "name")
_CAMERA = ("fx", "fy", "cx", "cy")


def scene_from_dict(scenes: Scenes, data: Mapping[str, Any]) -> Observation:
    """An observation from plain data.

    Args:
        scenes: of this run.
        data: `frames`, each with `rgb` and `detections`, and with `depth`, `intrinsics` and
            `camera_to_world` where there is depth; or these fields of a single frame beside the
            others: `gripper` (left out, one, or a list of `{"holding", "position_m"}`), `time_s`,
            `robot_position_m`, and the fields of `Conventions`. A detection has `category`, and a
            `mask` or a `box`; `instance`, `score` and `states` where they are known.

    Raises:
        InputError: a field that is missing or unknown (the nearest known one is named), or a value
            that cannot be used.
    """
    _only("scene", data, (*_SCENE, *_FRAME, *_HOW))
    how = {name: data[name] for name in _HOW if name in data}
    if "frames" in data:
        beside = [name for name in _FRAME if name in data]
        if beside:
            raise InputError(f"scene: {', '.join(beside)} belong into one of the frames")
        frames = list(_sequence("frames", data["frames"]))
        for index, frame in enumerate(frames):
            _only(f"frames.{index}", frame, _FRAME)
    else:
        frames = [{name: data[name] for name in _FRAME if name in data}]
    gripper = data.get("gripper")
    several = gripper if isinstance(gripper, Sequence) else () if gripper is None else (gripper,)
    return scenes.reading(**how).scene(
        *(_picture(frame, index) for index, frame in enumerate(frames)),
        hands=[_hand(hand, index) for index, hand in enumerate(several)],
        time_s=_number("time_s", data.get("time_s", 0.0)),
        robot_m=data.get("robot_position_m"),
    )


def _picture(frame: Mapping[str, Any], index: int) -> Picture:
    label = f"frames.{index}"
    camera = frame.get("intrinsics")
    if isinstance(camera, Mapping):
        _only(f"{label}.intrinsics", camera, _CAMERA)
        camera = [_need(f"{label}.intrinsics", camera, name) for name in _CAMERA]
    found = _sequence(f"{label}.detections", frame.get("detections", ()))
    return Picture(
        _need(label, frame, "rgb"),
        [_found(d, f"{label}.detections.{i}") for i, d in enumerate(found)],
        frame.get("depth"),
        camera,
        frame.get("camera_to_world"),
    )


def _found(data: Any, label: str) -> Found:
    _only(label, data, _DETECTION)
    category = _need(label, data, "category")
    if not isinstance(category, str):
        raise InputError(f"{label}: category must be a text, got {category!r}")
    return Found(
        category,
        data.get("mask"),
        data.get("box"),
        data.get("instance"),
        _number(f"{label}.score", data.get("score", 1.0)),
        data.get("states", {}),
    )


def _hand(data: Any, index: int) -> Hand:
    label = "gripper" if index == 0 else f"gripper.{index}"
    _only(label, data, _HAND)
    name = data.get("name", GRIPPER if index == 0 else f"{GRIPPER}_{index + 1}")
    return Hand(
        _need(label, data, "holding"),
        _need(label, data, "position_m"),
        data.get("released"),
        data.get("released_m"),
        name,
    )


def _need(label: str, data: Mapping[str, Any], name: str) -> Any:
    if name not in data:
        raise InputError(f"{label}: {name} is missing")
    return data[name]


def _only(label: str, data: Any, known: Iterable[str]) -> None:
    if not isinstance(data, Mapping):
        raise InputError(f"{label} must be a dict, got {type(data).__name__}")
    for name in data:
        if name not in tuple(known):
            raise UnknownNameError(f"field of {label}", str(name), known)


def _sequence(label: str, data: Any) -> Sequence[Any]:
    if not isinstance(data, list | tuple):
        raise InputError(f"{label} must be a list, got {type(data).__name__}")
    return data


def _number(label: str, data: Any) -> float:
    if isinstance(data, bool) or not isinstance(data, int | float):
        raise InputError(f"{label} must be a number, got {data!r}")
    return float(data)
