from pathlib import Path

import numpy as np
import pytest

from forestall.domain.load import shipped
from forestall.errors import FileFormatError, InputError, UnknownNameError
from forestall.training import shards
from forestall.training.questions import ATTRIBUTES
from forestall.training.scenes import Artist, SceneConfig
from forestall.training.shards import PictureConfig, make_shard, read

pytestmark = pytest.mark.simulator

SMALL = PictureConfig(1, 1, 1, 1, SceneConfig(views=2, things=(6, 8)), "embree")


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("pictures")
    for split in ("train", "unseen"):
        make_shard(out, SMALL, split, 0)
    return out


def test_a_shard_holds_crops_with_what_is_true_of_them(folder: Path) -> None:
    crops = read(folder, "train")
    assert crops.pixels.shape[1:] == (80, 80, 4) and crops.pixels.dtype == np.uint8
    assert (crops.category == "").sum() == 2 and crops.frame.max() == 1
    order = list(ATTRIBUTES)
    vocabulary = shipped("household")
    for name, values in zip(crops.category.tolist(), crops.values.tolist(), strict=True):
        known = {a for a, v in zip(order, values, strict=True) if v >= 0}
        assert "temperature" not in known
        if name:
            assert known <= set(vocabulary[name].attributes)
        else:
            assert not known
    assert (crops.pixels[..., 3].reshape(len(crops.area), -1).max(axis=1) > 0).all()


def test_some_test_pictures_are_seen_through_worse_eyes_too(tmp_path: Path) -> None:
    config = PictureConfig(1, 1, 1, 1, SceneConfig(views=5, things=(6, 8), held=1.0), "embree")
    make_shard(tmp_path, config, "test", 0)
    crops = read(tmp_path, "test")
    assert set(crops.seen.tolist()) == {"", *shards.SENSED}
    assert set(crops.frame[crops.seen != ""].tolist()) == {0}
    assert crops.held.any() and not crops.held[crops.category == ""].any()
    drawn, blurred = crops.seen == "", crops.seen == "motion blur of 5 px"
    first = drawn & (crops.frame == 0) & (crops.category != "")
    assert crops.category[first].tolist() == crops.category[blurred].tolist()
    assert (crops.values[first] == crops.values[blurred]).all()
    colours, masks = crops.pixels[..., :3], crops.pixels[..., 3]
    assert (masks[first] == masks[blurred]).all()
    assert (colours[first] != colours[blurred]).any()
    outlined = crops.seen == "outlines up to 3 px off"
    assert not np.array_equal(crops.area[outlined], crops.area[first])


def test_the_same_seed_draws_the_same_pictures(folder: Path) -> None:
    artist = Artist(shipped("household"), SMALL.scene, "embree")
    first, second = list(artist.pictures(2_000_000))
    again = list(Artist(shipped("household"), SMALL.scene, "embree").pictures(2_000_000))
    assert np.array_equal(first.frame.rgb, again[0].frame.rgb)
    assert second.states == again[1].states
    assert not np.array_equal(first.frame.rgb, second.frame.rgb)


def test_nothing_else_is_true_of_what_is_broken() -> None:
    artist = Artist(
        shipped("household"), SceneConfig(views=1, things=(12, 14), broken=1.0), "embree"
    )
    (picture,) = artist.pictures(77)
    broken = [s for s in picture.states.values() if s.get("broken") == "broken"]
    assert broken and all(s == {"broken": "broken"} for s in broken)


def test_things_that_are_not_trained_on_are_drawn_too(folder: Path) -> None:
    found = set(shards.unseen_things().categories) - set(shipped("household").categories)
    assert found >= {"Jug", "Tray"}
    assert set(read(folder, "unseen").category.tolist()) & found


def test_other_options_do_not_mix_with_what_is_there(tmp_path: Path) -> None:
    shards._same_options(tmp_path, SMALL)
    with pytest.raises(InputError, match="made for 1 train scenes, now 9"):
        shards._same_options(tmp_path, PictureConfig(9, 1, 1, 1, SMALL.scene, "embree"))
    with pytest.raises(InputError, match=r"other options \(scene\)"):
        shards._same_options(tmp_path, PictureConfig(1, 1, 1, 1, SceneConfig(views=3), "embree"))


def test_bad_input(tmp_path: Path) -> None:
    with pytest.raises(UnknownNameError, match="split"):
        read(tmp_path, "validation")
    with pytest.raises(InputError, match="test: from 1"):
        PictureConfig(test=0)
    (tmp_path / "test").mkdir()
    for damage in (b"not a shard", b"PK\x03\x04 half of one"):
        (tmp_path / "test" / "000000.npz").write_bytes(damage)
        with pytest.raises(FileFormatError, match=r"000000.npz cannot be read.*remove it"):
            read(tmp_path, "test")
