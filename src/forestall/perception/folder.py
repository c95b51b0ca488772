"""Stored observations of the user's own: pictures, depth, masks, camera and hand as files.

The format is described in `docs/observation-format.md`. Called by the command line; calls
`folder_files.py` for single files, `conventions.py` for declared units and axes, and
`domain/words.py` for names. Every fault has its own message, which names the file and says what
would be valid; what files that are in order cannot say together is for `gate.py` to find.
"""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any, Literal

import numpy as np
from PIL import Image
from pydantic import BaseModel, ConfigDict, Field

from forestall.config import DEFAULT_DOMAIN
from forestall.domain.load import shipped
from forestall.domain.model import Domain
from forestall.domain.words import Names, stated
from forestall.errors import FileFormatError, InputError, PerceptionError, UnknownNameError
from forestall.perception.conventions import (
    CameraAxes,
    DepthKind,
    MaskKind,
    Up,
    camera_pose,
    place,
    z_depth,
)
from forestall.perception.folder_files import MaskFile, read_depth, read_rgb, single_mask
from forestall.perception.gate import inspect
from forestall.perception.gate_config import GateConfig
from forestall.reading.documents import read_json
from forestall.reading.files import inside
from forestall.reading.models import validated
from forestall.types.facts import category_of, is_instance
from forestall.types.finding import refuse
from forestall.types.observation import (
    Detection,
    Frame,
    GripperState,
    Intrinsics,
    Mask,
    Observation,
)

OBSERVATION_FILE = "observation.json"
OBSERVATION_FORMAT = 1

_GATE = GateConfig()

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


class _Conventions(_Strict):
    """How a frame, or every frame of the document, is to be read; None: as is usual."""

    depth_unit: str | float | None = None
    depth_kind: DepthKind | None = None
    camera_axes: CameraAxes | None = None
    mask_kind: MaskKind | Literal["ids"] | None = None
    mask_threshold: float | None = None

    def over(self, other: _Conventions) -> _Conventions:
        """These, and those of `other` where these say nothing."""
        said = {k: getattr(self, k) for k in _Conventions.model_fields}
        rest = {k: getattr(other, k) for k in _Conventions.model_fields}
        return _Conventions(**{k: rest[k] if v is None else v for k, v in said.items()})


class _Frame(_Conventions):
    intrinsics: _Camera
    camera_to_world: tuple[_Row, _Row, _Row, _Row]
    rgb: str = "rgb.png"
    depth: str | None = None
    masks: str | None = None
    detections: list[_Detection]


class _Gripper(_Strict):
    holding: str | None
    position_m: _Vec3


class _Document(_Conventions):
    format: int
    up: Up = "z"
    time_s: float = 0.0
    gripper: _Gripper
    robot_position_m: _Vec3 | None = None
    frames: list[_Frame] = Field(min_length=1)


def read_observation(
    path: Path | str,
    domain: Domain | None = None,
    gate: GateConfig | None = _GATE,
    names: Names | None = None,
) -> tuple[Observation, Mapping[str, Mapping[str, str]]]:
    """Read a stored observation and the states that were written down with it.

    Args:
        path: the folder.
        domain: which categories and states there are; the household's by default.
        gate: what observations cannot be; None lets everything in.
        names: of the run that it is a part of, so that ids mean the same things all along.

    Raises:
        FileFormatError: a file is missing or cannot be read as what it should be, or what it says
            cannot be used.
        UnknownNameError: an attribute or value that is not in the domain.
        ObservationError: the gate refuses it.
    """
    folder = Path(path)
    words = domain or shipped(DEFAULT_DOMAIN)
    document = _document(folder)
    reading = _Reading(folder, document, words, names or Names(words))
    frames = tuple(reading.frame(data, index) for index, data in enumerate(document.frames))
    holding = document.gripper.holding
    with _located(folder, "gripper"):
        if holding is not None:
            holding = reading.holding(holding)
        hand = place(document.gripper.position_m, document.up)
    with _located(folder, "robot_position_m"):
        stands = document.robot_position_m
        robot = _below(frames[-1]) if stands is None else place(stands, document.up)
    observation = Observation(
        frames=frames,
        gripper=GripperState(holding, hand),
        time_s=document.time_s,
        robot_position_world_m=robot,
    )
    if gate is not None:
        refuse(inspect(observation, words, gate), str(folder / OBSERVATION_FILE))
    return observation, reading.states


