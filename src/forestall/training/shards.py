"""Pictures on disk: crops with what is true of them, in shards that are each made whole.

Called by the command line; calls `scenes.py`. A shard is a few scenes; it is written under another
name first, so that what is there is complete and a killed job goes on where it was. The shards of
a folder depend on nothing but their seeds and the options that stand beside them.
"""

from __future__ import annotations

import json
import tomllib
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import as_completed
from concurrent.futures.process import BrokenProcessPool
from dataclasses import asdict, dataclass, field, replace
from importlib.resources import files
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from forestall.config import PICTURE_SEEDS
from forestall.domain.load import extend, shipped
from forestall.domain.model import Domain
from forestall.embeddings.crops import MARGIN, crop, whole
from forestall.errors import FileFormatError, ForestallError, InputError, UnknownNameError
from forestall.files import alone, make_folder, replace_file, whole_file
from forestall.perception.segmenters import InstanceSegmenter
from forestall.processes import pool
from forestall.reading.arrays import NUMBERS, read_npz
from forestall.reading.documents import read_json
from forestall.reading.fields import Field
from forestall.sensors import Errors, Sensor
from forestall.training.questions import ATTRIBUTES
from forestall.training.scenes import Artist, Picture, SceneConfig
from forestall.types.facts import category_of
from forestall.types.observation import GripperState, Mask, Observation, Rgb

Progress = Callable[[int, int, str], None]

STORED_PIXELS = 80
STORED_MARGIN = MARGIN * STORED_PIXELS / 64
"""Wider than what the encoder is given, which leaves room for shifted and scaled windows."""

SCENES_PER_SHARD = 20
OPTIONS_NAME = "pictures.json"

SELDOM = {
    "CounterTop": 0.1,
    "DiningTable": 0.2,
    "Drawer": 0.7,
    "Cabinet": 0.7,
    "Floor": 0.1,
    "Shelf": 0.2,
    "Sink": 0.3,
    "StoveBurner": 0.35,
    "StoveKnob": 0.15,
    "TVStand": 0.3,
}
"""Share of the crops that are kept of what is in view all the time."""

SENSED = {
    "outlines up to 3 px off": Errors(outline_px=3),
    "exposure off by up to 25 %, colours with noise": Errors(gain=0.25, colour_noise=8.0),
    "motion blur of 5 px": Errors(blur_px=5),
    "all of it": Errors(outline_px=3, gain=0.25, colour_noise=8.0, blur_px=5),
}
"""Through what some of the test pictures are seen once more."""

SENSED_EVERY = 5
"""Of so many views of a scene one."""

VALUES = {a: {v: k for k, v in enumerate(values)} for a, values in ATTRIBUTES.items()}


@dataclass(frozen=True, slots=True)
class PictureConfig:
    """What a folder of pictures holds.

    Args:
        train: scenes to train on.
        development: scenes to fit temperature and thresholds on.
        test: scenes that the reported figures come from.
        unseen: scenes with things that are not trained on.
        scene: how scenes are drawn.
        renderer: by name.
    """

    train: int = 1060
    development: int = 100
    test: int = 160
    unseen: int = 60
    scene: SceneConfig = field(default_factory=SceneConfig)
    renderer: str = "embree"

    def __post_init__(self) -> None:
        for split in PICTURE_SEEDS:
            if not 0 < getattr(self, split) <= 100_000:
                raise InputError(f"{split}: from 1 to 100,000 scenes, got {getattr(self, split)}")


@dataclass(frozen=True, slots=True, eq=False)
class Crops:
    """n crops and what is true of them.

    Args:
        pixels: (n, STORED_PIXELS, STORED_PIXELS, 4) uint8.
        category: (n) names; "" for a whole frame.
        values: (n, attributes) int8, the index of the value in ATTRIBUTES, -1 where it has none.
        area: (n) mask pixels in the frame.
        frame: (n) which frame of the shard (or of the split) it was cut from.
        held: (n) bool, whether the thing is in the hand.
        seen: (n) through what: "" as it was drawn, or a name of SENSED.
    """

    pixels: npt.NDArray[np.uint8]
    category: npt.NDArray[np.str_]
    values: npt.NDArray[np.int8]
    area: npt.NDArray[np.int32]
    frame: npt.NDArray[np.int32]
    held: npt.NDArray[np.bool_]
    seen: npt.NDArray[np.str_]

    def where(self, keep: npt.NDArray[np.bool_]) -> Crops:
        """Some of them."""
        return Crops(**{name: getattr(self, name)[keep] for name in self.__dataclass_fields__})


