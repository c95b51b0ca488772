from __future__ import annotations

from dataclasses import replace

import numpy as np

from forestall.perception.gate_config import WatchConfig
from forestall.perception.gate_time import SenseWatch
from forestall.types.observation import Frame, GripperState, Observation

from .rooms import EYE, ROOM, room, with_frame
from .synthetic import looking, observed


def later(seen: Observation, seconds: float, noise: int | None = None) -> Observation:
    """The same scene some time later; with `noise`, as a real camera would show it."""
    seen = replace(seen, time_s=seen.time_s + seconds)
    if noise is None:
        return seen
    rng = np.random.default_rng(noise)

    def change(frame: Frame) -> Frame:
        rgb = frame.rgb ^ rng.integers(0, 2, frame.rgb.shape).astype(np.uint8)
        return replace(frame, rgb=rgb)

    return with_frame(seen, change)


def shifted(seen: Observation, x: float) -> Observation:
    def change(frame: Frame) -> Frame:
        pose = frame.camera_to_world.copy()
        pose[0, 3] += x
        return replace(frame, camera_to_world=pose)

    return with_frame(seen, change)


def refusing(watch: SenseWatch, seen: Observation) -> list[str]:
    return [f.what for f in watch.look(seen) if f.refuses]


def test_a_scene_that_goes_on_gives_no_findings() -> None:
    watch = SenseWatch()
    for step in range(5):
        eye = looking((0.1 * step, -0.9, 1.5), (0.0, 0.3, 0.85))
        seen = observed(ROOM[:-1], eye, time_s=1.0 * step)
        assert watch.look(seen) == ()
        assert watch.look(seen) == ()  # a second look at the same moment


def test_the_same_picture_while_time_passes_is_believed_twice() -> None:
    watch = SenseWatch(WatchConfig(most_equal=2))
    assert watch.look(room()) == ()
    (warning,) = watch.look(later(room(), 3.0))
    assert warning.what == "frozen" and not warning.refuses
    assert refusing(watch, later(room(), 6.0)) == ["frozen"]
    assert refusing(watch, later(room(), 9.0, noise=1)) == []
    assert watch.look(later(room(), 12.0, noise=2)) == ()


def test_the_same_picture_while_the_camera_moves_is_frozen_at_once() -> None:
    watch = SenseWatch()
    watch.look(room())
    assert refusing(watch, shifted(later(room(), 1.0), 0.05)) == ["frozen"]


def test_two_directions_of_one_observation_cannot_look_alike() -> None:
    seen = room()
    twice = replace(seen, frames=(seen.frames[0], shifted(seen, 0.3).frames[0]))
    assert refusing(SenseWatch(), twice) == ["frozen"]


def test_time_does_not_run_backwards() -> None:
    watch = SenseWatch()
    watch.look(room())
    assert refusing(watch, later(room(), -1.0)) == ["time"]
    assert refusing(watch, replace(room(), time_s=float("nan"))) == ["time"]
    assert refusing(watch, later(room(), 1.0, noise=1)) == []
    watch.reset()
    assert watch.look(later(room(), -1.5)) == ()


def test_a_camera_does_not_leap() -> None:
    watch = SenseWatch()
    watch.look(observed(ROOM[:-1], EYE, time_s=1.0))
    far = looking((30.0, -0.9, 1.5), (29.9, 0.3, 0.85))
    there = [s.moved((30.0, 0.0, 0.0)) for s in ROOM[:-1]]
    assert "jump" in refusing(watch, observed(there, far, time_s=1.5))


def test_things_that_nothing_moved_do_not_jump_together() -> None:
    watch = SenseWatch()
    watch.look(observed(ROOM[:-1], EYE, time_s=1.0))
    wrong = shifted(observed(ROOM[:-1], EYE, time_s=2.0), 0.6)
    found = watch.look(with_frame(wrong, lambda f: replace(f, rgb=f.rgb ^ np.uint8(1))))
    assert [(f.what, f.refuses) for f in found] == [("jump", True)]
    assert "Mug-1" in found[0].sentence


def test_one_thing_may_have_been_moved_by_somebody() -> None:
    watch = SenseWatch()
    hand = GripperState(None, (0.0, -2.0, 1.0))
    mug = next(s for s in ROOM if s.id == "Mug-1")
    first = replace(observed(ROOM[:-1], EYE, time_s=1.0), gripper=hand)
    others = [s for s in ROOM[:-1] if s is not mug]
    second = observed([*others, mug.moved((-0.9, 0.0, 0.0))], EYE, time_s=2.0)
    watch.look(first)
    (finding,) = watch.look(replace(second, gripper=hand))
    assert finding.what == "jump" and not finding.refuses and "Mug-1" in finding.sentence


def test_what_the_hand_holds_may_be_anywhere() -> None:
    watch = SenseWatch()
    watch.look(room())
    carried = [*ROOM[:-1], ROOM[-1].moved((-0.5, 0.0, 0.0))]
    seen = observed(carried, EYE, holding="Plate-1", hand=(-0.25, -0.3, 1.1), time_s=3.0)
    assert watch.look(seen) == ()


def test_a_graph_without_pictures_has_a_clock_only() -> None:
    from forestall.types.graph import SceneGraph

    hand = GripperState(None, (0.0, 0.0, 0.0))
    watch = SenseWatch()
    for time_s in (0.0, 1.0, 2.0, 3.0):
        assert watch.look(Observation((), hand, time_s, graph=SceneGraph(()))) == ()
    assert refusing(watch, Observation((), hand, 1.0, graph=SceneGraph(()))) == ["time"]
