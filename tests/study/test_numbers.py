"""Agreement, strengths, shares and power against published and hand-made numbers."""

from collections.abc import Sequence

import numpy as np
import pytest
from numpy.typing import NDArray

from forestall.study.agreement import alphas, strengths
from forestall.study.answers import Answer, Rater, Start
from forestall.study.assigning import Design
from forestall.study.clustered import Clusters, alpha_of, share_of
from forestall.study.measuring import attentive, comparisons, shares, summary
from forestall.study.model import Study
from forestall.study.power import ASSUMED, Variance, detectable, raters_needed, variance_of
from forestall.study.simulated import Taste, simulate

from .studies import AGAINST, study_of

# Krippendorff (2011), section C: four observers, twelve units, data missing.
OBSERVERS = (
    (1, 2, 3, 3, 2, 1, 4, 1, 2, None, None, None),
    (1, 2, 3, 3, 2, 2, 4, 1, 2, 5, None, 3),
    (None, 3, 3, 3, 2, 3, 4, 2, 2, 5, 1, None),
    (1, 2, 3, 3, 2, 4, 4, 1, 2, 5, 1, None),
)

# Agresti, "Categorical Data Analysis" (2002), table 10.10: the American League's East, 1987.
TEAMS = ("Milwaukee", "Detroit", "Toronto", "New York", "Boston", "Cleveland", "Baltimore")
GAMES = (
    (0, 7, 9, 7, 7, 9, 11),
    (6, 0, 7, 5, 11, 9, 9),
    (4, 6, 0, 7, 7, 8, 12),
    (6, 8, 6, 0, 6, 7, 10),
    (6, 2, 6, 7, 0, 7, 12),
    (4, 4, 5, 6, 6, 0, 6),
    (2, 4, 1, 3, 1, 7, 0),
)
ABILITIES = (1.581, 1.436, 1.294, 1.248, 1.108, 0.684, 0.0)

TASTE = Taste({"objects": 0.3, "caption": 0.9, "image": 1.6})


def counts(*units: Sequence[object]) -> NDArray[np.float64]:
    """How often each thing was given each value; its values in a row."""
    values = sorted({v for unit in units for v in unit}, key=str)
    return np.array([[unit.count(v) for v in values] for unit in map(list, units)], float)


def test_alpha_is_the_published_one() -> None:
    units = [[v for o in OBSERVERS if (v := o[k]) is not None] for k in range(12)]
    assert alphas(counts(*units)) == pytest.approx(0.743, abs=5e-4)
    assert alphas(counts("xx", "yy")) == 1
    assert alphas(counts("xy", "xy")) == pytest.approx(-0.5)
    assert np.isnan(alphas(counts("x", "y"))) and np.isnan(alphas(counts("xx")))
    several = alphas(np.stack([counts("xx", "yy"), counts("xy", "xy")]))
    assert several == pytest.approx([1, -0.5])


def test_an_interval_of_alpha_goes_by_rater_and_item() -> None:
    """Raters who all see it alike narrow it, a rater of another mind widens it."""
    raters = [r for r in range(6) for _ in range(8)]
    items = list(range(8)) * 6
    by = Clusters.of(raters, items)
    same = alpha_of([i % 2 for i in items], items, by)
    assert (same.value, same.low, same.high) == (1, None, None)
    one_errs = [(i % 2) ^ (r == i % 6 and r < 2) for r, i in zip(raters, items, strict=True)]
    another = [(i % 2) ^ (r == 0) for r, i in zip(raters, items, strict=True)]
    narrow, wide = alpha_of(one_errs, items, by), alpha_of(another, items, by)
    assert narrow.low is not None and narrow.high is not None and narrow.value is not None
    assert wide.low is not None and wide.high is not None
    assert narrow.low < narrow.value < narrow.high <= 1
    assert wide.high - wide.low > narrow.high - narrow.low
    alone = alpha_of([0, 1], [0, 0], Clusters.of([0, 1], [0, 0]))
    assert alone.value == 0 and alone.low is None
    assert alpha_of([], [], Clusters.of([], [])).value is None


def test_where_all_say_both_there_is_no_interval() -> None:
    found = share_of([0.5] * 6, Clusters.of([0, 0, 1, 1, 2, 2], [0, 1] * 3))
    assert (found.value, found.low, found.high) == (0.5, None, None)


def test_strengths_are_the_published_ones() -> None:
    fitted = strengths(np.array(GAMES, float))
    assert fitted is not None
    assert fitted - fitted[-1] == pytest.approx(ABILITIES, abs=2e-3)
    assert strengths(np.array([[0.0, 3.0], [0.0, 0.0]])) is None


