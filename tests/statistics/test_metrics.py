from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from rows_by_hand import failing, good, judged, seen

from forestall.errors import InputError
from forestall.statistics.intervals import Metric, bootstrap, mean, proportion, rate
from forestall.statistics.metrics import (
    ALWAYS,
    NEVER,
    RANDOM,
    TRUTH,
    at_thresholds,
    by_rule,
    confirmed,
    point_metrics,
    trivial,
)
from forestall.statistics.pairs import paired
from forestall.statistics.watches import Watches, canonical


def test_exact_interval_of_a_known_proportion() -> None:
    found = proportion([True] * 71 + [False] * 29)
    assert (found.value, found.n, found.count, found.method) == (0.71, 100, 71, "exact")
    assert found.low == pytest.approx(0.6107, abs=1e-3)
    assert found.high == pytest.approx(0.7964, abs=1e-3)


def test_nothing_counted_is_no_value() -> None:
    for metric in (proportion([]), mean([], []), rate([], [], []), rate([0], [0], ["a"])):
        assert (metric.value, metric.low, metric.high, metric.n) == (None, None, None, 0)
    with pytest.raises(InputError, match="0 things"):
        Metric(0.0, None, None, 0)


def test_runs_of_one_scene_are_drawn_together() -> None:
    values = [0.0, 1.0] * 20
    alone = mean(values, list(range(40)))
    together = mean(values, [k // 2 for k in range(40)])
    assert alone.low is not None and alone.low < 0.5 < (alone.high or 0)
    assert (together.low, together.high) == (0.5, 0.5)


def test_one_scene_gives_no_interval() -> None:
    found = mean([1.0, 3.0], ["kitchen", "kitchen"])
    assert (found.value, found.low, found.high, found.method) == (2.0, None, None, "none")


def test_a_rate_of_zero_is_not_certain() -> None:
    found = rate([0] * 20, [8] * 20, list(range(20)))
    assert (found.value, found.n, found.count) == (0.0, 160, 0)
    assert found.high == pytest.approx(0.1684, abs=1e-3)


def test_draws_in_which_a_statistic_has_no_value_are_left_out() -> None:
    def first_only(w: np.ndarray) -> np.ndarray:
        return np.where(w[:, 0] > 0, 1.0, np.nan)

    found = bootstrap(first_only, ["a", "b"])
    assert (found.value, found.low, found.high) == (1.0, 1.0, 1.0)


def test_paired_difference_and_mcnemar() -> None:
    first = [True] * 8 + [False] * 2
    second = [False] * 6 + [True] * 3 + [False]
    found = paired(first, second, list(range(10)))
    assert found.difference.value == pytest.approx(0.5)
    assert (found.only_first, found.only_second) == (6, 1)
    assert found.p == pytest.approx(0.125)
    assert paired([], [], []).p is None
    with pytest.raises(InputError):
        paired([True], [], [])


def test_detection_is_counted_as_the_paper_does_and_as_it_should_be() -> None:
    rows = [
        failing(0, judged=seen(0.95, 0.8, 0.8, 0.95)),  # in time, one step ahead
        failing(1, judged=seen(0.5, 0.95, 0.95, 0.95)),  # before it could be known
        failing(2, judged=seen(0.95, 0.95, 0.95, 0.5)),  # too late
        failing(3, judged=seen(0.95, None, None, 0.95)),  # never
        failing(4, judged=seen(0.5, 0.9, 0.95, 0.95), known=4, effect=2),  # not foreseeable
    ]
    found = point_metrics(at_thresholds(Watches.of(rows), "scene-graph", (0.9,)))
    counted = {m: (found[m].count, found[m].n) for m in ("fdr", "in_time", "after_known")}
    assert counted == {"fdr": (4, 5), "in_time": (1, 4), "after_known": (2, 5)}
    early = found["early_alarms_per_boundary"]
    assert (early.count, early.n) == (2, 1 * 4 + 4)
    assert (found["lead_subtasks"].value, found["lead_subtasks"].n) == (1.0, 1)
    assert found["lead_s"].value == 10.0


def test_harm_after_the_last_step_is_led_until_the_end_of_the_run() -> None:
    row = failing(0, judged=seen(0.95, 0.95, 0.5, 0.95), effect=4, simulated_s=47.0)
    found = point_metrics(at_thresholds(Watches.of([row]), "scene-graph", (0.9,)))
    assert (found["lead_subtasks"].value, found["lead_s"].value) == (2.0, 27.0)


def test_false_alarms_are_counted_by_run_and_by_boundary_apart() -> None:
    rows = [
        good(0, judged=seen(0.5, 0.5, 0.95, 0.95)),
        good(1, judged=seen(0.95, 0.95, 0.95, 0.95)),
        good(0, of="harmless", judged=seen(0.95, 0.95, 0.95, 0.5)),
        failing(0, judged=seen(0.95, 0.5, 0.95, 0.95)),
    ]
    found = point_metrics(at_thresholds(Watches.of(rows), "scene-graph", (0.9,)))
    counted = {m: (v.count, v.n) for m, v in found.items() if m.startswith("false")}
    hours = {m: found[m].value for m in list(counted) if "_per_hour_" in m and counted.pop(m)}
    assert counted == {
        "false_alarms_per_boundary_undisturbed": (2, 8),
        "false_alarms_per_run_undisturbed": (1, 2),
        "false_alarms_per_boundary_harmless": (1, 4),
        "false_alarms_per_run_harmless": (1, 1),
        "false_alarms_per_boundary_all": (3, 12),
        "false_alarms_per_run_all": (2, 3),
    }
    assert hours["false_alarms_per_hour_undisturbed"] == pytest.approx(2 / (200 / 3600))
    assert hours["false_alarms_per_hour_all"] == pytest.approx(3 / (300 / 3600))
    assert found["balanced_accuracy_undisturbed"].value == pytest.approx(0.75)
    assert found["balanced_accuracy_all"].value == pytest.approx((1 + 1 / 3) / 2)


def test_an_alarm_is_unfounded_where_the_truth_says_go_on() -> None:
    """A step is refused, and the goal is reached without it."""
    right = tuple(replace(j, possible=j.index != 1) for j in seen(0.95, 0.5, 0.95, 0.95))
    rows = [good(0, judged=right), good(1, judged=seen(0.95, 0.5, 0.95, 0.95)), good(2)]
    found = point_metrics(at_thresholds(Watches.of(rows), "scene-graph", (0.9,)))
    counted = {m: (found[f"{m}_per_run_all"].count) for m in ("false_alarms", "unfounded")}
    assert counted == {"false_alarms": 2, "unfounded": 1}


def test_a_failing_run_is_told_apart_from_its_twin_by_an_alarm_that_the_twin_has_not() -> None:
    calm, alarmed = seen(0.95, 0.95, 0.95, 0.95), seen(0.95, 0.5, 0.95, 0.95)
    rows = [
        *(failing(k, judged=j) for k, j in enumerate((alarmed, alarmed, calm, alarmed))),
        *(good(k, judged=j) for k, j in enumerate((calm, alarmed, calm))),
    ]
    found = point_metrics(at_thresholds(Watches.of(rows), "scene-graph", (0.9,)))["pairs_apart"]
    assert (found.count, found.n) == (1, 3)  # the fourth has no twin


def test_a_score_at_the_threshold_is_no_alarm() -> None:
    rows = [failing(0, judged=seen(0.9, 0.9))]
    assert point_metrics(at_thresholds(Watches.of(rows), "scene-graph", (0.9,)))["fdr"].count == 0


def test_mean_over_thresholds() -> None:
    rows = [failing(0, judged=seen(0.87, 0.95)), failing(1, judged=seen(0.7, 0.95))]
    found = point_metrics(at_thresholds(Watches.of(rows), "scene-graph", (0.9, 0.85, 0.8)))["fdr"]
    assert found.value == pytest.approx((1 / 3 + 1) / 2)
    assert (found.n, found.count) == (2, None)


def test_trivial_detectors() -> None:
    bad = failing(0, judged=tuple(replace(j, reachable=j.index < 1) for j in seen(0.9, 0.5, 0.9)))
    rows = [bad] + [good(k, judged=seen(0.95, 0.95, 0.5)) for k in range(30)]
    own = at_thresholds(Watches.of(rows), "scene-graph", (0.9,))
    found = {name: point_metrics(alarms) for name, alarms in trivial(own.of, own).items()}
    per_run = "false_alarms_per_run_undisturbed"
    assert (found[ALWAYS]["fdr"].value, found[ALWAYS][per_run].value) == (1.0, 1.0)
    assert found[ALWAYS]["balanced_accuracy_all"].value == 0.5
    assert (found[NEVER]["fdr"].value, found[NEVER][per_run].value) == (0.0, 0.0)
    assert (found[TRUTH]["in_time"].value, found[TRUTH][per_run].value) == (1.0, 0.0)
    assert found[RANDOM]["false_alarms_per_boundary_undisturbed"].value == pytest.approx(
        1 / 3, abs=0.02
    )
    assert found[RANDOM][per_run].value == pytest.approx(1 - (2 / 3) ** 3, abs=0.02)


def test_an_alarm_that_the_reasoner_does_not_confirm_is_none() -> None:
    alarm = [replace(j, decision="replan") for j in seen(0.5, 0.5)]
    rows = [
        failing(0, judged=(replace(alarm[0], confirmed=True), alarm[1])),
        failing(1, judged=tuple(alarm)),
    ]
    assert point_metrics(by_rule(Watches.of(rows), confirmed))["fdr"].count == 1


def test_a_detector_is_measured_on_the_runs_that_it_watched() -> None:
    both = judged({"scene-graph": [0.5], "image": [0.99]})
    rows = [failing(0, judged=both), failing(1, judged=seen(0.5)), failing(2, end="error")]
    assert Watches.of(rows).names == ("image", "scene-graph")
    assert point_metrics(at_thresholds(Watches.of(rows), "image", (0.9,)))["fdr"].n == 2
    found = point_metrics(at_thresholds(Watches.of(rows), "scene-graph", (0.9,)))["fdr"]
    assert (found.count, found.n) == (2, 3), "a run that broke off counts as undetected"


def test_an_episode_counts_once() -> None:
    with pytest.raises(InputError, match="same episode"):
        canonical([failing(0), failing(0)])
    with pytest.raises(InputError, match="one case"):
        Watches.of([failing(0), failing(0, threshold=0.8)])


def test_a_failing_run_must_say_when_it_can_be_known() -> None:
    rows = [failing(0, known=None, effect=None, judged=seen(0.5))]
    with pytest.raises(InputError, match="can be known"):
        point_metrics(at_thresholds(Watches.of(rows), "scene-graph", (0.9,)))


@settings(max_examples=30, deadline=None)
@given(st.lists(st.booleans(), min_size=1, max_size=60))
def test_an_exact_interval_holds_its_value(hits: list[bool]) -> None:
    found = proportion(hits)
    assert found.value is not None and found.low is not None and found.high is not None
    assert 0 <= found.low <= found.value <= found.high <= 1
