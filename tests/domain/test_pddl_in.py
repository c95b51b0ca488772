"""PDDL files become domains whose skills do what the files say."""

from __future__ import annotations

import pytest
from pddl_corpus import NAMES, execute, plan, problem


@pytest.mark.parametrize("name", NAMES)
def test_plan_of_the_corpus_reaches_its_goal(name: str) -> None:
    state, goal = problem(name)
    assert not state.true(goal)
    assert execute(state, plan(name)).true(goal)