def make(out: Path, config: PictureConfig, workers: int, progress: Progress) -> None:
    """Make every shard that is not there yet, development and test first.

    Raises:
        InputError: the folder holds pictures made with other options, or another process is
            writing to it.
    """
    make_folder(out)
    with alone(out):
        _same_options(out, config)
        _make(out, config, workers, progress)


def _make(out: Path, config: PictureConfig, workers: int, progress: Progress) -> None:
    todo = [
        (split, first)
        for split in ("development", "test", "unseen", "train")
        for first in range(0, getattr(config, split), SCENES_PER_SHARD)
    ]
    left = [job for job in todo if not _path(out, *job).exists()]
    progress(len(todo) - len(left), len(todo), "pictures")
    if not left:
        return
    with pool(min(workers, len(left))) as hands:
        futures = {hands.submit(make_shard, out, config, *job): job for job in left}
        try:
            for done, future in enumerate(as_completed(futures), len(todo) - len(left) + 1):
                future.result()
                progress(done, len(todo), futures[future][0])
        except BrokenProcessPool as error:
            raise ForestallError(
                "a process that drew has died (killed, or out of memory): what was finished is "
                "kept; run the same command again to go on"
            ) from error
        except BaseException:  # an interrupt, too, ends what is still waiting
            hands.shutdown(wait=False, cancel_futures=True)
            raise


def make_shard(out: Path, config: PictureConfig, split: str, first: int) -> Path:
    """Draw the scenes of one shard and write it."""
    domain = shipped("household") if split != "unseen" else unseen_things()
    artist = Artist(domain, config.scene, config.renderer)
    count = min(SCENES_PER_SHARD, getattr(config, split) - first)
    rows: list[_Row] = []
    frames = 0
    for seed in range(PICTURE_SEEDS[split] + first, PICTURE_SEEDS[split] + first + count):
        for picture in artist.pictures(seed):
            found = _rows(picture, frames)
            if split == "test" and picture.view % SENSED_EVERY == 0:
                found += _sensed(picture, found)
            artist.shown.update(r.category for r in found if r.category and not r.seen)
            rows += found
            frames += 1
    path = _path(out, split, first)
    path.parent.mkdir(exist_ok=True)
    with whole_file(path) as file:
        np.savez(
            file,
            pixels=np.stack([r.pixels for r in rows]),
            category=np.array([r.category for r in rows]),
            values=np.array([r.values for r in rows], dtype=np.int8),
            area=np.array([r.area for r in rows], dtype=np.int32),
            frame=np.array([r.frame for r in rows], dtype=np.int32),
            held=np.array([r.held for r in rows], dtype=bool),
            seen=np.array([r.seen for r in rows], dtype=np.str_),
        )
    return path


def read(folder: Path, split: str) -> Crops:
    """Every crop of a split, shards in order.

    Raises:
        UnknownNameError: no such split.
        FileFormatError: no pictures there, or a damaged shard.
    """
    if split not in PICTURE_SEEDS:
        raise UnknownNameError("split", split, PICTURE_SEEDS)
    paths = sorted((folder / split).glob("*.npz"))
    if not paths:
        raise FileFormatError(
            f"{folder} holds no {split} pictures: make them with `forestall encoder pictures`"
        )
    shards = []
    frames = 0
    for path in paths:
        try:
            data = read_npz(path, NUMBERS + "U")
            shard = Crops(**{name: data[name] for name in Crops.__dataclass_fields__})
        except (FileFormatError, ValueError, KeyError) as error:
            raise FileFormatError(f"{path} cannot be read ({error}): remove it") from error
        shard.frame[:] += frames
        frames = int(shard.frame[-1]) + 1
        shards.append(shard)
    return Crops(
        **{
            name: np.concatenate([getattr(s, name) for s in shards])
            for name in Crops.__dataclass_fields__
        }
    )


