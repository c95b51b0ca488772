from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

from forestall.domain.load import shipped
from forestall.errors import (
    FileFormatError,
    ObservationError,
    PerceptionError,
)
from forestall.perception.folder import read_observation, write_observation
from forestall.perception.given import GivenStateEstimator
from forestall.perception.perceiver import GraphPerceiver
from forestall.perception.segmenters import GivenMasks, InstanceSegmenter
from forestall.types.observation import Frame, Observation

from .synthetic import CAMERA, Solid, at, looking, observed

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
    "category": (lambda d: detection(d).update(category="( )"), FileFormatError, "must be a word"),
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
    "attribute": (
        lambda d: detection(d).update(states={"dirtyy": "clean"}),
        FileFormatError,
        r"observation.json: frames.0.detections.1: states: .*'dirtyy': did you mean dirty",
    ),
    "value": (
        lambda d: detection(d).update(states={"dirty": "filthy"}),
        FileFormatError,
        r"observation.json: frames.0.detections.1: states: unknown value of dirty 'filthy'.*clean",
    ),
    "id that no pixel has": (
        lambda d: detection(d).update(id=77),
        FileFormatError,
        r"detections.1: .*masks.png has no pixel with the id 77; it has 1, 2, 3$",
    ),
    "misspelt category beside an instance": (
        lambda d: detection(d).update(category="Plaet"),
        FileFormatError,
        r"detections.1: instance 'Plate-1' is not a Plaet: .*no category 'Plaet', .*mean Plate\?",
    ),
    "three rows": (
        lambda d: d["frames"][0]["camera_to_world"].pop(),
        FileFormatError,
        "frames.0.camera_to_world: a 4 x 4 matrix is wanted.*this has 3 rows of 4",
    ),
    "rows of three": (
        lambda d: [row.pop() for row in d["frames"][0]["camera_to_world"]],
        FileFormatError,
        "this has 4 rows of 3",
    ),
    "a matrix in one row": (
        lambda d: d["frames"][0].update(camera_to_world=[1.0] * 16),
        FileFormatError,
        "a 4 x 4 matrix is wanted.*this is no list of rows",
    ),
    "a place of two numbers": (
        lambda d: d["gripper"].update(position_m=[1.0, 2.0]),
        FileFormatError,
        r"gripper.position_m: a place is wanted, three numbers \[x, y, z\] in metres",
    ),
    "neither id nor mask": (lambda d: detection(d).pop("id"), FileFormatError, "either"),
    "missing mask file": (
        lambda d: (detection(d).pop("id"), detection(d).update(mask="no.png")),
        FileFormatError,
        "no.png: No such file",
    ),
    "missing picture": (
        lambda d: d["frames"][0].update(rgb="no.png"),
        FileFormatError,
        "no.png: No such file",
    ),
    "no matrix": (
        lambda d: d["frames"][0].update(camera_to_world=[[2, 0, 0, 0]] * 4),
        FileFormatError,
        "frames.0.camera_to_world: the last row",
    ),
    "mirrored": (
        lambda d: [row.__setitem__(0, -row[0]) for row in d["frames"][0]["camera_to_world"]],
        FileFormatError,
        "left-handed",
    ),
    "no rotation": (
        lambda d: d["frames"][0]["camera_to_world"][0].__setitem__(0, 0.9),
        FileFormatError,
        "no rotation .* from the nearest one",
    ),
    "unit": (lambda d: d.update(depth_unit="foot"), FileFormatError, "foot.*cm"),
    "axes": (lambda d: d.update(camera_axes="unity"), FileFormatError, "opengl"),
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
    "shape": (lambda d: d[:-1], "shape"),
    "type": (lambda d: d.astype(np.int32), "whole numbers.*depth_unit"),
}


@pytest.mark.parametrize("fault", DEPTH_FAULTS)
def test_faulty_depth_is_refused(folder: Path, fault: str) -> None:
    change, text = DEPTH_FAULTS[fault]
    np.save(folder / "depth.npy", change(np.load(folder / "depth.npy")))
    with pytest.raises(FileFormatError, match=text):
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
    with pytest.raises(FileFormatError, match="does not fit"):
        read_observation(folder)


def test_eight_bit_depth_is_refused(folder: Path) -> None:
    Image.fromarray(np.ones((240, 320), np.uint8)).save(folder / "depth.png")
    edit(folder, lambda d: d["frames"][0].update(depth="depth.png"))
    with pytest.raises(FileFormatError, match="16-bit"):
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


# --- declared units and conventions -----------------------------------------------------------


def redone(folder: Path, change: Callable[[np.ndarray], np.ndarray]) -> None:
    np.save(folder / "depth.npy", change(np.load(folder / "depth.npy")))


