"""The page of a run: one HTML file that needs nothing but itself, drawn from its record.

Calls: `write_page` → `page_view.py` (what is shown) → `graph_svg.py`, `pictures.py`; the template
escapes every text. The same record gives the same bytes.
"""

from __future__ import annotations

from functools import cache
from importlib.resources import files
from pathlib import Path

from jinja2 import Environment, PackageLoader, StrictUndefined
from markupsafe import Markup

from forestall.files import replace_file
from forestall.records.beside import beside
from forestall.records.derived import in_words
from forestall.report.beside_view import COLUMNS
from forestall.report.figure_style import colours_css, inline_svg
from forestall.report.graph_svg import graph_css
from forestall.report.page_view import Page, page_view, status_sign
from forestall.report.words import duration
from forestall.types.episode import EpisodeRecord

MOST_BYTES = 2_000_000
"""How large a page may be; its pictures get worse before it gets larger."""

_LEAST_PICTURES = 100_000


def page_html(record: EpisodeRecord, folder: Path | None = None, *, home: str = "") -> str:
    """The page of a run as text.

    Args:
        record: of the run.
        folder: where the pictures of a record lie that was read, and runs beside it.
        home: a link to all runs, where somebody serves the page; a file has none.
    """
    others = () if folder is None else beside(folder, record)
    page = page_view(record, folder, MOST_BYTES, others)
    text = _rendered(page, home)
    size = len(text.encode("utf-8"))
    if size > MOST_BYTES:
        room = MOST_BYTES - (size - _pictures_size(page))
        text = _rendered(page_view(record, folder, max(_LEAST_PICTURES, room), others), home)
    return text


def _pictures_size(page: Page) -> int:
    shown = [p for c in page.cards for p in (c.picture, c.thumb, *c.views) if p is not None]
    return sum(len(p.uri) for p in shown)


def _rendered(page: Page, home: str) -> str:
    return (
        environment()
        .get_template("page.html.jinja")
        .render(
            page=page,
            record=page.record,
            home=home,
            columns=COLUMNS,
            timeline=_timeline(page),
            style=Markup(template("page.css") + graph_css() + colours_css()),
            script=Markup(page_script()),
        )
    )


def _timeline(page: Page) -> Markup:
    """The drawing of the run and those beside it, "" where there are none."""
    if page.beside is None:
        return Markup("")
    strategies = ", ".join(row.cells[0] for row in page.beside.rows)
    words = f"what happened when with the strategies {strategies}; the table has the numbers"
    return Markup(inline_svg(page.beside.drawing, "beside", words))


def page_script() -> str:
    """The script that every page carries; whoever serves pages allows this one alone."""
    return template("page.js") + template("space.js")


def template(name: str) -> str:
    """The text of a style sheet or script that pages carry."""
    return files("forestall.report").joinpath("templates", name).read_text(encoding="utf-8")


@cache
def environment() -> Environment:
    """The template engine of this package; it escapes every text."""
    made = Environment(
        loader=PackageLoader("forestall.report"),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
    )
    made.filters["duration"] = duration
    made.filters["sign"] = status_sign
    made.filters["in_words"] = in_words
    made.filters["svg"] = Markup  # graph_svg escapes its own texts
    return made


def write_page(record: EpisodeRecord, path: Path | str, folder: Path | None = None) -> Path:
    """Write the page of a run, finished or killed.

    Args:
        record: pictures come from its observations; where there are none the page says so.
        path: the HTML file; its folder is made when it is not there.
        folder: of the run; pictures of a record that was read are there, and runs beside it.

    Returns:
        The path.

    Raises:
        FileFormatError: a picture of the folder is none.
    """
    path = Path(path)
    path.parent.mkdir(parents=True, exist_ok=True)
    replace_file(path, page_html(record, folder).encode("utf-8"))
    return path
