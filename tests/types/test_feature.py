"""Image features as bytes."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from forestall.errors import InputError
from forestall.types.feature import quantised, unquantised, whole_numbers

vectors = arrays(
    np.float32, st.integers(1, 64), elements=st.floats(-10, 10, width=32, allow_subnormal=False)
).filter(lambda v: float(np.abs(v).max()) > 1e-3)


@given(vectors)
def test_the_direction_survives(vector: np.ndarray) -> None:
    back = unquantised(quantised(vector))
    assert back.dtype == np.float32
    assert np.linalg.norm(back) == pytest.approx(1.0, abs=1e-6)
    # each number is off by half a step at most
    step = np.abs(vector).max() / 127 / np.linalg.norm(vector)
    off = 0.5 * step * np.sqrt(len(vector))
    assert float(back @ (vector / np.linalg.norm(vector))) >= 1.0 - off**2 - 1e-5


@given(vectors, st.sampled_from((0.25, 2.0, 64.0)))
def test_length_does_not_count_and_twice_is_once(vector: np.ndarray, scale: float) -> None:
    stored = quantised(vector)
    assert len(stored) == len(vector)
    assert quantised(vector * np.float32(scale)) == stored
    assert quantised(unquantised(stored)) == stored


def test_the_rule() -> None:
    assert whole_numbers(quantised([0.5, -0.25, 0.0, 0.003])).tolist() == [127, -64, 0, 1]
    assert unquantised(bytes([3, 252])).tolist() == pytest.approx([0.6, -0.8])


@pytest.mark.parametrize(
    "bad", [[], [0.0, 0.0], [1.0, float("nan")], [float("inf"), 1.0], [[1.0, 2.0]]]
)
def test_no_direction_no_feature(bad: list[float]) -> None:
    with pytest.raises(InputError, match="one row of finite numbers"):
        quantised(bad)


@pytest.mark.parametrize("bad", [b"", bytes(8)])
def test_bytes_without_a_direction(bad: bytes) -> None:
    for read in (whole_numbers, unquantised):
        with pytest.raises(InputError, match="no direction"):
            read(bad)
