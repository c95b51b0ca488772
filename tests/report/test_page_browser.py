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


@pytest.mark.parametrize("where", list(WIDTHS))
def test_the_3d_view_turns_and_marks_what_the_picture_marks(
    drawn: str, chromium: Any, where: str
) -> None:
    page = page_of(chromium, where)
    page.goto(drawn)
    alarm = page.locator(f"#moment-{records.ALARM_INDEX + 1}")
    view, plate = alarm.locator(".space svg"), alarm.locator('.space [data-node="Plate-1"]')
    seen = [shape(plate)]
    for key in ("ArrowLeft", "ArrowUp", "+", "-", "Home"):
        view.press(key)
        seen.append(shape(plate))
    assert len(set(seen[:4])) == 4 and seen[5] == seen[0]
    assert page.locator("#where").text_content() == "8 of 14"  # the keys are those of the view
    for name in ("turn right", "look from lower", "nearer", "farther", "as at first"):
        alarm.get_by_role("button", name=name).click()
        seen.append(shape(plate))
    assert len(set(seen[5:9])) == 4 and seen[-1] == seen[0]
    view.scroll_into_view_if_needed()
    box = view.bounding_box()
    page.mouse.move(box["x"] + 60, box["y"] + 90)
    page.mouse.down()
    page.mouse.move(box["x"] + 110, box["y"] + 120)
    page.mouse.up()
    page.wait_for_function(  # a box is made anew at every turn: it is looked up each time
        "at => [...at[0].querySelectorAll('[data-node=\"Plate-1\"] polygon')]"
        ".map(p => p.getAttribute('points')).join(' ') !== at[1]",
        arg=[view.element_handle(), seen[0]],
    )
    view.press("Home")
    node, x, y = view.evaluate(ON_TOP)
    page.mouse.move(x, y)
    for where_else in (".box", ".space .sp-box"):
        thing = alarm.locator(f'{where_else}[data-node="{node}"]')
        assert thing.evaluate("e => e.classList.contains('pointed')")
    page.locator("h1").hover()
    assert alarm.locator(".pointed").count() == 0
    alarm.locator('.fg-placed[data-node="Plate-1"]').focus()
    assert plate.evaluate("e => e.classList.contains('pointed')")
    assert_fits(page)
    page.context.close()


ON_TOP = """svg => {
    for (const box of svg.querySelectorAll(".near")) {
        const at = box.querySelector("polygon").getBoundingClientRect();
        const x = at.left + at.width / 2, y = at.top + at.height / 2;
        const there = document.elementFromPoint(x, y);
        const node = box.getAttribute("data-node");
        const framed = [...svg.closest("article").querySelectorAll(".box")].some(
            b => b.getAttribute("data-node") === node);
        if (framed && there && there.closest("[data-node]") === box) { return [node, x, y]; }
    }
}"""
"""The first box of the 3D view that the picture frames, too, and that nothing hides."""


def shape(box: Any) -> str:
    """Where the faces of a box are drawn."""
    found: str = box.evaluate(
        "e => [...e.querySelectorAll('polygon')].map(p => p.getAttribute('points')).join(' ')"
    )
    return found


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