def along_the_ray(depth: np.ndarray) -> np.ndarray:
    camera = CAMERA
    u = (np.arange(camera.width) - camera.cx) / camera.fx
    v = (np.arange(camera.height) - camera.cy) / camera.fy
    return depth * np.sqrt(1 + u[None, :] ** 2 + v[:, None] ** 2)


TURN_Y = np.array([[1, 0, 0, 0], [0, 0, 1, 0], [0, -1, 0, 0], [0, 0, 0, 1.0]])


def with_y_up(data: dict[str, Any]) -> None:
    for frame in data["frames"]:
        frame["camera_to_world"] = (TURN_Y @ frame["camera_to_world"]).tolist()
    data["gripper"]["position_m"] = (TURN_Y[:3, :3] @ data["gripper"]["position_m"]).tolist()
    data["robot_position_m"] = (TURN_Y[:3, :3] @ data["robot_position_m"]).tolist()
    data["up"] = "y"


def with_their_axes(turn: np.ndarray) -> Callable[[dict[str, Any]], None]:
    def change(data: dict[str, Any]) -> None:
        frame = data["frames"][0]
        pose = np.array(frame["camera_to_world"])
        pose[:3, :3] = pose[:3, :3] @ turn
        frame["camera_to_world"] = pose.tolist()

    return change


ROS = np.array([[0, -1, 0], [0, 0, -1], [1, 0, 0.0]])
DECLARED: dict[str, tuple[Callable[[Path], None], dict[str, Any]]] = {
    "millimetres": (lambda f: redone(f, lambda z: z * 1000), {"depth_unit": "mm"}),
    "whole millimetres": (
        lambda f: redone(f, lambda z: np.round(z * 1000).astype(np.uint16)),
        {"depth_unit": "mm"},
    ),
    "fifths": (
        lambda f: redone(f, lambda z: np.round(z * 5000).astype(np.uint16)),
        {"depth_unit": 0.0002},
    ),
    "ray": (lambda f: redone(f, along_the_ray), {"depth_kind": "ray"}),
    "opengl": (
        lambda f: edit(f, with_their_axes(np.diag([1.0, -1.0, -1.0]))),
        {"camera_axes": "opengl"},
    ),
    "ros": (lambda f: edit(f, with_their_axes(ROS)), {"camera_axes": "ros"}),
    "y up": (lambda f: edit(f, with_y_up), {}),
}


@pytest.mark.parametrize("name", DECLARED)
@pytest.mark.parametrize("of_frame", [False, True])
def test_what_is_declared_is_converted(folder: Path, name: str, of_frame: bool) -> None:
    expected, _ = read_observation(folder)
    change, declared = DECLARED[name]
    change(folder)
    edit(folder, lambda d: (d["frames"][0] if of_frame else d).update(declared))
    found, _ = read_observation(folder)
    assert np.allclose(found.frames[0].depth_m, expected.frames[0].depth_m, atol=0.0006)
    assert np.allclose(found.frames[0].camera_to_world, expected.frames[0].camera_to_world)
    assert np.allclose(found.gripper.position_world_m, expected.gripper.position_world_m)
    assert np.allclose(found.robot_position_world_m, expected.robot_position_world_m)


@pytest.mark.parametrize("name", ["millimetres", "opengl"])
def test_what_is_not_declared_is_refused_by_the_gate(folder: Path, name: str) -> None:
    DECLARED[name][0](folder)
    with pytest.raises(ObservationError, match=r"depth_unit|camera_axes") as error:
        read_observation(folder)
    assert str(folder) in str(error.value)
    assert any(f.refuses for f in error.value.findings)


def test_a_rounded_rotation_is_projected_to_the_nearest(folder: Path) -> None:
    def rounded(data: dict[str, Any]) -> None:
        frame = data["frames"][0]
        frame["camera_to_world"] = np.round(frame["camera_to_world"], 3).tolist()

    edit(folder, rounded)
    rotation = read_observation(folder)[0].frames[0].camera_to_world[:3, :3]
    assert np.allclose(rotation @ rotation.T, np.eye(3), atol=1e-12)
    assert np.allclose(rotation, POSE[:3, :3], atol=2e-3)


def test_a_byte_order_mark_is_no_fault(folder: Path) -> None:
    file = folder / "observation.json"
    file.write_text("\ufeff" + file.read_text(), encoding="utf-8")
    assert read_observation(folder)[0].time_s == 3.5


# --- kinds of masks ------------------------------------------------------------------------------


