"""Which moments of a log are looked at, and which subtasks lie between them.

Called by the readers; calls nothing. Where a log does not say which pictures are a look, there is
one just before each subtask begins, one at the end, and, if wanted, some in between.
"""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from forestall.logs.layout import Layout, Step
from forestall.types.episode import SkillStatus


@dataclass(frozen=True, slots=True)
class Moment:
    """A look: when, on the clock of the log, and what `types.recorded.Look` says of it.

    `at_ns` is None for the end of a run that nobody looked at once more.
    """

    at_ns: int | None
    before: tuple[int, ...]
    done: int | None
    succeeded: bool


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


def unseen(stamps_ns: Sequence[int], steps: Sequence[Step], layout: Layout) -> Iterator[str]:
    """Which subtasks nothing shows as they begin, in words."""
    for number, step in enumerate(steps, 1):
        before = bisect_right(stamps_ns, step.begins_ns)
        gap_s = (step.begins_ns - stamps_ns[max(0, before - 1)]) / 1e9 if len(stamps_ns) else 0
        if gap_s > layout.stale_s:
            yield f"step {number} begins {gap_s:.1f} s after the last picture before it"
        elif gap_s < 0:
            yield f"step {number} begins {-gap_s:.1f} s before the first picture"


def moments_of(looks_ns: Sequence[int], steps: Sequence[Step]) -> list[Moment]:
    """Looks with the subtasks between them: one that begins at a look has it before it."""
    found, at = [], 0
    for index, look in enumerate(looks_ns):
        begun: list[int] = []
        while index and at < len(steps) and steps[at].begins_ns < look:
            begun.append(at)
            at += 1
        found.append(_moment(look, begun, steps))
    left = list(range(at, len(steps)))
    return [*found, _moment(None, left, steps)] if left else found


def _moment(look: int | None, begun: Sequence[int], steps: Sequence[Step]) -> Moment:
    done = [n for n in begun if steps[n].status is not SkillStatus.REFUSED]
    last = done[-1] if done else None
    ended_well = last is None or steps[last].status is SkillStatus.SUCCEEDED
    return Moment(look, tuple(begun), last, ended_well)
