from __future__ import annotations

import csv
import io
import json
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.stats import binomtest

from forestall.errors import InputError, UnknownNameError
from forestall.training.fitting import fit_temperature, fit_threshold
from forestall.training.measure import (
    BANDS,
    Answers,
    Measurement,
    measure,
    share,
)
from forestall.training.measure_tables import (
    Condition,
    as_json,
    confusion_csv,
    figures_csv,
    markdown,
    write_tables,
)

Row = tuple[str, str, int, tuple[float, ...], bool, int]


def answers_of(rows: list[Row]) -> Answers:
    """(category, attribute, truth, probability, answered, area) → Answers, a crop for each row."""
    width = 4
    padded = [[*r[3], *[0.0] * (width - len(r[3]))] for r in rows]
    return Answers(
        category=np.array([r[0] for r in rows], dtype=np.str_),
        attribute=np.array([r[1] for r in rows], dtype=np.str_),
        truth=np.array([r[2] for r in rows], dtype=np.int64),
        probability=np.array(padded, dtype=np.float32).reshape(len(rows), width),
        answered=np.array([r[4] for r in rows], dtype=bool),
        area=np.array([r[5] for r in rows], dtype=np.int64),
        crop=np.arange(len(rows)),
    )


SURE_FIRST, SURE_SECOND = (0.9, 0.1), (0.1, 0.9)


def worked() -> Measurement:
    """Microwaves: 8 of 9 closed and 1 of 2 open named rightly; mugs: 1 of 1, and 1 unanswered."""
    rows: list[Row] = [("Microwave", "open", 0, SURE_FIRST, True, 30)] * 8
    rows += [("Microwave", "open", 0, SURE_SECOND, True, 100)]
    rows += [("Microwave", "open", 1, SURE_SECOND, True, 3000)]
    rows += [("Microwave", "open", 1, SURE_FIRST, True, 3000)]
    rows += [("Mug", "filled", 2, (0.1, 0.1, 0.7, 0.1), True, 10)]
    rows += [("Mug", "filled", 3, (0.4, 0.2, 0.2, 0.2), False, 500)]
    return measure(answers_of(rows))


def test_figures_of_a_worked_case() -> None:
    m = worked()
    assert [g.attribute for g in m.attributes] == ["filled", "open"]
    assert [g.category for g in m.categories] == ["Microwave", "Mug"]
    assert [(g.attribute, g.category) for g in m.pairs] == [
        ("filled", "Mug"),
        ("open", "Microwave"),
    ]
    assert m.crops == 13
    doors = m.attributes[1].figures
    assert (doors.n, doors.answered.count, doors.accuracy.count) == (11, 11, 9)
    assert doors.balanced == pytest.approx((8 / 9 + 1 / 2) / 2)
    assert doors.accuracy.value == pytest.approx(9 / 11)
    mugs = m.attributes[0].figures
    assert (mugs.n, mugs.answered.count, mugs.balanced) == (2, 1, 1.0)
    assert mugs.silent == ("filled=wine",)
    assert m.overall.figures.balanced == pytest.approx(((8 / 9 + 1 / 2) / 2 + 1) / 2)
    assert m.overall.figures.accuracy.value == pytest.approx(10 / 12)
    assert m.overall.figures.answered.value == pytest.approx(12 / 13)


def test_confusion_has_a_last_column_for_what_was_not_answered() -> None:
    m = worked()
    assert m.attributes[1].values == ("closed", "open")
    assert m.attributes[1].confusion == ((8, 1, 0), (1, 1, 0))
    assert m.attributes[0].confusion == (
        (0, 0, 0, 0, 0),
        (0, 0, 0, 0, 0),
        (0, 0, 1, 0, 0),
        (0, 0, 0, 0, 1),
    )
    assert m.overall.confusion == ()


def test_calibration_error_with_and_without_what_was_not_answered() -> None:
    m = worked()
    assert m.attributes[1].figures.calibration_error == pytest.approx(0.9 - 9 / 11, abs=1e-6)
    mugs = m.attributes[0].figures
    assert mugs.calibration_error == pytest.approx(0.3, abs=1e-6)
    assert mugs.calibration_error_all == pytest.approx((0.3 + 0.4) / 2, abs=1e-6)
    (only,) = m.attributes[1].bins
    assert (only.low, only.high, only.n) == (13 / 15, 14 / 15, 11)


def test_size_bands_start_at_their_first_number() -> None:
    rows: list[Row] = [
        ("Mug", "dirty", 0, SURE_FIRST, True, area)
        for area in (1, 19, 20, 59, 60, 119, 120, 499, 500, 1999, 2000, 10**6)
    ]
    sizes = measure(answers_of(rows)).overall.sizes
    assert [(band, f.n) for band, f in sizes] == [(band, 2) for band in BANDS]


