"""The large problem of the timings is one: it has plans, and they run."""

from __future__ import annotations

import pytest

from forestall.experiments.yard import domain, drawn
from forestall.planning.execute import Refusal, apply
from forestall.planning.planner import plan_goal
from forestall.planning.search import SearchConfig
from forestall.types.verdict import ReplanOutcome

pytestmark = pytest.mark.slow


@pytest.mark.parametrize("seed", range(4))
def test_a_plan_among_two_hundred_things_runs(seed: int) -> None:
    state, goal = drawn(200, seed)
    assert len(state.kinds) == 200
    assert len(domain().skills) == 15
    planned = plan_goal(state, goal, SearchConfig(120.0))
    assert planned.outcome is ReplanOutcome.SOLVED, planned.note
    for step in planned.subtasks:
        after = apply(state, step)
        assert not isinstance(after, Refusal), after.reason
        state = after
    assert all(map(state.holds, goal.literals))


def test_a_yard_is_drawn_the_same_again() -> None:
    (one, wanted), (other, again) = drawn(60, 5), drawn(60, 5)
    assert (one.facts, one.values, wanted) == (other.facts, other.values, again)
    assert drawn(60, 6)[0].facts != one.facts
