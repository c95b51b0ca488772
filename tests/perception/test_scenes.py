from __future__ import annotations

from dataclasses import dataclass, field
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from forestall.domain.load import shipped
from forestall.domain.truth import truth as truth_of
from forestall.errors import InputError
from forestall.perception.given import GivenStateEstimator
from forestall.perception.perceiver import GraphPerceiver
from forestall.perception.scene_dict import scene_from_dict
from forestall.perception.scenes import Conventions, Found, Hand, Picture, Scenes, found_in
from forestall.perception.segmenters import GivenMasks
from forestall.types.facts import GRIPPER, Literal, Truth
from forestall.types.graph import SceneGraph, Seen
from forestall.types.observation import Observation

from .rooms import HAND, room
from .synthetic import CAMERA

HOUSEHOLD = shipped("household")
WORDS = {"CounterTop": "kitchen counter", "Mug": "025_mug", "Bowl": "bowl"}
K = (CAMERA.fx, CAMERA.fy, CAMERA.cx, CAMERA.cy)


def things(**options: Any) -> list[Found]:
    """What a detector that speaks its own language finds in the room."""
    frame = room().frames[0]
    assert frame.instance_ids is not None
    found = []
    for i, name in enumerate(frame.instance_names):
        mask = frame.instance_ids == i
        if not mask.any():
            continue
        category = name.rsplit("-", 1)[0]
        rows, columns = np.nonzero(mask)
        box = (columns.min(), rows.min(), columns.max() + 1, rows.max() + 1)
        shown: dict[str, Any] = {"mask": mask} if not options.get("boxes") else {"box": box}
        found.append(Found(WORDS.get(category, category), id=f"{name}|7", **shown))
    return found


def perceived(observation: Observation) -> SceneGraph:
    perceiver = GraphPerceiver(GivenMasks(), GivenStateEstimator({}), HOUSEHOLD)
    return perceiver.perceive(observation)


def truth(graph: SceneGraph, text: str) -> Truth:
    return truth_of(graph, Literal.parse(text), HOUSEHOLD)


def pictured(found: list[Found], **options: Any) -> Picture:
    frame = room().frames[0]
    given: dict[str, Any] = {
        "depth": frame.depth_m,
        "intrinsics": K,
        "camera_to_world": frame.camera_to_world,
    }
    return Picture(frame.rgb, found, **(given | options))


PLATE = Hand("Plate-1|7", HAND)


def test_masks_with_depth_give_the_graph_of_the_room() -> None:
    seen = Scenes(HOUSEHOLD).scene(pictured(things()), hands=PLATE, time_s=2.0)
    graph, expected = perceived(seen), perceived_directly()
    assert {n.category for n in graph.nodes} == {n.category for n in expected.nodes}
    assert truth(graph, "inside(Bowl, Microwave)") is Truth.TRUE
    assert truth(graph, "on_top_of(Mug, CounterTop)") is Truth.TRUE
    assert truth(graph, "held_by(Plate, gripper)") is Truth.TRUE
    assert seen.robot_position_world_m[2] == 0.0


def perceived_directly() -> SceneGraph:
    from forestall.perception.segmenters import InstanceSegmenter

    perceiver = GraphPerceiver(InstanceSegmenter(), GivenStateEstimator({}), HOUSEHOLD)
    return perceiver.perceive(room())


def test_boxes_with_depth_say_where_things_are() -> None:
    seen = Scenes(HOUSEHOLD).scene(pictured(things(boxes=True)), hands=PLATE)
    assert not any(d.outlined for d in seen.frames[0].detections or ())
    graph, expected = perceived(seen), perceived_directly()
    for name in ("Mug-1", "Pot-1", "Bowl-1"):
        node, known = graph.get(name), expected.get(name)
        assert node is not None and known is not None
        assert node.centroid_m is not None and known.centroid_m is not None
        assert np.linalg.norm(np.subtract(node.centroid_m, known.centroid_m)) < 0.08


def test_without_depth_things_are_known_and_their_places_are_not() -> None:
    rgb = room().frames[0].rgb
    scenes = Scenes(HOUSEHOLD)
    seen = scenes.scene(Picture(rgb, things(boxes=True)), hands=PLATE, time_s=1.0)
    graph = perceived(seen)
    mug = graph.get("Mug-1")
    assert mug is not None and mug.seen is Seen.VISIBLE
    assert mug.centroid_m is None and mug.box_m is None
    for fact in (
        "inside(Bowl, Microwave)",
        "on_top_of(Mug, CounterTop)",
        "inside(Mug, Microwave)",
        "near(Mug-1, Bowl-1)",
        "blocking(Mug-1, Bowl-1)",
        "vacant(Microwave)",
        "vacant(Bowl)",
        "not inside(Mug-1, Bowl-1)",
    ):
        assert truth(graph, fact) is Truth.UNOBSERVED, fact
    assert truth(graph, "held_by(Plate, gripper)") is Truth.TRUE


