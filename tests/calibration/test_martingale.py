"""The bet against exchangeability: it wins rarely where nothing changed, soon where much did."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.stats import binom

from forestall.calibration.conformal import NOT_JUDGED
from forestall.calibration.martingale import ENOUGH, EXPONENTS, ExchangeabilityTest

LEVEL = 0.05


def stream(seed: int, n: int = 20) -> tuple[np.random.Generator, ExchangeabilityTest]:
    rng = np.random.default_rng(seed)
    return rng, ExchangeabilityTest({"a": rng.random(n).tolist()}, rng)


def test_it_is_rarely_wrong_where_the_runs_are_exchangeable() -> None:
    """Ties and runs without a score included; at any time, not only at the end."""
    streams, wrong = 200, 0
    for seed in range(streams):
        rng = np.random.default_rng(seed)
        all_runs = np.round(rng.random(120), 1)
        all_runs[rng.random(120) < 0.1] = NOT_JUDGED
        test = ExchangeabilityTest({"a": all_runs[:20].tolist()}, rng)
        for s in all_runs[20:]:
            test.add(float(s), "a")
        wrong += test.broken(LEVEL)
    assert wrong <= binom.ppf(1 - 1e-4, streams, LEVEL)


def test_its_p_values_are_uniform_and_its_bets_fair() -> None:
    """The mean of a step over p is the capital before it: the derivatives integrate to 1."""
    p = (np.arange(400_000) + 0.5) / 400_000
    for e in EXPONENTS[1:]:
        coarse = 0.002 if e > 0.4 else 0.05
        assert float(np.mean(e * p ** (e - 1))) == pytest.approx(1.0, abs=coarse)


@pytest.mark.parametrize("late", [0, 60])
def test_it_says_so_when_runs_become_stranger(late: int) -> None:
    for seed in range(10):
        rng, test = stream(seed, 40)
        for _ in range(late):
            test.add(rng.random(), "a")
        for _ in range(40):
            test.add(0.1 * rng.random() - 0.05, "a")
        assert test.broken(LEVEL)
        assert test.added == late + 40


def test_other_tasks_in_another_mixture_are_no_change() -> None:
    rng = np.random.default_rng(1)
    test = ExchangeabilityTest(
        {"easy": (0.9 + 0.1 * rng.random(30)).tolist(), "hard": (0.5 * rng.random(30)).tolist()},
        rng,
    )
    for _ in range(200):
        test.add(0.5 * rng.random(), "hard")
    assert not test.broken(LEVEL)


def test_the_same_stream_has_the_same_capital_and_a_very_large_one_is_kept() -> None:
    capitals = []
    for _ in range(2):
        _, test = stream(7)
        for i in range(400):
            test.add(-float(i), "a")
        capitals.append(test.capital)
    assert capitals[0] == capitals[1] >= ENOUGH
    assert np.isfinite(capitals[0])
