"""What a world tells about the machine that it runs on; written by worlds, shown by `doctor`."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Working:
    """One thing that a world needs, or could use, and whether it works here.

    Args:
        what: in a few words.
        works: whether it does.
        needed: whether nothing runs without it.
        detail: what was found.
        hint: what to install.
    """

    what: str
    works: bool
    needed: bool
    detail: str
    hint: str = ""
