"""Parts and worlds that go wrong: any object with one call replaced, from some call on.

For whoever wants to see what a run does then; the project's own suite is `tests/robot`. Calls
nothing. A `Fault` is put around as many objects as one likes and knows whether it has happened.
"""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

Instead = Callable[..., Any]
"""What is done instead: is given the good call, and its arguments."""


@dataclass(slots=True, eq=False)
class Fault:
    """One thing that goes wrong.

    Args:
        call: the method or property concerned, or several: "scan|observe".
        instead: what is done then.
        after: how many calls go well before.
    """

    call: str
    instead: Instead
    after: int = 0
    calls: int = field(default=0, init=False)
    happened: bool = field(default=False, init=False)

    def around(self, good: Any) -> Any:
        """The object, with this fault."""
        return _Misbehaving(good, self)

    def run(self, call: Callable[..., Any], *args: Any, **named: Any) -> Any:
        """The call, good or bad."""
        self.calls += 1
        if self.calls <= self.after:
            return call(*args, **named)
        self.happened = True
        return self.instead(call, *args, **named)


class _Misbehaving:
    """Hands everything on but one call."""

    def __init__(self, good: Any, fault: Fault) -> None:
        self._good, self._fault = good, fault

    @property  # type: ignore[misc]
    def __class__(self) -> Any:
        return type(self._good)

    def __getattr__(self, name: str) -> Any:
        if name not in self._fault.call.split("|"):
            return getattr(self._good, name)
        if isinstance(getattr(type(self._good), name, None), property):
            return self._fault.run(lambda: getattr(self._good, name))
        good = getattr(self._good, name)
        return lambda *args, **named: self._fault.run(good, *args, **named)


def raises(error: BaseException) -> Instead:
    """Raises, each time."""

    def instead(call: Callable[..., Any], *args: Any, **named: Any) -> Any:
        raise error

    return instead


def gives(answer: Any) -> Instead:
    """Answers this, whatever it is."""
    return lambda call, *args, **named: answer


def changes(change: Callable[[Any], Any]) -> Instead:
    """Answers what is made of the good answer."""
    return lambda call, *args, **named: change(call(*args, **named))


def hangs(until: threading.Event, then: Any = None) -> Instead:
    """Does not come back until somebody sets `until`, however it is cancelled.

    Where it comes back, it does what it should have done, late; `then` is set over the answer.
    """

    def instead(call: Callable[..., Any], *args: Any, **named: Any) -> Any:
        until.wait()
        return call(*args, **named) if then is None else then

    return instead


def spins() -> Instead:
    """Goes round for ever in Python."""

    def instead(call: Callable[..., Any], *args: Any, **named: Any) -> Any:
        while True:
            time.sleep(0)

    return instead
