"""Logs by name: what writes one while a run goes on.

Called by `forestall run --log`; calls the writers of `tables.LOGS`. Reading them is
`recorded.open_data`'s.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from forestall.assembly.registry import log
from forestall.assembly.tables import LOGS
from forestall.errors import InputError
from forestall.logs.writing import EpisodeLog


@contextmanager
def logging_to(text: str | None) -> Iterator[list[EpisodeLog]]:
    """The listener that writes a log, none where none was named; half of a log is taken away.

    Args:
        text: "name:path", as "mcap:run.mcap".

    Raises:
        InputError: it is not spelt so, a package is missing, or something is there already.
    """
    if text is None:
        yield []
        return
    name, colon, path = text.partition(":")
    if not colon or not path:
        known = ", ".join(f"{name}:PATH" for name in LOGS)
        raise InputError(f"log {text!r}: what kind of log and where, one of {known}")
    writer = log(name)(Path(path))
    listener = EpisodeLog(writer)
    try:
        yield [listener]
    finally:
        if not listener.complete:
            writer.abandon()
