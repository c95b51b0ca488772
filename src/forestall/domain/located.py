"""Where in its file the thing stands that an error speaks about.

Called by the loaders and the checks. An error carries keys, texts such as "[skills.pick_up]" that
stand in the file where it is wrong; whoever knows the file turns them into a line.
"""

from __future__ import annotations

import re

from forestall.errors import DomainError, InputError


def keyed(error: InputError, *keys: str) -> InputError:
    """The error with further texts that stand where the file is wrong, the nearest first."""
    error.keys = (*getattr(error, "keys", ()), *keys)  # type: ignore[attr-defined]
    return error


def located(source: str, text: str, error: InputError) -> DomainError:
    """The error with the file and the line of what it speaks about, as far as that is found.

    A name that is not known is looked for in the table that the error is about.
    """
    where = next((k for k in getattr(error, "keys", ()) if k in text), None)
    if where is None:
        return DomainError(f"{source}: {error}")
    at = text.index(where)
    name = getattr(error, "name", None)
    if name is not None and where.startswith("["):
        found = re.compile(rf"(?<![\w?]){re.escape(name)}(?!\w)").search(text, at + len(where))
        following = text.find("\n[", at)
        if found is not None and (following < 0 or found.start() < following):
            at = found.start()
    return DomainError(f"{source}, line {text.count(chr(10), 0, at) + 1}: {error}")
