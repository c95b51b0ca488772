"""Remembered frames: the same pictures, drawn once, and never those of another state."""

from __future__ import annotations

import numpy as np
import pytest

from forestall.tasks.files import load_task
from forestall.types.observation import Frame, Intrinsics, Observation
from forestall.types.plan import Subtask
from forestall.worlds.kitchen.environment import KitchenEnvironment
from forestall.worlds.kitchen.rendering import FrameMemory
from forestall.worlds.kitchen.rendering.drawn import Drawn

SMALL = Intrinsics.from_vertical_fov(96, 72, 60.0)


def kitchen(frames: FrameMemory | None) -> KitchenEnvironment:
    loaded = load_task("make-coffee")
    return KitchenEnvironment(loaded.task.scene, loaded.domain, intrinsics=SMALL, frames=frames)


def same(a: Observation, b: Observation) -> bool:
    return len(a.frames) == len(b.frames) and all(
        np.array_equal(x.rgb, y.rgb)
        and np.array_equal(x.depth_m, y.depth_m)
        and np.array_equal(x.instance_ids, y.instance_ids)  # type: ignore[arg-type]
        for x, y in zip(a.frames, b.frames, strict=True)
    )


def test_a_run_shows_the_same_with_and_without_memory_while_things_move_and_change() -> None:
    frames = FrameMemory()
    plain, first, second = kitchen(None), kitchen(frames), kitchen(frames)
    steps = ("pick_up(Mug)", "put_in(Mug, Sink)", "toggle_on(Faucet)", "open_obj(Fridge)")
    for env in (plain, first, second):
        env.reset(11)
    assert same(plain.scan(), first.scan())
    drawn = frames.misses
    assert same(first.scan(), second.scan())
    assert (frames.misses, frames.hits) == (drawn, 2 * drawn)
    for step in map(Subtask.parse, steps):
        for env in (plain, first, second):
            env.execute(step)
        before = frames.misses
        a, b, c = (env.observe() for env in (plain, first, second))
        assert same(a, b) and same(b, c)
        assert frames.misses == before + len(a.frames)  # a changed state is drawn anew, once


def test_another_room_is_another_picture() -> None:
    frames = FrameMemory()
    env = kitchen(frames)
    env.reset(11)
    one = env.observe()
    env.reset(12)
    assert not same(one, env.observe())
    assert frames.hits == 0


def test_what_was_not_asked_for_the_longest_time_is_forgotten() -> None:
    def frame(value: int) -> Frame:
        return Frame(
            np.full((72, 96, 3), value, np.uint8), np.ones((72, 96), np.float32), SMALL, np.eye(4)
        )

    size = 72 * 96 * 7
    memory = FrameMemory(most_bytes=2 * size)
    memory.keep(b"a", Drawn(frame(1)))
    memory.keep(b"b", Drawn(frame(2)))
    assert memory.get(b"a") is not None
    memory.keep(b"c", Drawn(frame(3)))
    assert memory.get(b"b") is None
    assert memory.get(b"a") is not None and memory.get(b"c") is not None


def test_what_is_held_is_counted() -> None:
    large = np.zeros((720, 960, 3), np.uint8)
    part = Frame(large[:72, :96], np.ones((72, 96), np.float32), SMALL, np.eye(4))
    assert Drawn(part).nbytes == large.nbytes + 72 * 96 * 4


def test_what_is_kept_has_a_block_of_its_own_and_stays_as_it_is() -> None:
    large = np.arange(720 * 960 * 3, dtype=np.uint32).astype(np.uint8).reshape(720, 960, 3)
    ids = np.full((72, 96), 3, np.int32)
    part = Frame(large[:72, :96], np.ones((72, 96), np.float32), SMALL, np.eye(4), ids)
    kept = FrameMemory().keep(b"a", Drawn(part))
    assert np.array_equal(kept.frame.rgb, part.rgb)
    assert np.array_equal(kept.frame.depth_m, part.depth_m)
    assert kept.frame.instance_ids is not None and np.array_equal(kept.frame.instance_ids, ids)
    assert kept.nbytes == 72 * 96 * (3 + 4 + 4)
    large[:] = 0
    assert kept.frame.rgb.any(), "no view of what it was made from"
    with pytest.raises(ValueError, match="read-only"):
        kept.frame.rgb[:] = 0
