"""Prompts from named fragments: one file each in `prompts/`, its purpose in its first line.

Called by whoever asks a language model. A fragment includes others by name. What comes from a
scene, a file or a model is data: it goes through the filter `quoted`, or comes from `words.py`,
which quotes it; a fragment's own text is all that is not.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from functools import cache
from importlib.resources import files
from typing import Any

from jinja2 import Environment, PackageLoader, StrictUndefined

from forestall.llm.words import quoted
from forestall.types.exchange import Request

ENDING = ".txt"
SYSTEM_END = "---\n"
"""Divides what the system says from what the user says."""

_PURPOSE = re.compile(r"\{#\s*(.+?)\s*#\}", re.DOTALL)

CHARACTERS_A_TOKEN = 4.0
"""Characters of English that a token of today's models has on average: for estimates alone."""


def fragments() -> Mapping[str, str]:
    """Name → purpose of every fragment."""
    folder = files("forestall.llm").joinpath("prompts")
    found = {}
    for file in sorted(folder.iterdir(), key=lambda f: f.name):
        if file.name.endswith(ENDING):
            match = _PURPOSE.match(file.read_text(encoding="utf-8"))
            found[file.name.removesuffix(ENDING)] = "" if match is None else match[1]
    return found


def rendered(name: str, **values: Any) -> tuple[tuple[str, str], ...]:
    """A prompt's messages: what the system says, then what the user says.

    Raises:
        jinja2.UndefinedError: a value that the prompt needs is not given.
    """
    text = _environment().get_template(f"{name}{ENDING}").render(**values)
    system, _, user = text.partition(SYSTEM_END)
    return (("system", _tidy(system)), ("user", _tidy(user)))


def fragment(name: str, **values: Any) -> str:
    """One fragment by itself."""
    return _tidy(_environment().get_template(f"{name}{ENDING}").render(**values))


def estimated_tokens(request: Request) -> int:
    """About how many tokens the messages of a request have, at four characters each."""
    return round(sum(len(text) for _, text in request.messages) / CHARACTERS_A_TOKEN)


def _tidy(text: str) -> str:
    return "\n".join(line.strip() for line in text.splitlines() if line.strip())


@cache
def _environment() -> Environment:
    environment = Environment(
        loader=PackageLoader("forestall.llm", "prompts"),
        autoescape=False,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters["quoted"] = quoted
    return environment