def test_what_was_located_stays_where_it_was_in_a_picture_without_depth() -> None:
    scenes = Scenes(HOUSEHOLD)
    perceiver = GraphPerceiver(GivenMasks(), GivenStateEstimator({}), HOUSEHOLD)
    before = perceiver.perceive(scenes.scene(pictured(things()), hands=PLATE, time_s=1.0))
    rgb = room().frames[0].rgb
    after = perceiver.perceive(scenes.scene(Picture(rgb, things()), hands=PLATE, time_s=2.0))
    assert truth(after, "inside(Bowl, Microwave)") is Truth.TRUE
    assert after.relations == before.relations
    node = after.get("Mug-1")
    assert node is not None and node.box_m is not None and node.seen is Seen.REMEMBERED


def test_a_robot_without_a_hand_says_nothing_of_it() -> None:
    graph = perceived(Scenes(HOUSEHOLD).scene(pictured(things())))
    assert graph.get(GRIPPER) is None
    assert truth(graph, "held_by(Mug-1, gripper)") is Truth.UNOBSERVED


def test_two_hands_hold_two_things() -> None:
    hands = [PLATE, Hand("Mug-1|7", (0.3, 0.2, 0.95), name="left")]
    seen = Scenes(HOUSEHOLD).scene(pictured(things()), hands=hands)
    graph = perceived(seen)
    held = {(r.subject, r.object) for r in graph.relations if r.predicate == "held_by"}
    assert held == {("Plate-1", "gripper"), ("Mug-1", "left")}
    assert not graph.parents("Mug-1", HOUSEHOLD.containing)
    with pytest.raises(InputError, match="same name"):
        Scenes(HOUSEHOLD).scene(pictured([]), hands=[PLATE, PLATE])


@dataclass
class Detections:
    """Looks like `supervision.Detections`."""

    xyxy: np.ndarray
    mask: np.ndarray | None = None
    confidence: np.ndarray | None = None
    tracker_id: np.ndarray | None = None
    data: dict[str, Any] = field(default_factory=dict)


def test_detections_of_others_are_taken_as_they_are() -> None:
    found = things(boxes=True)
    names = np.array([f.category for f in found])
    boxes = np.array([f.box for f in found], dtype=float)
    frame = room().frames[0]
    bare = Scenes(HOUSEHOLD).from_detections(
        frame.rgb, Detections(boxes, data={"class_name": names})
    )
    assert [d.category for d in bare.frames[0].detections or ()][:2] == ["Bowl", "CounterTop"]
    assert bare.frames[0].colour_only
    full = Detections(
        boxes,
        np.stack([np.asarray(f.mask) for f in things()]),
        np.full(len(found), 0.9),
        np.arange(len(found)) + 5,
        {"class_name": names},
    )
    seen = Scenes(HOUSEHOLD).from_detections(
        frame.rgb,
        full,
        depth=frame.depth_m,
        intrinsics=np.array([[K[0], 0, K[2]], [0, K[1], K[3]], [0, 0, 1.0]]),
        camera_to_world=frame.camera_to_world,
        hands=Hand(None, HAND),
    )
    first = (seen.frames[0].detections or ())[0]
    assert (first.category, first.instance, first.score) == ("Bowl", "Bowl-5", 0.9)
    assert truth(perceived(seen), "inside(Bowl, Microwave)") is Truth.TRUE


def test_detections_of_nothing_are_no_fault() -> None:
    assert found_in(Detections(np.zeros((0, 4)))) == []


BAD: dict[str, tuple[Any, str]] = {
    "no boxes": (SimpleNamespace(), "xyxy must be"),
    "no names": (Detections(np.zeros((1, 4))), "class_name.* is missing"),
    "length": (
        Detections(np.zeros((2, 4)), confidence=np.ones(1), data={"class_name": ["a", "b"]}),
        "confidence has 1 entries for 2",
    ),
}


@pytest.mark.parametrize("name", BAD)
def test_other_things_are_no_detections(name: str) -> None:
    detections, text = BAD[name]
    with pytest.raises(InputError, match=text):
        found_in(detections)


def as_dict() -> dict[str, Any]:
    frame = room().frames[0]
    return {
        "rgb": frame.rgb,
        "depth": (frame.depth_m * 1000).astype(np.uint16),
        "depth_unit": "mm",
        "intrinsics": dict(zip(("fx", "fy", "cx", "cy"), K, strict=True)),
        "camera_to_world": frame.camera_to_world.tolist(),
        "detections": [
            {"category": f.category, "instance": f.id, "mask": f.mask} for f in things()
        ],
        "gripper": {"holding": "Plate-1|7", "position_m": HAND},
        "time_s": 2,
    }


