import math
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from rows_by_hand import failing, good, judged, seen

from forestall.statistics.sweep import (
    Sample,
    auroc,
    average_precision,
    detected_at,
    detection_at,
    measured,
    roc_points,
    sample,
    sweep_metrics,
)

scores = st.one_of(st.sampled_from([0.1, 0.5, 0.7, 0.9, math.inf]), st.floats(0, 1))
groups = st.tuples(
    st.lists(scores, min_size=1, max_size=12), st.lists(scores, min_size=1, max_size=12)
)


def of(bad: list[float], fine: list[float]) -> Sample:
    labels = [True] * len(bad) + [False] * len(fine)
    return Sample(np.array(bad + fine), np.array(labels), tuple(range(len(labels))))


def value(statistic: object, given_: Sample) -> float:
    assert callable(statistic)
    return float(statistic(np.ones((1, len(given_.score))))[0])


def naive_auroc(bad: list[float], fine: list[float]) -> float:
    wins = sum(1.0 if b < f else 0.5 if b == f else 0.0 for b in bad for f in fine)
    return wins / (len(bad) * len(fine))


def naive_precision(bad: list[float], fine: list[float]) -> float:
    total, before = 0.0, 0.0
    for limit in sorted({*bad, *fine}):
        hits, alarms = sum(b <= limit for b in bad), sum(f <= limit for f in fine)
        recall = hits / len(bad)
        total += (recall - before) * hits / (hits + alarms)
        before = recall
    return total


@settings(max_examples=80, deadline=None)
@given(groups)
def test_area_and_precision_are_what_they_are_defined_as(
    drawn: tuple[list[float], list[float]],
) -> None:
    bad, fine = drawn
    assert value(auroc(of(bad, fine)), of(bad, fine)) == pytest.approx(naive_auroc(bad, fine))
    assert value(average_precision(of(bad, fine)), of(bad, fine)) == pytest.approx(
        naive_precision(bad, fine)
    )


@settings(max_examples=60, deadline=None)
@given(groups)
def test_area_only_depends_on_the_order(drawn: tuple[list[float], list[float]]) -> None:
    bad, fine = drawn
    known = sorted({*bad, *fine})
    places = [[float(known.index(s)) for s in group] for group in drawn]
    first = value(auroc(of(bad, fine)), of(bad, fine))
    assert value(auroc(of(*places)), of(*places)) == pytest.approx(first)
    assert value(auroc(of(fine, bad)), of(fine, bad)) == pytest.approx(1 - first)
    assert value(auroc(of(bad * 2, fine * 3)), of(bad * 2, fine * 3)) == pytest.approx(first)


@settings(max_examples=60, deadline=None)
@given(groups, st.sampled_from([0.0, 0.05, 0.1, 0.5, 1.0]))
def test_detection_keeps_to_its_false_alarm_rate(
    drawn: tuple[list[float], list[float]], rate: float
) -> None:
    bad, fine = drawn
    best = 0.0
    for limit in {*bad, *fine}:
        if sum(f <= limit for f in fine) <= rate * len(fine):
            best = max(best, sum(b <= limit for b in bad) / len(bad))
    assert value(detection_at(of(bad, fine), rate), of(bad, fine)) == pytest.approx(best)


@settings(max_examples=40, deadline=None)
@given(groups)
def test_a_weight_is_worth_as_many_runs(drawn: tuple[list[float], list[float]]) -> None:
    one, twice = of(*drawn), of([drawn[0][0], *drawn[0]], drawn[1])
    weights = np.ones((1, len(one.score)))
    weights[0, 0] = 2
    for statistic in (auroc, average_precision, lambda s: detection_at(s, 0.1)):
        assert float(statistic(one)(weights)[0]) == pytest.approx(value(statistic(twice), twice))


def test_a_curve_by_hand() -> None:
    hand = of([0.1, 0.5, math.inf], [0.5, 0.9, 0.9, 0.9])
    assert roc_points(hand) == [
        (0.0, 0.0, None),
        (0.0, pytest.approx(1 / 3), 0.1),
        (0.25, pytest.approx(2 / 3), 0.5),
        (1.0, pytest.approx(2 / 3), 0.9),
    ]
    assert detected_at(hand, 0.10).value == pytest.approx(1 / 3)
    assert detected_at(hand, 0.25).value == pytest.approx(2 / 3)
    points = roc_points(hand)
    assert all(a[0] <= b[0] and a[1] <= b[1] for a, b in pairwise(points))


def test_the_lowest_score_of_a_run_counts() -> None:
    rows = [
        failing(0, judged=seen(0.5, 0.95, 0.95, 0.95)),  # only before it can be known
        failing(1, judged=seen(0.95, None, 0.6, 0.1)),
        failing(2, judged=seen(0.1, 0.1), known=3, effect=2),
        good(0, judged=seen(0.8, 0.9)),
        good(1, judged=seen(None, None)),
        good(2, of="harmless", judged=seen(0.7, 0.9)),
    ]
    whole = sample(rows, "scene-graph")
    assert whole.score.tolist() == [0.5, 0.1, 0.1, 0.8, math.inf, 0.7]
    assert sample(rows, "scene-graph", "undisturbed").score.tolist() == [
        0.5,
        0.1,
        0.1,
        0.8,
        math.inf,
    ]
    timely = sample(rows, "scene-graph", in_time=True)
    assert timely.score.tolist() == [0.95, 0.6, 0.8, math.inf, 0.7]
    found = sweep_metrics(rows, "scene-graph")
    assert (found["auroc_all"].value, found["auroc_all"].n) == (1.0, 6)
    assert found["in_time_fa10_all"].value == 0.5


def test_runs_that_a_detector_did_not_watch_are_counted() -> None:
    both = judged({"scene-graph": [0.5], "image": [0.99]})
    rows = [failing(0, judged=both), failing(1, judged=seen(0.5)), good(0, judged=both)]
    found = sample(rows, "image")
    assert (len(found.score), found.unread) == (2, 1)


def test_without_other_runs_nothing_is_measured() -> None:
    only = of([0.5, 0.6], [])
    assert measured(auroc(only), only).value is None
    assert detected_at(only, 0.1).n == 0
    assert roc_points(only) == []


def test_full_detection_is_not_certain() -> None:
    found = detected_at(of([0.1] * 10, [0.9] * 10), 0.05)
    assert (found.value, found.high) == (1.0, 1.0)
    assert found.low == pytest.approx(0.6915, abs=1e-3)
