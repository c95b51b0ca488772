from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy import ndimage

from forestall.domain.load import shipped
from forestall.embeddings.twotower import TwoTowerEncoder
from forestall.perception.kind import of_its_kind, roughness
from forestall.perception.learned import LearnedStateEstimator
from forestall.types.observation import Detection, Rgb

from .rooms import room


def drawing() -> Rgb:
    """Flat areas with the noise of a sensor, and edges."""
    return room().frames[0].rgb


def photograph() -> Rgb:
    """Texture at every scale and soft edges."""
    rng = np.random.default_rng(4)
    picture = np.full((240, 320), 120.0)
    for scale in (1, 2, 4, 8, 16, 32):
        rough = ndimage.gaussian_filter(rng.normal(0, 1, picture.shape), scale)
        picture += 12 * rough / rough.std()
    return np.repeat(np.clip(picture, 0, 255).astype(np.uint8)[:, :, None], 3, axis=2)


LIMIT = TwoTowerEncoder().reading.most_rough
"""The shipped encoder's."""


def test_what_is_smooth_but_for_edges_is_a_drawing_and_texture_is_none() -> None:
    assert LIMIT is not None
    assert roughness(drawing()) < LIMIT / 2
    assert roughness(photograph()) > 2 * LIMIT
    assert of_its_kind(photograph(), None)
    assert of_its_kind(photograph()[:40, :40], LIMIT)


@pytest.mark.parametrize("noise", [0.0, 6.0, 12.0])
def test_the_noise_of_a_sensor_makes_no_photograph_of_a_drawing(noise: float) -> None:
    rough = drawing() + np.random.default_rng(0).normal(0, noise, drawing().shape)
    assert of_its_kind(np.clip(rough, 0, 255).astype(np.uint8), LIMIT)


@pytest.mark.parametrize("noise", [0.0, 6.0])
def test_neither_noise_nor_its_size_makes_a_drawing_of_a_photograph(noise: float) -> None:
    noisy = photograph() + np.random.default_rng(0).normal(0, noise, photograph().shape)
    seen = np.clip(noisy, 0, 255).astype(np.uint8)
    assert not of_its_kind(seen, LIMIT)
    assert not of_its_kind(seen.repeat(4, axis=0).repeat(4, axis=1), LIMIT)


def test_a_photograph_with_hard_edges_is_none_either() -> None:
    seen = photograph() // 2
    seen[:, 100:220] += 120
    seen[60:90] = 250
    assert not of_its_kind(seen, LIMIT)


def test_of_a_photograph_the_shipped_encoder_tells_no_state() -> None:
    encoder = TwoTowerEncoder()
    assert encoder.reading.most_rough is not None
    estimator = LearnedStateEstimator(encoder, shipped("household"))
    seen = room().frames[0]
    mask = np.zeros(seen.depth_m.shape, dtype=np.bool_)
    mask[80:160, 100:200] = True
    photo = replace(seen, rgb=photograph())
    found = estimator.estimate(photo, [Detection("Bowl", mask)])
    assert list(found[0].values()) == [None] * len(found[0])
    assert len(found[0]) >= 2
