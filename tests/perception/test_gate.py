from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from forestall.domain.load import shipped
from forestall.domain.model import Domain
from forestall.errors import InputError, ObservationError
from forestall.perception.gate import inspect
from forestall.perception.gate_config import GateConfig
from forestall.perception.given import GivenStateEstimator
from forestall.perception.perceiver import GraphPerceiver
from forestall.perception.segmenters import GivenMasks, InstanceSegmenter
from forestall.types.finding import Finding, refuse
from forestall.types.observation import Depth, Frame, GripperState, Observation

from .rooms import EYE, HAND, ROOM, detected, room, with_frame
from .synthetic import Solid, at, looking, observed, picture

HOUSEHOLD = shipped("household")


def refused(observation: Observation) -> set[str]:
    """Names of what refuses it."""
    return {f.what for f in inspect(observation, HOUSEHOLD) if f.refuses}


def camera(**values: Any) -> Callable[[Observation], Observation]:
    return lambda o: with_frame(o, lambda f: replace(f, intrinsics=replace(f.intrinsics, **values)))


def scaled_camera(by: float) -> Callable[[Observation], Observation]:
    def change(frame: Frame) -> Frame:
        k = frame.intrinsics
        scaled = replace(k, fx=k.fx * by, fy=k.fy * by, cx=k.cx * by, cy=k.cy * by)
        return replace(frame, intrinsics=scaled)

    return lambda o: with_frame(o, change)


def depth(change: Callable[[Depth], np.ndarray]) -> Callable[[Observation], Observation]:
    def changed(frame: Frame) -> Frame:
        return replace(frame, depth_m=np.ascontiguousarray(change(frame.depth_m), dtype=np.float32))

    return lambda o: with_frame(o, changed)


def masks(change: Callable[[np.ndarray], np.ndarray]) -> Callable[[Observation], Observation]:
    def changed(frame: Frame) -> Frame:
        assert frame.instance_ids is not None
        return replace(frame, instance_ids=np.ascontiguousarray(change(frame.instance_ids)))

    return lambda o: with_frame(o, changed)


def pose(change: Callable[[np.ndarray], np.ndarray]) -> Callable[[Observation], Observation]:
    return lambda o: with_frame(
        o, lambda f: replace(f, camera_to_world=change(f.camera_to_world.copy()))
    )


def moved(axis: int, to: float) -> Callable[[np.ndarray], np.ndarray]:
    def change(matrix: np.ndarray) -> np.ndarray:
        matrix[axis, 3] = to
        return matrix

    return change


def turned(matrix: np.ndarray) -> np.ndarray:
    matrix[:3, :3] = np.eye(3)
    return matrix


def noise(values: Depth) -> np.ndarray:
    return np.random.default_rng(1).uniform(0.5, 3.0, values.shape)


