"""Pages in headless Chromium, at the width of a desktop and of a phone; what all such tests ask."""

from __future__ import annotations

from typing import Any

import pytest

WIDTHS = {"desktop": (1400, 900), "phone": (400, 800)}


def page_of(chromium: Any, where: str, **how: Any) -> Any:
    """An empty page in a context of its own; close `page.context` after it."""
    width, height = WIDTHS[where]
    context = chromium.new_context(viewport={"width": width, "height": height}, **how)
    context.set_default_timeout(120_000)
    return context.new_page()


def assert_fits(page: Any) -> None:
    """Nothing is wider than the window, once the page with its style is there."""
    page.wait_for_load_state("load")
    page.wait_for_function(
        "document.documentElement.scrollWidth <= window.innerWidth", timeout=30_000
    )


def axe_says(page: Any) -> str:
    """What axe finds that a screen reader would miss, "" for nothing; the page bypasses its CSP."""
    axe = pytest.importorskip("axe_playwright_python.sync_playwright", reason="axe is missing")
    found = axe.Axe().run(page)
    return str(found.generate_report()) if found.violations_count else ""