def rater(study: Study, number: int, choose: dict[int, str], simulated: bool = False) -> Rater:
    answers = {k: Answer(k, c) for k, c in choose.items()}  # type: ignore[arg-type]
    return Rater(Start(study.digest, number, simulated), answers)


def test_shares_are_counted_by_side() -> None:
    study = study_of(6, Design(3))
    found = []
    for number, trials in enumerate(study.raters, 1):
        wanted = ["ours", "other", "both", "ours", "ours", "ours"]
        chosen, real = {}, iter(wanted)
        for k, trial in enumerate(trials):
            better = "ours" if trial.check else next(real)
            other = "b" if trial.ours == "a" else "a"
            chosen[k] = {"ours": trial.ours, "other": other, "both": "both"}[better]
        found += comparisons(study, rater(study, number, chosen))
    table = shares(found, AGAINST)["all"]
    counts = {what: table[what].count for what in ("wins", "losses", "both")}
    assert counts == {"wins": 12, "losses": 3, "both": 3} and table["wins"].n == 18
    assert table["preference"].value == pytest.approx(13.5 / 18)
    assert table["decided"].value == pytest.approx(0.8) and table["decided"].n == 15


def test_who_does_not_read_is_left_out_and_counted() -> None:
    study = study_of(20, Design(4))
    careless = {k: "both" for k in range(len(study.raters[0]))}
    good = {k: t.ours for k, t in enumerate(study.raters[1])}
    raters = [rater(study, 1, careless), rater(study, 2, dict(good))]
    assert [attentive(study, r) for r in raters] == [False, True]
    data = summary(study, raters)
    assert data["not_attentive"] == 1 and data["answers"] == 20 and data["raters"] == 2
    assert data["against"]["all"]["wins"]["value"] == 1.0
    assert data["against"]["objects"]["odds"]["value"] is None and data["strengths"] is None
    assert data["preference_of_all_raters"]["value"] == pytest.approx(0.75)
    assert summary(study, [])["answers"] == 0


def test_odds_agree_with_bradley_terry() -> None:
    study = study_of(40, Design(15))
    data = summary(study, simulate(study, TASTE, seed=2))
    for name in AGAINST:
        row = data["against"][name]
        strength = data["strengths"][name]
        assert row["odds"]["value"] == pytest.approx(np.exp(-strength["value"]), rel=1e-6)
        assert row["odds"]["low"] == pytest.approx(np.exp(-strength["high"]))
        assert strength["low"] < strength["value"] < strength["high"]
        assert row["odds"]["low"] < row["odds"]["value"] < row["odds"]["high"]


def test_raters_needed_find_what_they_should() -> None:
    for difference in (0.15, 0.2):
        needed = raters_needed(ASSUMED, difference, items=40, each=13)
        assert needed is not None
        assert detectable(ASSUMED, needed, 40, 13) <= difference
        assert needed == 2 or detectable(ASSUMED, needed - 1, 40, 13) > difference
    assert raters_needed(ASSUMED, 0.05, items=10, each=3) is None
    assert raters_needed(Variance(0, 0, 0), 0.1, 10, 3) == 2


def test_variances_are_those_that_answers_were_drawn_with() -> None:
    random = np.random.default_rng(4)
    parts = []
    for _ in range(60):
        raters, things = random.normal(0, 0.2, 15), random.normal(0, 0.3, 30)
        pairs = [(r, i) for r in range(15) for i in range(30)]
        scores = [raters[r] + things[i] + random.normal(0, 0.4) for r, i in pairs]
        found = variance_of(scores, ["x"] * 450, [r for r, _ in pairs], [i for _, i in pairs])
        assert found is not None
        parts.append((found.rater, found.item, found.rest))
    assert np.mean(parts, axis=0) == pytest.approx((0.04, 0.09, 0.16), rel=0.2)
    assert variance_of([1.0, 0.0], ["x", "x"], [1, 2], [1, 2]) is None


def test_true_numbers_are_those_of_very_many_answers() -> None:
    study = study_of(150, Design(100, 150, seed=3))
    data = summary(study, simulate(study, TASTE, seed=3))
    for name in AGAINST:
        assert data["against"][name]["wins"]["value"] == pytest.approx(TASTE.wins(name), abs=0.04)
    assert data["against"]["all"]["both"]["value"] == pytest.approx(TASTE.both, abs=0.035)
    assert data["alpha"]["value"] == pytest.approx(TASTE.alpha(), abs=0.04)