Y_UP = np.array([[1, 0, 0, 0], [0, 0, 1, 0], [0, -1, 0, 0], [0, 0, 0, 1.0]])
BROKEN: dict[str, tuple[Callable[[Observation], Observation], str]] = {
    "focal length 1e300": (camera(fx=1e300, fy=1e300), "camera"),
    "focal length 1e-300": (camera(fx=1e-300, fy=1e-300), "camera"),
    "focal length of another side": (camera(fx=600.0), "camera"),
    "no focal length": (camera(fx=float("nan")), "camera"),
    "principal point outside": (camera(cx=5000.0), "camera"),
    "intrinsics times ten": (scaled_camera(10.0), "camera"),
    "focal length times two": (camera(fx=416.0, fy=416.0), "floor"),
    "camera at 1e300": (pose(moved(0, 1e300)), "pose"),
    "camera up at 1e300": (pose(moved(2, 1e300)), "pose"),
    "camera under the floor": (pose(moved(2, -0.5)), "pose"),
    "identity": (pose(lambda m: np.eye(4)), "pose"),
    "identity rotation": (pose(turned), "pose"),
    "inverse pose": (pose(np.linalg.inv), "pose"),
    "OpenGL axes": (pose(lambda m: m @ np.diag([1.0, -1, -1, 1])), "pose"),
    "y up": (pose(lambda m: Y_UP @ m), "hand"),
    "depth constant": (depth(lambda z: np.full_like(z, 1.5)), "distances"),
    "depth upside down": (depth(lambda z: z[::-1]), "masks"),
    "depth mirrored": (depth(lambda z: z[:, ::-1]), "masks"),
    "depth halved": (depth(lambda z: z / 2), "floor"),
    "depth doubled": (depth(lambda z: z * 2), "floor"),
    "depth in millimetres": (depth(lambda z: z * 1000), "distances"),
    "depth in kilometres": (depth(lambda z: z / 1000), "distances"),
    "depth noise": (depth(noise), "distances"),
    "no depth": (depth(np.zeros_like), "distances"),
    "masks upside down": (masks(lambda m: m[::-1]), "masks"),
    "masks mirrored": (masks(lambda m: m[:, ::-1]), "masks"),
    "masks to the right": (masks(lambda m: np.roll(m, 30, axis=1)), "masks"),
    "masks to the left": (masks(lambda m: np.roll(m, -30, axis=1)), "masks"),
    "masks down": (masks(lambda m: np.roll(m, 30, axis=0)), "masks"),
    "masks up": (masks(lambda m: np.roll(m, -30, axis=0)), "masks"),
    "black": (lambda o: with_frame(o, lambda f: replace(f, rgb=f.rgb * 0)), "blank"),
    "one colour": (lambda o: with_frame(o, lambda f: replace(f, rgb=f.rgb * 0 + 90)), "blank"),
    "time": (lambda o: replace(o, time_s=float("nan")), "numbers"),
    "hand": (
        lambda o: replace(o, gripper=replace(o.gripper, position_world_m=(0.0, np.inf, 0.0))),
        "numbers",
    ),
    "held far from the hand": (
        lambda o: replace(o, gripper=replace(o.gripper, position_world_m=(-1.0, 1.0, 2.0))),
        "hand",
    ),
}


def test_a_room_passes_with_ids_and_with_masks() -> None:
    for observation in (room(), detected(room())):
        assert inspect(observation, HOUSEHOLD) == ()
        assert inspect(observation) == ()


@pytest.mark.parametrize("name", BROKEN)
def test_what_cannot_be_is_refused(name: str) -> None:
    change, what = BROKEN[name]
    assert what in refused(change(room()))


BLIND = {"depth halved", "focal length times two"}


@pytest.mark.parametrize("name", sorted(set(BROKEN) - BLIND))
def test_most_of_it_needs_no_domain(name: str) -> None:
    change, _ = BROKEN[name]
    assert any(f.refuses for f in inspect(change(room())))


@pytest.mark.parametrize(
    "eye", [(0.1, -0.9, 1.5), (-0.8, -1.5, 1.3), (0.6, -2.5, 1.7), (0.0, -0.5, 1.9)]
)
@pytest.mark.parametrize("pixels", [0.0, 1.0, 2.0])
def test_noise_of_depth_pose_and_outlines_is_no_reason(
    eye: tuple[float, float, float], pixels: float
) -> None:
    from scipy.ndimage import grey_dilation

    rng = np.random.default_rng(3)
    seen = observed(ROOM[:-1], looking(eye, (0.0, 0.3, 0.85)), time_s=1.0)
    frame = seen.frames[0]
    z = frame.depth_m.astype(np.float64)
    z = np.where(z > 0, np.maximum(z + rng.normal(size=z.shape) * 0.003 * z**2, 0.0), 0.0)
    z[rng.random(z.shape) < 0.1] = 0.0
    assert frame.instance_ids is not None
    size = 2 * int(pixels) + 1
    ids = grey_dilation(frame.instance_ids, size=(size, size))
    tilt = np.deg2rad(1.0)
    turn = np.array([[np.cos(tilt), -np.sin(tilt), 0], [np.sin(tilt), np.cos(tilt), 0], [0, 0, 1]])
    leaning = frame.camera_to_world.copy()
    leaning[:3, :3] = leaning[:3, :3] @ turn
    leaning[:3, 3] += 0.01
    noisy = replace(frame, depth_m=z.astype(np.float32), instance_ids=ids, camera_to_world=leaning)
    assert refused(replace(seen, frames=(noisy,))) == set()


