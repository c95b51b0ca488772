"""A corrected plan made cheaper: what is needless goes, errands move, what is dangerous ends first.

Called by the replanner, which checks every plan and plans the pieces; calls `planning`.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass
from itertools import pairwise

from forestall.deadline import TimeUp
from forestall.planning.needless import content, pruned, unsafe
from forestall.planning.robot_time import Spot, robot_time_s
from forestall.planning.state import State
from forestall.planning.thrift import WORTH_S, cost_s, for_good, thrifty
from forestall.planning.validate import run
from forestall.replanning.kept import hand
from forestall.replanning.searching import as_usual
from forestall.types.facts import Literal
from forestall.types.plan import Subtask
from forestall.types.verdict import Replan

Steps = tuple[Subtask, ...]

DETOUR_S = 15.0
"""From so many seconds on something dangerous is ended for a repair and begun again after it."""
MOST_TRIED = 2
"""How many plans that end first what is dangerous are checked."""


@dataclass(frozen=True, slots=True)
class Asked:
    """What making a plan cheaper asks for.

    Args:
        state: that the plan starts from.
        wanted: what must change, and does before the old plan is taken up again.
        check: a plan → the answer with it, None where it will not do.
        steps_to: a state and facts → steps to them, none where they are not found.
        start: where the robot stands, x and y in metres.
        keeps_rest: whether the old plan's steps stand as they are, because there is no goal that
            says what they are for.
    """

    state: State
    wanted: tuple[Literal, ...]
    check: Callable[[Steps], Replan | None]
    steps_to: Callable[[State, Sequence[Literal]], Steps]
    start: Spot | None
    keeps_rest: bool = False


def cheaper(asked: Asked, found: Replan, rest: int) -> Replan:
    """The plan in less of the robot's time, and with less time of what is dangerous.

    Args:
        asked: state and needs.
        found: an accepted plan.
        rest: how many of its last steps are the old plan's.
    """
    assert found.plan is not None
    steps, best = found.plan.subtasks, found
    shortest, mine = steps, len(steps) - rest
    restored = _restored(asked, steps, mine)

    def accepts(other: Steps, own: int) -> bool:
        nonlocal best, shortest, mine
        if asked.keeps_rest and other[len(other) - rest :] != steps[len(steps) - rest :]:
            return False
        if not restored <= _restored(asked, other, own):
            return False
        accepted = asked.check(other)
        if accepted is not None:
            best, shortest, mine = accepted, other, own
        return accepted is not None

    with suppress(TimeUp):  # the plan as it is will do
        pruned(asked.state, steps, mine, accepts)
        for other, own in _ended_first(asked, shortest, mine):
            now_s = cost_s(run(asked.state, shortest), asked.start)
            if cost_s(run(asked.state, other), asked.start) < now_s and accepts(other, own):
                break
        if thrifty(asked.state, shortest, mine, accepts, asked.start) != steps:
            pruned(asked.state, shortest, mine, accepts)
    return best


def less_of_time(one: Replan, other: Replan | None, state: State, start: Spot | None) -> Replan:
    """The plan that costs the robot less; the first one where there is no other or it is as good.

    Args:
        one: an accepted plan.
        other: another one.
        state: that both start from.
        start: where the robot stands, x and y in metres.
    """
    if one.plan is None or other is None or other.plan is None:
        return one
    one_s = cost_s(run(state, one.plan.subtasks), start)
    other_s = cost_s(run(state, other.plan.subtasks), start)
    return other if other_s < one_s - WORTH_S else one


def _ended_first(asked: Asked, steps: Steps, mine: int) -> list[tuple[Steps, int]]:
    """Plans that first end what is dangerous now, and bring it about again where it is needed.

    Where there is a goal, who checks the plan says whether it is; what somebody has left on and
    nothing asks for stays off.
    """
    state = asked.state
    detour_s = robot_time_s(run(state, steps[:mine]), asked.start)
    if not unsafe(state) or detour_s < DETOUR_S:
        return []
    usual = [x for x in as_usual(state) if not state.holds(x)]
    ending = asked.steps_to(state, (*usual, *hand(state, usual))) if usual else ()
    repair, rest = steps[:mine], steps[mine:]
    middle = run(state, (*ending, *repair))
    if not ending or middle.refusal is not None:
        return []
    now = [Literal(x.predicate, x.args, state.value(x.args[0], x.predicate) or "") for x in usual]
    back = asked.steps_to(middle.final, (*now, *hand(middle.final, now)))
    own, end = len(ending) + len(repair), run(state, steps).final
    again = run(state, (*ending, *repair, *back, *rest))
    states = again.states[own + len(back) :]
    last = next((k for k, pair in enumerate(pairwise(states)) if for_good(*pair)), len(rest))
    plans = [(*ending, *repair, *rest)]
    plans += [
        (*ending, *repair, *rest[:k], *back, *rest[k:])
        for k in range(last + 1)
        if back and (k in (0, last) or _drives(state, rest[k]))
    ]
    ended = frozenset() if asked.keeps_rest else frozenset((*x.args, x.predicate) for x in usual)
    traces = [(plan, run(state, plan)) for plan in plans]
    fitting = [
        (cost_s(trace, asked.start), plan)
        for plan, trace in traces
        if trace.refusal is None and _ends_as_well(trace.final, end, ended)
    ]
    return [(plan, own) for _, plan in sorted(fitting)[:MOST_TRIED]]


def _ends_as_well(state: State, end: State, ended: frozenset[tuple[str, ...]]) -> bool:
    """Whether everything is as it would be in the end, or what was dangerous has been ended."""
    different = content(state) ^ content(end)
    if not different:
        return True
    return unsafe(state) < unsafe(end) and all(x[:-1] in ended for x in different)


def _drives(state: State, step: Subtask) -> bool:
    return state.domain.drives(step)


def _restored(asked: Asked, steps: Sequence[Subtask], count: int) -> set[Literal]:
    """What must change and does by the first steps of a plan."""
    after = run(asked.state, steps[:count]).final
    return {x for x in asked.wanted if after.holds(x)}