def unseen_file() -> dict[str, Any]:
    """What the file of unseen things and questions says."""
    text = files("forestall").joinpath("data/encoder_zero_shot.toml").read_text(encoding="utf-8")
    return tomllib.loads(text)


def unseen_things() -> Domain:
    """The household with the things that the encoder is not trained on."""
    tables = unseen_file()["categories"]
    return extend(shipped("household"), tables, {})


@dataclass(frozen=True, slots=True, eq=False)
class _Row:
    pixels: npt.NDArray[np.uint8]
    name: str
    category: str
    values: list[int]
    area: int
    frame: int
    held: bool = False
    seen: str = ""


def _rows(picture: Picture, number: int) -> list[_Row]:
    """The crops of one picture as it was drawn, the whole frame last."""
    rgb = picture.frame.rgb
    rng = np.random.default_rng([picture.seed, 2, picture.view])
    rows = []
    for d in InstanceSegmenter().segment(picture.frame):
        if rng.uniform() >= SELDOM.get(d.category, 1.0) or d.instance is None:
            continue
        rows.append(_row(picture, rgb, d.mask, d.instance, number))
    pixels = whole(rgb, STORED_PIXELS)
    rows.append(_Row(pixels, "", "", _values({}), int(rgb[..., 0].size), number))
    return rows


def _sensed(picture: Picture, drawn: Sequence[_Row]) -> list[_Row]:
    """The same things as a sensor gives them; what its masks have lost is left out."""
    rows = []
    for k, (seen, errors) in enumerate(SENSED.items()):
        sensor = Sensor(errors)
        sensor.reset(picture.seed * 100 + picture.view * 10 + k)
        now = Observation(
            frames=(picture.frame,), gripper=GripperState(None, (0.0, 0.0, 0.0)), time_s=0.0
        )
        (frame,) = sensor.sense(now).frames
        masks = {d.instance: d.mask for d in InstanceSegmenter().segment(frame)}
        for row in drawn:
            if row.name in masks:
                found = _row(picture, frame.rgb, masks[row.name], row.name, row.frame)
                rows.append(replace(found, seen=seen))
    return rows


def _row(picture: Picture, rgb: Rgb, mask: Mask, name: str, number: int) -> _Row:
    return _Row(
        pixels=crop(rgb, mask, STORED_PIXELS, STORED_MARGIN),
        name=name,
        category=category_of(name),
        values=_values(picture.states[name]),
        area=int(mask.sum()),
        frame=number,
        held=name == picture.held,
    )


def _values(states: Mapping[str, str]) -> list[int]:
    return [VALUES[a][states[a]] if a in states else -1 for a in ATTRIBUTES]


def _path(out: Path, split: str, first: int) -> Path:
    return out / split / f"{first:06d}.npz"


def options(folder: Path) -> dict[str, Any]:
    """What a folder of pictures was made with.

    Raises:
        FileFormatError: the file that says so is missing or damaged.
    """
    path = folder / OPTIONS_NAME
    return dict(Field(read_json(path, "list of options")).pairs(lambda f: f.value))


def _same_options(out: Path, config: PictureConfig) -> None:
    """See that the folder's options are these, how many scenes there are apart."""
    path = out / OPTIONS_NAME
    wanted: dict[str, Any] = asdict(config) | {
        "values": ATTRIBUTES,
        "seldom": SELDOM,
        "sensed": {name: asdict(errors) for name, errors in SENSED.items()},
        "sensed every": SENSED_EVERY,
    }
    wanted = json.loads(json.dumps(wanted))
    if path.exists():
        there = options(out)
        free = set(PICTURE_SEEDS)
        for split in sorted(free):
            old, new = there.get(split, 0), getattr(config, split)
            if old != new and (new < old or old % SCENES_PER_SHARD):
                raise InputError(
                    f"{out} was made for {old} {split} scenes, now {new} are asked for: a folder "
                    f"grows, from a multiple of {SCENES_PER_SHARD}; choose another one"
                )
        differing = [k for k in wanted if k not in free and there.get(k) != wanted[k]]
        if differing:
            raise InputError(
                f"{out} holds pictures made with other options ({', '.join(differing)}): "
                "choose another folder or remove it"
            )
    replace_file(path, json.dumps(wanted, indent=2).encode())
