"""Standard output and error of a command whose reader may be gone (`forestall ... | head`).

Called by `main.py`, so this file imports only what cannot fail. A pipe that breaks elsewhere, of a
world or of a part, is none of this.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from typing import IO, Any, cast


class Unheard:
    """A stream that goes on into nothing once its reader is gone; else the stream itself."""

    def __init__(self, stream: IO[str]) -> None:
        self._stream = stream

    def __getattr__(self, name: str) -> Any:
        return getattr(self._stream, name)

    def __iter__(self) -> Iterator[str]:
        return iter(self._stream)

    def write(self, text: str) -> int:
        """Write, heard or not."""
        try:
            return self._stream.write(text)
        except BrokenPipeError:
            self._silence()
            return len(text)

    def flush(self) -> None:
        """Flush, heard or not."""
        try:
            self._stream.flush()
        except BrokenPipeError:
            self._silence()

    def _silence(self) -> None:
        """From now on into nothing, what is still buffered included: it is flushed at exit, too."""
        nothing = os.open(os.devnull, os.O_WRONLY)
        try:
            os.dup2(nothing, self._stream.fileno())
        finally:
            os.close(nothing)


@contextmanager
def heard_or_not() -> Iterator[None]:
    """Meanwhile a reader of standard output or error that goes away breaks nothing."""
    out, err = sys.stdout, sys.stderr
    if out is not None:
        sys.stdout = cast("Any", Unheard(out))
    if err is not None:
        sys.stderr = cast("Any", Unheard(err))
    try:
        yield
    finally:
        for stream in (sys.stdout, sys.stderr):
            with suppress(OSError, ValueError, AttributeError):  # full, closed, or not there
                stream.flush()
        sys.stdout, sys.stderr = out, err
