"""Fast Downward and this project agree about PDDL files, where it is installed."""

from __future__ import annotations

import importlib.util
from pathlib import Path

import pytest
from pddl_corpus import FOLDER, NAMES, execute, problem, subtask

from forestall.types.plan import Subtask

pytestmark = pytest.mark.skipif(
    importlib.util.find_spec("up_fast_downward") is None, reason="Fast Downward is not installed"
)


def solve(domain: Path, problem_file: Path) -> list[Subtask]:
    """The steps of Fast Downward's plan."""
    from unified_planning.io import PDDLReader
    from unified_planning.shortcuts import OneshotPlanner, get_environment

    get_environment().credits_stream = None
    read = PDDLReader().parse_problem(str(domain), str(problem_file))
    with OneshotPlanner(name="fast-downward") as planner:
        result = planner.solve(read, timeout=60)
    assert result.plan is not None, result.status
    return [
        subtask(
            a.action.name.replace("-", "_"),
            *(str(p).replace("-", "_") for p in a.actual_parameters),
        )
        for a in result.plan.actions
    ]


@pytest.mark.parametrize("name", NAMES)
def test_plans_of_fast_downward_reach_the_goal_here(name: str) -> None:
    steps = solve(FOLDER / f"{name}.pddl", FOLDER / f"{name}.problem.pddl")
    state, goal = problem(name)
    assert execute(state, steps).true(goal)
