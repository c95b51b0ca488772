"""Judges under one bound: thresholds come from the calibration runs, counts from the others."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from rows_by_hand import failing, good, judged

from forestall.errors import InputError
from forestall.statistics.bounded import bounded
from forestall.statistics.rows import EpisodeRow
from forestall.statistics.summary import summary
from forestall.statistics.tables import tables

CHECK, SCORE = "plan-check", "scene-graph"


def calm(lowest: list[tuple[float, float]]) -> list[EpisodeRow]:
    """Good runs in rooms of their own, with the lowest score and check of each."""
    return [
        good(1000 + k, judged=judged({SCORE: (1.0, s), CHECK: (1.0, c)}))
        for k, (s, c) in enumerate(lowest)
    ]


ROWS = [
    failing(0, judged=judged({SCORE: (1.0, 0.6, 0.6, 1.0), CHECK: (1.0, 0.0, 0.0, 0.0)})),
    failing(1, judged=judged({SCORE: (1.0, 0.8, 0.8, 1.0), CHECK: (1.0, 0.0, 0.0, 0.0)})),
    good(50, judged=judged({SCORE: (1.0, 0.8), CHECK: (1.0, 1.0)})),
]


def test_a_threshold_is_the_lowest_that_so_many_good_runs_allow() -> None:
    apart = calm([(0.7, 1.0), *[(0.9, 1.0)] * 18])
    found = bounded(ROWS, apart, 0.05)
    assert (found["runs"], found["smallest_level"]) == (19, 0.05)
    score = found["judges"][SCORE]
    assert score["thresholds"] == [0.7]
    assert (score["in_time"].count, score["in_time"].n) == (1, 2)
    assert score["false_alarms_per_run_undisturbed"].value == 0.0
    assert bounded(ROWS, apart[:18], 0.05)["judges"][SCORE]["thresholds"] == [None]


def test_a_check_that_alarms_in_too_many_good_runs_may_not_alarm() -> None:
    quiet = bounded(ROWS, calm([(1.0, 1.0)] * 39), 0.05)["judges"][CHECK]
    assert (quiet["thresholds"], quiet["in_time"].value) == ([1.0], 1.0)
    loud = bounded(ROWS, calm([(1.0, 0.0)] * 5 + [(1.0, 1.0)] * 34), 0.05)["judges"]
    assert loud[CHECK]["in_time"].value == 0.0
    assert loud[f"{SCORE} and {CHECK}"]["in_time"].value == 1.0


def test_an_alarm_that_was_right_does_not_count_against_the_bound() -> None:
    """A step that is refused, in a run that goes well without it."""
    refused = calm([(1.0, 0.0)] * 5 + [(1.0, 1.0)] * 34)
    known = [
        replace(row, judged=tuple(replace(j, possible=j.scores[CHECK] != 0.0) for j in row.judged))
        for row in refused
    ]
    found = bounded(ROWS, known, 0.05)["judges"][CHECK]
    assert (found["thresholds"], found["in_time"].value) == ([1.0], 1.0)


def test_together_they_keep_to_the_bound_in_new_rooms() -> None:
    random = np.random.default_rng(5)

    def drawn(count: int) -> list[tuple[float, float]]:
        hard = random.random(count)
        return [(1 - h * random.random(), float(h < 0.98)) for h in hard]

    apart = calm(drawn(99))
    new = [replace(row, seed=30_000 + k) for k, row in enumerate(calm(drawn(2000)))]
    judges = bounded(new, apart, 0.1)["judges"]
    for name in (SCORE, f"{SCORE} or {CHECK}", f"{SCORE} and {CHECK}"):
        rate = judges[name]["false_alarms_per_run_undisturbed"].value
        assert 0 < rate < 0.2, name
    mean = np.mean(
        [
            bounded(new[:200], calm(drawn(49)), 0.1)["judges"][f"{SCORE} or {CHECK}"][
                "false_alarms_per_run_undisturbed"
            ].value
            for _ in range(20)
        ]
    )
    assert mean < 0.13, "0.1, and what chance adds in 20 calibrations"


def test_rooms_that_are_counted_calibrate_nothing() -> None:
    with pytest.raises(InputError, match="calibrated in a room that is counted"):
        bounded(ROWS, [replace(ROWS[2], judged=ROWS[2].judged)])


def test_the_table_is_there_where_something_was_calibrated() -> None:
    made = {t.name: t for t in tables(summary(ROWS, {}, calibration=calm([(0.7, 1.0)] * 19)))}
    lines = {row[0]: row[1:3] for row in made["bounded"].rows}
    assert lines[SCORE][0] == "0.700"
    assert lines[SCORE][1].startswith("50.0 %")
    assert "bounded" not in {t.name for t in tables(summary(ROWS, {}))}
