from __future__ import annotations

import csv
import xml.etree.ElementTree as ET
from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from forestall.report import figure_data, figure_households
from forestall.report.experiment_page import write_experiment
from forestall.statistics import intervals
from forestall.statistics.cells import DASH
from forestall.statistics.rows import EpisodeRow
from forestall.statistics.summary import summary
from forestall.statistics.tables import tables

from .experiment_rows import case_rows, experiment
from .household_rows import both
from .test_page import Page

HOSTILE = "</td><script>alert(1)</script>&\"'{{x}}"
FIGURES = (
    "households",
    "in-time",
    "risk",
    "success",
    "timelines",
    "roc",
    "kinds",
    "knowability",
    "scores",
    "time",
)
META: Mapping[str, Any] = {
    "title": "The experiments, test split",
    "split": "test",
    "seeds": "20000 to 20009",
    "machine": {"cores": 2},
    "minutes": 18.25,
    "findings": ["One dirty pan among ten clean things moves the mean by little."],
    "names": {"image": "image (stand-in: colours)"},
}


pytestmark = pytest.mark.slow
"""Every figure of an experiment is drawn, several times."""


@pytest.fixture(autouse=True, scope="module")
def few_draws() -> Any:
    """Fewer draws of the bootstrap: these tests are about what is shown."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(intervals, "RESAMPLES", 40)
        intervals._draws.cache_clear()
        yield
    intervals._draws.cache_clear()


@cache
def whole() -> tuple[tuple[EpisodeRow, ...], dict[str, Any]]:
    rows = tuple(experiment(each=6))
    return rows, summary(rows, {})


def content() -> dict[str, Any]:
    """What the only household says."""
    found: dict[str, Any] = whole()[1]["profiles"]["kind"]
    return found


def write(
    folder: Path,
    rows: Sequence[EpisodeRow],
    made: Mapping[str, Any] | None = None,
    meta: Mapping[str, Any] = META,
    links: Mapping[str, str] | None = None,
) -> tuple[Page, str]:
    made = summary(rows, {}) if made is None else made
    path = write_experiment(folder, rows, made, tables(made), meta, links)
    assert path == folder / "index.html"
    text = path.read_text(encoding="utf-8")
    return Page(text), text


@pytest.fixture(scope="module")
def written(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Page, str]:
    folder = tmp_path_factory.mktemp("whole")
    rows, made = whole()
    return folder, *write(folder, rows, made)


def test_the_page_says_what_was_run(written: tuple[Path, Page, str]) -> None:
    _, page, _ = written
    words = page.words
    for text in ("The experiments, test split", "20000 to 20009", "cores 2", "18.25"):
        assert text in words
    assert str(len(whole()[0])) in words
    assert "One dirty pan among ten clean things moves the mean by little." in words
    assert "image (stand-in: colours)" in words


def test_every_ordering_is_there_with_its_verdict(written: tuple[Path, Page, str]) -> None:
    _, page, _ = written
    found = content()["orderings"]
    assert len({o["verdict"] for o in found}) > 1
    for ordering in found:
        assert ordering["sentence"] in page.words


def test_ours_stands_beside_the_paper_with_interval_and_false_alarms(
    written: tuple[Path, Page, str],
) -> None:
    _, page, _ = written
    line = next(p for p in content()["paper"] if p["what"] == "detection, full score")
    ours, false = line["ours"], line["false_alarms"]["harmless"]
    start = page.words.index("detection, full score")
    cells = page.words[start : start + 10]
    assert "94.01 %" in cells
    assert f"{100 * ours['value']:.1f} %" in cells
    assert f"{100 * ours['low']:.1f} to {100 * ours['high']:.1f}" in cells
    rate = f"{100 * false['value']:.1f} % ({100 * false['low']:.1f} to {100 * false['high']:.1f})"
    assert rate in cells


def test_what_was_not_measured_is_no_number(written: tuple[Path, Page, str]) -> None:
    _, page, _ = written
    line = next(p for p in content()["paper"] if p["ours"]["value"] is None)
    start = page.words.index(line["what"])
    assert "not measured" in page.words[start : start + 5]


def test_every_figure_is_a_file_and_on_the_page(written: tuple[Path, Page, str]) -> None:
    folder, page, _ = written
    assert {p.stem for p in (folder / "figures").glob("*")} == set(FIGURES)
    for name in FIGURES:
        assert ET.parse(folder / "figures" / f"{name}.svg").getroot().tag.endswith("svg")
        assert f"figures/{name}.svg" in page.links
        assert f"figure-{name}" in page.ids
    assert len(page.ids) == len(set(page.ids))
    assert sum(tag == "svg" for tag, _ in page.tags) == len(FIGURES)


def test_every_table_is_a_file_in_both_forms_and_on_the_page(
    written: tuple[Path, Page, str],
) -> None:
    folder, page, _ = written
    found = tables(whole()[1])
    assert found
    for table in found:
        assert table.title in page.words
        assert (folder / "tables" / f"{table.name}.md").read_text("utf-8") == table.markdown()
        with (folder / "tables" / f"{table.name}.csv").open(encoding="utf-8", newline="") as file:
            assert tuple(map(tuple, csv.reader(file))) == (table.header, *table.rows)
        assert {f"tables/{table.name}.md", f"tables/{table.name}.csv"} <= set(page.links)
        for cell in (c for row in table.rows for c in row):
            assert cell in page.words


def test_the_page_needs_nothing_from_elsewhere(written: tuple[Path, Page, str]) -> None:
    _, page, text = written
    assert page.sources == []
    assert all(not link.startswith(("http", "//")) for link in page.links)
    assert "@import" not in text
    assert set(page.described) <= set(page.ids)


def test_all_episodes_are_listed_and_can_be_filtered(written: tuple[Path, Page, str]) -> None:
    _, page, text = written
    body = text[text.index('id="episodes-table"') :]
    assert body.count("<tr>") == len(whole()[0]) + 1
    selects = [attrs for tag, attrs in page.tags if tag == "select"]
    heads = ["set", "task", "scenario", "kind", "seed", "strategy", "goal"]
    columns = [heads[int(s["data-column"])] for s in selects]
    assert columns == ["set", "task", "kind", "strategy", "goal"]
    assert "without reasoning" in body


def test_links_only_where_they_were_given(tmp_path: Path) -> None:
    rows, made = whole()
    linked = {rows[0].key: "episodes/one/index.html", "no such row": "episodes/two.html"}
    page, _ = write(tmp_path, rows, made, links=linked)
    others = [x for x in page.links if not x.startswith(("figures/", "tables/", "#", "data:"))]
    assert others == ["episodes/one/index.html"]


def test_the_same_rows_give_the_same_bytes_in_any_order(tmp_path: Path) -> None:
    rows, made = whole()
    write(tmp_path / "a", rows, made)
    shuffled = [rows[int(i)] for i in np.random.default_rng(1).permutation(len(rows))]
    write(tmp_path / "b", shuffled, made)
    files = sorted(p.relative_to(tmp_path / "a") for p in (tmp_path / "a").rglob("*.*"))
    assert len(files) > 20
    for file in files:
        assert (tmp_path / "a" / file).read_bytes() == (tmp_path / "b" / file).read_bytes()


def test_hostile_names_stay_text(tmp_path: Path) -> None:
    rng = np.random.default_rng(3)
    rows = []
    for of, kind in (("irreversible", HOSTILE), ("robofail", HOSTILE), ("undisturbed", None)):
        rows += case_rows(rng, of, HOSTILE, kind and HOSTILE, kind, 20_000)
    rows = [replace(r, error=HOSTILE, end="error") for r in rows[:1]] + rows[1:]
    meta = {"title": HOSTILE, HOSTILE: HOSTILE, "findings": [HOSTILE], "names": {"image": HOSTILE}}
    page, text = write(tmp_path, rows, meta=meta, links={rows[1].key: 'x" onclick="y'})
    assert text.count("<script") == 1
    assert "<script>alert" not in text
    assert page.words.count(HOSTILE) > 5
    assert all("onclick" not in attrs for _, attrs in page.tags)
    for path in (tmp_path / "figures").glob("*.svg"):
        ET.parse(path)


def test_an_episode_that_broke_off_is_told_from_a_failed_one(tmp_path: Path) -> None:
    rng = np.random.default_rng(3)
    rows = case_rows(rng, "robofail", "boil-water", "a", "drop", 20_000)
    rows[0] = replace(rows[0], success=True, end="error", error="the worker died")
    page, _ = write(tmp_path, rows)
    assert "! broke off" in page.words
    assert "the worker died" in page.words
    assert any("broke off; they count as failed" in w for w in page.words)


@pytest.mark.parametrize(
    ("strategies", "missing"),
    [
        ((), {*FIGURES, "demonstrations"}),
        (
            ("proactive",),
            {"timelines", "roc", "kinds", "knowability", "scores"}
            | {"in-time", "risk", "demonstrations"},
        ),
        (("watch",), {"timelines", "demonstrations"}),
    ],
)
def test_what_is_missing_is_said(
    tmp_path: Path, strategies: tuple[str, ...], missing: set[str]
) -> None:
    rng = np.random.default_rng(3)
    rows: list[EpisodeRow] = []
    for of, name in (("robofail", "a"), ("undisturbed", None)) if strategies else ():
        rows += case_rows(rng, of, "boil-water", name, name and "drop", 20_000, strategies)
    page, _ = write(tmp_path, rows)
    assert {p.stem for p in (tmp_path / "figures").glob("*")} == set(FIGURES) - missing
    assert sum(w.startswith("Missing: ") for w in page.words) == len(missing)
    if not rows:
        assert "No episode was run." in page.words


@pytest.fixture(scope="module")
def two(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Page, dict[str, Any]]:
    rows = both(scenarios=2, rooms=2, acted=1)
    made = summary(rows, {})
    folder = tmp_path_factory.mktemp("two")
    return folder, write(folder, rows, made)[0], made


def test_two_households_stand_side_by_side(two: tuple[Path, Page, dict[str, Any]]) -> None:
    folder, page, made = two
    asked, beside, acted = tables(made)[:3]
    assert (asked.name, beside.name) == ("sentences", "side-by-side")
    assert acted.name == "strategies-side-by-side"
    assert [row[0] for row in asked.rows] == [str(k) for k in range(1, 11)]
    assert DASH not in {c for row in asked.rows for c in row}, "all ten are measured in both"
    first = page.words.index(asked.title)
    assert first < page.words.index(beside.title) < page.words.index("What was run")
    for cell in (c for row in (*asked.rows, *beside.rows, *acted.rows) for c in row):
        assert cell in page.words
    assert {p.stem for p in (folder / "figures").glob("*")} == {*FIGURES, "demonstrations"}
    for path in (folder / "figures").glob("*.svg"):
        ET.parse(path)


def test_figures_show_what_the_summary_holds(two: tuple[Path, Page, dict[str, Any]]) -> None:
    contents = two[2]["profiles"]
    panels = dict(figure_households.in_time(two[2], lambda n: n))
    assert list(panels) == ["kind", "honest"]
    for profile, lines in panels.items():
        score = next(x for x in lines if x.label.startswith("scene-graph  (area"))
        own = contents[profile]["detectors"]["scene-graph"]
        marked = (own[m]["value"] for m in ("false_alarms_per_run_all@0.90", "in_time@0.90"))
        assert score.mark == tuple(marked)
        check = next(x for x in lines if x.label.startswith("plan-check  (area"))
        hit = contents[profile]["detectors"]["plan-check"]["in_time"]
        assert check.points == () and check.span == (hit["low"], hit["high"])
    for profile, lines in figure_households.risk(two[2], lambda n: n):
        found = contents[profile]["detectors"]
        false = {x.label: x.mark and x.mark[0] for x in lines}
        for judge in ("scene-graph", "plan-check", "scene-graph or plan-check"):
            end = "@0.90" if judge == "scene-graph" else ""
            assert false[judge] == pytest.approx(
                found[judge][f"false_alarms_per_hour_all{end}"]["value"]
            )
    known = {title for title, _, _ in figure_households.demonstrations(two[2], lambda n: n)}
    assert known == {"kind", "honest"}
    (_, dots), (_, others) = figure_households.strategies(two[2], lambda n: n)
    assert [d.label for d in dots] == [d.label for d in others]


def test_a_figure_of_an_earlier_run_does_not_stay(tmp_path: Path) -> None:
    rows, made = whole()
    write(tmp_path, rows, made)
    write(tmp_path, [])
    assert list((tmp_path / "figures").glob("*")) == []


def test_operating_points_lie_where_the_summary_has_them() -> None:
    made = content()
    panels = figure_data.roc(made, lambda name: name)
    assert [title for title, _ in panels] == ["detectors", "parts of the score"]
    curves = {c.label: c for c in panels[0][1]}
    metrics = made["detectors"]["scene-graph"]
    marks = {t: (x, y) for t, x, y in curves["scene-graph"].marks}
    for at in (0.9, 0.85, 0.8):
        x, y = marks[at]
        assert y == metrics[f"fdr@{at:.2f}"]["value"]
        parts = [metrics[f"false_alarms_per_run_{s}@{at:.2f}"] for s in ("undisturbed", "harmless")]
        assert x == pytest.approx(sum(p["count"] for p in parts) / sum(p["n"] for p in parts))
    assert curves["always"].points == ((1.0, 1.0),)
    assert curves["never"].points == ((0.0, 0.0),)
    assert all(c.single for c in panels[0][1] if c.label in ("always", "never", "random"))


def test_alarms_in_time_late_and_early_add_up_to_the_detected() -> None:
    made = content()
    for group, (_, shares) in zip(
        ("scene", "plan", "after"), figure_data.knowability(made, lambda n: n), strict=True
    ):
        for share in shares:
            key = f"{share.label}@0.90"
            detected = made["by_knowable"]["robofail"][group]["detectors"][key]["fdr"]
            assert share.in_time + share.late + share.early == pytest.approx(detected["value"])
            assert min(share.in_time, share.late, share.early) >= 0


def test_timelines_show_the_salad_and_when_it_was_too_late() -> None:
    rows, _ = whole()
    found = figure_data.timelines(rows, lambda n: n)
    assert found is not None
    row, lanes = found
    assert (row.set, row.task) == ("irreversible", "make-salad")
    assert [lane.label for lane in lanes] == ["none", "post-hoc", "online", "proactive"]
    of_case = {r.strategy: r for r in rows if figure_data.case_of(r) == figure_data.case_of(row)}
    assert lanes[0].harmed_s == of_case["watch"].harmed_s
    assert lanes[0].alarms == ()
    assert lanes[3].alarms == (12.0 * (row.known or 0),)
    assert lanes[3].known_s == 12.0 * (row.known or 0)
    other = next(r for r in rows if r.set == "robofail")
    chosen = figure_data.timelines(rows, lambda n: n, figure_data.case_of(other))
    assert chosen is not None
    assert figure_data.case_of(chosen[0]) == figure_data.case_of(other)
