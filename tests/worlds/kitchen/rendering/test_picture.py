# mypy: disable-error-code="arg-type, union-attr"
"""How the picture looks: light, glow, textures, smooth edges, transparency, determinism."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import numpy.typing as npt
import pytest
from room import CAMERA, FORWARD, KINDS, Room, mixed_room, wall

from forestall.errors import InputError, UnknownNameError
from forestall.worlds.kitchen.rendering import TEXTURES, Appearance, make_renderer
from forestall.worlds.kitchen.rendering.embree import EmbreeTracer
from forestall.worlds.kitchen.rendering.picture import RayRenderer
from forestall.worlds.kitchen.rendering.pixels import discontinuities
from forestall.worlds.kitchen.rendering.textures import texture
from forestall.worlds.kitchen.rendering.timing import frame_times

BOTH = pytest.mark.parametrize("name", ["embree", "rays"])


@BOTH
def test_same_state_gives_the_same_bits(name: str) -> None:
    scene = mixed_room().build()
    renderer = scene.renderer(name)
    first, second = renderer.render(scene.data, FORWARD), renderer.render(scene.data, FORWARD)
    fresh = scene.frame(name)
    for other in (second, fresh):
        assert np.array_equal(first.rgb, other.rgb)
        assert np.array_equal(first.depth_m, other.depth_m)
        assert np.array_equal(first.instance_ids, other.instance_ids)


def test_number_of_threads_does_not_matter() -> None:
    scene = mixed_room().build()
    frames = [
        RayRenderer(EmbreeTracer(scene.model), scene.model, scene.appearance, CAMERA, threads=n)
        .render(scene.data, FORWARD)
        .rgb
        for n in (1, 3)
    ]
    assert np.array_equal(*frames)


def test_what_was_rendered_before_does_not_matter() -> None:
    scene = mixed_room().build()
    renderer = scene.renderer()
    renderer.render(scene.data, FORWARD)
    scene.data.qpos[0] += 0.05
    scene.refresh()
    assert np.array_equal(renderer.render(scene.data, FORWARD).rgb, scene.frame().rgb)


@BOTH
def test_glowing_geoms_are_bright_without_light(name: str) -> None:
    room = wall(Room())
    orange = (1.0, 0.4, 0.1, 1.0)
    room.add("burner_glow", KINDS.mjGEOM_BOX, (0.05, 0.2, 0.2), (1.5, 0.4, 0), rgba=orange)
    room.add("burner", KINDS.mjGEOM_BOX, (0.05, 0.2, 0.2), (1.5, -0.4, 0), rgba=orange)
    rgb = room.light((-3, 0, 0.5)).build().frame(name).rgb.astype(int)
    glowing, dull = rgb[60, 50], rgb[60, 110]
    assert glowing[0] > 235
    assert glowing.sum() > dull.sum() + 60


def test_material_emission_and_colour_win_over_the_geom() -> None:
    room = wall(Room())
    lit = room.spec.add_material(name="lit", rgba=[0.1, 0.9, 0.1, 1])
    lit.emission = 1.0
    room.add("screen", KINDS.mjGEOM_BOX, (0.05, 0.3, 0.3), (1.5, 0, 0), rgba=(1, 0, 0, 1))
    room.spec.geom("screen").material = "lit"
    red, green, _ = room.build().frame().rgb[60, 80].astype(int)
    assert green > 200
    assert green > red + 60


@BOTH
def test_light_casts_a_shadow(name: str) -> None:
    room = wall(Room(), rgba=(0.8, 0.8, 0.8, 1))
    room.add("block", KINDS.mjGEOM_BOX, (0.02, 0.25, 0.1), (1.6, 0, 0.2))
    rgb = room.light((0.3, 0, 1.2)).build().frame(name).rgb.astype(int)
    shade, lit = rgb[70, 80].sum(), rgb[70, 20].sum()
    assert shade < 0.85 * lit
    assert shade > 60


def test_colour_change_shows_without_moving_anything() -> None:
    scene = mixed_room().build()
    renderer = scene.renderer()
    before = renderer.render(scene.data, FORWARD)
    scene.model.geom("egg").rgba[:] = (0.1, 0.1, 0.9, 1)
    after = renderer.render(scene.data, FORWARD)
    egg = before.instance_ids == before.instance_names.index("Egg-1")
    changed = (before.rgb != after.rgb).any(axis=-1)
    assert changed[egg].mean() > 0.9
    assert np.array_equal(before.depth_m, after.depth_m)
    near = egg.copy()
    for axis, shift in ((0, 1), (0, -1), (1, 1), (1, -1)):
        near |= np.roll(egg, shift, axis)
    assert not changed[~near].any()


def test_smooth_edges_leave_depth_and_ids_of_the_centre_ray(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    scene = mixed_room().build()
    smooth = scene.frame()
    monkeypatch.setattr(RayRenderer, "_smooth_edges", lambda *_: None)
    hard = scene.frame()
    assert np.array_equal(smooth.depth_m, hard.depth_m)
    assert np.array_equal(smooth.instance_ids, hard.instance_ids)
    differs = (smooth.rgb != hard.rgb).any(axis=-1)
    assert differs.any()
    assert hard.instance_ids is not None
    flat = np.zeros((*hard.depth_m.shape, 3), np.float32)
    step = discontinuities(hard.instance_ids + 1, flat + 0.6, hard.depth_m)
    assert differs[step].mean() > 0.5


def test_edge_pixels_lie_between_both_sides() -> None:
    room = wall(Room(), rgba=(0.9, 0.9, 0.9, 1)).light((0, 0, 1))
    half = np.deg2rad(8) / 2
    room.add("bar", KINDS.mjGEOM_BOX, (0.01, 0.5, 0.3), (1.9, 0, 0), rgba=(0.05, 0.05, 0.05, 1),
             quat=(np.cos(half), np.sin(half), 0, 0), instance="Bar-1")  # fmt: skip
    rgb = room.build().frame().rgb[..., 0].astype(int)
    column = rgb[10:60, 90]
    between = (column > column.min() + 20) & (column < column.max() - 20)
    assert 1 <= between.sum() <= 6


@BOTH
def test_transparent_geom_lets_the_wall_through(name: str) -> None:
    def centre(alpha: float) -> npt.NDArray[np.int_]:
        room = wall(Room(), rgba=(0.1, 0.2, 0.9, 1)).light((0.2, 0, 1))
        room.add("pane", KINDS.mjGEOM_BOX, (0.01, 0.4, 0.4), (1.5, 0, 0),
                 rgba=(0.9, 0.2, 0.1, alpha), instance="Pane-1")  # fmt: skip
        frame = room.build().frame(name)
        assert frame.depth_m[60, 80] == pytest.approx(1.49, abs=1e-4)
        assert frame.instance_ids is not None
        assert frame.instance_ids[60, 80] == 0
        colour: npt.NDArray[np.int_] = frame.rgb[60, 80].astype(int)
        return colour

    solid, glass = centre(1.0), centre(0.3)
    assert glass[2] > solid[2] + 40
    assert glass[0] < solid[0] - 30


@pytest.mark.parametrize("kind", TEXTURES)
def test_textures_vary_but_keep_the_colour(kind: str) -> None:
    look = {"rgba": (0.6, 0.5, 0.4, 1)}
    plain = wall(Room(), 0.4, **look).light((0, 0, 0.5)).build().frame().rgb.astype(float)
    drawn = (
        wall(Room(), 0.4, texture=kind, **look).light((0, 0, 0.5)).build().frame().rgb.astype(float)
    )
    assert np.abs(drawn.mean((0, 1)) - plain.mean((0, 1))).max() < 40
    if kind != "ceramic":
        assert (drawn - plain).std() > 0.7


def test_texture_is_tileable_and_has_mipmaps() -> None:
    wood = texture("wood")
    at = np.array([[0.31, 0.77]], np.float32)
    fine = np.full(1, 1e-4, np.float32)
    again = wood.sample(at + np.float32(3 * wood.extent_m), fine)
    assert wood.sample(at, fine) == pytest.approx(again, abs=2e-3)
    coarse = wood.sample(at, np.full(1, 10.0, np.float32))
    assert coarse == pytest.approx(wood.texels[: 512 * 512].mean(), abs=1e-3)


def test_room_is_neither_black_nor_burnt_out() -> None:
    rgb = mixed_room().build().frame().rgb
    assert (rgb.max(axis=-1) < 12).mean() < 0.01
    assert (rgb.min(axis=-1) > 250).mean() < 0.01
    assert 70 < rgb.mean() < 200


def test_unknown_names_and_wrong_sizes_are_refused() -> None:
    scene = mixed_room().build()
    with pytest.raises(UnknownNameError, match="did you mean embree"):
        make_renderer("embre", scene.model, scene.appearance, CAMERA)
    short = Appearance((), np.full(1, -1, np.int32), (None,))
    with pytest.raises(InputError, match="describes 1 geoms"):
        make_renderer("embree", scene.model, short, CAMERA)
    with pytest.raises(InputError, match="unknown texture 'marble'"):
        replace(short, texture=("marble",))
    with pytest.raises(InputError, match="beyond instance_names"):
        replace(short, geom_instance=np.zeros(1, np.int32))
    with pytest.raises(InputError, match="has shape"):
        replace(short, texture=(None, None))


def test_frame_times_are_positive_and_as_many_as_asked_for() -> None:
    scene = mixed_room().build()
    times = frame_times(scene.renderer(), scene.data, FORWARD, 2)
    assert len(times) == 2
    assert min(times) > 0
