"""The pages in headless Chromium, as raters use them, at the width of a desktop and of a phone."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from browsers import WIDTHS, assert_fits, axe_says, page_of
from forestall.study.answers import read_raters
from forestall.study.assigning import Design
from forestall.study.reporting import report_of, report_page
from forestall.study.simulated import simulate, write_simulated

from .studies import LONG, NASTY, make
from .test_reporting import TASTE
from .test_serving import served

pytestmark = pytest.mark.slow


@pytest.mark.parametrize("where", list(WIDTHS))
def test_a_study_is_answered_by_mouse_and_keys_killed_and_resumed(
    tmp_path: Path, chromium: Any, where: str
) -> None:
    study = make(tmp_path, 4, Design(1), NASTY)
    count, asked = len(study.raters[0]), []
    page = page_of(chromium, where)
    page.on("request", lambda request: asked.append(request.url))
    with served(tmp_path) as server:
        home = server.address
        page.goto(home)
        page.get_by_role("button", name="Begin").click()
        page.get_by_role("heading", name="Which explanation is better?").wait_for()
        page.get_by_label("A name or code").fill(LONG)
        page.get_by_label("I have read this").check()
        page.get_by_role("button", name="Begin").click()
        reached(page, 1, count)
        assert_fits(page)
        page.get_by_role("button", name="A is better").click()
        reached(page, 2, count)
        page.keyboard.press("s")
        reached(page, 3, count)
        page.keyboard.press("Backspace")
        reached(page, 2, count)
        page.get_by_role("button", name="Both or cannot tell", pressed=True).wait_for()
        page.keyboard.press("b")
        reached(page, 3, count)
        page.get_by_text("Pause").click()
        page.get_by_role("link", name="your own link").wait_for()
        assert_fits(page)
        state = page.context.storage_state()
        page.context.close()  # the rater goes away, the server is stopped
    with served(tmp_path) as server:
        page = page_of(chromium, where, storage_state=state)
        page.goto(server.address)
        for k in range(2, count):
            reached(page, k + 1, count)
            page.keyboard.press("a")
        page.get_by_role("heading", name="Thank you").wait_for()
        page.get_by_role("button", name="Next person").click()
        page.get_by_role("button", name="Begin").wait_for()
        page.context.close()
    (rater,) = read_raters(tmp_path, study)
    assert [a.choice for _, a in sorted(rater.answers.items())] == ["a", "b", *["a"] * (count - 2)]
    assert all(a.seconds is not None for a in rater.answers.values())
    assert all(url.startswith((home, "data:")) for url in asked)


def test_without_javascript_it_works_as_well(tmp_path: Path, chromium: Any) -> None:
    study = make(tmp_path, 2, Design(1))
    page = page_of(chromium, "phone", java_script_enabled=False)
    with served(tmp_path) as server:
        page.goto(server.address)
        page.get_by_label("I have read this").check()
        page.get_by_role("button", name="Begin").click()
        for _ in study.raters[0]:
            page.get_by_role("button", name="Both or cannot tell").click()
        page.get_by_role("heading", name="Thank you").wait_for()
        page.context.close()
    (rater,) = read_raters(tmp_path, study)
    assert {a.choice for a in rater.answers.values()} == {"both"}


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_axe_finds_nothing_that_a_screen_reader_would_miss(
    tmp_path: Path, chromium: Any, scheme: str
) -> None:
    study = make(tmp_path, 1, Design(1))
    page = page_of(chromium, "phone", color_scheme=scheme, bypass_csp=True)
    with served(tmp_path) as server:
        page.goto(server.address)
        found = [axe_says(page)]
        page.get_by_label("I have read this").check()
        page.get_by_role("button", name="Begin").click()
        reached(page, 1, len(study.raters[0]))
        found.append(axe_says(page))
        page.keyboard.press("a")
        page.get_by_role("heading", name="Thank you").wait_for()
        found.append(axe_says(page))
    larger = make(tmp_path / "larger", 30, Design(8))
    write_simulated(tmp_path / "larger", simulate(larger, TASTE, seed=1))
    page.set_content(report_page(report_of(larger, read_raters(tmp_path / "larger", larger))))
    found.append(axe_says(page))
    page.context.close()
    assert found == [""] * 4


def reached(page: Any, number: int, count: int) -> None:
    """Wait until a comparison is shown and its keys work."""
    expect = pytest.importorskip("playwright.sync_api").expect
    expect(page).to_have_title(f"{number} of {count}", timeout=120_000)
    page.wait_for_load_state()