def test_nothing_answered_gives_none_and_not_zero() -> None:
    m = measure(answers_of([("Mug", "dirty", 1, SURE_FIRST, False, 30)]))
    f = m.overall.figures
    assert (f.balanced, f.calibration_error, f.accuracy.value) == (None, None, None)
    assert (f.answered.value, f.silent) == (0.0, ("dirty=dirty",))
    assert "| none |" in markdown(m)
    assert as_json(m)["overall"]["figures"]["balanced"] is None


def test_values_of_an_attribute_that_is_not_built_in() -> None:
    rows: list[Row] = [("Rug", "rolled", 1, (0.2, 0.8), True, 90)]
    m = measure(answers_of(rows), {"rolled": ("flat", "rolled up")})
    assert m.attributes[0].confusion == ((0, 0, 0), (0, 1, 0))
    with pytest.raises(UnknownNameError, match="rolled"):
        measure(answers_of(rows))


@pytest.mark.parametrize(
    "row",
    [
        ("Mug", "dirty", 2, SURE_FIRST, True, 30),
        ("Mug", "dirty", -1, SURE_FIRST, True, 30),
        ("Mug", "dirty", 0, (0.5, 0.2, 0.3), True, 30),
    ],
)
def test_what_lies_beyond_the_values_is_refused(row: Row) -> None:
    answers = answers_of([row])
    with pytest.raises(InputError, match="beyond"):
        measure(answers)


def test_answers_are_checked() -> None:
    good = answers_of([("Mug", "dirty", 0, SURE_FIRST, True, 30)] * 2)
    fields = {name: getattr(good, name) for name in Answers.__dataclass_fields__}
    with pytest.raises(InputError, match="truth 1"):
        Answers(**fields | {"truth": good.truth[:1]})
    with pytest.raises(InputError, match="sum to 1"):
        Answers(**fields | {"probability": good.probability * np.float32(0.5)})
    with pytest.raises(InputError, match="sum to 1"):
        Answers(**fields | {"probability": good.probability * np.float32("nan")})
    with pytest.raises(InputError, match="answered bool"):
        Answers(**fields | {"answered": np.ones(2)})
    with pytest.raises(InputError, match="no answers"):
        measure(answers_of([]))


@given(st.integers(1, 400).flatmap(lambda n: st.tuples(st.integers(0, n), st.just(n))))
@settings(max_examples=25, deadline=None)
def test_interval_is_that_of_clopper_and_pearson(case: tuple[int, int]) -> None:
    count, n = case
    found = share(count, n)
    exact = binomtest(count, n).proportion_ci(0.95)
    assert found.low == pytest.approx(exact.low, abs=1e-8)
    assert found.high == pytest.approx(exact.high, abs=1e-8)


@given(st.integers(0, 2**32), st.integers(1, 60))
@settings(max_examples=30, deadline=None)
def test_groups_add_up_whatever_the_answers(seed: int, n: int) -> None:
    m = measure(drawn(np.random.default_rng(seed), n))
    for family in (m.attributes, m.categories, m.pairs):
        assert sum(g.figures.n for g in family) == n
        assert sum(g.figures.accuracy.count for g in family) == m.overall.figures.accuracy.count
    for group in m.groups():
        f = group.figures
        assert sum(s.n for _, s in group.sizes) == f.n
        assert sum(b.n for b in group.bins) == f.answered.count
        assert f.balanced is None or 0 <= f.balanced <= 1
        if group.confusion:
            counts = np.array(group.confusion)
            assert counts.sum() == f.n
            assert np.trace(counts[:, :-1]) == f.accuracy.count
    done = [g.figures.balanced for g in m.attributes if g.figures.balanced is not None]
    if done:
        assert m.overall.figures.balanced == pytest.approx(np.mean(done))


def drawn(rng: np.random.Generator, n: int) -> Answers:
    """Answers of two attributes and three categories at random."""
    rows: list[Row] = []
    for _ in range(n):
        attribute, k = (("dirty", 2), ("filled", 4))[rng.integers(2)]
        probability = rng.dirichlet([1.0] * k)
        rows.append(
            (
                str(rng.choice(["Mug", "Cup", "Pot"])),
                attribute,
                int(rng.integers(k)),
                tuple(probability),
                bool(rng.uniform() < 0.8),
                int(rng.integers(1, 4000)),
            )
        )
    return answers_of(rows)


@pytest.mark.parametrize("temperature", [0.5, 1.0, 3.0])
def test_temperature_is_found_again(temperature: float) -> None:
    rng = np.random.default_rng(5)
    calibrated = rng.normal(0, 2, (20_000, 4))
    chance = np.exp(calibrated) / np.exp(calibrated).sum(axis=1, keepdims=True)
    truth = (rng.uniform(size=(20_000, 1)) > chance.cumsum(axis=1)).sum(axis=1).clip(0, 3)
    groups = np.full(20_000, "filled")
    assert fit_temperature(calibrated * temperature, truth, groups) == {
        "filled": pytest.approx(temperature, rel=0.05)
    }


