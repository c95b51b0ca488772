"""The page of an experiment: one HTML file that needs nothing but itself, figures and tables.

Calls: `write_experiment` → `experiment_view.py` (what is shown) → the figures; the template escapes
every text. The same rows and summary give the same bytes.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol

from markupsafe import Markup

from forestall.files import replace_file
from forestall.report.experiment_view import View, experiment_view
from forestall.report.figure_style import colours_css, inline_svg
from forestall.report.page import environment, template

if TYPE_CHECKING:
    from forestall.statistics.rows import EpisodeRow

PAGE_NAME = "index.html"
FIGURES_NAME = "figures"
TABLES_NAME = "tables"


class ShownTable(Protocol):
    """A table as the page shows and keeps it."""

    @property
    def name(self) -> str:
        """Of its files, without ending."""

    @property
    def title(self) -> str:
        """Above it."""

    @property
    def header(self) -> Sequence[str]:
        """Names of the columns."""

    @property
    def rows(self) -> Sequence[Sequence[str]]:
        """Cells."""

    @property
    def note(self) -> str:
        """Below it."""

    def markdown(self) -> str:
        """As Markdown."""

    def csv(self) -> str:
        """As comma-separated values."""


def write_experiment(
    folder: Path | str,
    rows: Sequence[EpisodeRow],
    summary: Mapping[str, Any],
    tables: Sequence[ShownTable],
    meta: Mapping[str, Any],
    links: Mapping[str, str] | None = None,
) -> Path:
    """Write the page of an experiment with its figures and tables.

    Args:
        folder: made when it is not there. `figures/*.svg`, `tables/*.md` and `tables/*.csv` are
            written first, the page last.
        rows: of all episodes, in any order.
        summary: of the same rows, as plain data.
        tables: in the order in which they are shown.
        meta: what was run, name → value, shown in this order. "title" is the heading, "findings"
            are sentences, "names" says how detectors, strategies and sets are called on the page
            (among others, which are stand-ins); by default as the summary says.
        links: key of a row → relative address of the page of that episode.

    Returns:
        The page.
    """
    folder = Path(folder)
    view = experiment_view(rows, summary, meta, links or {})
    text = _page_html(view, tables)
    for name in (FIGURES_NAME, TABLES_NAME):
        (folder / name).mkdir(parents=True, exist_ok=True)
    for figure in view.figures:
        path = folder / FIGURES_NAME / f"{figure.name}.svg"
        if figure.svg is None:
            path.unlink(missing_ok=True)  # of an earlier run, and no longer true
        else:
            replace_file(path, figure.svg)
    for table in tables:
        for ending, made in (("md", table.markdown()), ("csv", table.csv())):
            replace_file(folder / TABLES_NAME / f"{table.name}.{ending}", made.encode("utf-8"))
    page = folder / PAGE_NAME
    replace_file(page, text.encode("utf-8"))
    return page


def _page_html(view: View, tables: Sequence[ShownTable]) -> str:
    drawings = {
        f.name: Markup(inline_svg(f.svg, f.name, f.title))
        for f in view.figures
        if f.svg is not None
    }
    return (
        environment()
        .get_template("experiment.html.jinja")
        .render(
            view=view,
            tables=tables,
            drawings=drawings,
            style=Markup(template("page.css") + template("experiment.css") + colours_css()),
            script=Markup(experiment_script()),
        )
    )


def experiment_script() -> str:
    """The script that every page of an experiment carries; who serves one allows this alone."""
    return template("experiment.js")
