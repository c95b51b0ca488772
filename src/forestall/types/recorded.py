"""Runs that somebody else recorded, look by look, and what is said of how they failed.

Read by a data set (`seams.DataSet`) and turned into graphs by `assembly.recorded`.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field

from forestall.types.observation import Observation
from forestall.types.plan import Plan


@dataclass(frozen=True, slots=True, eq=False)
class Look:
    """One observation of a recorded run.

    Args:
        observation: what was seen and felt; None at the end of a run at which nobody looked.
        before: steps of the plan, from 0, that begin just before this look: what was known until
            then is what they started on. Of the first look itself where there was none earlier.
        done: step of the plan that this look shows done, None for a look on the way.
        succeeded: whether whoever carried that step out took it for done.
        unshown: of the steps before, those that no look shows as they begin, and why: what was seen
            is too old, or of later.
    """

    observation: Observation | None
    before: tuple[int, ...] = ()
    done: int | None = None
    succeeded: bool = True
    unshown: tuple[tuple[int, str], ...] = ()


@dataclass(frozen=True, slots=True)
class RecordedRun:
    """One run.

    Args:
        name: of its own.
        task: what it was to do.
        scene: where.
        plan: what was carried out, in the domain's words.
        looks: opens the run anew and gives its looks one after the other; FileFormatError where one
            cannot be read.
        fails: the step, from 0, at which the label says that it failed, None for a good run.
        seconds: the first and the last second that the label names.
        kind: which sort of failure, "" where nobody says.
        why: in the words of the label.
        left_out: what of the run could not be read, in words.
    """

    name: str
    task: str
    scene: str
    plan: Plan
    looks: Callable[[], Iterator[Look]]
    fails: int | None = None
    seconds: tuple[int, int] = (0, 0)
    kind: str = ""
    why: str = ""
    left_out: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class Unread:
    """A run of a data set that cannot be used, and why."""

    name: str
    why: str


@dataclass(slots=True)
class ReadReport:
    """What came of a data set.

    Args:
        good: names of the runs that went well.
        failing: names of those that failed.
        unread: those that could not be used.
        notes: run → what of it was left out.
    """

    good: list[str] = field(default_factory=list)
    failing: list[str] = field(default_factory=list)
    unread: list[Unread] = field(default_factory=list)
    notes: dict[str, list[str]] = field(default_factory=dict)
