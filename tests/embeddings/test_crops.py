import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from forestall.embeddings.crops import INPUT_PIXELS, bounding_box, crop, crops, whole


def scene(x0: int, y0: int, x1: int, y1: int) -> tuple[np.ndarray, np.ndarray]:
    """A red rectangle, masked, on black."""
    rgb = np.zeros((480, 640, 3), dtype=np.uint8)
    mask = np.zeros((480, 640), dtype=bool)
    rgb[y0:y1, x0:x1] = (200, 0, 0)
    mask[y0:y1, x0:x1] = True
    return rgb, mask


def test_the_object_fills_the_crop_but_for_the_margin() -> None:
    found = crop(*scene(100, 100, 180, 160))
    assert found.shape == (INPUT_PIXELS, INPUT_PIXELS, 4)
    inside = found[..., 3] > 127
    assert inside.any(axis=0).sum() == pytest.approx(INPUT_PIXELS / 1.25, abs=1.5)
    assert inside.any(axis=1).sum() == pytest.approx(INPUT_PIXELS / 1.25 * 60 / 80, abs=1.5)
    assert (found[..., 0][inside] > 100).all()
    assert found[2, 2, 0] == 0


def test_beyond_the_frame_is_grey_and_not_masked() -> None:
    found = crop(*scene(0, 0, 80, 80))
    assert found[1, 1].tolist() == [127, 127, 127, 0]
    assert found[INPUT_PIXELS // 2, INPUT_PIXELS // 2].tolist() == [200, 0, 0, 255]


def test_the_colour_does_not_depend_on_the_mask() -> None:
    rgb = np.random.default_rng(0).integers(0, 255, (480, 640, 3), dtype=np.uint8)
    ring = np.zeros((480, 640), dtype=bool)
    ring[100:200, 100:200] = True
    full = crop(rgb, ring)
    ring[110:190, 110:190] = False
    assert np.array_equal(crop(rgb, ring)[..., :3], full[..., :3])


def test_an_empty_mask_gives_a_grey_crop() -> None:
    rgb = np.zeros((480, 640, 3), dtype=np.uint8)
    found = crop(rgb, np.zeros((480, 640), dtype=bool))
    assert bounding_box(np.zeros((480, 640), dtype=bool)) is None
    assert (found[..., :3] == 127).all() and (found[..., 3] == 0).all()


@given(st.integers(0, 639), st.integers(0, 479), st.integers(1, 640), st.integers(1, 480))
def test_any_box_can_be_cut(x: int, y: int, width: int, height: int) -> None:
    rgb, mask = scene(x, y, min(x + width, 640), min(y + height, 480))
    found = crop(rgb, mask)
    assert found.shape == (INPUT_PIXELS, INPUT_PIXELS, 4)
    assert (found[..., 3] > 0).any()


def test_a_whole_frame_keeps_its_shape() -> None:
    rgb = np.full((480, 640, 3), 80, dtype=np.uint8)
    found = whole(rgb)
    assert (found[0, :, 3] == 0).all() and (found[0, :, :3] == 127).all()
    assert (found[INPUT_PIXELS // 2, 1:-1] == (80, 80, 80, 255)).all()


def test_many_masks_are_cut_as_each_alone() -> None:
    rgb, one = scene(10, 10, 50, 90)
    _, other = scene(300, 200, 330, 260)
    both = crops(rgb, [one, other])
    assert np.array_equal(both[0], crop(rgb, one)) and np.array_equal(both[1], crop(rgb, other))