@contextmanager
def _located(folder: Path, where: str) -> Iterator[None]:
    """Say of a fault in which part of the document it is."""
    try:
        yield
    except (FileFormatError, UnknownNameError):
        raise
    except (InputError, PerceptionError) as error:
        raise FileFormatError(f"{folder / OBSERVATION_FILE}: {where}: {error}") from error


def _document(folder: Path) -> _Document:
    file = folder / OBSERVATION_FILE
    if not folder.is_dir():
        raise FileFormatError(f"{folder} is not a folder: give the one with {OBSERVATION_FILE}")
    if not file.is_file():
        raise FileFormatError(f"{file} is missing: a stored observation begins with it")
    data = read_json(file, "stored observation")
    if isinstance(data, dict) and data.get("format") != OBSERVATION_FORMAT:
        raise FileFormatError(
            f"{file}: format {data.get('format')!r}: this version reads {OBSERVATION_FORMAT}"
        )
    return validated(_Document, data, str(file))


class _Reading:
    """One document being read: its names and states over all frames."""

    def __init__(self, folder: Path, document: _Document, domain: Domain, names: Names) -> None:
        self._folder, self._document, self._domain = folder, document, domain
        self._names = names
        self._numbered: set[str] = set()
        self.states = GivenStates()
        told = [d for frame in document.frames for d in frame.detections if d.instance]
        for given in told:
            names.reserve(given.instance or "")
        for given in told:
            with suppress(InputError):  # said again, with its place, when its turn comes
                names.instance(given.instance or "", names.words.category(given.category))

    def holding(self, said: str) -> str:
        """The instance that is held, by whatever id."""
        if said not in self._names and self._names.words.category(said) == said:
            raise InputError(f"holding {said!r} needs a number, for example {said}-1")
        return self._names.instance(said)

    def frame(self, data: _Frame, index: int) -> Frame:
        """One frame with its pictures, as ours."""
        folder, place = self._folder, f"frames.{index}"
        how = data.over(self._document)
        rgb = read_rgb(inside(folder, data.rgb))
        height, width = rgb.shape[:2]
        k = data.intrinsics
        camera = Intrinsics(width, height, k.fx, k.fy, k.cx, k.cy)
        raw, implied, file = read_depth(folder, data.depth)
        unit = how.depth_unit or implied
        if unit is None:
            raise FileFormatError(
                f"{file}: depth is whole numbers ({raw.dtype}): declare depth_unit (m, cm, mm or "
                "the metres of one unit)"
            )
        try:
            depth = z_depth(raw, camera, unit, how.depth_kind or "z")
        except InputError as error:
            raise FileFormatError(f"{file}: {error}") from error
        if not bool((depth > 0).any()):
            raise FileFormatError(f"{file}: depth is 0 everywhere, so nothing can be located")
        masks = MaskFile.open(folder, data.masks, depth.shape)
        detections = self._detections(data, place, how, masks, depth.shape)
        with _located(folder, f"{place}.camera_to_world"):
            axes = how.camera_axes or "opencv"
            pose = camera_pose(data.camera_to_world, axes, self._document.up)
            return Frame(rgb, depth, camera, pose, detections=detections)

    def _detections(
        self,
        data: _Frame,
        place: str,
        how: _Conventions,
        masks: MaskFile | None,
        shape: tuple[int, ...],
    ) -> tuple[Detection, ...]:
        found: list[Detection] = []
        used: set[int | str | None] = set()
        alone = len(self._document.frames) == 1
        for number, given in enumerate(data.detections):
            where = f"{self._folder / OBSERVATION_FILE}: {place}.detections.{number}"
            try:
                category, instance = self._named(given, alone)
                if any(instance is not None and d.instance == instance for d in found):
                    raise InputError(f"instance {instance!r} occurs twice in this frame")
                if given.states:
                    self._tell(given.states, category, instance)
            except UnknownNameError:
                raise
            except InputError as error:
                raise FileFormatError(f"{where}: {error}") from error
            source = given.id if given.id is not None else given.mask
            if source in used:
                raise FileFormatError(
                    f"{where}: mask {source!r} belongs to another detection already"
                )
            used.add(source)
            mask = _mask(self._folder, given, how, masks, where, shape)
            found.append(Detection(category, mask, instance, given.score))
        return tuple(found)

    def _named(self, given: _Detection, alone: bool) -> tuple[str, str | None]:
        """Category and instance of a detection, in the domain's words where it has them."""
        names = self._names
        category = names.words.category(given.category)
        if given.instance is None:
            if not alone:
                return category, None
            name = names.free(category, self._numbered)
            self._numbered.add(name)
            return category, name
        other = category_of(given.instance)
        if names.words.knows(other) and names.words.category(other) != category:
            raise InputError(f"instance {given.instance!r} is not a {category}")
        return category, names.instance(given.instance, category)

    def _tell(self, given: Mapping[str, str], category: str, instance: str | None) -> None:
        """Take down the states of a thing; of what the domain does not know it has none."""
        if instance is None:
            raise InputError(f"states need an instance, for example {category}-1")
        told = stated(given, category, self._domain)
        if told:
            self.states.setdefault(instance, {}).update(told)


