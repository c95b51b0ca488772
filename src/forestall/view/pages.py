"""The pages of the view, as HTML. Called by `serving.py`; the template escapes every text.

They work without JavaScript; `view.js` sends filters when they change, and fetches a page again
when the server says that something has happened.
"""

from __future__ import annotations

import os
import time
from collections.abc import Mapping, Sequence
from functools import cache
from importlib.resources import files
from pathlib import Path
from typing import Any
from urllib.parse import quote, urlencode

from jinja2 import Environment, PackageLoader, StrictUndefined

from forestall.report.words import duration
from forestall.view.batch import Batch
from forestall.view.choosing import Choice
from forestall.view.comparing import Sides
from forestall.view.index import ExperimentRow
from forestall.view.live import Progress
from forestall.view.rows import Outcome

ASSETS = {"view.css": "text/css", "view.js": "text/javascript"}
"""Files beside the templates that pages ask for, with their types."""

OUTCOME_LOOKS = {
    Outcome.SUCCEEDED: ("good", "✓"),
    Outcome.FAILED: ("bad", "✕"),
    Outcome.NOT_SCORED: ("open", "?"),
    Outcome.RUNNING: ("busy", "▸"),
    Outcome.BROKEN_OFF: ("open", "■"),
    Outcome.UNREADABLE: ("bad", "!"),
}
"""Outcome → its class in the style sheet and its sign (colour alone never tells)."""


def index_page(
    folder: Path,
    choice: Choice,
    experiments: Sequence[tuple[ExperimentRow, bool]],
    total: int,
    version: int,
) -> str:
    """All runs and experiments.

    Args:
        folder: that is viewed.
        choice: the runs that are shown.
        experiments: all of them, each with whether it is at work.
        total: how many runs there are.
        version: of the index; the page asks what has happened since.
    """
    asked = {f.name: f.chosen for f in choice.filters if f.chosen}
    links = {
        k: f"/?{urlencode({**asked, 'page': k})}"
        for k in (choice.page - 1, choice.page + 1)
        if 1 <= k <= choice.pages
    }
    return _render(
        "index", folder=folder, choice=choice, experiments=experiments, total=total,
        follow=f"/events?seen={version}", links=links,
    )  # fmt: skip


def live_page(place: str, progress: Progress, outcome: Outcome, offset: int) -> str:
    """A run that is not over, as far as it has come.

    Args:
        place: of the run.
        progress: of it.
        outcome: whether it is still at work.
        offset: how far its lines were read; the page asks what has come since.
    """
    follow = f"/events?{urlencode({'run': _bytes(place), 'seen': offset})}"
    return _render(
        "live", place=place, progress=progress, outcome=outcome,
        follow=follow if outcome is Outcome.RUNNING else "",
    )  # fmt: skip


def batch_page(row: ExperimentRow, batch: Batch, busy: bool) -> str:
    """An experiment that is not over, as far as it has come.

    Args:
        row: of it.
        batch: its newest episodes, and what was asked for.
        busy: whether it is still at work.
    """
    follow = f"/events?{urlencode({'experiment': _bytes(row.place), 'seen': batch.size})}"
    return _render("batch", row=row, batch=batch, busy=busy, follow=follow if busy else "")


def compare_page(places: tuple[str, str], sides: Sides) -> str:
    """Two runs side by side."""
    return _render("compare", places=places, sides=sides)


def message_page(text: str) -> str:
    """A page with one message."""
    return _render("message", text=text)


def asset(name: str) -> bytes:
    """One of `ASSETS`."""
    return files("forestall.view").joinpath("templates", name).read_bytes()


def run_link(place: str) -> str:
    """The address of the page of a run."""
    return f"/run/{_quoted(place)}/" if place else "/run/"


def experiment_link(place: str) -> str:
    """The address of the page of an experiment."""
    return f"/experiment/{_quoted(place)}/" if place else "/experiment/"


def picture_link(place: str, name: str) -> str:
    """The address of a picture of a run."""
    return f"{run_link(place)}{name}"


def _bytes(place: str) -> bytes:
    """Names of files need not be text."""
    return os.fsencode(place)


def _quoted(place: str) -> str:
    return quote(_bytes(place))


def _ago(changed_s: float) -> str:
    return time.strftime("%Y-%m-%d %H:%M", time.localtime(changed_s))


def _roughly(seconds: float) -> str:
    """A time that is an estimate, in no finer units than it deserves."""
    minutes = round(seconds / 60)
    if minutes < 1:
        return "less than a minute"
    hours, minutes = divmod(minutes, 60)
    return f"{hours} h {minutes} min" if hours else f"{minutes} min"


def _render(name: str, **values: Any) -> str:
    found: Mapping[str, Any] = values
    return environment().get_template(f"{name}.html.jinja").render(found)


@cache
def environment() -> Environment:
    """The template engine of this package."""
    made = Environment(
        loader=PackageLoader("forestall.view"),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
    )
    made.filters |= {
        "run_link": run_link,
        "experiment_link": experiment_link,
        "picture_link": picture_link,
        "duration": duration,
        "date": _ago,
        "roughly": _roughly,
        "look": lambda o: OUTCOME_LOOKS[o][0],
        "sign": lambda o: OUTCOME_LOOKS[o][1],
    }
    return made
