import csv
import io
import json
import random
from dataclasses import replace
from functools import cache
from typing import Any

import pytest
from rows_by_hand import failing, good, judged

from forestall.statistics.cells import DASH, Table, points, share
from forestall.statistics.paper import PAPER
from forestall.statistics.rows import EpisodeRow
from forestall.statistics.summary import summary
from forestall.statistics.tables import tables

NAMES = {"image": "image (stand-in: small encoder)"}


@cache
def experiment() -> tuple[EpisodeRow, ...]:
    rows = []
    for k in range(12):
        watch = judged({"scene-graph": [0.95, 0.7], "image": [0.92, 0.86 + k / 200]})
        fine = judged({"scene-graph": [0.95, 0.96], "image": [0.92, 0.88 + k / 200]})
        watch = tuple(replace(j, reachable=False, cause="a bowl") for j in watch)
        for of in ("robofail", "irreversible"):
            rows.append(failing(k, of=of, judged=watch, reasoning_s=5.0))
            for strategy in ("post-hoc", "online", "proactive"):
                success = k < {"post-hoc": 2, "online": 5, "proactive": 11}[strategy]
                rows.append(failing(k, strategy, of, success=success, reasoning_s=0.1 * k))
        rows.append(failing(k, "proactive", without="reasoning", success=k < 3))
        for threshold in (0.9, 0.85, 0.8):
            rows.append(failing(k, "proactive", detector="image", threshold=threshold))
        for of in ("undisturbed", "harmless"):
            rows.append(good(k, of=of, judged=fine))
            rows.append(good(k, "proactive", of, success=k > 0, replans=int(k < 2)))
    return tuple(rows)


def content() -> dict[str, Any]:
    """Of the only household."""
    found: dict[str, Any] = summarised()["profiles"]["kind"]
    return found


@cache
def summarised() -> dict[str, Any]:
    return summary(experiment(), {"machine": "test"}, names=NAMES)


def table(name: str, of: dict[str, Any] | None = None) -> Table:
    return next(t for t in tables(of or summarised()) if t.name == name)


def cell(found: Table, column: str, *begin: str) -> str:
    row = next(r for r in found.rows if r[: len(begin)] == begin)
    return row[found.header.index(column)]


def test_a_share_says_how_many_of_how_many() -> None:
    metric = {"value": 0.71, "low": 0.6107, "high": 0.7964, "n": 100, "count": 71}
    assert share(metric) == "71.0 % [61.1, 79.6] (71/100)"
    assert share({**metric, "low": None, "high": None}) == "71.0 % (71/100)"
    assert share({"value": None, "low": None, "high": None, "n": 0}) == DASH
    assert points({**metric, "count": None}) == "+71.0 points [+61.1, +79.6] (n = 100)"


def test_a_table_as_markdown_and_csv() -> None:
    found = Table("t", "Title", ("a", "b|c"), (("x, y", "1|2"),), "Note.")
    assert found.markdown() == (
        "### Title\n\n| a | b\\|c |\n| --- | --- |\n| x, y | 1\\|2 |\n\nNote.\n"
    )
    assert list(csv.reader(io.StringIO(found.csv()))) == [["a", "b|c"], ["x, y", "1|2"]]


def test_a_summary_is_plain_and_does_not_depend_on_the_order_of_rows() -> None:
    text = json.dumps(summarised(), allow_nan=False)
    shuffled = random.Random(1).sample(experiment(), len(experiment()))
    again = summary(shuffled, {"machine": "test"}, names=NAMES)
    assert json.dumps(again, allow_nan=False) == text
    assert tables(json.loads(text)) == tables(summarised())


def test_every_metric_has_its_value_interval_and_count() -> None:
    for name in ("strategies", "detectors"):
        for metrics in content()[name].values():
            groups = metrics.values() if name == "strategies" else [metrics]
            for group in groups:
                for metric in group.values():
                    assert metric.keys() >= {"value", "low", "high", "n", "method"}
                    assert (metric["value"] is None) == (metric["n"] == 0)
    success = content()["strategies"]["proactive"]["irreversible"]["success"]
    assert (success["count"], success["n"], success["method"]) == (11, 12, "exact")


