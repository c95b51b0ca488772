"""Which moments of a log are looked at, and which subtasks lie between them.

Called by the readers; calls nothing. Where a log does not say which pictures are a look, there is
one just before each subtask begins, one at the end, and, if wanted, some in between.
"""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Sequence
from dataclasses import dataclass

from forestall.logs.layout import Layout, Step
from forestall.types.episode import SkillStatus

BEGUN_NS = 50_000_000
"""A picture so soon after a subtask began still shows how it was found."""


@dataclass(frozen=True, slots=True)
class Moment:
    """A look: when, on the clock of the log, and what `types.recorded.Look` says of it.

    `at_ns` is None for the end of a run that nobody looked at once more.
    """

    at_ns: int | None
    before: tuple[int, ...]
    done: int | None
    succeeded: bool
    unshown: tuple[tuple[int, str], ...] = ()


def chosen(stamps_ns: Sequence[int], steps: Sequence[Step], layout: Layout) -> list[int]:
    """Of the times at which there are pictures, those that are looked at.

    Args:
        stamps_ns: in order.
        steps: in order.
        layout: whether there are looks in between.
    """
    if not len(stamps_ns):
        return []
    picked = {stamps_ns[-1]}
    for step in steps:
        before = bisect_right(stamps_ns, step.begins_ns)
        picked.add(stamps_ns[max(0, before - 1)])
    if layout.every_s is not None:
        gap_ns, last = int(layout.every_s * 1e9), None
        for stamp in stamps_ns:
            if last is None or stamp - last >= gap_ns:
                picked.add(stamp)
                last = stamp
    return sorted(picked)


def moments_of(
    looks_ns: Sequence[int], steps: Sequence[Step], stale_s: float | None = None
) -> list[Moment]:
    """Looks with the subtasks between them: one that begins at a look has it before it.

    Args:
        looks_ns: in order.
        steps: in order.
        stale_s: how old a look may be as a subtask begins; None where looks are numbers, not times.
    """
    found, at = [], 0
    for index, look in enumerate(looks_ns):
        begun: list[int] = []
        while index and at < len(steps) and steps[at].begins_ns < look:
            begun.append(at)
            at += 1
        shown_ns = looks_ns[max(0, index - 1)]
        found.append(_moment(look, begun, steps, _unshown(begun, steps, shown_ns, stale_s)))
    left = list(range(at, len(steps)))
    if not left:
        return found
    unshown = _unshown(left, steps, looks_ns[-1], stale_s) if len(looks_ns) else ()
    return [*found, _moment(None, left, steps, unshown)]


def notes_of(moments: Sequence[Moment]) -> list[str]:
    """Which subtasks nothing shows as they begin, in words."""
    return [why for moment in moments for _, why in moment.unshown]


def _unshown(
    begun: Sequence[int], steps: Sequence[Step], look_ns: int, stale_s: float | None
) -> tuple[tuple[int, str], ...]:
    """Which of the subtasks after a look it does not show as they begin, and why."""
    if stale_s is None:
        return ()
    found = []
    for number in begun:
        gap_ns = steps[number].begins_ns - look_ns
        said = f"step {number + 1} begins {abs(gap_ns) / 1e9:.1f} s"
        if gap_ns > stale_s * 1e9:
            most = f"at most {stale_s:g} s may lie between"
            found.append((number, f"{said} after the last picture before it: {most}"))
        elif gap_ns < -BEGUN_NS:
            found.append((number, f"{said} before the first picture"))
    return tuple(found)


def _moment(
    look: int | None,
    begun: Sequence[int],
    steps: Sequence[Step],
    unshown: tuple[tuple[int, str], ...],
) -> Moment:
    done = [n for n in begun if steps[n].status is not SkillStatus.REFUSED]
    last = done[-1] if done else None
    ended_well = last is None or steps[last].status is SkillStatus.SUCCEEDED
    return Moment(look, tuple(begun), last, ended_well, unshown)
