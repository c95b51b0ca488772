"""Stored observations of the user's own: pictures, depth, masks, camera and hand as files.

The format is described in `docs/observation-format.md`. Called by the command line; calls
`folder_files.py` for single files, `conventions.py` for declared units and axes, and
`domain/words.py` for names. Every fault has its own message, which names the file and says what
would be valid; what files that are in order cannot say together is for `gate.py` to find.
"""

from __future__ import annotations

import logging
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Literal

from pydantic import BaseModel, ConfigDict, Field

from forestall.config import DEFAULT_DOMAIN
from forestall.domain.load import shipped
from forestall.domain.model import Domain
from forestall.domain.words import Names, stated
from forestall.errors import FileFormatError, InputError, PerceptionError
from forestall.perception.conventions import (
    CameraAxes,
    DepthKind,
    MaskKind,
    Up,
    camera_pose,
    place,
    z_depth,
)
from forestall.perception.folder_fields import Place, Pose, nearest
from forestall.perception.folder_files import MaskFile, read_depth, read_rgb, single_mask
from forestall.perception.folder_out import (
    OBSERVATION_FILE,
    OBSERVATION_FORMAT,
    write_observation,
)
from forestall.perception.gate import inspect
from forestall.perception.gate_config import GateConfig
from forestall.reading.documents import read_json
from forestall.reading.files import inside
from forestall.reading.models import validated
from forestall.types.facts import GRIPPER, category_of
from forestall.types.finding import refuse
from forestall.types.observation import (
    Detection,
    Frame,
    GripperState,
    Intrinsics,
    Mask,
    Observation,
    Vec3,
)

_GATE = GateConfig()

_log = logging.getLogger("forestall")

GivenStates = dict[str, dict[str, str]]


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
    outlined: bool = True
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
    camera_to_world: Pose
    rgb: str = "rgb.png"
    depth: str | None = None
    masks: str | None = None
    detections: list[_Detection]


class _Gripper(_Strict):
    name: str = GRIPPER
    holding: str | None
    position_m: Place
    released: str | None = None
    released_m: Place | None = None
    width_m: float | None = None
    told: bool = True


class _Document(_Conventions):
    format: int
    up: Up = "z"
    time_s: float = 0.0
    gripper: _Gripper
    other_hands: list[_Gripper] = []
    named: dict[str, Place] = {}
    robot_position_m: Place | None = None
    frames: list[_Frame] = Field(min_length=1)


def read_observation(
    path: Path | str,
    domain: Domain | None = None,
    gate: GateConfig | None = _GATE,
    names: Names | None = None,
    *,
    numbered: bool = True,
) -> tuple[Observation, Mapping[str, Mapping[str, str]]]:
    """Read a stored observation and the states that were written down with it.

    A word that no category has and that is nearly one is logged as a warning, on standard error
    unless logging is set up otherwise: it is taken as it stands, for a thing of its own.

    Args:
        path: the folder.
        domain: which categories and states there are; the household's by default.
        gate: what observations cannot be; None lets everything in and doubts nothing.
        names: of the run that it is a part of, so that ids mean the same things all along.
        numbered: whether things without an instance get one where there is one frame alone.

    Raises:
        FileFormatError: a file is missing or cannot be read as what it should be, or what it says
            cannot be used: an attribute or value that is not in the domain, too.
        ObservationError: the gate refuses it.
    """
    folder = Path(path)
    words = domain or shipped(DEFAULT_DOMAIN)
    document = _document(folder)
    reading = _Reading(folder, document, words, names or Names(words), numbered)
    frames = tuple(reading.frame(data, index) for index, data in enumerate(document.frames))
    with _located(folder, "gripper"):
        hand = reading.hand(document.gripper, "gripper")
    with _located(folder, "other_hands"):
        others = tuple(reading.hand(other, "other_hands") for other in document.other_hands)
    with _located(folder, "named"):
        told = tuple((n, place(at, document.up)) for n, at in document.named.items())
    with _located(folder, "robot_position_m"):
        stands = document.robot_position_m
        robot = _below(frames[-1]) if stands is None else place(stands, document.up)
    observation = Observation(
        frames=frames,
        gripper=hand,
        time_s=document.time_s,
        robot_position_world_m=robot,
        others=others,
        told=told,
    )
    if gate is not None:
        for doubt in reading.doubts:
            _log.warning("forestall: warning: %s", doubt)
        refuse(inspect(observation, words, gate), str(folder / OBSERVATION_FILE))
    return observation, reading.states


