"""Attributes of things and the phrases that say how their values look.

Called by `vocabulary.py`, which holds the attributes of every category; calls nothing. Phrases are
what an image-text encoder compares with a picture, so a text that no encoder can read, or that
cannot tell two values apart, is refused here.
"""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any

from forestall.errors import InputError, UnknownNameError
from forestall.types.facts import DERIVED, RELATIONS
from forestall.types.plan import SKILLS

THING = "{thing}"
"""Stands in a phrase for the category's words."""

_ARTICLE = re.compile(r"\b([Aa])n? (?=(\w+))")
_SPOKEN_CONSONANT = re.compile(r"uni(?![nm])|us[eu]|uti|eu|once|one\b", re.IGNORECASE)


@dataclass(frozen=True, slots=True)
class Attribute:
    """What can be one way or another about a thing, and how that looks.

    Args:
        name: as in facts, e.g. "open".
        values: every value; the first is the default of a new object.
        phrases: value → texts that fit a picture of it; `THING` stands for the category's words.
        camera: whether a picture can show it.
        by_category: category → value → texts that replace the general ones.
    """

    name: str
    values: tuple[str, ...]
    phrases: Mapping[str, tuple[str, ...]] = field(default_factory=dict, hash=False)
    camera: bool = True
    by_category: Mapping[str, Mapping[str, tuple[str, ...]]] = field(
        default_factory=dict, hash=False
    )


def parse_attribute(name: str, data: Mapping[str, Any], base: Attribute | None = None) -> Attribute:
    """Build one attribute from its TOML table.

    Args:
        name: name of the attribute.
        data: its table.
        base: what the attribute is so far; phrases are added to it or replaced, value by value.

    Raises:
        InputError: an unknown field or value, too few values, a name that is something else, or a
            phrase that no encoder can read.
    """
    label = f"attribute {name}"
    unknown = set(data) - set(Attribute.__dataclass_fields__) | set(data) & {"name"}
    if unknown:
        known = ", ".join(f for f in Attribute.__dataclass_fields__ if f != "name")
        raise InputError(f"{label}: unknown field {', '.join(sorted(unknown))}: known: {known}")
    taken = {r: "relation" for r in RELATIONS} | {d: "derived fact" for d in DERIVED}
    taken |= {s: "skill" for s in SKILLS}
    if name in taken:
        raise InputError(f"{label}: {name!r} is the name of a {taken[name]}: choose another one")
    if not re.fullmatch(r"[a-z]+(_[a-z]+)*", name):
        raise InputError(f"{label}: the name must be lower-case letters a-z, joined by '_'")
    values = _values(label, data.get("values", () if base is None else base.values))
    camera = data.get("camera", True if base is None else base.camera)
    if not isinstance(camera, bool):
        raise InputError(f"{label}: camera must be true or false")
    if base is not None and (values, camera) != (base.values, base.camera):
        raise InputError(
            f"{label} exists: its values ({', '.join(base.values)}) and camera = "
            f"{str(base.camera).lower()} stay as they are; only phrases can be given"
        )
    phrases = _phrases(f"{label}: phrases", data.get("phrases", {}), values)
    tables = _table(f"{label}: by_category", data.get("by_category", {}))
    special = {
        c: _phrases(f"{label}: by_category.{c}", table, values) for c, table in tables.items()
    }
    if not camera and (phrases or special):
        raise InputError(f"{label}: camera = false, so that it cannot have phrases")
    if base is not None:
        phrases = {**base.phrases, **phrases}
        for category, shipped in base.by_category.items():
            special[category] = {**shipped, **special.get(category, {})}
    result = Attribute(name, values, phrases, camera, special)
    _check_apart(f"{label}: phrases", phrases)
    for category, table in special.items():
        _check_apart(f"{label}: by_category.{category}", {**phrases, **table})
    return result


def _values(label: str, given: Any) -> tuple[str, ...]:
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


def _table(label: str, given: Any) -> Mapping[str, Any]:
    if not isinstance(given, Mapping):
        raise InputError(f"{label} must be a table")
    return given


def _phrases(label: str, given: Any, values: tuple[str, ...]) -> dict[str, tuple[str, ...]]:
    table = _table(label, given)
    for value in table:
        if value not in values:
            raise UnknownNameError(f"value in {label}", value, values)
    return {v: texts(f"{label}.{v}", table[v], 1) for v in values if v in table}


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


def _check_apart(label: str, phrases: Mapping[str, Iterable[str]]) -> None:
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
