"""The documentation as a site: it builds without warnings, and its pages load nothing."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

pytest.importorskip("mkdocs", reason="mkdocs is not installed: pip install 'forestall[docs]'")
pytestmark = pytest.mark.slow

ROOT = Path(__file__).parent.parent
LOADED = re.compile(
    r"<(?:script|link|img|iframe|source|video|object)\b[^>]*?\s(?:src|href|data)=\"?((?:https?:)?//[^\s\">]+)"
    r"|@import\s+[^;]*?((?:https?:)?//[^;)\"']+)|url\(\s*[\"']?((?:https?:)?//[^)\"']+)"
)


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("site")
    done = subprocess.run(
        [sys.executable, "-m", "mkdocs", "build", "--strict", "--site-dir", str(folder)],
        cwd=ROOT,
        capture_output=True,
        text=True,
        check=False,
        env={**os.environ, "NO_MKDOCS_2_WARNING": "1", "NO_COLOR": "1"},
    )
    assert done.returncode == 0, done.stderr
    assert "WARNING" not in done.stderr
    return folder


def test_what_a_load_is() -> None:
    loads = ['<script src="https://a.b/c.js">', "<link rel=x href=//a.b/c>", "@import 'http://a.b'"]
    assert all(LOADED.search(text) for text in (*loads, "url(https://a.b/c.woff)"))
    assert not LOADED.search('<a href="https://arxiv.org/abs/2508.11286"><img src="a.jpg">')


def test_no_page_loads_anything_from_a_network(site: Path) -> None:
    pages = [*site.rglob("*.html"), *site.rglob("*.css")]
    assert len(pages) > 25
    found = {str(p.relative_to(site)): LOADED.findall(p.read_text("utf-8")) for p in pages}
    assert not {name: loads for name, loads in found.items() if loads}


def test_every_document_is_a_page_and_the_reference_has_every_name(site: Path) -> None:
    import forestall

    for document in ROOT.glob("docs/**/*.md"):
        page = site / document.relative_to(ROOT / "docs").with_suffix(".html")
        assert page.is_file() and page.stat().st_size > 5000, page
    reference = (site / "python.html").read_text("utf-8")
    at_home = {"Memory": "SqliteStore", "open_memory": "open_store"}
    for name in (at_home.get(n, n) for n in forestall.__all__):
        assert re.search(rf'id="forestall\.[\w.]*\b{name}"', reference), name
    assert 'id="forestall.seams.Segmenter"' in reference


def test_pictures_of_the_gallery_are_small() -> None:
    pictures = list((ROOT / "docs" / "gallery").glob("*.jpg"))
    text = (ROOT / "docs" / "gallery.md").read_text("utf-8")
    assert sum(p.stat().st_size for p in pictures) < 1_000_000
    assert {p.name for p in pictures} == set(re.findall(r"\]\(gallery/([\w-]+\.jpg)\)", text))
