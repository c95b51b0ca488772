"""The page of a run: one HTML file that needs nothing but itself, drawn from its record.

Calls: `write_page` → `page_view.py` (what is shown) → `graph_svg.py`, `pictures.py`; the template
escapes every text. The same record gives the same bytes.
"""

from __future__ import annotations

from importlib.resources import files
from pathlib import Path

from jinja2 import Environment, PackageLoader, StrictUndefined
from markupsafe import Markup

from forestall.files import replace_file
from forestall.records.derived import in_words
from forestall.report.graph_svg import graph_css
from forestall.report.page_view import duration, page_view, status_sign
from forestall.types.episode import EpisodeRecord


def page_html(record: EpisodeRecord, folder: Path | None = None) -> str:
    """The page of a run as text; `folder` is where the pictures of a record lie that was read."""
    environment = Environment(
        loader=PackageLoader("forestall.report"),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
    )
    environment.filters["duration"] = duration
    environment.filters["sign"] = status_sign
    environment.filters["in_words"] = in_words
    environment.filters["svg"] = Markup  # graph_svg escapes its own texts
    templates = files("forestall.report").joinpath("templates")
    style = templates.joinpath("page.css").read_text(encoding="utf-8")
    script = templates.joinpath("page.js").read_text(encoding="utf-8")
    return environment.get_template("page.html.jinja").render(
        page=page_view(record, folder),
        record=record,
        style=Markup(style + graph_css()),
        script=Markup(script),
    )


def write_page(record: EpisodeRecord, path: Path | str, folder: Path | None = None) -> Path:
    """Write the page of a run, finished or killed.

    Args:
        record: pictures come from its observations; where there are none the page says so.
        path: the HTML file; its folder is made when it is not there.
        folder: of a record that was read from one; its pictures are there.

    Returns:
        The path.

    Raises:
        FileFormatError: a picture of the folder is none.
    """
    path = Path(path)
    path.parent.mkdir(parents=True, exist_ok=True)
    replace_file(path, page_html(record, folder).encode("utf-8"))
    return path