def test_temperature_of_each_attribute_looks_only_at_its_values() -> None:
    logits = np.array([[2.0, 0.0, 99.0, -np.inf], [2.0, 0.0, np.nan, 5.0]] * 5)
    truth = np.array([0, 0, 0, 0, 1, 0, 0, 0, 1, 0])
    found = fit_temperature(logits, truth, np.full(10, "open"))
    assert found["open"] == pytest.approx(2 / np.log(8 / 2), rel=1e-3)
    with pytest.raises(InputError, match="filled"):
        fit_temperature(logits, truth, np.full(10, "filled"))
    with pytest.raises(UnknownNameError):
        fit_temperature(logits, truth, np.full(10, "opened"))


def test_threshold_is_the_lowest_that_reaches_the_target() -> None:
    sure = np.array([0.95, 0.9, 0.85, 0.8, 0.75, 0.7, 0.65, 0.6])
    probability = np.stack([sure, 1 - sure], axis=1)
    probability[1::2] = probability[1::2, ::-1]  # says 0, 1, 0, 1, ...
    truth = np.array([0, 1, 0, 1, 0, 1, 1, 0])  # the last two are wrong
    groups = np.full(8, "open")
    found = fit_threshold(probability, truth, 0.99, groups, smallest=3)["open"]
    assert (found.value, found.reached, found.balanced) == (0.7, True, 1.0)
    assert (found.answered, found.n) == (6 / 8, 8)
    easy = fit_threshold(probability, truth, 0.7, groups, smallest=3)["open"]
    assert (easy.value, easy.answered, easy.balanced) == (0.0, 1.0, 0.75)
    forced = fit_threshold(probability, truth, 0.99, groups, smallest=20)["open"]
    assert (forced.value, forced.reached, forced.balanced) == (0.0, False, 0.75)


TARGETS = st.just(0.0) | st.floats(1e-6, 1)
"""Below the test's tolerance no accuracy can be told from a target that it misses."""


@given(st.integers(0, 2**32), TARGETS, st.integers(1, 10))
@settings(max_examples=40, deadline=None)
def test_threshold_does_what_it_says(seed: int, target: float, smallest: int) -> None:
    rng = np.random.default_rng(seed)
    n = int(rng.integers(1, 60))
    first = rng.integers(10, 91, n) / 100  # ties on purpose
    probability = np.stack([first, 1 - first], axis=1).astype(np.float32)
    truth = rng.integers(0, 2, n)
    found = fit_threshold(probability, truth, target, np.full(n, "open"), smallest)["open"]

    def at(threshold: float) -> tuple[bool, float, float]:
        kept = probability.max(axis=1) >= threshold
        parts = [(kept & (truth == v), int((truth == v).sum())) for v in np.unique(truth)]
        enough = all(part.sum() >= min(smallest, of) for part, of in parts)
        said = probability.argmax(axis=1)
        recalls = [float((said[part] == truth[part]).mean()) for part, _ in parts if part.any()]
        return enough, float(np.mean(recalls)) if recalls else 0.0, float(kept.mean())

    enough, balanced, answered = at(found.value)
    assert enough
    assert (balanced, answered) == pytest.approx((found.balanced, found.answered))
    assert found.reached == (balanced >= target - 1e-12)
    for lower in np.unique(probability.max(axis=1)):
        if lower < found.value or not found.reached:
            usable, other, _ = at(float(lower))
            assert not usable or other < (target if found.reached else balanced + 1e-9)


def test_tables_carry_the_same_figures(tmp_path: Path) -> None:
    m = worked()
    lines = list(csv.DictReader(io.StringIO(figures_csv(m))))
    doors = next(
        r for r in lines if (r["attribute"], r["category"], r["mask_px"]) == ("open", "", "")
    )
    assert float(doors["balanced_accuracy"]) == pytest.approx(25 / 36, abs=1e-6)
    assert (doors["n"], doors["answered"]) == ("11", "1.0")
    wine = next(r for r in lines if r["attribute"] == "filled" and r["mask_px"] == "500-2000")
    assert (wine["accuracy"], wine["silent"]) == ("", "filled=wine")
    confusions = list(csv.DictReader(io.StringIO(confusion_csv(m))))
    assert {(r["said"], r["n"]) for r in confusions if r["truth"] == "wine"} >= {
        ("unobserved", "1")
    }
    text = markdown(m)
    assert "| open | 11 | 100.0 % (71.5 to 100.0) | 81.8 % (48.2 to 97.7) | 69.4 % |" in text
    assert "| closed | 8 | 1 | 0 |" in text
    paths = write_tables(m, [Condition("in the hand", m.overall)], tmp_path / "new")
    assert sorted(p.name for p in paths) == sorted(p.name for p in (tmp_path / "new").iterdir())
    data = json.loads((tmp_path / "new" / "measurement.json").read_text(encoding="utf-8"))
    assert data == as_json(m)
    told = (tmp_path / "new" / "measurement.md").read_text(encoding="utf-8")
    assert "| in the hand | 13 |" in told and "By condition" not in text
    assert data["attributes"][1]["confusion"] == [[8, 1, 0], [1, 1, 0]]
