import math
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from rows_by_hand import failing, good, judged, seen

from forestall.statistics.curves import roc_points
from forestall.statistics.intervals import Clusters
from forestall.statistics.rows import Judged
from forestall.statistics.sweep import (
    Line,
    Sample,
    auroc,
    average_precision,
    boundary_area,
    detected_at,
    detection_at,
    measured,
    sample,
    sweep_metrics,
)
from forestall.statistics.watches import ALL, Watches

scores = st.one_of(st.sampled_from([0.1, 0.5, 0.7, 0.9, math.inf]), st.floats(0, 1))
groups = st.tuples(
    st.lists(scores, min_size=1, max_size=12), st.lists(scores, min_size=1, max_size=12)
)


def of(bad: list[float], fine: list[float]) -> Sample:
    labels = np.array([True] * len(bad) + [False] * len(fine))
    everything = np.ones(len(labels), bool)
    return Sample(np.array(bad + fine), labels, everything, Clusters.of(range(len(labels))))


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
    line = Line.by(Watches.of(rows), "scene-graph")
    assert counted(line) == [0.5, 0.1, 0.1, 0.8, math.inf, 0.7]
    assert counted(line, "undisturbed") == [0.5, 0.1, 0.1, 0.8, math.inf]
    assert counted(line, ALL, in_time=True) == [0.95, 0.6, 0.8, math.inf, 0.7]
    found = sweep_metrics(line)
    assert (found["auroc_all"].value, found["auroc_all"].n) == (1.0, 6)
    assert found["auroc_in_time_all"].value == pytest.approx(4 / 6)
    assert found["in_time_fa10_all"].value == 0.5


def counted(line: Line, negatives: str = ALL, in_time: bool = False) -> list[float]:
    """Scores of the failing runs, the undisturbed and the harmless ones, in this order."""
    found = sample(line, negatives, in_time=in_time)
    order = {"robofail": 0, "undisturbed": 1, "harmless": 2}
    places = sorted(range(len(line.of)), key=lambda k: (order[line.of.rows[k].set], k))
    return [float(found.score[k]) for k in places if found.counted[k]]


def test_runs_that_a_judge_did_not_watch_are_left_out() -> None:
    both = judged({"scene-graph": [0.5], "image": [0.99]})
    rows = [failing(0, judged=both), failing(1, judged=seen(0.5)), good(0, judged=both)]
    assert counted(Line.by(Watches.of(rows), "image")) == [0.99, 0.99]


def test_boundaries_in_time_are_held_against_faultless_ones() -> None:
    bad = tuple(
        replace(j, possible=True, reachable=j.index < 1)
        for j in seen(0.3, 0.5, None, 0.1)  # in time at the second and the third
    )
    fine = tuple(replace(j, possible=True, reachable=True) for j in seen(0.4, 0.5, 0.9))
    line = Line.by(Watches.of([failing(0, judged=bad), good(1, judged=fine)]), "scene-graph")
    found = boundary_area(line)
    # 0.5 against 0.3, 0.4, 0.5, 0.9: half and one; nothing judged: none
    assert found.value == pytest.approx(1.5 / 8)
    assert found.n == 6


@settings(max_examples=25, deadline=None)
@given(st.lists(st.lists(scores, min_size=1, max_size=3), min_size=2, max_size=5), st.data())
def test_the_area_of_boundaries_is_what_it_is_defined_as(
    runs: list[list[float]], data: st.DataObject
) -> None:
    bad = data.draw(st.integers(1, len(runs) - 1))
    rows = [
        failing(k, known=0, effect=9, judged=untrue(run))
        if k < bad
        else good(k, judged=seen(*(None if math.isinf(x) else x for x in run)))
        for k, run in enumerate(runs)
    ]
    line = Line.by(Watches.of(rows), "scene-graph")
    first = [x for run in runs[:bad] for x in run]
    second = [x for run in runs[bad:] for x in run]
    assert boundary_area(line).value == pytest.approx(naive_auroc(first, second))


def untrue(run: list[float]) -> tuple[Judged, ...]:
    """Boundaries from which the goal is out of reach."""
    given_ = seen(*(None if math.isinf(x) else x for x in run))
    return tuple(replace(j, reachable=False) for j in given_)


def test_without_other_runs_nothing_is_measured() -> None:
    only = of([0.5, 0.6], [])
    assert measured(auroc(only), only).value is None
    assert detected_at(only, 0.1).n == 0
    assert roc_points(only) == []


def test_full_detection_is_not_certain() -> None:
    found = detected_at(of([0.1] * 10, [0.9] * 10), 0.05)
    assert (found.value, found.high) == (1.0, 1.0)
    assert found.low == pytest.approx(0.6915, abs=1e-3)
