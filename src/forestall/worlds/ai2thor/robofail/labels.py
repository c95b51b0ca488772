"""When a run failed, in each spelling that RoboFail has. Called by `layout`; calls nothing.

One frame is one second, and the first frame is second 1: "01:15" is frame 75.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from typing import Any

from forestall.errors import FileFormatError

NO_FAILURE = "no failure added"
"""What whoever made the data set writes of a run that went well."""

_TIME = re.compile(r"(?:(\d{1,3}):)?(\d{1,4})")
_BETWEEN = re.compile(r"\s*(?:,|;|-|–|to|and)\s*|\s+")


def failed_at(step: Any, reason: Any) -> tuple[int, int] | None:
    """The first and the last second of a failure, None for a run that went well.

    Args:
        step: a time ("01:15"), seconds (75, "0"), several of them in a text ("00:31-00:41") or in a
            list, or a list of spans ([["00:31", "00:41"]]).
        reason: in words.

    Raises:
        FileFormatError: something else, or nothing, though there is a reason.
    """
    if not isinstance(reason, str) or not reason.strip():
        raise FileFormatError("gt_failure_reason: why it failed, or 'No failure added', is missing")
    if reason.strip().rstrip(".").casefold() == NO_FAILURE:
        return None
    seconds = list(_seconds(step))
    if not seconds:
        raise FileFormatError(f"gt_failure_step: {step!r} names no time, such as '01:15'")
    return min(seconds), max(seconds)


def _seconds(said: Any, depth: int = 0) -> Iterator[int]:
    if isinstance(said, bool) or depth > 2:
        raise _wrong(said)
    if isinstance(said, int | float):
        if not 0 <= said < 10_000:
            raise _wrong(said)
        yield int(said)
    elif isinstance(said, str):
        for part in filter(None, _BETWEEN.split(said.strip())):
            found = _TIME.fullmatch(part)
            if found is None or (found[1] is not None and int(found[2]) >= 60):
                raise _wrong(said)
            yield 60 * int(found[1] or 0) + int(found[2])
    elif isinstance(said, list):
        for each in said:
            yield from _seconds(each, depth + 1)
    elif said is not None:
        raise _wrong(said)


def _wrong(said: Any) -> FileFormatError:
    return FileFormatError(
        f"gt_failure_step: {str(said)[:80]!r} is no time: '01:15', seconds, or a list of these is "
        "expected"
    )
