from __future__ import annotations

from dataclasses import replace

import numpy as np
import numpy.typing as npt
import pytest

from forestall.assembly.configuration import run_config
from forestall.assembly.make import make_environment, make_world, prepare
from forestall.domain.load import shipped
from forestall.errors import InputError, UnknownNameError
from forestall.sensors import DEPTH_CAMERAS, REALISTIC, Errors, Sensor, SensorPart
from forestall.sensors.masks import miscalled, moved_outlines, without
from forestall.tasks.edge import WorldsEdge
from forestall.types.episode import SkillOutcome, SkillStatus
from forestall.types.observation import Depth, Intrinsics, Observation
from forestall.types.plan import Subtask
from perception.rooms import room

CAMERA = Intrinsics(320, 240, 300.0, 300.0, 159.5, 119.5)


def flat(distance_m: float) -> Depth:
    return np.full((240, 320), distance_m, dtype=np.float32)


def spread(camera: str, distance_m: float) -> float:
    z = DEPTH_CAMERAS[camera](flat(distance_m), CAMERA, np.random.default_rng(1))
    return float(z[z > 0].std())


@pytest.mark.parametrize(
    ("camera", "distance_m", "deviation_m"),
    [
        ("realsense", 1.0, 0.08 / (300 * 0.05)),
        ("realsense", 2.0, 4 * 0.08 / (300 * 0.05)),
        ("tof", 1.0, 0.0013),
        ("tof", 3.0, 0.0027),
        ("perfect", 2.0, 0.0),
    ],
)
def test_noise_is_what_was_published(camera: str, distance_m: float, deviation_m: float) -> None:
    assert spread(camera, distance_m) == pytest.approx(deviation_m, rel=0.1, abs=1e-9)


def test_structured_light_gives_steps_that_grow_with_the_square_of_distance() -> None:
    z = DEPTH_CAMERAS["kinect"](flat(2.0), CAMERA, np.random.default_rng(1))
    steps = np.diff(np.unique(z[z > 0]))
    assert steps.min() == pytest.approx(2.0**2 / (300 * 0.075 * 8), rel=0.1)


@pytest.mark.parametrize("camera", ["kinect", "realsense", "tof"])
def test_depth_ends_at_the_range_and_is_never_negative(camera: str) -> None:
    rng = np.random.default_rng(0)
    assert not DEPTH_CAMERAS[camera](flat(0.1), CAMERA, rng).any()
    assert not DEPTH_CAMERAS[camera](flat(20.0), CAMERA, rng).any()
    assert not DEPTH_CAMERAS[camera](flat(0.0), CAMERA, rng).any()


@pytest.mark.parametrize("camera", ["kinect", "realsense"])
def test_edges_have_holes(camera: str) -> None:
    z = flat(2.0)
    z[80:160, 120:200] = 1.0
    seen = DEPTH_CAMERAS[camera](z, CAMERA, np.random.default_rng(0))
    holes = seen == 0
    beside = holes[80:160, 110:210].mean()
    assert beside > 3 * holes[:60].mean() + 0.005


def squares() -> npt.NDArray[np.int32]:
    ids = np.full((60, 80), -1, dtype=np.int32)
    ids[10:30, 10:30] = 0
    ids[35:55, 40:70] = 1
    return ids


def test_outlines_move_by_no_more_than_was_said() -> None:
    ids = squares()
    found = moved_outlines(ids, 3, np.random.default_rng(2))
    assert (found != ids).any()
    assert (found[13:27, 13:27] == 0).all()
    grown = found[:7, :7]
    assert (grown == -1).all()
    assert (moved_outlines(ids, 0, np.random.default_rng(2)) == ids).all()


def test_masks_are_missed_and_miscalled_as_often_as_was_said() -> None:
    rng = np.random.default_rng(0)
    ids = np.arange(2000, dtype=np.int32).reshape(40, 50)
    assert (without(ids, 0.05, 0, rng) < 0).mean() == pytest.approx(0.05, abs=0.02)
    names = [f"Mug-{i}" for i in range(2000)]
    found = miscalled(names, ["Mug", "Cup"], 0.02, rng)
    wrong = [n for n in found if n.startswith("Cup-")]
    assert len(wrong) / 2000 == pytest.approx(0.02, abs=0.01)
    assert len(set(found)) == 2000
    assert miscalled(["Floor-1"], ["Mug", "Cup"], 1.0, rng) == ("Floor-1",)