def test_sizes_of_things_tell_the_scale_without_a_floor() -> None:
    table = [
        Solid("DiningTable-1", (-0.8, 0.0, 0.7), (0.8, 0.8, 0.74)),
        at("Mug-1", 0.0, 0.3, 0.74, (0.085, 0.085, 0.1), True),
        at("Plate-1", -0.3, 0.4, 0.74, (0.22, 0.22, 0.025), True),
    ]
    seen = observed(table, looking((0.0, -0.3, 1.3), (0.0, 0.4, 0.75)))
    assert refused(seen) == set()
    assert "sizes" in refused(depth(lambda z: z / 2.5)(seen))
    assert "sizes" in refused(depth(lambda z: z * 2.5)(seen))
    alone = observed(table[:2], looking((0.0, -0.3, 1.3), (0.0, 0.4, 0.75)))
    assert refused(alone) == set()
    assert "sizes" in refused(depth(lambda z: z * 10)(alone))
    assert refused(depth(lambda z: z / 10)(alone))


@pytest.mark.parametrize(("called", "size_m"), [("Egg", (0.2, 0.2, 0.13)), ("Pot", (0.05,) * 3)])
def test_one_thing_under_a_wrong_name_is_doubted_and_not_refused(
    called: str, size_m: tuple[float, float, float]
) -> None:
    """A pot that a detector calls an egg and the other way round, with nothing else to judge by."""
    table = Solid("DiningTable-1", (-0.8, 0.0, 0.7), (0.8, 0.8, 0.74))
    seen = observed(
        [table, at(f"{called}-1", 0.0, 0.3, 0.74, size_m)],
        looking((0.0, -0.3, 1.3), (0.0, 0.4, 0.75)),
    )
    assert "sizes" not in refused(seen)
    found = [f for f in inspect(seen, HOUSEHOLD, GateConfig()) if f.what == "sizes"]
    assert [f.refuses for f in found] == [False] and "miscalled" in found[0].sentence


TABLE_M = 0.74
LABORATORY = [
    Solid("DiningTable-1", (-2.0, 0.0, 0.0), (2.0, 0.8, TABLE_M)),
    at("Mug-1", 0.0, 0.3, TABLE_M, (0.085, 0.085, 0.1), True),
    at("Plate-1", -0.3, 0.4, TABLE_M, (0.22, 0.22, 0.025), True),
    at("Pot-1", 0.3, 0.4, TABLE_M, (0.2, 0.2, 0.13), True),
]
OVER_IT = looking((0.0, -0.3, 1.4), (0.0, 0.4, 0.75))


def with_size(category: str, size_m: tuple[float, float, float]) -> Domain:
    known = replace(HOUSEHOLD[category], size_m=size_m)
    return replace(HOUSEHOLD, categories={**HOUSEHOLD.categories, category: known})


STATED = with_size("DiningTable", (4.0, 0.8, TABLE_M))


def refused_by(domain: Domain, seen: Observation, factor: float) -> set[str]:
    found = inspect(depth(lambda z: z * factor)(seen), domain)
    return {f.what for f in found if f.refuses}


@pytest.mark.parametrize("factor", [0.1, 0.2, 0.3, 0.45])
def test_a_table_that_the_border_cuts_does_not_hide_that_all_else_is_too_small(
    factor: float,
) -> None:
    seen = observed(LABORATORY, OVER_IT)
    for domain in (HOUSEHOLD, STATED):
        assert refused_by(domain, seen, 1.0) == set()
        assert refused_by(domain, seen, factor) == {"sizes"}


@pytest.mark.parametrize("factor", [0.6, 0.65, 0.7, 1.4, 1.6])
def test_a_stated_height_of_furniture_tells_less_wrong_depth(factor: float) -> None:
    seen = observed(LABORATORY, OVER_IT)
    assert refused_by(STATED, seen, factor) == {"sizes"}
    assert refused_by(HOUSEHOLD, seen, factor) == set(), "nobody says how high the table is"
    (finding,) = inspect(depth(lambda z: z * factor)(seen), STATED)
    assert f"depth is {factor:.2g} times what it is" in finding.sentence


@pytest.mark.parametrize("height_m", [0.55, 0.95])
def test_a_table_of_another_height_alone_is_no_reason(height_m: float) -> None:
    moved = [s.moved((0.0, 0.0, height_m - TABLE_M)) for s in LABORATORY]
    assert refused_by(STATED, observed(moved, OVER_IT), 1.0) == set()


def test_small_things_on_a_table_of_the_stated_height_are_no_reason() -> None:
    toys = [
        LABORATORY[0],
        at("Mug-1", 0.0, 0.3, TABLE_M, (0.055, 0.055, 0.065), True),
        at("Plate-1", -0.3, 0.4, TABLE_M, (0.14, 0.14, 0.015), True),
    ]
    assert refused_by(STATED, observed(toys, OVER_IT), 1.0) == set()


