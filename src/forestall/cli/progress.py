"""Progress bars on standard error, with a time left."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager

_PACE_S = 3600.0
"""The time left goes by the steps of so long: an episode may take minutes."""


@contextmanager
def bar(title: str, *, quiet: bool = False) -> Iterator[Callable[[int, int, str], None]]:
    """A bar that is fed with (done, total, what) and shown from the first time on.

    Where nobody watches there is none.
    """
    if quiet or sys.stderr is None or not sys.stderr.isatty():
        yield lambda done, total, what: None
        return
    from rich.console import Console
    from rich.progress import (
        BarColumn,
        MofNCompleteColumn,
        Progress,
        TextColumn,
        TimeElapsedColumn,
        TimeRemainingColumn,
    )

    progress = Progress(
        TextColumn("{task.description}"),
        BarColumn(),
        MofNCompleteColumn(),
        TimeElapsedColumn(),
        TimeRemainingColumn(),
        console=Console(file=sys.stderr),
        speed_estimate_period=_PACE_S,
    )
    row = progress.add_task(title, total=None)

    def feed(done: int, total: int, what: str) -> None:
        progress.start()
        progress.update(row, completed=done, total=total, description=f"{title}: {what}")

    try:
        yield feed
    finally:
        progress.stop()
