"""Several judges and parts under one bound: exact, never worse than Bonferroni, monotone."""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from scipy.stats import binom

from forestall.calibration import conformal
from forestall.calibration.conformal import NOT_JUDGED
from forestall.calibration.joint import p_value, smallest_level, thresholds


@st.composite
def matrices(draw: st.DrawFn) -> npt.NDArray[np.float64]:
    """Runs and judges with many ties, and places where nothing was judged."""
    rng = np.random.default_rng(draw(st.integers(0, 2**32)))
    size = (draw(st.integers(1, 30)), draw(st.integers(1, 3)))
    found = rng.integers(0, draw(st.integers(1, 12)) + 1, size) / 12
    return np.where(rng.random(size) < draw(st.sampled_from([0.0, 0.2])), NOT_JUDGED, found)


patiently = settings(max_examples=60, deadline=None, suppress_health_check=[HealthCheck.too_slow])
LEVELS = st.floats(0.01, 0.9)
SHARES = st.lists(st.sampled_from([1 / 6, 1 / 3, 1 / 2, 1.0]), min_size=3, max_size=3)


def drawn(rng: np.random.Generator, n: int) -> npt.NDArray[np.float64]:
    """Runs of three judges: two that agree, one coarse that is often silent."""
    common = rng.normal(size=n)
    second = common + 0.3 * rng.normal(size=n)
    third = np.where(rng.random(n) < 0.4, NOT_JUDGED, np.round(rng.normal(size=n)))
    return np.column_stack([common, second, third])


def test_two_columns_by_hand() -> None:
    """Four runs and a new one that is the strangest in one column: its number is 1 / share."""
    runs = np.array([[1.0, 4.0], [2.0, 3.0], [3.0, 2.0], [4.0, 1.0]])
    assert p_value(runs, [2, 1], [0.0, NOT_JUDGED]) == 1 / 5
    # in the light one 1; of the others the ranks 1 and 2 in the heavy one are 1 at most, over 2
    assert p_value(runs, [2, 1], [NOT_JUDGED, 0.0]) == 3 / 5
    assert smallest_level(runs, [2, 1], 0) == 1 / 5
    assert thresholds(runs, [2, 1], 0.2) == (1.0, None)


def test_good_runs_without_a_score_of_a_part_do_not_fill_its_budget() -> None:
    runs = np.array([[0.5 + i / 100, NOT_JUDGED] for i in range(19)])
    assert thresholds(runs, [1, 1], 0.05) == (0.5, None)


@patiently
@given(matrices(), LEVELS)
def test_one_column_is_the_plain_quantile(runs: npt.NDArray[np.float64], level: float) -> None:
    column = runs[:, :1]
    assert thresholds(column, [1.0], level) == (conformal.threshold(column[:, 0].tolist(), level),)
    if (column < NOT_JUDGED).any():
        assert smallest_level(column, [1.0], 0) == conformal.smallest_level(len(column))


@patiently
@given(matrices(), SHARES, LEVELS)
def test_it_alarms_wherever_bonferroni_would(
    runs: npt.NDArray[np.float64], shares: list[float], level: float
) -> None:
    shares = shares[: runs.shape[1]]
    for place, line in enumerate(thresholds(runs, shares, level)):
        split = level * shares[place] / sum(shares)
        plain = conformal.threshold(runs[:, place].tolist(), split - 1e-9)
        assert plain is None or (line is not None and line >= plain)


@patiently
@given(matrices(), SHARES, st.lists(st.integers(0, 12), min_size=3, max_size=3), st.integers(0, 2))
def test_a_stranger_run_is_never_less_rare(
    runs: npt.NDArray[np.float64], shares: list[float], new: list[int], place: int
) -> None:
    columns = runs.shape[1]
    row = [x / 12 for x in new[:columns]]
    lower = list(row)
    lower[place % columns] -= 1 / 6
    assert p_value(runs, shares[:columns], lower) <= p_value(runs, shares[:columns], row)


@patiently
@given(matrices(), SHARES, LEVELS, st.lists(st.integers(-1, 13), min_size=3, max_size=3))
def test_below_any_line_is_a_p_value_of_at_most_the_level(
    runs: npt.NDArray[np.float64], shares: list[float], level: float, new: list[int]
) -> None:
    shares = shares[: runs.shape[1]]
    row = [x / 12 for x in new[: runs.shape[1]]]
    lines = thresholds(runs, shares, level)
    if any(line is not None and s < line for line, s in zip(lines, row, strict=True)):
        assert p_value(runs, shares, row) <= level + 1e-9


@pytest.mark.parametrize(("n", "level"), [(59, 0.05), (40, 0.2)])
def test_all_judges_together_keep_to_the_level(n: int, level: float) -> None:
    rng = np.random.default_rng(3)
    draws, alarms, rare = 800, 0, 0
    for _ in range(draws):
        bag = drawn(rng, n + 1)
        lines = thresholds(bag[:n], [2, 2, 1], level)
        new = bag[n].tolist()
        alarms += any(t is not None and s < t for t, s in zip(lines, new, strict=True))
        rare += p_value(bag[:n], [2, 2, 1], new) <= level
    most = binom.ppf(1 - 1e-4, draws, level)
    assert alarms <= rare <= most
    assert rare >= draws * level / 2  # the budget is spent, not saved


@patiently
@given(st.integers(1, 200), st.integers(1, 4))
def test_the_runs_that_a_level_needs_suffice(seed: int, columns: int) -> None:
    """Without ties, and whatever the columns have to do with each other."""
    rng = np.random.default_rng(seed)
    shares = rng.integers(1, 4, size=columns).tolist()
    count = sum(math.floor(s / min(shares)) for s in shares)
    n = conformal.runs_needed(0.1, count)
    assert None not in thresholds(rng.random((n, columns)), shares, 0.1)