def test_strategies_table() -> None:
    found = table("strategies")
    assert "(11/12)" in cell(found, "success", "irreversible", "proactive")
    assert "(0/12)" in cell(found, "success", "irreversible", "none")
    assert "(2/12)" in cell(found, "plan changed", "undisturbed", "proactive")


def test_the_harm_of_false_alarms_is_shown() -> None:
    found = table("monitor-or-none")
    assert cell(found, "success", "undisturbed", "proactive").startswith("-8.3 points")


def test_every_detection_rate_has_its_false_alarms_beside_it() -> None:
    found = table("detectors-robofail")
    fdr = "detected (as the paper counts)"
    shown = NAMES["image"]
    assert "(12/12)" in cell(found, fdr, "scene-graph", "0.85")
    assert "(8/12)" in cell(found, fdr, shown, "0.90")
    assert "(4/12)" in cell(found, "false alarms per run, undisturbed", shown, "0.90")
    assert "(n = 12)" in cell(found, fdr, shown, "mean")
    assert cell(found, "success of the proactive strategy", shown, "mean").endswith("(n = 12)")
    trivial = table("trivial-robofail")
    assert "(12/12)" in cell(trivial, fdr, "always")
    assert "(12/12)" in cell(trivial, "false alarms per run, harmless", "always")


def test_a_stand_in_is_called_one_in_every_table() -> None:
    everywhere = "\n".join(t.markdown() for t in tables(summarised()))
    assert everywhere.count(NAMES["image"]) > 20
    for cells in (c for t in tables(summarised()) for r in t.rows for c in r):
        assert "image" not in cells or "stand-in" in cells, cells


def test_measured_time_is_in_tables_of_its_own() -> None:
    slower = [replace(r, reasoning_s=r.reasoning_s + 7.0, compute_s={"x": 1}) for r in experiment()]
    other = {t.name: t for t in tables(summary(slower, {"machine": "test"}, names=NAMES))}
    for found in tables(summarised()):
        assert (other[found.name] != found) == found.timed, found.name


def test_missing_and_broken_episodes_are_said_below_every_table() -> None:
    rows = list(experiment())
    rows[0] = replace(rows[0], end="error", error="the worker died")
    found = summary(rows, {}, ["missing: 1 episodes of online on robofail"])
    assert found["episodes"]["errors"] == 1
    for one in tables(found):
        assert "missing: 1 episodes of online on robofail." in one.note
        assert f"1 of {len(rows)} episodes broke off" in one.note


def test_the_papers_numbers_are_beside_ours() -> None:
    values = [p.value for p in PAPER if p.unit == "%"]
    assert values == [70, 30, 20, 0, 94.01, 84.33, 82.67, 74.67, 70.33, 75.67, 75.67, 37.67]
    assert [p.value for p in PAPER if p.unit == "s"] == [109.2, 133.9, 151.0, 84.6]
    found = table("paper")
    assert "(11/12)" in cell(found, "ours", "success, proactive")
    assert cell(found, "ours", "detection, without edge matching") == DASH
    assert "(n = 12)" in cell(found, "ours", "detection, full score")
    assert "0.0 %" in cell(found, "with false alarms per run, undisturbed", "detection, full score")
    assert len(table("paper-times").rows) == 4


def test_groups_by_kind_task_and_knowability() -> None:
    for name, value in (("kind", "drop"), ("task", "make-coffee"), ("knowable", "scene")):
        found = table(f"strategies-by-{name}")
        assert "(11/12)" in cell(found, "success", "irreversible", value, "proactive")
        detected = table(f"detection-by-{name}")
        fdr = "detected (as the paper counts)"
        assert "(12/12)" in cell(detected, fdr, "robofail", value, "scene-graph at 0.90")


@pytest.mark.parametrize("rows", [(), experiment()[:1]])
def test_an_experiment_that_has_hardly_begun(rows: tuple[EpisodeRow, ...]) -> None:
    found = summary(rows, {})
    json.dumps(found, allow_nan=False)
    assert all(t.markdown().startswith("### ") for t in tables(found))
    assert {o["verdict"] for o in found["profiles"]["kind"]["orderings"]} == {"not measured"}
