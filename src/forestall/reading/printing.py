"""Text of others as it may be shown on a terminal; called by the command line, calls nothing."""

from __future__ import annotations

import unicodedata

_KEPT = "\n\t"
_TURNING = frozenset("\u061c\u200e\u200f\u202a\u202b\u202c\u202d\u202e\u2066\u2067\u2068\u2069")


def printable(text: str) -> str:
    r"""The text with every character that steers a terminal, or turns what is read, written out.

    Control characters (escape sequences begin with one) and marks that turn the direction of
    writing become "\x1b" and the like; line ends and tabs stay.
    """
    if text.isascii() and text.isprintable():
        return text
    return "".join(c if c in _KEPT or not _steers(c) else _written(c) for c in text)


def one_line(text: str) -> str:
    """Likewise, and in one line."""
    return printable(" ".join(text.split()))


def shown(text: str) -> str:
    """Likewise, and as it is where rich reads markup."""
    from rich.markup import escape

    return escape(one_line(text))


def _steers(character: str) -> bool:
    return character in _TURNING or unicodedata.category(character) in ("Cc", "Cs", "Zl", "Zp")


def _written(character: str) -> str:
    return character.encode("unicode_escape").decode("ascii")
