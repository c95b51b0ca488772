"""How long the robot takes for a plan: its skills, and the ways between their places.

Called by whoever chooses between plans; calls nothing. Durations and speed are the domain's, places
are where things were seen.
"""

from __future__ import annotations

import math

from forestall.domain.model import Domain
from forestall.planning.driving import place_of
from forestall.planning.state import State
from forestall.planning.validate import Trace
from forestall.types.plan import Subtask

ARM_M = 1.6
"""What is handled at one place and is no farther than this is reached from where the robot is."""
UNKNOWN_M = 1.5
"""How far it is between two places of which nobody knows where they are."""

Spot = tuple[float, float]
Aim = tuple[str, Spot | None]
"""A place by its outermost thing, and where it is, as far as that is known."""


def robot_time_s(trace: Trace, start: Spot | None = None) -> float:
    """Seconds that what ran of a plan takes; arguments as those of `times_s`."""
    return sum(times_s(trace, start))


def times_s(trace: Trace, start: Spot | None = None) -> list[float]:
    """Seconds for each step that ran of a plan.

    Args:
        trace: of the plan.
        start: where the robot stands at first, x and y in metres; None: the first way is free.
    """
    first = trace.states[0]
    domain, found = first.domain, []
    at: Aim | None = None if start is None else ("", start)
    for state, step in zip(trace.states, trace.meant, strict=False):
        skill = domain.skill(step.skill)
        to, ways_s = aim(first, state, step), 0.0
        if to is not None:
            ways_s = 0.0 if at is None else way_s(domain, at, to, skill.drives)
            at = to if ways_s or at is None else at
        found.append(ways_s + (0.0 if skill.drives else skill.duration_s))
    return found


def way_s(domain: Domain, one: Aim, other: Aim, always: bool = False) -> float:
    """How long the robot drives from where it works to another place.

    Args:
        domain: has its speed.
        one: where it works.
        other: where it is to work.
        always: whether it drives, too, where it reaches that from where it is.
    """
    way_m = _apart_m(one, other)
    if not always and one[0] == other[0] and way_m <= ARM_M:
        return 0.0
    driving = domain.driving()
    turns_s = 0.0 if driving is None else driving.duration_s
    return turns_s + way_m / domain.robot.speed_m_per_s


def aim(first: State, state: State, step: Subtask) -> Aim | None:
    """The place at which a ground step is done, and where that is; None: wherever the robot is.

    Args:
        first: the state in which things were seen.
        state: before the step.
        step: with instances.
    """
    held = {h for _, h in state.in_hands()}
    names = [a for a in reversed(step.args) if a not in held and a in state.kinds]
    if not names:
        return None
    return place_of(state, names[0]) or state.root(names[0]), spot(first, state, names[0])


def spot(first: State, state: State, name: str) -> Spot | None:
    """Where a thing is: where it was seen, or where that is on which it was put since."""
    here = [name, *(p.parent for p in state.chain(name))]
    for k, one in enumerate(here):
        seen_there = one in first.kinds and [p.parent for p in first.chain(one)] == here[k + 1 :]
        if seen_there and one in first.where:
            return first.where[one]
    return None


def _apart_m(one: Aim, other: Aim) -> float:
    if one[1] is not None and other[1] is not None:
        return math.dist(one[1], other[1])
    return 0.0 if one[0] == other[0] else UNKNOWN_M
