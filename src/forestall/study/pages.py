"""The pages that a rater sees, as HTML. Called by `serving.py`; the template escapes every text.

They work without JavaScript; `study.js` adds keys and measures time. Nothing of what they hold
tells which explanation is whose.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from importlib.resources import files
from typing import Any

from jinja2 import Environment, PackageLoader, StrictUndefined

from forestall.study.answers import MOST_NAME, Answer
from forestall.study.model import Study, Trial

ASSETS = {"study.css": "text/css", "study.js": "text/javascript"}
"""Files beside the templates that pages ask for, with their types."""


@dataclass(frozen=True, slots=True)
class Progress:
    """Where a rater stands.

    Args:
        position: of the trial that is shown, from 0.
        count: of all his trials.
        answered: how many have an answer.
        resume: path that leads back to it on another device.
    """

    position: int
    count: int
    answered: int
    resume: str


def welcome_page(study: Study, problem: str = "") -> str:
    """Consent and instructions; `problem` says why the study did not begin."""
    count = max(map(len, study.raters))
    minutes = max(1, round(count / 2))
    return _render(
        "welcome", count=count, minutes=minutes, most_name=MOST_NAME, problem=problem, study=study
    )


def trial_page(study: Study, trial: Trial, progress: Progress, given: Answer | None) -> str:
    """One comparison; `given` is what the rater answered before."""
    item = study.item(trial.item)
    left, right = study.texts(trial)
    return _render(
        "trial", item=item, texts={"a": left, "b": right}, progress=progress,
        given=None if given is None else given.choice,
    )  # fmt: skip


def done_page(progress: Progress) -> str:
    """Thanks."""
    return _render("done", progress=progress)


def message_page(title: str, text: str) -> str:
    """A page with one message."""
    return _render("message", title=title, text=text)


def asset(name: str) -> bytes:
    """One of `ASSETS`."""
    return files("forestall.study").joinpath("templates", name).read_bytes()


def _render(name: str, **values: Any) -> str:
    found: Mapping[str, Any] = values
    return environment().get_template(f"{name}.html.jinja").render(found)


@cache
def environment() -> Environment:
    """The template engine of this package."""
    return Environment(
        loader=PackageLoader("forestall.study"),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
    )
