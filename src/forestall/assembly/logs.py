"""Logs by name: what writes one while a run goes on, or of the record of a run.

Called by `forestall run --log`, `replay --log` and `export`; calls the writers of `tables.LOGS`.
Reading them is `recorded.open_data`'s.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from forestall.assembly.registry import log
from forestall.assembly.tables import LOGS
from forestall.errors import InputError
from forestall.logs.retold import retell
from forestall.logs.writing import EpisodeLog, JudgedWriter, LogWriter
from forestall.types.episode import EpisodeRecord


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
    writer = _writer(text)
    listener = EpisodeLog(writer)
    try:
        yield [listener]
    finally:
        if not listener.complete:
            writer.abandon()


def showing(text: str) -> JudgedWriter:
    """The writer of a log that shows judgements.

    Args:
        text: "name:path", as "rerun:run.rrd".

    Raises:
        InputError: it is not spelt so, a package is missing, something is there already, or it is
            a log of what was seen and done alone.
    """
    writer = _writer(text)
    if not isinstance(writer, JudgedWriter):
        raise InputError(
            f"log {text!r}: that kind keeps what a robot saw, with depth and masks, while it runs: "
            "forestall run --log; what was judged is shown by rerun:FILE"
        )
    return writer


def export(record: EpisodeRecord, folder: Path | None, writer: JudgedWriter) -> None:
    """Write all of a record; half of a log is taken away.

    Args:
        record: of a run.
        folder: that its pictures are in, None where it has them itself.
        writer: as `showing` gives it.

    Raises:
        InputError: it cannot be written.
        FileFormatError: a picture of the record that is none.
    """
    try:
        retell(record, folder, writer)
    except BaseException:
        writer.abandon()
        raise


def _writer(text: str) -> LogWriter:
    name, colon, path = text.partition(":")
    if not colon or not path:
        known = ", ".join(f"{name}:PATH" for name in LOGS)
        raise InputError(f"log {text!r}: what kind of log and where, one of {known}")
    made: LogWriter = log(name)(Path(path))
    return made
