"""Listeners that fail or are late: named, told everything all the same, and nothing changes."""

from __future__ import annotations

import threading
import time
from typing import Any

from forestall.audience import Audience


class Slow:
    """Hears the second thing only when it is let; then everything, in order."""

    def __init__(self) -> None:
        self.heard: list[Any] = []
        self.go_on = threading.Event()

    def __getattr__(self, name: str) -> Any:
        if not name.startswith("on_"):
            raise AttributeError(name)

        def on(*about: Any) -> None:
            if len(self.heard) == 1:
                self.go_on.wait(10)
            self.heard.append((name, *about))

        return on


class Quick(Slow):
    """Hears at once."""

    def __init__(self) -> None:
        super().__init__()
        self.go_on.set()


def test_all_have_heard_when_the_loop_goes_on() -> None:
    one, two = Quick(), Quick()
    audience = Audience([one, two], 5.0)
    for k in range(20):
        audience.tell("on_boundary", k)
        assert one.heard[-1] == two.heard[-1] == ("on_boundary", k)
    audience.leave()
    assert audience.notes == ()


def test_one_that_is_late_keeps_nobody_waiting_and_hears_everything_in_the_end() -> None:
    slow, quick = Slow(), Quick()
    audience = Audience([slow, quick], 0.1)
    started = time.monotonic()
    for k in range(50):
        audience.tell("on_boundary", k)
    assert time.monotonic() - started < 3  # it was waited for once
    assert len(quick.heard) == 50 and len(slow.heard) == 1
    assert audience.notes == (
        "listener Slow did not come back from on_boundary within 0.1 s; the run went on without it",
    )
    slow.go_on.set()
    audience.tell_last(0, "on_end", "record")
    audience.leave()
    assert [a for _, a in slow.heard] == [*range(50), "record"]
    assert audience.notes[0].endswith("and it has caught up")


def test_failures_are_counted_by_what_was_told() -> None:
    class Broken(Quick):
        def on_boundary(self, about: Any, context: Any = None) -> None:
            raise OSError(f"disk full at {about}")

    audience = Audience([Broken()], 5.0)
    for k in range(3):
        audience.tell("on_boundary", k)
    audience.leave()
    assert audience.notes == (
        "listener Broken failed in on_boundary: OSError: disk full at 0 (3 times)",
    )