def test_masks_of_few_pixels_are_missing() -> None:
    found = without(squares(), 0.0, 500, np.random.default_rng(0))
    assert set(np.unique(found)) == {-1, 1}


def equal(one: Observation, two: Observation) -> bool:
    pairs = zip(one.frames, two.frames, strict=True)
    return all(
        np.array_equal(a.depth_m, b.depth_m)
        and np.array_equal(a.rgb, b.rgb)
        and np.array_equal(a.camera_to_world, b.camera_to_world)
        and np.array_equal(np.asarray(a.instance_ids), np.asarray(b.instance_ids))
        and a.instance_names == b.instance_names
        for a, b in pairs
    )


def test_the_same_run_has_the_same_errors_and_another_look_has_others() -> None:
    everything = replace(REALISTIC, gain=0.1, blur_px=3, colour_noise=4.0)
    sensor = Sensor(everything, ["Mug", "Bowl", "Pot"])
    sensor.reset(7)
    first, second = sensor.sense(room()), sensor.sense(room())
    sensor.reset(7)
    assert equal(sensor.sense(room()), first)
    assert not equal(first, second)
    sensor.reset(8)
    assert not equal(sensor.sense(room()), first)


def test_a_sensor_without_errors_changes_nothing() -> None:
    sensor = Sensor(Errors())
    assert equal(sensor.sense(room()), room())


def test_pose_errors_have_the_size_that_was_said() -> None:
    sensor = Sensor(Errors(pose_cm=1.0, pose_deg=1.0))
    true = room().frames[0].camera_to_world
    off, turned = [], []
    for _ in range(200):
        seen = sensor.sense(room()).frames[0].camera_to_world
        off.append(((seen[:3, 3] - true[:3, 3]) ** 2).sum())
        cosine = (np.trace(seen[:3, :3] @ true[:3, :3].T) - 1) / 2
        turned.append(np.degrees(np.arccos(np.clip(cosine, -1, 1))) ** 2)
    assert np.sqrt(np.mean(off)) == pytest.approx(0.01, rel=0.15)
    assert np.sqrt(np.mean(turned)) == pytest.approx(1.0, rel=0.15)


@pytest.mark.parametrize(
    "wrong", [{"missed": 1.5}, {"outline_px": -1}, {"pose_cm": -1.0}, {"gain": float("nan")}]
)
def test_errors_that_cannot_be_are_named(wrong: dict[str, float]) -> None:
    with pytest.raises(InputError, match=next(iter(wrong))):
        Errors(**wrong)  # type: ignore[arg-type]


def test_an_unknown_camera_is_answered_with_the_known_ones() -> None:
    with pytest.raises(UnknownNameError, match="realsense"):
        Errors(depth="realsens")


def test_a_run_through_a_sensor_without_identities_has_an_edge() -> None:
    config = run_config("heat-potato", world="symbolic", states="oracle", sensor="realistic")
    prepared = prepare(config)
    loaded = prepared.loaded
    with make_world(config, loaded.domain).open(loaded.task.scene, loaded.domain) as world:
        assert isinstance(make_environment(prepared, world), WorldsEdge)
        plain = prepare(run_config("heat-potato", world="symbolic", states="oracle"))
        assert make_environment(plain, world) is world.environment


def test_a_detector_confuses_movable_things_only() -> None:
    part = SensorPart(Errors(mislabelled=1.0), shipped("household"))
    world = part.around(_Still())
    names = world.observe().frames[0].instance_names
    assert "Floor-1" in names and "CounterTop-1" in names
    assert "Mug-1" not in names and "Plate-1" not in names


class _Still:
    """A world in which nothing happens."""

    time_s = 0.0

    def observe(self, focus: object = ()) -> Observation:
        return room()

    scan = observe

    def reset(self, seed: int) -> None: ...
    def approach(self, name: str) -> float:
        return 0.0

    def execute(self, subtask: Subtask) -> SkillOutcome:
        return SkillOutcome(SkillStatus.REFUSED, 0.0, "nothing happens here")

    def hold(self) -> None: ...
    def close(self) -> None: ...
