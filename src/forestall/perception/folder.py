"""Stored observations of the user's own: pictures, depth, masks, camera and hand as files.

The format is described in `docs/observation-format.md`. Called by the command line; calls
`folder_files.py` for single files. Every fault has its own message, which names the file and says
what would be valid.
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image
from pydantic import BaseModel, ConfigDict, Field, ValidationError

from forestall.domain.load import shipped
from forestall.domain.model import Domain
from forestall.errors import FileFormatError, UnknownNameError
from forestall.perception.folder_files import MaskFile, read_depth, read_rgb, single_mask
from forestall.types.facts import category_of, is_instance
from forestall.types.observation import Detection, Frame, GripperState, Intrinsics, Observation

OBSERVATION_FILE = "observation.json"
OBSERVATION_FORMAT = 1

GivenStates = dict[str, dict[str, str]]
_Vec3 = tuple[float, float, float]
_Row = tuple[float, float, float, float]


class _Strict(BaseModel):
    model_config = ConfigDict(extra="forbid", allow_inf_nan=False)


class _Camera(_Strict):
    fx: float = Field(gt=0)
    fy: float = Field(gt=0)
    cx: float
    cy: float


class _Detection(_Strict):
    category: str
    instance: str | None = None
    id: int | None = Field(default=None, gt=0)
    mask: str | None = None
    score: float = Field(default=1.0, ge=0, le=1)
    states: dict[str, str] = {}


class _Frame(_Strict):
    intrinsics: _Camera
    camera_to_world: tuple[_Row, _Row, _Row, _Row]
    rgb: str = "rgb.png"
    depth: str | None = None
    masks: str | None = None
    detections: list[_Detection]


class _Gripper(_Strict):
    holding: str | None
    position_m: _Vec3


class _Document(_Strict):
    format: int
    time_s: float = 0.0
    gripper: _Gripper
    robot_position_m: _Vec3 | None = None
    frames: list[_Frame] = Field(min_length=1)


def read_observation(
    path: Path | str, domain: Domain | None = None
) -> tuple[Observation, Mapping[str, Mapping[str, str]]]:
    """Read a stored observation and the states that were written down with it.

    Args:
        path: the folder.
        domain: which categories and states there are; the household's by default.

    Raises:
        FileFormatError: a file is missing or cannot be read as what it should be.
        UnknownNameError: a category, attribute or value that is not in the domain.
        PerceptionError: depth or masks that cannot be used.
    """
    folder = Path(path)
    words = domain or shipped("household")
    document = _document(folder)
    frames, states = [], GivenStates()
    for index, data in enumerate(document.frames):
        frames.append(_frame(folder, data, index, len(document.frames) == 1, words, states))
    holding = document.gripper.holding
    if holding is not None:
        holding = _instance(holding, words, f"{folder / OBSERVATION_FILE}: gripper.holding")
    observation = Observation(
        frames=tuple(frames),
        gripper=GripperState(holding, document.gripper.position_m),
        time_s=document.time_s,
        robot_position_world_m=document.robot_position_m or _below(frames[-1]),
    )
    return observation, states


def _document(folder: Path) -> _Document:
    file = folder / OBSERVATION_FILE
    if not folder.is_dir():
        raise FileFormatError(f"{folder} is not a folder: give the one with {OBSERVATION_FILE}")
    if not file.is_file():
        raise FileFormatError(f"{file} is missing: a stored observation begins with it")
    try:
        data = json.loads(file.read_text(encoding="utf-8"))
    except (json.JSONDecodeError, UnicodeDecodeError) as error:
        raise FileFormatError(f"{file} is not JSON: {error}") from error
    if isinstance(data, dict) and data.get("format") != OBSERVATION_FORMAT:
        raise FileFormatError(
            f"{file}: format {data.get('format')!r}: this version reads {OBSERVATION_FORMAT}"
        )
    try:
        return _Document.model_validate(data)
    except ValidationError as error:
        first = error.errors()[0]
        where = ".".join(map(str, first["loc"])) or "the document"
        raise FileFormatError(f"{file}: {where}: {first['msg']}") from error


def _frame(
    folder: Path,
    data: _Frame,
    index: int,
    alone: bool,
    domain: Domain,
    states: GivenStates,
) -> Frame:
    rgb = read_rgb(folder / data.rgb)
    depth = read_depth(folder, data.depth, rgb.shape[:2])
    height, width = depth.shape
    camera = data.intrinsics
    masks = MaskFile.open(folder, data.masks, depth.shape)
    detections: list[Detection] = []
    used: set[int | str | None] = set()
    for number, given in enumerate(data.detections):
        where = f"{folder / OBSERVATION_FILE}: frames.{index}.detections.{number}"
        category = domain[given.category].name
        instance = given.instance
        if instance is not None:
            instance = _instance(instance, domain, where)
            if category_of(instance) != category:
                raise FileFormatError(f"{where}: instance {instance!r} is not a {category}")
        elif alone:
            instance = _next_name(category, detections, data.detections)
        if any(instance is not None and d.instance == instance for d in detections):
            raise FileFormatError(f"{where}: instance {instance!r} occurs twice in this frame")
        if given.states:
            if instance is None:
                raise FileFormatError(f"{where}: states need an instance, for example {category}-1")
            states.setdefault(instance, {}).update(_states(given.states, category, domain))
        source = given.id if given.id is not None else given.mask
        if source in used:
            raise FileFormatError(f"{where}: mask {source!r} belongs to another detection already")
        used.add(source)
        mask = _mask(folder, given, masks, where, depth.shape)
        detections.append(Detection(category, mask, instance, given.score))
    return Frame(
        rgb=rgb,
        depth_m=depth,
        intrinsics=Intrinsics(width, height, camera.fx, camera.fy, camera.cx, camera.cy),
        camera_to_world=np.asarray(data.camera_to_world, dtype=np.float64),
        detections=tuple(detections),
    )


def _mask(
    folder: Path,
    given: _Detection,
    masks: MaskFile | None,
    where: str,
    shape: tuple[int, ...],
) -> np.ndarray[tuple[int, ...], np.dtype[np.bool_]]:
    if (given.id is None) == (given.mask is None):
        raise FileFormatError(
            f"{where}: give either 'id' (its value in masks.png) or 'mask' "
            "(its name in masks.npz, or a PNG file)"
        )
    if given.mask is not None and given.mask.endswith(".png"):
        mask = single_mask(folder / given.mask, shape)
    elif masks is None:
        raise FileFormatError(f"{where}: there is no masks.png and no masks.npz in {folder}")
    else:
        mask = masks.of(given.id if given.id is not None else given.mask, where)
    if not mask.any():
        raise FileFormatError(f"{where}: the mask of this {given.category} is empty")
    return mask


def _instance(name: str, domain: Domain, where: str) -> str:
    canonical = domain.canonical(name)
    if domain.find(canonical) is None:
        raise UnknownNameError("object category", category_of(name), domain.categories)
    if not is_instance(canonical):
        raise FileFormatError(f"{where}: {name!r} needs a number, for example {canonical}-1")
    return canonical


def _next_name(category: str, done: Sequence[Detection], given: Sequence[_Detection]) -> str:
    taken = {d.instance for d in done} | {g.instance for g in given}
    number = 1
    while f"{category}-{number}" in taken:
        number += 1
    return f"{category}-{number}"


def _states(given: Mapping[str, str], category: str, domain: Domain) -> dict[str, str]:
    known = domain[category].attributes
    for attribute, value in given.items():
        if attribute not in known:
            raise UnknownNameError(f"attribute of {category}", attribute, known)
        if value not in domain.values(attribute):
            raise UnknownNameError(f"value of {attribute}", value, domain.values(attribute))
    return dict(given)


def _below(frame: Frame) -> _Vec3:
    """The floor below a camera: where the robot stands if nothing else is said."""
    x, y, _ = (float(v) for v in frame.camera_to_world[:3, 3])
    return (x, y, 0.0)


def write_observation(
    path: Path | str,
    observation: Observation,
    states: Mapping[str, Mapping[str, str]] | None = None,
) -> None:
    """Write an observation so that `read_observation` gives it back.

    Args:
        path: the folder; made if it is not there.
        observation: frames with instance ids or with detections.
        states: instance → attribute → value, written beside the detections.
    """
    folder = Path(path)
    folder.mkdir(parents=True, exist_ok=True)
    frames = []
    for index, frame in enumerate(observation.frames):
        tail = "" if len(observation.frames) == 1 else f"-{index + 1}"
        frames.append(_write_frame(folder, frame, tail, states or {}))
    document = {
        "format": OBSERVATION_FORMAT,
        "time_s": observation.time_s,
        "gripper": {
            "holding": observation.gripper.holding,
            "position_m": observation.gripper.position_world_m,
        },
        "robot_position_m": observation.robot_position_world_m,
        "frames": frames,
    }
    text = json.dumps(document, indent=2)
    (folder / OBSERVATION_FILE).write_text(text + "\n", encoding="utf-8")


def _write_frame(
    folder: Path, frame: Frame, tail: str, states: Mapping[str, Mapping[str, str]]
) -> dict[str, object]:
    Image.fromarray(frame.rgb).save(folder / f"rgb{tail}.png")
    np.save(folder / f"depth{tail}.npy", frame.depth_m)
    detections: list[dict[str, object]] = []
    masks: str | None = None
    if frame.detections is not None:
        masks = f"masks{tail}.npz"
        arrays: dict[str, Any] = {f"m{i}": d.mask for i, d in enumerate(frame.detections)}
        np.savez_compressed(folder / masks, **arrays)
        for key, d in zip(arrays, frame.detections, strict=True):
            detections.append(
                {"category": d.category, "instance": d.instance, "score": d.score, "mask": key}
            )
    elif frame.instance_ids is not None:
        masks = f"masks{tail}.png"
        Image.fromarray((frame.instance_ids + 1).astype(np.uint16)).save(folder / masks)
        for i in np.unique(frame.instance_ids[frame.instance_ids >= 0]):
            name = frame.instance_names[int(i)]
            detections.append({"category": category_of(name), "instance": name, "id": int(i) + 1})
    for detection in detections:
        known = states.get(str(detection["instance"]))
        if known:
            detection["states"] = dict(known)
    k = frame.intrinsics
    return {
        "intrinsics": {"fx": k.fx, "fy": k.fy, "cx": k.cx, "cy": k.cy},
        "camera_to_world": frame.camera_to_world.tolist(),
        "rgb": f"rgb{tail}.png",
        "depth": f"depth{tail}.npy",
        "masks": masks,
        "detections": detections,
    }
