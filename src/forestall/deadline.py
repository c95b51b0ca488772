"""How long a piece of work may take, and that somebody may stop it before.

Handed down from whoever asks (a runtime, a replanner) through everything that may take long, which
asks `over`, or calls `check`, every few milliseconds. Work is never killed: it notices and stops.
"""

from __future__ import annotations

import time

from forestall.errors import ForestallError


class TimeUp(ForestallError):
    """Work was stopped at its deadline; caught by whoever can say what that means."""


class Deadline:
    """A point in time at which work stops, and a switch that stops it at once.

    Starts to run when it is made. Any thread may call `cancel`; whoever works asks.

    Args:
        seconds: wall-clock seconds from now; None: no limit, only the switch.
        outer: a deadline that this one may not outlast; its `cancel` stops this one, too.
    """

    __slots__ = ("_at_s", "_cancelled", "_outer")

    def __init__(self, seconds: float | None = None, outer: Deadline | None = None) -> None:
        self._at_s = float("inf") if seconds is None else time.monotonic() + seconds
        if outer is not None:
            self._at_s = min(self._at_s, outer._at_s)
        self._cancelled = False  # one plain store, seen by every thread
        self._outer = outer

    def left(self) -> float:
        """Seconds that are left, never below 0; infinity without a limit."""
        return 0.0 if self.cancelled else max(self._at_s - time.monotonic(), 0.0)

    @property
    def over(self) -> bool:
        """Whether to stop now."""
        outer = self._outer
        return (
            self._cancelled
            or time.monotonic() >= self._at_s
            or (outer is not None and outer.cancelled)
        )

    @property
    def cancelled(self) -> bool:
        """Whether somebody called `cancel`, here or on an outer deadline."""
        return self._cancelled or (self._outer is not None and self._outer.cancelled)

    def cancel(self) -> None:
        """Stop the work at the next time that it asks; may be called from any thread, and twice."""
        self._cancelled = True

    def check(self) -> None:
        """Go on, or raise TimeUp."""
        if self.over:
            raise TimeUp("cancelled" if self.cancelled else "out of time")

    def within(self, seconds: float | None) -> Deadline:
        """A deadline `seconds` from now, or this one where that is earlier; stopped with it."""
        return Deadline(seconds, self)
