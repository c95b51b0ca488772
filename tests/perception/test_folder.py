from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

from forestall.domain.load import shipped
from forestall.errors import FileFormatError, PerceptionError, UnknownNameError
from forestall.perception.folder import read_observation, write_observation
from forestall.perception.given import GivenStateEstimator
from forestall.perception.perceiver import GraphPerceiver
from forestall.perception.segmenters import GivenMasks, InstanceSegmenter
from forestall.types.observation import Frame, Observation

from .synthetic import Solid, at, looking, observed

POSE = looking((0.0, -0.7, 1.65), (0.0, 0.3, 0.9))
SCENE = [
    Solid("CounterTop-1", (-1.0, 0.0, 0.86), (1.0, 0.6, 0.9)),
    at("Plate-1", 0.1, 0.3, 0.9, (0.22, 0.22, 0.02), True),
    at("Potato-1", 0.1, 0.3, 0.92, (0.1, 0.07, 0.065)),
]
STATES = {"Plate-1": {"dirty": "clean"}}


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    write_observation(tmp_path / "o", observed(SCENE, POSE, holding="Mug-1", time_s=3.5), STATES)
    return tmp_path / "o"


def edit(folder: Path, change: Callable[[dict[str, Any]], None]) -> None:
    file = folder / "observation.json"
    data = json.loads(file.read_text())
    change(data)
    file.write_text(json.dumps(data))


def test_what_was_written_is_read_back(folder: Path) -> None:
    observation, states = read_observation(folder)
    original = observed(SCENE, POSE).frames[0]
    frame = observation.frames[0]
    assert np.array_equal(frame.depth_m, original.depth_m)
    assert np.array_equal(frame.rgb, original.rgb)
    assert np.allclose(frame.camera_to_world, POSE)
    assert observation.gripper.holding == "Mug-1"
    assert observation.time_s == 3.5
    assert states == STATES


def test_the_graph_is_that_of_the_original(folder: Path) -> None:
    observation, states = read_observation(folder)
    from_folder = GraphPerceiver(GivenMasks(), GivenStateEstimator(states), shipped("household"))
    direct = GraphPerceiver(InstanceSegmenter(), GivenStateEstimator(STATES), shipped("household"))
    original = observed(SCENE, POSE, holding="Mug-1", time_s=3.5)
    assert from_folder.perceive(observation) == direct.perceive(original)


def test_detections_go_to_npz_and_come_back(tmp_path: Path, folder: Path) -> None:
    observation, states = read_observation(folder)
    write_observation(tmp_path / "again", observation, states)
    assert (tmp_path / "again" / "masks.npz").is_file()
    again, same = read_observation(tmp_path / "again")
    assert same == states
    for a, b in zip(
        observation.frames[0].detections or (), again.frames[0].detections or (), strict=True
    ):
        assert (a.category, a.instance) == (b.category, b.instance)
        assert np.array_equal(a.mask, b.mask)


def test_several_frames_keep_their_order(tmp_path: Path) -> None:
    other = looking((0.5, -0.7, 1.65), (0.0, 0.3, 0.9))
    write_observation(tmp_path / "o", observed(SCENE, POSE, other))
    observation, _ = read_observation(tmp_path / "o")
    assert [tuple(f.camera_to_world[:3, 3]) for f in observation.frames] == [
        tuple(POSE[:3, 3]),
        tuple(other[:3, 3]),
    ]


def test_depth_png_is_millimetres(folder: Path) -> None:
    depth = np.load(folder / "depth.npy")
    (folder / "depth.npy").unlink()
    Image.fromarray(np.round(depth * 1000).astype(np.uint16)).save(folder / "depth.png")
    edit(folder, lambda d: d["frames"][0].pop("depth"))
    observation, _ = read_observation(folder)
    assert np.allclose(observation.frames[0].depth_m, depth, atol=0.0006)


def test_unnamed_detections_are_numbered(folder: Path) -> None:
    def change(data: dict[str, Any]) -> None:
        for d in data["frames"][0]["detections"]:
            d.pop("instance")

    edit(folder, change)
    observation, states = read_observation(folder)
    names = {d.instance for d in observation.frames[0].detections or ()}
    assert names == {"CounterTop-1", "Plate-1", "Potato-1"}
    assert states == STATES


def detection(data: dict[str, Any], number: int = 1) -> Any:
    return data["frames"][0]["detections"][number]


