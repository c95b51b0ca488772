"""The page of a run in headless Chromium: every control, both widths, both colour schemes."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from browsers import WIDTHS, assert_fits, axe_says, page_of
from forestall.report.page import write_page

from . import records

pytestmark = pytest.mark.slow

NASTY = (
    '<script>document.title = "taken"</script><b>bold</b>',
    "\u202eצלחת נקייה במיקרוגל",
    "Überlanges" * 30,
)


@pytest.fixture
def drawn(tmp_path: Path) -> str:
    path = write_page(records.potato_record(width=160, height=120), tmp_path / "index.html")
    return path.as_uri()


@pytest.mark.parametrize("where", list(WIDTHS))
def test_every_control_of_the_page(drawn: str, chromium: Any, where: str) -> None:
    page, asked = page_of(chromium, where), []
    page.on("request", lambda request: asked.append(request.url))
    page.goto(drawn)
    assert_fits(page)
    where_now, cards = page.locator("#where"), page.locator("details.moment")
    page.keyboard.press("ArrowRight")
    page.keyboard.press("ArrowRight")
    assert where_now.text_content() == "2 of 14"
    assert opened(cards) == [1, records.ALARM_INDEX]
    assert page.locator(".strip a[aria-current]").count() == 1
    page.keyboard.press("ArrowLeft")
    assert opened(cards) == [0, records.ALARM_INDEX]
    page.get_by_role("button", name="moment after").click()
    page.get_by_role("button", name="moment before").click()
    assert where_now.text_content() == "1 of 14"
    assert page.get_by_role("button", name="moment before").is_disabled()
    page.locator(".strip a").nth(records.ALARM_INDEX).click()
    assert where_now.text_content() == f"{records.ALARM_INDEX + 1} of 14"
    alarm = page.locator(f"#moment-{records.ALARM_INDEX + 1}")
    node = alarm.locator('.fg-placed[data-node="Plate-1"]')
    frame = alarm.locator('.box[data-node="Plate-1"]')
    node.focus()
    assert frame.evaluate("e => e.classList.contains('pointed')")
    page.locator("h1").hover()
    node.hover()
    assert frame.evaluate("e => getComputedStyle(e).opacity") == "1"
    assert alarm.locator(".box.culprit").count() == 1
    page.get_by_role("button", name="Unfold all").click()
    assert len(opened(cards)) == 14
    assert_fits(page)
    page.get_by_role("button", name="Fold all").click()
    assert opened(cards) == []
    page.context.close()
    assert all(url.startswith(("file:", "data:")) for url in asked)


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_axe_finds_nothing(tmp_path: Path, chromium: Any, scheme: str) -> None:
    page = page_of(chromium, "desktop", color_scheme=scheme)
    makers = (records.potato_record, records.unjudged_record, records.troubled_record)
    for make in makers:
        page.goto(write_page(make(), tmp_path / f"{make.__name__}.html").as_uri())
        if page.locator("#unfold").is_visible():
            page.locator("#unfold").click()
        assert axe_says(page) == ""
    page.context.close()


@pytest.mark.parametrize("name", NASTY)
def test_names_of_any_kind_change_nothing(tmp_path: Path, chromium: Any, name: str) -> None:
    whole = records.potato_record()
    record = replace(
        whole,
        scenario=name,
        task=replace(whole.task, title=name),
        failures=(name,),
        boundaries=tuple(
            replace(b, sentence=f"{name} is in the way.") if b.sentence else b
            for b in whole.boundaries
        ),
    )
    page = page_of(chromium, "phone")
    page.goto(write_page(record, tmp_path / "index.html").as_uri())
    assert page.locator("h1").text_content() == name
    assert page.title() == f"{whole.task.name} · {name} · seed 7"
    assert page.locator("b", has_text="bold").count() == 0
    assert_fits(page)
    page.context.close()


def opened(cards: Any) -> list[int]:
    """Positions of the cards that are unfolded."""
    found: list[int] = cards.evaluate_all(
        "c => c.map((e, k) => e.open ? k : -1).filter(k => k >= 0)"
    )
    return found
