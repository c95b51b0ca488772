"""The view in headless Chromium: every control, both widths, a run while it happens, axe."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from browsers import WIDTHS, assert_fits, axe_says, page_of
from forestall.files import alone
from forestall.records.beside import folder_beside
from forestall.records.record import RunRecorder, write_record
from forestall.view.choosing import EACH
from report import records

from .folders import LONG, NASTY, add_episode, begin_experiment, make, named, shown

pytestmark = pytest.mark.slow


@pytest.mark.parametrize("where", list(WIDTHS))
def test_every_control_of_the_index(tmp_path: Path, chromium: Any, where: str) -> None:
    folder = tmp_path / "runs"
    make(folder)
    for k, name in enumerate(NASTY):
        write_record(folder / f"nasty-{k}", named(records.empty_record(), name, name))
    page, asked = page_of(chromium, where), []
    page.on("request", lambda request: asked.append(request.url))
    with shown(folder) as server:
        page.goto(server.address)
        assert_fits(page)
        assert page.locator("#count").text_content() == "8 of 8 runs"
        assert page.title() == "Runs in runs"
        compare = page.get_by_role("button", name="Compare two runs")
        assert compare.is_disabled()
        for name, value, count in (("outcome", "succeeded", 2), ("alarm", "with", 2)):
            with page.expect_navigation():
                page.locator(f"#filter-{name}").select_option(value)
            assert page.locator("#count").text_content() == f"{count} of 8 runs"
        page.locator("input[name=run]").nth(0).check()
        page.locator("input[name=run]").nth(1).check()
        with page.expect_navigation():
            compare.click()
        page.get_by_role("heading", name="Two runs side by side").wait_for()
        assert_fits(page)
        with page.expect_navigation():  # its script is there, too
            page.get_by_role("link", name="All runs").click()
        with page.expect_navigation():
            page.locator("#filter-task").select_option("heat-potato")
        page.locator("a[href='/run/good/']").click()
        page.locator("#scrub").wait_for()
        page.keyboard.press("ArrowRight")  # its own script runs under the policy of the server
        assert page.locator("#where").text_content() == "1 of 14"
        page.get_by_role("link", name="All runs").click()
        page.get_by_role("link", name="experiment", exact=True).click()
        page.get_by_role("link", name="one").click()
        page.locator("#timeline").wait_for()
        home = server.address
        page.context.close()
    assert all(url.startswith((home, "data:")) for url in asked)


@pytest.mark.parametrize("where", list(WIDTHS))
def test_a_run_is_followed_to_its_end(tmp_path: Path, chromium: Any, where: str) -> None:
    record = records.potato_record(width=160, height=120)
    recorder = RunRecorder(tmp_path / "run")
    recorder.on_start(records.begun(record))
    page = page_of(chromium, where)
    with shown(tmp_path) as server:
        page.goto(f"{server.address}run/run/")
        assert page.get_by_role("status").text_content().startswith("▸ running: 0 of 11")
        for boundary, context in records.calls(record)[: records.ALARM_INDEX + 1]:
            recorder.on_boundary(boundary, context)
        page.get_by_text(records.SENTENCE).wait_for()
        page.get_by_alt_text("The newest picture").wait_for()
        assert_fits(page)
        write_record(tmp_path / "run", record)
        page.locator("#timeline").wait_for()
        page.context.close()


@pytest.mark.parametrize("where", list(WIDTHS))
def test_a_batch_is_followed_and_the_index_with_it(
    tmp_path: Path, chromium: Any, where: str
) -> None:
    folder = tmp_path / "batch"
    begin_experiment(folder, 3)
    page = page_of(chromium, where)
    with shown(tmp_path) as server, alone(folder):
        page.goto(server.address)
        page.get_by_text("0 of 3 episodes").wait_for()
        add_episode(folder, scenario=LONG)
        page.get_by_text("1 of 3 episodes").wait_for()
        assert_fits(page)
        page.get_by_role("link", name="batch").click()
        page.get_by_role("status").get_by_text("1 of 3 episodes").wait_for()
        assert_fits(page)
        add_episode(folder, success=False)
        page.get_by_text("2 of 3 episodes").wait_for()
        assert page.locator("ol.lines li").count() == 2
        page.context.close()


def test_without_javascript_it_works_as_well(tmp_path: Path, chromium: Any) -> None:
    for k in range(EACH + 1):
        empty = replace(records.empty_record(), seed=k)
        write_record(tmp_path / "runs" / f"{k:03d}", empty)
    page = page_of(chromium, "phone", java_script_enabled=False)
    with shown(tmp_path / "runs") as server:
        page.goto(server.address)
        page.get_by_role("link", name="older").click()
        assert page.locator("tbody tr").count() == 1
        page.get_by_role("link", name="newer").click()
        page.locator("#filter-outcome").select_option("failed")
        page.get_by_role("button", name="Show").click()
        page.locator("input[name=run]").nth(0).check()
        page.get_by_role("button", name="Compare two runs").click()
        page.get_by_text("Choose two runs to compare; 1 were chosen.").wait_for()
        page.context.close()


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_axe_finds_nothing(tmp_path: Path, chromium: Any, scheme: str) -> None:
    folder = tmp_path / "runs"
    make(folder)
    begin_experiment(folder / "batch", 3)
    add_episode(folder / "batch")
    write_record(folder_beside(folder / "good", "none"), records.unjudged_record())
    page = page_of(chromium, "phone", color_scheme=scheme, bypass_csp=True)
    pair = "compare?run=good&run=deep/bad"
    with shown(folder) as server, alone(folder / "batch"):
        for path in ("", "run/good/", "run/begun/", pair, "experiment/batch/", "none"):
            page.goto(f"{server.address}{path}")
            assert axe_says(page) == "", path
        page.context.close()
