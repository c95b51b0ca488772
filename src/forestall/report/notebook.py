"""Graphs, verdicts, diagnoses and records as HTML for a notebook's cell.

Called by `types/drawing.py`; calls `graph_svg.py` and `page.py`. The template escapes every text.
"""

from __future__ import annotations

from typing import Any

from forestall.config import DEFAULT_DOMAIN
from forestall.report.drawn import drawn
from forestall.report.graph_svg import graph_svg
from forestall.report.page import environment, page_html
from forestall.types.episode import EpisodeRecord
from forestall.types.graph import SceneGraph
from forestall.types.verdict import Diagnosis, Verdict


def html_of(thing: object) -> str:
    """A thing as HTML that carries its own style.

    Args:
        thing: a `SceneGraph`, a `Verdict`, a `Diagnosis` or an `EpisodeRecord`; of a record that
            was read from a folder the pictures are not to be had.

    Raises:
        TypeError: it is something else.
    """
    if isinstance(thing, SceneGraph):
        return graph_html(thing)
    if isinstance(thing, Verdict):
        expected = "" if thing.nearest is None else graph_html(thing.nearest.graph, "expected")
        return _rendered("verdict", verdict=thing, expected=expected)
    if isinstance(thing, Diagnosis):
        return _rendered("diagnosis", diagnosis=thing)
    if isinstance(thing, EpisodeRecord):
        return _rendered("record", record=thing, page=page_html(thing))
    raise TypeError(f"a {type(thing).__name__} has no drawing")


def graph_html(graph: SceneGraph, side: str = "observed") -> str:
    """A graph, whose relations are drawn as those of the default domain where they are of it."""
    expected = side == "expected"
    how = drawn(DEFAULT_DOMAIN)
    return graph_svg(
        graph, None, (), (), "expected" if expected else "observed", how, standalone=True
    )


def _rendered(what: str, **values: Any) -> str:
    macros: Any = environment().get_template("notebook.html.jinja").module
    return str(getattr(macros, what)(**values))