JSON_FAULTS = {
    "format": (lambda d: d.update(format=9), FileFormatError, "format 9"),
    "unknown field": (lambda d: d.update(colour=1), FileFormatError, "colour"),
    "no frames": (lambda d: d.update(frames=[]), FileFormatError, "frames"),
    "no gripper": (lambda d: d.pop("gripper"), FileFormatError, "gripper"),
    "category": (lambda d: detection(d).update(category="Plat"), UnknownNameError, "Plate"),
    "holding": (lambda d: d["gripper"].update(holding="Mugg-1"), UnknownNameError, "Mug"),
    "holding without number": (
        lambda d: d["gripper"].update(holding="Mug"),
        FileFormatError,
        "needs a number",
    ),
    "duplicate": (
        lambda d: detection(d, 2).update(category="Plate", instance="Plate-1"),
        FileFormatError,
        "twice",
    ),
    "instance of another category": (
        lambda d: detection(d).update(instance="Mug-1"),
        FileFormatError,
        "is not a Plate",
    ),
    "attribute": (lambda d: detection(d).update(states={"open": "open"}), UnknownNameError, "open"),
    "value": (
        lambda d: detection(d).update(states={"dirty": "filthy"}),
        UnknownNameError,
        "clean",
    ),
    "empty mask": (lambda d: detection(d).update(id=77), FileFormatError, "empty"),
    "neither id nor mask": (lambda d: detection(d).pop("id"), FileFormatError, "either"),
    "missing mask file": (
        lambda d: (detection(d).pop("id"), detection(d).update(mask="no.png")),
        FileFormatError,
        "no.png is missing",
    ),
    "missing picture": (
        lambda d: d["frames"][0].update(rgb="no.png"),
        FileFormatError,
        "no.png is missing",
    ),
    "no rotation": (
        lambda d: d["frames"][0].update(camera_to_world=[[2, 0, 0, 0]] * 4),
        PerceptionError,
        "rotation",
    ),
}


@pytest.mark.parametrize("fault", JSON_FAULTS)
def test_a_faulty_document_is_refused(folder: Path, fault: str) -> None:
    change, error, text = JSON_FAULTS[fault]
    edit(folder, change)
    with pytest.raises(error, match=text):
        read_observation(folder)


def filled(value: float) -> Callable[[np.ndarray], np.ndarray]:
    def change(depth: np.ndarray) -> np.ndarray:
        depth[10, 10] = value
        return depth

    return change


DEPTH_FAULTS: dict[str, tuple[Callable[[Any], Any], str]] = {
    "nan": (filled(np.nan), "1 NaN"),
    "infinite": (filled(np.inf), "infinite"),
    "negative": (filled(-1.0), "negative"),
    "zeros": (np.zeros_like, "0 everywhere"),
    "shape": (lambda d: d[:-1], "does not fit"),
    "type": (lambda d: d.astype(np.int32), "float32"),
}


@pytest.mark.parametrize("fault", DEPTH_FAULTS)
def test_faulty_depth_is_refused(folder: Path, fault: str) -> None:
    change, text = DEPTH_FAULTS[fault]
    np.save(folder / "depth.npy", change(np.load(folder / "depth.npy")))
    with pytest.raises(PerceptionError, match=text):
        read_observation(folder)


@pytest.mark.parametrize("name", ["observation.json", "rgb.png", "depth.npy", "masks.png"])
def test_missing_and_damaged_files_are_named(folder: Path, name: str) -> None:
    (folder / name).write_bytes(b"\x89PNG nonsense")
    with pytest.raises(FileFormatError, match=name):
        read_observation(folder)
    (folder / name).unlink()
    with pytest.raises(FileFormatError, match=name):
        read_observation(folder)


def test_a_folder_is_asked_for(tmp_path: Path) -> None:
    with pytest.raises(FileFormatError, match="not a folder"):
        read_observation(tmp_path / "nowhere")


def test_masks_must_fit(folder: Path) -> None:
    Image.fromarray(np.ones((10, 10), np.uint8)).save(folder / "masks.png")
    with pytest.raises(PerceptionError, match="does not fit"):
        read_observation(folder)


def test_eight_bit_depth_is_refused(folder: Path) -> None:
    Image.fromarray(np.ones((240, 320), np.uint8)).save(folder / "depth.png")
    edit(folder, lambda d: d["frames"][0].update(depth="depth.png"))
    with pytest.raises(PerceptionError, match="16-bit"):
        read_observation(folder)


def test_given_masks_need_masks() -> None:
    bare = observed(SCENE, POSE).frames[0]
    with pytest.raises(PerceptionError, match="given masks"):
        GivenMasks().segment(bare)
    no_ids = Frame(bare.rgb, bare.depth_m, bare.intrinsics, bare.camera_to_world)
    with pytest.raises(PerceptionError, match="instance ids"):
        InstanceSegmenter().segment(no_ids)


def test_an_id_without_a_name_is_refused() -> None:
    bare = observed(SCENE, POSE).frames[0]
    assert bare.instance_ids is not None
    broken = Frame(
        bare.rgb, bare.depth_m, bare.intrinsics, bare.camera_to_world, bare.instance_ids, ("Mug-1",)
    )
    with pytest.raises(PerceptionError, match="no name"):
        InstanceSegmenter().segment(broken)


def test_a_frame_with_depth_that_is_not_a_number_cannot_be_made() -> None:
    bare: Observation = observed(SCENE, POSE)
    depth = bare.frames[0].depth_m.copy()
    depth[0, 0] = np.nan
    with pytest.raises(PerceptionError, match="NaN"):
        Frame(bare.frames[0].rgb, depth, bare.frames[0].intrinsics, POSE)


def test_two_detections_may_not_share_a_mask(folder: Path) -> None:
    def change(data: dict[str, Any]) -> None:
        first, second = data["frames"][0]["detections"][:2]
        second["id"] = first["id"]

    edit(folder, change)
    with pytest.raises(FileFormatError, match="belongs to another detection"):
        read_observation(folder)
