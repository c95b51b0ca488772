"""Names of judges and what they say: the threshold of each, its model, how many demonstrations.

Called by whatever counts alarms or compares judges. Names are an open set: a judge is what stands
before the first comma, and behind it what it was told. Two judges of one run can be asked together,
`or` (an alarm if either raises one) and `and` (if both do).
"""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import dataclass

from forestall.statistics.rows import EXACT

PRIMARY = "scene-graph"
LITERAL = "scene-graph, whole scene"
MINED = "preconditions"
PLAN_CHECK = "plan-check"

THRESHOLDS = (0.90, 0.85, 0.80)
"""Of the paper's experiments (Sec. 4, "Analysis of Potential Failure Detection")."""

YES_NO = 0.5
"""Threshold of judges that say yes or no."""

MODELS = (EXACT, "coarse", "wrong")
OTHERS = (PRIMARY, MINED)
"""Judges that learn from demonstrations and are asked together with the plan check."""

_DEMONSTRATIONS = re.compile(r"^(?P<judge>.+), (?P<count>\d+)(?: varied)? demonstrations?$")


@dataclass(frozen=True, slots=True, order=True)
class Together:
    """Two judges that are asked together."""

    first: str
    second: str
    both: bool

    @property
    def name(self) -> str:
        """As tables have it."""
        return f"{self.first} {'and' if self.both else 'or'} {self.second}"


def thresholds_of(judge: str) -> tuple[float, ...]:
    """At which a judge raises alarms, its own first."""
    return (YES_NO,) if judge.startswith((MINED, PLAN_CHECK)) else THRESHOLDS


def suffixes(judge: str) -> dict[str, tuple[float, ...]]:
    """End of a metric's name → the thresholds that it is at; none where there is only one."""
    found = thresholds_of(judge)
    if len(found) == 1:
        return {"": found}
    return {**{f"@{t:.2f}": (t,) for t in found}, "@mean": found}


def plan_check(model: str) -> str:
    """The plan check that reads a model."""
    return PLAN_CHECK if model == EXACT else f"{PLAN_CHECK}, {model}"


def together(known: Iterable[str]) -> tuple[Together, ...]:
    """Every pair of a judge that learns and a plan check, if both are known."""
    names = set(known)
    return tuple(
        Together(first, second, both)
        for model in MODELS
        if (second := plan_check(model)) in names
        for first in OTHERS
        if first in names
        for both in (False, True)
    )


def demonstrations_of(judge: str, plain: int) -> tuple[str, int]:
    """A judge without its number of demonstrations, and that number; `plain` if none is said."""
    found = _DEMONSTRATIONS.match(judge)
    return (judge, plain) if found is None else (found["judge"], int(found["count"]))


def is_variant(judge: str) -> bool:
    """Whether it is another one with another number of demonstrations."""
    return _DEMONSTRATIONS.match(judge) is not None
