"""Phrases that say how the values of attributes look.

Called by `load`, and by `model` for the article before a word; calls nothing. Phrases are
what an image-text encoder compares with a picture, so a text that no encoder can read, or that
cannot tell two values apart, is refused here.
"""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Iterable, Mapping
from typing import Any

from forestall.errors import InputError, UnknownNameError

THING = "{thing}"
"""Stands in a phrase for the category's words."""

_ARTICLE = re.compile(r"\b([Aa])n? (?=(\w+))")
_SPOKEN_CONSONANT = re.compile(r"uni(?![nm])|us[eu]|uti|eu|once|one\b", re.IGNORECASE)


def attribute_values(label: str, given: Any) -> tuple[str, ...]:
    """Values of an attribute: two or more different words.

    Raises:
        InputError: they are something else.
    """
    values = tuple(given) if isinstance(given, list | tuple) else ()
    if len(values) < 2 or len(set(map(str, values))) < len(values):
        raise InputError(
            f"{label}: values must name two or more different ones, the default first: "
            'values = ["unripe", "ripe"]'
        )
    for value in values:
        readable = isinstance(value, str) and re.fullmatch(r"[A-Za-z]+(_[A-Za-z]+)*", value)
        if not readable or value in ("true", "false"):
            raise InputError(
                f"{label}: value {value!r} must be letters a-z, joined by '_', and not true or "
                "false, which are values of relations"
            )
    return values


def table(label: str, given: Any) -> Mapping[str, Any]:
    """A table.

    Raises:
        InputError: it is something else.
    """
    if not isinstance(given, Mapping):
        raise InputError(f"{label} must be a table")
    return given


def phrase_table(label: str, given: Any, values: tuple[str, ...]) -> dict[str, tuple[str, ...]]:
    """Value → its phrases.

    Raises:
        InputError: an unknown value, or a phrase that no encoder can read.
    """
    entries = table(label, given)
    for value in entries:
        if value not in values:
            raise UnknownNameError(f"value in {label}", value, values)
    return {v: texts(f"{label}.{v}", entries[v], 1) for v in values if v in entries}


def texts(label: str, given: Any, least: int = 0) -> tuple[str, ...]:
    """A list of texts that an encoder can read.

    Raises:
        InputError: no list, fewer than `least`, or a text that is empty or in another script.
    """
    if not isinstance(given, list | tuple) or len(given) < least:
        raise InputError(f'{label} must be a list of texts: ["a ripe {THING}"]')
    for text in given:
        check_text(label, text)
    return tuple(t.strip() for t in given)


def check_text(label: str, text: Any) -> None:
    """Refuse what an encoder cannot read.

    Raises:
        InputError: no text, an empty one, one in another script, or an unknown placeholder.
    """
    if not isinstance(text, str) or not text.strip():
        raise InputError(f"{label}: {text!r} is empty or no text: write a phrase in English")
    plain = text.replace(THING, "")
    letters = [c for c in plain if c.isalpha()]
    foreign = sorted({c for c in letters if not unicodedata.name(c, "").startswith("LATIN")})
    if foreign or not (letters or THING in text):
        found = f" (not {' '.join(foreign)})" if foreign else ""
        raise InputError(
            f"{label}: {text!r}: the encoder reads Latin letters only{found}: write it in English"
        )
    if "{" in plain or "}" in plain:
        raise InputError(f"{label}: {text!r}: only {THING} may stand in braces")


def check_apart(label: str, phrases: Mapping[str, Iterable[str]]) -> None:
    """No phrase may stand for two values: it could not tell them apart."""
    owner: dict[str, str] = {}
    for value, several in phrases.items():
        for text in several:
            if owner.setdefault(text, value) != value:
                raise InputError(f"{label}: {text!r} stands for both {owner[text]} and {value}")


def with_articles(text: str) -> str:
    """The text with "a" or "an" as the next word begins."""

    def fitting(match: re.Match[str]) -> str:
        vowel = match[2][0] in "aeiouAEIOU" and not _SPOKEN_CONSONANT.match(match[2])
        return f"{match[1]}{'n' if vowel else ''} "

    return _ARTICLE.sub(fitting, text)
