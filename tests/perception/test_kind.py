from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy import ndimage

from forestall.domain.load import shipped
from forestall.embeddings.twotower import TwoTowerEncoder
from forestall.perception.kind import edge_contrast, of_its_kind
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


def test_what_is_smooth_but_for_edges_is_a_drawing_and_texture_is_none() -> None:
    assert edge_contrast(drawing()) > 2.7
    assert edge_contrast(photograph()) < 2.0
    assert of_its_kind(photograph(), None)
    assert of_its_kind(photograph()[:40, :40], 2.55)


@pytest.mark.parametrize("noise", [0.0, 6.0])
def test_the_noise_of_a_sensor_makes_no_photograph_of_a_drawing(noise: float) -> None:
    rough = drawing() + np.random.default_rng(0).normal(0, noise, drawing().shape)
    assert of_its_kind(np.clip(rough, 0, 255).astype(np.uint8), 2.55)


def test_of_a_photograph_the_shipped_encoder_tells_no_state() -> None:
    encoder = TwoTowerEncoder()
    assert encoder.reading.least_contrast is not None
    estimator = LearnedStateEstimator(encoder, shipped("household"))
    seen = room().frames[0]
    mask = np.zeros(seen.depth_m.shape, dtype=np.bool_)
    mask[80:160, 100:200] = True
    photo = replace(seen, rgb=photograph())
    found = estimator.estimate(photo, [Detection("Bowl", mask)])
    assert list(found[0].values()) == [None] * len(found[0])
    assert len(found[0]) >= 2
