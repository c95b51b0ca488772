"""A frame made from one of a similar scene is that of a full drawing, bit for bit."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np
import pytest
from room import FORWARD, KINDS, Room, Scene, mixed_room

from forestall.types.observation import Frame, Intrinsics
from forestall.worlds.kitchen.rendering import FrameMemory, make_remembering
from forestall.worlds.kitchen.rendering.changes import in_light, on_screen, windows
from forestall.worlds.kitchen.rendering.embree import EmbreeTracer
from forestall.worlds.kitchen.rendering.picture import RayRenderer
from forestall.worlds.kitchen.rendering.redrawing import RedrawingRenderer

CAMERA = Intrinsics.from_vertical_fov(161, 121, 60.0)


class Counting(RayRenderer):
    """Counts the pixels that are drawn."""

    pixels = 0

    def paint(self, shot, window, reach=None):  # type: ignore[no-untyped-def]
        rows, columns = window.size
        self.pixels += rows * columns
        return super().paint(shot, window, reach)


class Pair:
    """A scene drawn with and without memory by the same ray caster."""

    def __init__(self, room: Room, memory: FrameMemory | None = None) -> None:
        self.scene: Scene = room.build()
        scene = self.scene
        self.plain = Counting(
            EmbreeTracer(scene.model), scene.model, scene.appearance, CAMERA, threads=1
        )
        self.memory = memory or FrameMemory()
        self.remembering = RedrawingRenderer(
            self.memory, lambda: self.plain, "embree", scene.model, scene.appearance, CAMERA
        )

    def both(self) -> tuple[Frame, Frame, int]:
        """The remembering frame, the full one, and how many pixels the first drew."""
        self.scene.refresh()
        self.plain.pixels = 0
        first = self.remembering.render(self.scene.data, FORWARD)
        drawn = self.plain.pixels
        return first, self.plain.render(self.scene.data, FORWARD), drawn


def full_room() -> Room:
    room = mixed_room()
    room.add("glass", KINDS.mjGEOM_CYLINDER, (0.1, 0.2), (1.3, -0.1, -0.2), rgba=(0.5, 0.8, 1, 0.3),
             instance="Glass-1", free=True)  # fmt: skip
    return room.add("door", KINDS.mjGEOM_BOX, (0.02, 0.3, 0.3), (1.9, 0.5, 0.1), texture="wood",
                    instance="Door-1", free=True)  # fmt: skip


def same(a: Frame, b: Frame) -> bool:
    return (
        np.array_equal(a.rgb, b.rgb)
        and np.array_equal(a.depth_m, b.depth_m)
        and np.array_equal(a.instance_ids, b.instance_ids)  # type: ignore[arg-type]
        and a.instance_names == b.instance_names
    )


def edits(scene: Scene, rng: np.random.Generator) -> Iterator[None]:
    """Ever more random changes of things that are not fixed to the room."""
    model, data = scene.model, scene.data
    free = np.flatnonzero(model.geom_bodyid > 0)
    while True:
        g = int(rng.choice(free))
        first = int(model.jnt_qposadr[model.body_jntadr[model.geom_bodyid[g]]])
        match int(rng.integers(6)):
            case 0:
                data.qpos[first : first + 3] += rng.normal(0, 0.2, 3)
            case 1:
                data.qpos[first : first + 3] += rng.normal(0, 0.004, 3)
            case 2:
                data.qpos[first + 3 : first + 7] = rng.normal(size=4)
            case 3:
                model.geom_rgba[g] = [*rng.random(3), rng.choice([0.4, 1.0])]
            case 4:
                model.geom_group[g] = 4 - model.geom_group[g]
            case _:
                model.geom_size[g] *= rng.uniform(0.8, 1.25)
        yield


@pytest.mark.parametrize("seed", range(4))
def test_after_any_change_the_frame_is_that_of_a_full_drawing(seed: int) -> None:
    pair = Pair(full_room())
    pair.both()
    spared = 0
    for _, _ in zip(range(12), edits(pair.scene, np.random.default_rng(seed)), strict=False):
        found, full, drawn = pair.both()
        assert same(found, full)
        spared += CAMERA.width * CAMERA.height - drawn
    assert spared > 2 * CAMERA.width * CAMERA.height


def test_what_nobody_can_see_draws_nothing() -> None:
    pair = Pair(full_room().add("far", KINDS.mjGEOM_SPHERE, (0.05,), (-3, 0, 0), free=True))
    pair.both()
    pair.scene.data.qpos[-7] -= 0.5
    found, full, drawn = pair.both()
    assert same(found, full) and drawn == 0


def test_a_thing_more_in_the_same_room_is_drawn_where_it_shows() -> None:
    memory = FrameMemory()
    Pair(full_room(), memory).both()
    room = full_room().add("dot", KINDS.mjGEOM_SPHERE, (0.03,), (1.6, -0.7, 0.4),
                           instance="Apple-1", free=True)  # fmt: skip
    other = Pair(room, memory)
    found, full, drawn = other.both()
    assert same(found, full)
    assert 0 < drawn < CAMERA.width * CAMERA.height / 2
    assert other.both()[2] == 0
    assert "Apple-1" in found.instance_names


def test_other_names_for_the_same_things_are_another_frame_and_draw_nothing() -> None:
    memory = FrameMemory()
    one, _, _ = Pair(full_room(), memory).both()
    renamed = full_room()
    renamed.instances["can"] = "Zinc-1"
    found, full, drawn = Pair(renamed, memory).both()
    assert same(found, full) and drawn == 0
    assert one.instance_names != found.instance_names


def test_another_light_is_drawn_anew() -> None:
    pair = Pair(full_room())
    pair.both()
    pair.scene.model.light_diffuse[0] *= 0.5
    found, full, drawn = pair.both()
    assert same(found, full) and drawn == CAMERA.width * CAMERA.height


def test_frames_of_a_place_are_forgotten_with_it() -> None:
    pair = Pair(full_room(), FrameMemory(most_bytes=1))
    steps = edits(pair.scene, np.random.default_rng(0))
    for _ in range(3):
        next(steps)
        found, full, _ = pair.both()
        assert same(found, full)


def test_the_frame_cannot_be_written_to() -> None:
    scene = full_room().build()
    renderer = make_remembering("embree", scene.model, scene.appearance, CAMERA, FrameMemory())
    frame = renderer.render(scene.data, FORWARD)
    with pytest.raises(ValueError, match="read-only"):
        frame.rgb[0, 0] = 0


@pytest.mark.parametrize(
    ("middle", "half", "seen"),
    [
        ((2.0, 0, 0), 0.1, lambda b: b is not None and b[2] - b[0] < 40),
        ((0.0, 0, 0), 0.1, lambda b: b == (0, 0, CAMERA.height, CAMERA.width)),
        ((-2.0, 0, 0), 0.1, lambda b: b is None),
        ((2.0, 9, 0), 0.1, lambda b: b is None),
    ],
)
def test_where_a_box_is_seen(
    middle: tuple[float, float, float], half: float, seen: Callable[[object], bool]
) -> None:
    signs = np.array(np.meshgrid([-1, 1], [-1, 1], [-1, 1])).reshape(3, 8).T
    assert seen(on_screen(np.array(middle) + half * signs, FORWARD, CAMERA))


def test_light_is_asked_for_behind_and_beside_a_thing() -> None:
    points = np.array([[0, 0, 0], [0, 0.6, 1], [3, 0, 0], [0, 0, 3]], np.float32)
    lamp = np.array([0, 0, 2], np.float32)
    ball = (np.array([0, 0, 1], np.float32), 0.1)
    answer = in_light(points, np.full(4, 0.55, np.float32), lamp, [ball])
    assert answer.tolist() == [True, True, False, False]


def test_windows_hold_all_that_is_dirty_and_do_not_overlap_needlessly() -> None:
    dirty = np.zeros((241, 321), dtype=bool)
    dirty[3, 5] = dirty[200:240, 300:321] = dirty[90, 100] = True
    found = windows(dirty, 8)
    held = np.zeros_like(dirty)
    for (top, left, bottom, right), outer in found:
        held[top:bottom, left:right] = True
        assert outer[0] % 2 == outer[1] % 2 == 0
        assert outer[0] == max(top - 8, 0) and outer[3] == min(right + 8, 321)
    assert (held | ~dirty).all() and len(found) == 3