def _mask(
    folder: Path,
    given: _Detection,
    how: _Conventions,
    masks: MaskFile | None,
    where: str,
    shape: tuple[int, ...],
) -> Mask:
    if (given.id is None) == (given.mask is None):
        raise FileFormatError(
            f"{where}: give either 'id' (its value in masks.png) or 'mask' "
            "(its name in masks.npz, or a PNG file)"
        )
    kind = None if how.mask_kind == "ids" else how.mask_kind
    if given.mask is not None and given.mask.endswith(".png"):
        mask = single_mask(inside(folder, given.mask), shape, kind, how.mask_threshold)
    elif masks is None:
        raise FileFormatError(f"{where}: there is no masks.png and no masks.npz in {folder}")
    else:
        key = given.id if given.id is not None else given.mask
        mask = masks.of(key, where, kind, how.mask_threshold)
    if not mask.any():
        raise FileFormatError(f"{where}: the mask of this {given.category} is empty")
    return mask


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
            own: dict[str, object] = {
                "category": d.category,
                "instance": d.instance,
                "score": d.score,
                "mask": key,
            }
            if d.states and (d.instance or not tail):  # of several frames states need an instance
                own["states"] = dict(d.states)
            detections.append(own)
    elif frame.instance_ids is not None:
        masks = f"masks{tail}.png"
        Image.fromarray((frame.instance_ids + 1).astype(np.uint16)).save(folder / masks)
        for i in np.unique(frame.instance_ids[frame.instance_ids >= 0]):
            name = frame.instance_names[int(i)]
            instance = name if is_instance(name) else None
            detections.append(
                {"category": category_of(name), "instance": instance, "id": int(i) + 1}
            )
    for detection in detections:
        known = states.get(str(detection["instance"]))
        if known:
            detection["states"] = {**(detection.get("states") or {}), **known}  # type: ignore[dict-item]
    k = frame.intrinsics
    return {
        "intrinsics": {"fx": k.fx, "fy": k.fy, "cx": k.cx, "cy": k.cy},
        "camera_to_world": frame.camera_to_world.tolist(),
        "rgb": f"rgb{tail}.png",
        "depth": f"depth{tail}.npy",
        "masks": masks,
        "detections": detections,
    }
