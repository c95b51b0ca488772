"""Robustness: which runs, through which sensors, and what comes out of their rows."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from experiments.episodes import computed_row
from forestall.errors import InputError, UnknownNameError
from forestall.experiments.conduct import Experiment, conduct
from forestall.experiments.robustness import (
    DISTURBANCES,
    EXPERIMENT_KIND,
    FIGURE,
    RUNS,
    SUMMARY,
    Robustness,
    points,
    present,
    without_sensor,
)
from forestall.experiments.settings import Settings
from forestall.experiments.worker import Work, config_of
from forestall.kinds import SENSOR
from forestall.sensors import Errors
from forestall.statistics.rows import PERFECT, EpisodeRow

CHOICE = Robustness(limit=2, disturbances=("missed", "identities"))


def seen_row(work: Work) -> dict[str, Any]:
    """A row with an alarm in undisturbed runs where a quarter of the masks is missing."""
    row = EpisodeRow.from_json(computed_row(work))
    if work.run.sensor == "missed=0.25":
        judged = tuple(replace(j, scores={"scene-graph": 0.5}) for j in row.judged)
        row = replace(row, judged=judged)
    if work.run.sensor == "identities=false":
        row = replace(row, error="the camera froze", end="held")
    if work.run.case.failing:
        row = replace(row, known=1, effect=2)
    return row.to_json()


def play(out: Path, choice: Robustness = CHOICE) -> list[EpisodeRow]:
    experiment = Experiment(
        choice, engine="inline", settings=Settings(pages="none"), kind=EXPERIMENT_KIND
    )
    return conduct(experiment, out, lambda *a: None, seen_row, lambda *a: None)


def test_every_case_is_seen_through_every_sensor_the_perfect_one_first() -> None:
    runs = CHOICE.runs()
    sensors = [PERFECT, "missed=0.05", "missed=0.1", "missed=0.25", "identities=false"]
    assert [r.sensor for r in runs] == sensors * 4
    assert {r.case.set for r in runs} == {"robofail", "undisturbed"}
    assert {r.strategy for r in runs} == {"watch"}
    assert all(10_000 <= r.case.seed < 20_000 for r in runs)
    assert len({r.key for r in runs}) == len(runs)


def test_only_some_tasks_may_be_run() -> None:
    runs = Robustness(limit=3, disturbances=("identities",), tasks=("make-coffee",)).runs()
    assert {r.case.task for r in runs} == {"make-coffee"}
    assert len({r.case for r in runs}) == 6


def test_a_run_looks_through_what_its_sensor_says() -> None:
    for run in Robustness(limit=1).runs():
        chosen = config_of(run, Settings()).choice(SENSOR)
        if "=" not in run.sensor:
            assert chosen.name == run.sensor
        else:
            errors = Errors(**{k: v for k, v in chosen.options.items() if k in Errors.__slots__})
            assert errors != Errors()


def test_no_disturbance_is_called_like_another_and_each_strength_has_words() -> None:
    sensors = [s for d in DISTURBANCES for s in d.sensors]
    assert len(set(sensors)) == len(sensors)
    assert all(len(d.sensors) == len(d.strengths) for d in DISTURBANCES)


def test_rows_become_a_table_and_a_figure_and_are_not_run_again(tmp_path: Path) -> None:
    rows = play(tmp_path)
    made = present(tmp_path)
    assert [row[:2] for row in made.rows] == [
        (PERFECT, "nothing wrong"),
        ("missed", "share 5 %"),
        ("missed", "share 10 %"),
        ("missed", "share 25 %"),
        ("identities", "none"),
    ]
    rates = {p.strength: p.rates[RUNS] for p in points(rows)}
    assert (rates["nothing wrong"].count, rates["share 25 %"].count) == (0, 2)
    assert made.rows[3][4].startswith("100.0 %") and made.rows[0][4].startswith("0.0 %")
    assert [row[-1] for row in made.rows] == ["0", "0", "0", "0", "4"]
    told = json.loads((tmp_path / SUMMARY).read_text())
    assert (told["split"], len(told["points"])) == ("development", 5)
    svg = (tmp_path / FIGURE).read_text()
    assert "missed" in svg and "identities" in svg and "share 25 %" in svg
    lines = (tmp_path / "episodes.jsonl").read_text()
    assert play(tmp_path) == rows
    assert (tmp_path / "episodes.jsonl").read_text() == lines


def test_what_does_not_fit_is_said(tmp_path: Path) -> None:
    with pytest.raises(UnknownNameError, match="missed"):
        Robustness(disturbances=("mised",)).runs()
    with pytest.raises(UnknownNameError, match="honest"):
        Robustness(profile="honst").runs()
    with pytest.raises(UnknownNameError, match="heat-potato"):
        Robustness(tasks=("heat-potatoe",)).runs()
    with pytest.raises(InputError, match="--limit 0"):
        Robustness(limit=0).runs()
    with pytest.raises(InputError, match="by itself"):
        without_sensor(["world", "sensor"])
    play(tmp_path, Robustness(limit=1, disturbances=("identities",)))
    with pytest.raises(UnknownNameError, match="scene-graph"):
        present(tmp_path, "scene-grap")