def test_what_something_stands_before_is_not_too_small() -> None:
    behind = [
        LABORATORY[0],
        at("Plate-1", 0.0, 0.5, TABLE_M, (0.22, 0.22, 0.2)),
        at("Bottle-1", 0.0, 0.35, TABLE_M, (0.2, 0.02, 0.3)),
    ]
    low = looking((0.0, -0.5, 0.9), (0.0, 0.4, 0.85))
    domain = with_size("Plate", (3.0, 3.0, 1.0))
    assert "sizes" not in refused_by(domain, observed(behind, low), 1.0)
    assert "sizes" in refused_by(domain, observed(behind[:2], low), 1.0), "its size is wrong"


def test_a_thing_that_the_border_cuts_does_not_hide_that_all_else_is_too_large() -> None:
    slice_of_a_plate = at("Plate-2", 0.8, 0.4, TABLE_M, (0.22, 0.22, 0.025), True)
    seen = observed([*LABORATORY, slice_of_a_plate], OVER_IT)
    assert refused_by(HOUSEHOLD, seen, 1.0) == set()
    assert refused_by(HOUSEHOLD, seen, 2.0) == {"sizes"}


def tilted(observation: Observation, degrees: float, axis: int) -> Observation:
    """The observation with a camera that is believed to be turned about an axis of the world."""
    turn = Rotation.from_rotvec(np.deg2rad(degrees) * np.eye(3)[axis]).as_matrix()

    def change(frame: Frame) -> Frame:
        leaning = frame.camera_to_world.copy()
        leaning[:3, :3] = turn @ leaning[:3, :3]
        return replace(frame, camera_to_world=leaning)

    return with_frame(observation, change)


@pytest.mark.parametrize("axis", [0, 1])
@pytest.mark.parametrize(
    ("degrees", "said", "refuses"),
    [(0.0, False, False), (2.0, False, False), (6.0, True, False), (12.0, True, True)],
)
def test_planes_are_held_against_the_stated_gravity(
    degrees: float, axis: int, said: bool, refuses: bool
) -> None:
    found = [f for f in inspect(tilted(room(), degrees, axis)) if f.what == "pose"]
    assert bool(found) == said
    if said:
        assert f"lean by {degrees:.0f} degrees" in found[0].sentence
        assert found[0].refuses == refuses


def test_one_slope_with_nothing_that_stands_is_not_refused() -> None:
    eye = looking((0.0, -1.0, 1.2), (0.0, 0.0, 0.0))
    slope = picture([Solid("Table-1", (-4.0, -4.0, -0.02), (4.0, 4.0, 0.0))], eye)
    grain = np.random.default_rng(0).integers(0, 20, slope.rgb.shape).astype(np.uint8)
    seen = Observation((replace(slope, rgb=grain),), GripperState(None, HAND), 0.0)
    (found,) = [f for f in inspect(tilted(seen, 12.0, 0)) if f.what == "pose"]
    assert "lean" in found.sentence and not found.refuses


def test_a_table_that_leans_is_refused_and_a_slanted_thing_is_not() -> None:
    slab = Solid("DiningTable-1", (-3.0, 0.0, 0.7), (3.0, 3.0, 0.74))
    eye = looking((0.0, -0.3, 1.5), (0.0, 0.9, 0.75))
    tilt = np.deg2rad(30.0)
    turn = np.eye(4)
    turn[1:3, 1:3] = [[np.cos(tilt), -np.sin(tilt)], [np.sin(tilt), np.cos(tilt)]]
    leaning = replace(picture([slab], eye), camera_to_world=turn @ eye)
    assert "pose" in refused(Observation((leaning,), GripperState(None, HAND), 0.0))
    board = replace(leaning, instance_names=("Board-1",))
    assert refused(Observation((board,), GripperState(None, HAND), 0.0)) == set()


def test_a_mask_of_a_movable_thing_that_covers_everything_is_refused() -> None:
    def inverted(frame: Frame) -> Frame:
        mug = next(d for d in frame.detections or () if d.instance == "Mug-1")
        return replace(frame, detections=(replace(mug, mask=~mug.mask),))

    found = [f for f in inspect(with_frame(detected(room()), inverted), HOUSEHOLD) if f.refuses]
    assert any("Mug-1 covers" in f.sentence for f in found)