def as_npz(folder: Path, make: Callable[[np.ndarray], np.ndarray], **declared: object) -> None:
    ids = np.array(Image.open(folder / "masks.png"))
    arrays: dict[str, Any] = {}

    def change(data: dict[str, Any]) -> None:
        data.update(declared)
        frame = data["frames"][0]
        frame["masks"] = "masks.npz"
        for d in frame["detections"]:
            d["mask"] = f"m{d['id']}"
            arrays[d["mask"]] = make(ids == d.pop("id"))

    edit(folder, change)
    np.savez(folder / "masks.npz", **arrays)


MASKS: dict[str, tuple[Callable[[np.ndarray], np.ndarray], dict[str, Any]]] = {
    "bool": (lambda m: m, {}),
    "0 and 255": (lambda m: (m * 255).astype(np.uint8), {}),
    "0 and 1": (lambda m: m.astype(np.float32), {}),
    "scores": (lambda m: np.where(m, 0.97, 0.02), {"mask_kind": "scores"}),
    "strict scores": (
        lambda m: np.where(m, 0.97, 0.6),
        {"mask_kind": "scores", "mask_threshold": 0.9},
    ),
    "logits": (lambda m: np.where(m, 8.0, -8.0), {"mask_kind": "logits"}),
}


@pytest.mark.parametrize("kind", MASKS)
def test_masks_of_every_declared_kind_are_read(folder: Path, kind: str) -> None:
    expected = read_observation(folder)[0].frames[0].detections or ()
    make, declared = MASKS[kind]
    as_npz(folder, make, **declared)
    found = read_observation(folder)[0].frames[0].detections or ()
    assert [d.instance for d in found] == [d.instance for d in expected]
    assert all(np.array_equal(a.mask, b.mask) for a, b in zip(found, expected, strict=True))


BAD_MASKS: dict[str, tuple[Callable[[np.ndarray], np.ndarray], dict[str, Any], str]] = {
    "soft": (lambda m: np.where(m, 0.97, 0.02), {}, "mask_kind"),
    "logits": (lambda m: np.where(m, 8.0, -8.0), {}, "mask_kind"),
    "logits as scores": (lambda m: np.where(m, 8.0, -8.0), {"mask_kind": "scores"}, "logits"),
    "minus one": (lambda m: np.where(m, 1, -1), {}, "mask_kind"),
    "nan": (lambda m: np.where(m, 1.0, np.nan), {}, "NaN"),
    "3-D": (lambda m: m[None], {}, "shape"),
    "objects": (lambda m: np.array([m, None], dtype=object), {}, "not plain numbers"),
    "texts": (lambda m: m.astype(str), {}, "not plain numbers"),
}


@pytest.mark.parametrize("kind", BAD_MASKS)
def test_masks_that_say_nothing_sure_are_refused(folder: Path, kind: str) -> None:
    make, declared, text = BAD_MASKS[kind]
    as_npz(folder, make, **declared)
    with pytest.raises(FileFormatError, match=text) as error:
        read_observation(folder)
    place = "array 'm1'" if kind in ("objects", "texts") else "detections.0"
    assert "masks.npz" in str(error.value) and place in str(error.value)


def one_each(folder: Path, make: Callable[[np.ndarray], Image.Image], **declared: object) -> None:
    ids = np.array(Image.open(folder / "masks.png"))

    def change(data: dict[str, Any]) -> None:
        data.update(declared)
        for d in data["frames"][0]["detections"]:
            d["mask"] = f"o{d['id']}.png"
            make(ids == d.pop("id")).save(folder / d["mask"])

    edit(folder, change)


def with_alpha(mask: np.ndarray, inside: int = 255, outside: int = 0) -> Image.Image:
    white = [np.full(mask.shape, 255, np.uint8)] * 3
    alpha = np.where(mask, inside, outside).astype(np.uint8)
    return Image.fromarray(np.dstack([*white, alpha]))


PICTURES: dict[str, tuple[Callable[[np.ndarray], Image.Image], dict[str, Any]]] = {
    "alpha": (with_alpha, {}),
    "soft alpha": (lambda m: with_alpha(m, 250, 3), {"mask_kind": "alpha"}),
    "grey": (lambda m: Image.fromarray((m * 255).astype(np.uint8)), {}),
    "dark grey of 16 bit": (lambda m: Image.fromarray(m.astype(np.uint16)), {}),
    "colour on black": (
        lambda m: Image.fromarray(np.dstack([m * 9, m * 40, m * 7]).astype(np.uint8)),
        {},
    ),
}


@pytest.mark.parametrize("kind", PICTURES)
def test_a_picture_for_each_mask_is_read(folder: Path, kind: str) -> None:
    expected = read_observation(folder)[0].frames[0].detections or ()
    make, declared = PICTURES[kind]
    one_each(folder, make, **declared)
    found = read_observation(folder)[0].frames[0].detections or ()
    assert all(np.array_equal(a.mask, b.mask) for a, b in zip(found, expected, strict=True))