@contextmanager
def _located(folder: Path, where: str) -> Iterator[None]:
    """Say of a fault in which part of the document it is."""
    try:
        yield
    except FileFormatError:
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

    def __init__(
        self, folder: Path, document: _Document, domain: Domain, names: Names, numbered: bool
    ) -> None:
        self._folder, self._document, self._domain = folder, document, domain
        self._numbers = numbered and len(document.frames) == 1
        self._names = names
        self._numbered: set[str] = set()
        self.states = GivenStates()
        self.doubts: list[str] = []
        self._doubted: set[str] = set()
        told = [d for frame in document.frames for d in frame.detections if d.instance]
        for given in told:
            names.reserve(given.instance or "")
        for given in told:
            with suppress(InputError):  # said again, with its place, when its turn comes
                names.instance(given.instance or "", names.words.category(given.category))

    def hand(self, data: _Gripper, where: str) -> GripperState:
        """A hand, with the instances that it holds and let go."""
        up, released_m = self._document.up, data.released_m
        return GripperState(
            None if data.holding is None else self._instance(f"{where}.holding", data.holding),
            place(data.position_m, up),
            None if data.released is None else self._instance(f"{where}.released", data.released),
            None if released_m is None else place(released_m, up),
            data.name,
            data.told,
            data.width_m,
        )

    def _instance(self, where: str, said: str) -> str:
        """The instance that is held or was let go, by whatever id."""
        if said not in self._names:
            kind = self._names.words.category(said)
            if kind == said:
                raise InputError(f"{where} {said!r} needs a number, for example {said}-1")
            self._doubt(where, kind)
        return self._names.instance(said)

    def _doubt(self, where: str, category: str) -> None:
        """Note a word that means nothing in the domain and is nearly one that does."""
        if self._names.words.knows(category) or category in self._doubted:
            return
        near = nearest(category, self._domain)
        if near:
            self._doubted.add(category)
            self.doubts.append(
                f"{self._folder / OBSERVATION_FILE}: {where}: the domain {self._domain.name} has "
                f"no category {category!r}: did you mean {near}? It is taken for a thing of its "
                "own, which has no states"
            )

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
        for number, given in enumerate(data.detections):
            where = f"{self._folder / OBSERVATION_FILE}: {place}.detections.{number}"
            try:
                category, instance = self._named(given)
                self._doubt(f"{place}.detections.{number}", category)
                if any(instance is not None and d.instance == instance for d in found):
                    raise InputError(f"instance {instance!r} occurs twice in this frame")
                if given.states:
                    self._tell(given.states, category, instance)
            except InputError as error:
                raise FileFormatError(f"{where}: {error}") from error
            source = given.id if given.id is not None else given.mask
            if source in used:
                raise FileFormatError(
                    f"{where}: mask {source!r} belongs to another detection already"
                )
            used.add(source)
            mask = _mask(self._folder, given, how, masks, where, shape)
            found.append(Detection(category, mask, instance, given.score, given.outlined))
        return tuple(found)

    def _named(self, given: _Detection) -> tuple[str, str | None]:
        """Category and instance of a detection, in the domain's words where it has them."""
        names = self._names
        category = names.words.category(given.category)
        if given.instance is None:
            if not self._numbers:
                return category, None
            name = names.free(category, self._numbered)
            self._numbered.add(name)
            return category, name
        other = category_of(given.instance)
        if names.words.knows(other) and names.words.category(other) != category:
            raise InputError(self._misnamed(given.instance, category))
        return category, names.instance(given.instance, category)

    def _misnamed(self, instance: str, category: str) -> str:
        """That an id is of another category than the one beside it, and which would do."""
        own = self._names.words.category(category_of(instance))
        text = f"instance {instance!r} is not a {category}"
        if self._names.words.knows(category):
            return f"{text}: give the category {own}, or another instance, best {category}-N"
        near = nearest(category, self._domain) or own
        return f"{text}: the domain has no category {category!r}, did you mean {near}?"

    def _tell(self, given: Mapping[str, str], category: str, instance: str | None) -> None:
        """Take down the states of a thing; of what the domain does not know it has none."""
        if instance is None:
            raise InputError(f"states need an instance, for example {category}-1")
        try:
            told = stated(given, category, self._domain)
        except InputError as error:
            raise InputError(f"states: {error}") from error
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


def _below(frame: Frame) -> Vec3:
    """The floor below a camera: where the robot stands if nothing else is said."""
    x, y, _ = (float(v) for v in frame.camera_to_world[:3, 3])
    return (x, y, 0.0)


__all__ = ["OBSERVATION_FILE", "GivenStates", "read_observation", "write_observation"]
