"""One judge: hand-computed values, a public conformal library, coverage, monotonicity."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from scipy.stats import binom

from forestall.calibration.conformal import (
    NOT_JUDGED,
    extreme,
    p_value,
    runs_needed,
    smallest_level,
    threshold,
)
from forestall.errors import InputError

NINETEEN = [0.50 + 0.02 * i for i in range(19)]
SCORES = st.lists(
    st.floats(0, 1).map(lambda x: round(x, 2)) | st.just(NOT_JUDGED), min_size=1, max_size=60
)
patiently = settings(max_examples=60, deadline=None, suppress_health_check=[HealthCheck.too_slow])
LEVELS = st.floats(0.005, 0.995)


def test_the_extreme_of_a_run_is_its_lowest_score_and_none_does_not_count() -> None:
    assert extreme([0.9, None, 0.7, 1.0]) == 0.7
    assert extreme([None, None]) == NOT_JUDGED


@pytest.mark.parametrize(
    ("level", "expected"),
    [(0.04, None), (0.05, 0.50), (0.099, 0.50), (0.10, 0.52), (0.5, 0.68), (0.95, 0.86)],
)
def test_hand_computed_thresholds(level: float, expected: float | None) -> None:
    """k = floor(20 level): none, 1st, 1st, 2nd, 10th and 19th smallest of nineteen."""
    found = threshold(NINETEEN, level)
    assert found is None if expected is None else found == pytest.approx(expected)


def test_hand_computed_p_values() -> None:
    assert p_value(NINETEEN, 0.3) == 1 / 20
    assert p_value(NINETEEN, NINETEEN[0]) == 2 / 20
    assert p_value(NINETEEN, 1.0) == 1.0
    assert p_value([], 0.5) == 1.0


@pytest.mark.parametrize(("level", "runs"), [(0.5, 1), (0.1, 9), (0.05, 19), (0.01, 99), (0.3, 3)])
def test_so_many_runs_are_needed_and_one_less_is_too_few(level: float, runs: int) -> None:
    assert runs_needed(level) == runs
    assert smallest_level(runs) <= level + 1e-12 < smallest_level(runs - 1)
    assert threshold([0.5] * runs, level) is not None
    assert threshold([0.5] * (runs - 1), level) is None


def test_a_level_is_between_0_and_1() -> None:
    for level in (0.0, 1.0, -0.1, 5.0):
        with pytest.raises(InputError, match=r"such as 0\.05"):
            threshold(NINETEEN, level)


def test_where_little_was_judged_the_line_is_not_above_what_was_seen() -> None:
    assert threshold([0.8, 0.9, *[NOT_JUDGED] * 37], 0.5) == 0.9
    assert threshold([NOT_JUDGED] * 39, 0.5) is None


@pytest.mark.parametrize(("n", "level"), [(19, 0.05), (30, 0.1), (59, 0.05), (12, 0.25)])
def test_coverage_on_exchangeable_scores(n: int, level: float) -> None:
    """The share of alarms is within a binomial bound of floor((n + 1) level) / (n + 1)."""
    rng = np.random.default_rng(12)
    draws = 2000
    alarms = 0
    for _ in range(draws):
        common = rng.normal()  # exchangeable, not independent
        scores = common + rng.standard_t(2, size=n + 1)
        line = threshold(scores[:n].tolist(), level)
        assert line is not None
        alarms += bool(scores[n] < line)
    exact = math.floor((n + 1) * level + 1e-9) / (n + 1)
    assert exact <= level
    assert binom.ppf(1e-4, draws, exact) <= alarms <= binom.ppf(1 - 1e-4, draws, exact)


@patiently
@given(SCORES, LEVELS, st.floats(0, 1))
def test_an_alarm_is_a_p_value_of_at_most_the_level(
    scores: list[float], level: float, new: float
) -> None:
    line = threshold(scores, level)
    alarm = line is not None and new < line
    if alarm:
        assert p_value(scores, new) <= level + 1e-9
    elif p_value(scores, new) <= level - 1e-9:
        assert new >= max((s for s in scores if s < NOT_JUDGED), default=-math.inf)


@patiently
@given(SCORES)
def test_a_larger_level_has_no_lower_line(scores: list[float]) -> None:
    lines = [threshold(scores, level) for level in np.linspace(0.01, 0.99, 25)]
    numbers = [-math.inf if line is None else line for line in lines]
    assert all(a <= b for a, b in pairwise(numbers))


@patiently
@given(SCORES, LEVELS, st.integers(0, 59), st.floats(0, 0.5))
def test_a_worse_good_run_never_raises_the_line(
    scores: list[float], level: float, place: int, by: float
) -> None:
    place %= len(scores)
    if scores[place] == NOT_JUDGED:
        return
    worse = [s - by if i == place else s for i, s in enumerate(scores)]
    before, after = threshold(scores, level), threshold(worse, level)
    assert (after is None) == (before is None)
    assert after is None or before is None or after <= before


@pytest.mark.parametrize("n", [19, 40, 101])
def test_a_public_conformal_library_says_the_same(n: int) -> None:
    """MAPIE: strangeness is 1 - score, its interval around 0 ends where our threshold is.

    It wants more runs than 1 / level, one or two more than there must be.
    """
    mapie = pytest.importorskip("mapie.regression", reason="mapie is in the extra dev")
    dummy = pytest.importorskip("sklearn.dummy")
    scores = np.random.default_rng(n).random(n)
    levels = [x for x in (0.02, 0.05, 0.1, 0.21, 0.5) if 1 / x < n]
    zero = dummy.DummyRegressor(strategy="constant", constant=0.0).fit([[0.0]], [0.0])
    theirs = mapie.SplitConformalRegressor(
        zero, confidence_level=[1 - x for x in levels], prefit=True
    )
    theirs.conformalize(np.zeros((n, 1)), 1 - scores)
    _, ends = theirs.predict_interval(np.zeros((1, 1)))
    ours = [threshold(scores.tolist(), x) for x in levels]
    assert ours == pytest.approx((1 - ends[0, 1]).tolist())
