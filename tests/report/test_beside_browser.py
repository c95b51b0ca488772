"""The same start under other strategies, on the page of a run in headless Chromium."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from browsers import WIDTHS, assert_fits, axe_says, page_of
from forestall.records.beside import folder_beside
from forestall.records.record import read_record, write_record
from forestall.report.page import write_page

from . import records

pytestmark = pytest.mark.slow

OTHERS = ("none", "online", "post-hoc")


def beside(folder: Path) -> str:
    """The page of a run that has the paper's other strategies beside it; the address of it."""
    write_record(folder, records.potato_record(width=160, height=120))
    for name in OTHERS:
        other = replace(records.unjudged_record(), strategy=name)
        place = folder_beside(folder, name)
        write_record(place, other)
        write_page(other, place / "index.html")
    return write_page(read_record(folder), folder / "index.html", folder).as_uri()


@pytest.mark.parametrize("scheme", ["light", "dark"])
@pytest.mark.parametrize("where", list(WIDTHS))
def test_strategies_beside_a_run(tmp_path: Path, chromium: Any, where: str, scheme: str) -> None:
    page = page_of(chromium, where, color_scheme=scheme)
    page.goto(beside(tmp_path / "run"))
    assert_fits(page)
    section = page.locator("#beside")
    drawing = section.get_by_role("region", name="timeline of the strategies")
    drawing.scroll_into_view_if_needed()
    drawing.locator("svg").wait_for()
    said = drawing.locator("svg").evaluate("e => e.textContent")
    assert all(name in said for name in (*OTHERS, "proactive"))
    rows = section.locator("tbody tr")
    assert rows.count() == 4 and rows.first.locator("td").first.inner_text() == "proactive this run"
    hidden = "e => e.scrollWidth - e.clientWidth"
    for region in (drawing, section.get_by_role("region", name="table of the strategies")):
        region.focus()
        assert region.evaluate("e => getComputedStyle(e).outlineStyle") != "none"
        if region.evaluate(hidden) > 0:  # the arrow keys are those of what scrolls
            region.press("ArrowRight")
            page.wait_for_function("e => e.scrollLeft > 0", arg=region.element_handle())
            assert page.locator("#where").text_content() != "1 of 14"
    assert drawing.evaluate(hidden) <= 0 or where == "phone"
    assert axe_says(page) == ""
    link = section.get_by_role("link", name="post-hoc")
    link.focus()
    with page.expect_navigation():
        page.keyboard.press("Enter")
    assert page.url.endswith("/beside/post-hoc/index.html")
    page.context.close()