def test_a_dict_is_a_scene() -> None:
    graph = perceived(scene_from_dict(Scenes(HOUSEHOLD), as_dict()))
    assert truth(graph, "inside(Bowl, Microwave)") is Truth.TRUE
    data = as_dict()
    data["detections"][0]["states"] = {"dirty": "dirty"}
    graph = perceived(scene_from_dict(Scenes(HOUSEHOLD), data))
    bowl = graph.get("Bowl-1")
    assert bowl is not None and bowl.state("dirty") == "dirty"


def test_a_dict_of_several_frames_and_hands_is_a_scene() -> None:
    data = as_dict()
    keys = ("rgb", "depth", "intrinsics", "camera_to_world", "detections")
    frame = {k: data.pop(k) for k in keys}
    data["frames"] = [frame, {"rgb": frame["rgb"], "detections": []}]
    data["gripper"] = [data["gripper"], {"holding": None, "position_m": (0, 0, 1)}]
    seen = scene_from_dict(Scenes(HOUSEHOLD), data)
    assert [f.colour_only for f in seen.frames] == [False, True]
    assert [h.name for h in seen.hands] == ["gripper", "gripper_2"]


FAULTS: dict[str, tuple[dict[str, Any], str]] = {
    "unknown field": ({"colour": 1}, "colour"),
    "near field": ({"dept": 1}, "did you mean depth"),
    "unit": ({"depth_unit": None}, "declare depth_unit"),
    "unknown unit": ({"depth_unit": "inch"}, "depth_unit 'inch'"),
    "axes": ({"camera_axes": "unity"}, "camera_axes 'unity'"),
    "up": ({"up": "w"}, "unknown up"),
    "rgb": ({"rgb": np.zeros((4, 4), np.uint8)}, "rgb must be"),
    "depth": ({"depth": np.zeros((4, 4), np.uint16)}, "depth has the shape"),
    "objects": ({"depth": np.full((240, 320), None)}, "depth must be numbers"),
    "no camera": ({"intrinsics": None}, "depth needs intrinsics"),
    "camera": ({"intrinsics": [0, 1, 2, 3]}, "intrinsics must be"),
    "no pose": ({"camera_to_world": None}, "depth needs camera_to_world"),
    "pose": ({"camera_to_world": np.ones((4, 4))}, "last row"),
    "time": ({"time_s": "now"}, "time_s must be a number"),
    "hand": ({"gripper": {"holding": None}}, "gripper: position_m is missing"),
    "hand place": ({"gripper": {"holding": None, "position_m": [0, 1]}}, "three finite"),
    "detections": ({"detections": "mug"}, "detections must be a list"),
    "category": ({"detections": [{"category": 3}]}, r"detections\.0: category must be a text"),
    "no mask": ({"detections": [{"category": "mug"}]}, r"thing 0 \(mug\): give a mask or a box"),
    "box": ({"detections": [{"category": "mug", "box": [9, 9, 5, 5]}]}, "x low, y low"),
    "box outside": ({"detections": [{"category": "mug", "box": [900, 9, 950, 50]}]}, "lies in"),
    "nan box": ({"detections": [{"category": "mug", "box": [np.nan, 9, 5, 5]}]}, "finite"),
    "score": (
        {"detections": [{"category": "mug", "box": [0, 0, 5, 5], "score": 3}]},
        "score must lie",
    ),
    "state": (
        {"detections": [{"category": "mug", "box": [0, 0, 5, 5], "states": {"open": "open"}}]},
        "attribute of Mug 'open'",
    ),
    "frames and frame": ({"frames": []}, "belong into one of the frames"),
}


@pytest.mark.parametrize("name", FAULTS)
def test_a_faulty_dict_is_refused_by_name(name: str) -> None:
    change, text = FAULTS[name]
    with pytest.raises(InputError, match=text):
        scene_from_dict(Scenes(HOUSEHOLD), as_dict() | change)


def test_declared_conventions_hold_for_every_scene_of_a_run() -> None:
    how = Conventions(depth_unit="cm", camera_axes="opengl")
    frame = room().frames[0]
    turn = np.diag([1.0, -1.0, -1.0, 1.0])
    picture = Picture(frame.rgb, things(), frame.depth_m * 100, K, frame.camera_to_world @ turn)
    seen = Scenes(HOUSEHOLD, how).scene(picture, hands=PLATE)
    assert np.allclose(seen.frames[0].camera_to_world, frame.camera_to_world)
    assert np.allclose(seen.frames[0].depth_m, frame.depth_m, atol=1e-4)


def test_a_scene_has_a_picture() -> None:
    with pytest.raises(InputError, match="at least one picture"):
        Scenes(HOUSEHOLD).scene()