def test_detections_without_confidence_are_no_sight() -> None:
    assert refused(detected(room(), score=0.0)) == {"confidence"}
    some = detected(room())
    frame = some.frames[0]
    first, *rest = frame.detections or ()
    some = with_frame(some, lambda f: replace(f, detections=(replace(first, score=0.0), *rest)))
    (finding,) = inspect(some, HOUSEHOLD)
    assert finding.what == "confidence" and not finding.refuses
    perceiver = GraphPerceiver(GivenMasks(), GivenStateEstimator({}), HOUSEHOLD)
    node = perceiver.perceive(some).get(str(first.instance))
    assert node is not None and node.box_m is None
    assert perceiver.findings == (finding,)


def test_nothing_detected_is_said_and_refuses_nothing() -> None:
    bare = with_frame(detected(room()), lambda f: replace(f, detections=()))
    found = inspect(bare, HOUSEHOLD)
    assert [f.what for f in found] == ["masks"] and not found[0].refuses


def test_the_perceiver_takes_in_nothing_of_what_is_refused() -> None:
    perceiver = GraphPerceiver(InstanceSegmenter(), GivenStateEstimator({}), HOUSEHOLD)
    before = perceiver.perceive(room())
    change, _ = BROKEN["OpenGL axes"]
    with pytest.raises(ObservationError, match="camera_axes") as error:
        perceiver.perceive(replace(change(room()), time_s=3.0))
    assert isinstance(error.value, InputError) and error.value.findings == perceiver.findings
    assert perceiver.perceive(replace(room(), time_s=4.0)).relations == before.relations
    open_door = GraphPerceiver(InstanceSegmenter(), GivenStateEstimator({}), HOUSEHOLD, gate=None)
    assert open_door.perceive(change(room())).get("Mug-1") is not None


def test_limits_are_options() -> None:
    assert inspect(room(), HOUSEHOLD, GateConfig(max_height_m=1.0)) != ()


def test_a_refusal_says_what_else_there_is() -> None:
    grounds = [Finding("a", "x", 1), Finding("b", "y"), Finding("c", "z", refuses=False)]
    with pytest.raises(ObservationError, match=r"^file: frames\.1: a: x \(also: b\)$") as error:
        refuse(grounds, "file")
    assert error.value.findings == tuple(grounds)
    refuse(grounds[2:])


def test_a_picture_without_depth_is_held_against_nothing_but_its_colours() -> None:
    blind = with_frame(
        detected(room()), lambda f: replace(f, depth_m=f.depth_m * 0, colour_only=True)
    )
    assert inspect(blind, HOUSEHOLD) == ()
    black = with_frame(blind, lambda f: replace(f, rgb=f.rgb * 0))
    assert refused(black) == {"blank"}


def test_the_room_is_seen_from_the_height_that_is_stated() -> None:
    assert EYE[2, 3] == 1.5
    high = replace(room(), robot_position_world_m=(0.1, -0.9, -9.0))
    assert refused(high) == {"pose"}


def test_where_the_ground_meets_walls_without_a_mask_tells_nothing() -> None:
    corner = [
        Solid("Floor-1", (-4.0, -4.0, -0.02), (4.0, 1.2, 0.0)),
        Solid("Wall-1", (-4.0, 1.2, 0.0), (4.0, 1.25, 2.6)),
        Solid("Wall-2", (0.9, -4.0, 0.0), (0.95, 1.2, 2.6)),
        Solid("Arm-1", (0.1, -0.4, 1.15), (0.5, -0.3, 1.2)),
        Solid("Arm-2", (0.1, -0.4, 1.3), (0.5, -0.3, 1.35)),
    ]
    seen = detected(observed(corner, looking((-0.2, -0.9, 1.5), (0.5, 1.0, 0.9)), time_s=2.0))
    rng = np.random.default_rng(0)

    def floor_alone(frame: Frame) -> Frame:
        floor = tuple(d for d in frame.detections or () if d.category == "Floor")
        rgb = np.clip(frame.rgb + rng.integers(0, 20, frame.rgb.shape), 0, 255).astype(np.uint8)
        return replace(frame, detections=floor, rgb=rgb)

    alone = with_frame(seen, floor_alone)
    assert "masks" in {f.what for f in inspect(alone) if f.refuses}, "as if it were a thing"
    assert refused(alone) == set()