def test_a_soft_picture_of_a_mask_is_refused_where_nothing_is_declared(folder: Path) -> None:
    one_each(folder, lambda m: with_alpha(m, 250, 3))
    with pytest.raises(FileFormatError, match="mask_kind"):
        read_observation(folder)


def test_ids_in_colour_are_refused_with_how_to_write_them(folder: Path) -> None:
    ids = np.array(Image.open(folder / "masks.png"))
    Image.fromarray(np.dstack([ids * 9, ids * 31, ids]).astype(np.uint8)).save(folder / "masks.png")
    with pytest.raises(FileFormatError, match=r"r \+ 256"):
        read_observation(folder)


@pytest.mark.parametrize("name", ["ids.tif", "ids.npy"])
def test_large_ids_are_read_from_tiff_and_npy(folder: Path, name: str) -> None:
    ids = np.array(Image.open(folder / "masks.png")).astype(np.int32)
    large = np.where(ids > 0, ids + 70000, 0).astype(np.int32)
    if name.endswith("npy"):
        np.save(folder / name, large)
    else:
        Image.fromarray(large).save(folder / name)

    def change(data: dict[str, Any]) -> None:
        data["frames"][0]["masks"] = name
        for d in data["frames"][0]["detections"]:
            d["id"] += 70000

    edit(folder, change)
    found = read_observation(folder)[0].frames[0].detections or ()
    assert [int(d.mask.sum()) for d in found] == [
        int((ids == i).sum()) for i in sorted(set(np.unique(ids)) - {0})
    ]


# --- names ---------------------------------------------------------------------------------------

NAMES = {
    "lower case": ("countertop", "countertop-1", "CounterTop-1"),
    "a space": ("Counter Top", "Counter Top-1", "CounterTop-1"),
    "an underscore": ("counter_top", "counter_top_1", "CounterTop-1"),
    "a simulator's id": ("CounterTop", "CounterTop|+00.47|+00.95|-01.63", "CounterTop-1"),
    "a dictionary's id": ("countertop.n.01", "countertop.n.01_1", "CounterTop-1"),
    "a synonym": ("kitchen counter", "kitchen counter #4", "CounterTop-4"),
    "another script": ("Arbeitsfläche", "Arbeitsfläche-1", "Arbeitsfläche-1"),
    "something unknown": ("potted meat can", "010_potted_meat_can", "potted meat can-1"),
}


@pytest.mark.parametrize("kind", NAMES)
def test_categories_are_in_the_users_words(folder: Path, kind: str) -> None:
    category, instance, expected = NAMES[kind]
    edit(folder, lambda d: detection(d, 0).update(category=category, instance=instance))
    observation, states = read_observation(folder)
    found = (observation.frames[0].detections or ())[0]
    assert found.instance == expected
    graph = GraphPerceiver(
        GivenMasks(), GivenStateEstimator(states), shipped("household")
    ).perceive(observation)
    node = graph.get(expected)
    assert node is not None and node.box_m is not None


def test_what_is_held_has_an_id_of_any_form(folder: Path) -> None:
    edit(folder, lambda d: d["gripper"].update(holding="coffee mug|+0.1|+2.0"))
    assert read_observation(folder)[0].gripper.holding == "Mug-1"


@pytest.mark.parametrize("word", ["Plaet", "plaet", "potatoe"])
def test_a_word_that_is_nearly_a_category_is_doubted_and_taken(
    folder: Path, word: str, caplog: pytest.LogCaptureFixture
) -> None:
    near = "Potato" if word == "potatoe" else "Plate"
    edit(folder, lambda d: detection(d).update(category=word, instance="9", states={}))
    observation, _ = read_observation(folder)
    assert (observation.frames[0].detections or ())[1].category == word
    (said,) = caplog.messages
    assert (
        f"observation.json: frames.0.detections.1: the domain household has no category {word!r}"
        in (said)
    )
    assert f"did you mean {near}?" in said


def test_a_held_thing_that_is_nearly_of_a_category_is_doubted(
    folder: Path, caplog: pytest.LogCaptureFixture
) -> None:
    edit(folder, lambda d: d["gripper"].update(holding="Mgug-1"))
    assert read_observation(folder)[0].gripper.holding == "Mgug-1"
    (said,) = caplog.messages
    assert "gripper.holding: " in said and "'Mgug': did you mean Mug?" in said


@pytest.mark.parametrize("word", ["oscilloscope", "mug", "025_mug"])
def test_what_is_far_from_every_category_is_no_slip(
    folder: Path, word: str, caplog: pytest.LogCaptureFixture
) -> None:
    edit(folder, lambda d: detection(d).update(category=word, instance="9", states={}))
    read_observation(folder)
    assert caplog.messages == []
