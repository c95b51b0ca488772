"""Listeners apart from the episode: one that fails or hangs changes nothing and is named.

Each is told on a thread of its own, in order. The loop waits until all have heard, so that what
they write is written as it happens, but for no longer than a limit; to one that is late everything
is still told when it comes back. Called by the runtime, calls listeners.
"""

from __future__ import annotations

import queue
import threading
from collections.abc import Sequence
from typing import Any

from forestall.seams.running import Listener
from forestall.supervision import in_words

_Said = tuple[str, tuple[Any, ...]]


class Audience:
    """The listeners of one episode.

    Args:
        listeners: in the order in which they are told. Of the end they are told the other way
            round: what befell the later ones is known to the first, which writes the record.
        limit_s: how long to wait for each.
    """

    def __init__(self, listeners: Sequence[Listener], limit_s: float) -> None:
        self._seats = tuple(_Seat(listener) for listener in listeners)
        self._limit_s = limit_s

    def tell(self, what: str, *about: Any, to: type = object) -> None:
        """Tell all of a type, e.g. "on_boundary"; one that is late hears it when it comes back."""
        for seat in self._seats:
            if not isinstance(seat.listener, to):
                continue
            was_late = seat.late
            seat.tell(what, about)
            if not was_late:
                seat.wait(self._limit_s)

    @property
    def count(self) -> int:
        """How many there are."""
        return len(self._seats)

    def tell_last(self, position: int, what: str, *about: Any) -> None:
        """Tell one for the last time, and wait also where it was late."""
        seat = self._seats[position]
        if seat.late:
            seat.wait(self._limit_s)
        seat.tell(what, about)
        seat.wait(self._limit_s)

    def leave(self) -> None:
        """Nothing more will be told; what was told is still heard."""
        for seat in self._seats:
            seat.leave()

    @property
    def notes(self) -> tuple[str, ...]:
        """What befell them, in words."""
        return tuple(note for seat in self._seats for note in seat.notes())


class _Seat:
    """One listener and the thread on which it is told."""

    def __init__(self, listener: Listener) -> None:
        self.listener = listener
        self._name = f"listener {listener.__class__.__name__}"
        self._said: queue.SimpleQueue[_Said | None] = queue.SimpleQueue()
        self._open = 0
        self._now = ""
        self._late: dict[str, float] = {}
        self._failed: dict[str, list[str]] = {}
        self._lock = threading.Condition()
        self._thread = threading.Thread(target=self._serve, name=self._name, daemon=True)
        self._thread.start()

    @property
    def late(self) -> bool:
        """Whether it was late and has not caught up."""
        with self._lock:
            return self._open > 0

    def tell(self, what: str, about: tuple[Any, ...]) -> None:
        with self._lock:
            self._open += 1
        self._said.put((what, about))

    def wait(self, limit_s: float) -> None:
        """Until it has heard everything, or the limit."""
        with self._lock:
            if not self._lock.wait_for(lambda: self._open == 0, limit_s):
                self._late.setdefault(self._now, limit_s)

    def leave(self) -> None:
        """Nothing more will be told; the thread ends when all has been heard."""
        self._said.put(None)

    def notes(self) -> list[str]:
        with self._lock:
            late = [
                f"{self._name} did not come back from {what} within {limit_s:g} s; "
                f"the run went on without it{'' if self._open else ', and it has caught up'}"
                for what, limit_s in self._late.items()
            ]
            failed = [
                f"{self._name} failed in {what}: {errors[0]}"
                + (f" ({len(errors)} times)" if len(errors) > 1 else "")
                for what, errors in self._failed.items()
            ]
        return [*late, *failed]

    def _serve(self) -> None:
        while (said := self._said.get()) is not None:
            what, about = said
            with self._lock:
                self._now = what
            try:
                getattr(self.listener, what)(*about)
            except BaseException as error:  # noqa: BLE001 - a listener cannot change an episode
                with self._lock:
                    self._failed.setdefault(what, []).append(in_words(error))
            del said, about
            with self._lock:
                self._open -= 1
                self._lock.notify_all()
