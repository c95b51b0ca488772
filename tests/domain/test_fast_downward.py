"""Fast Downward and this project agree about PDDL files, where it is installed."""

from __future__ import annotations

import importlib.util
import subprocess
import sys
from pathlib import Path

import pytest
from pddl_corpus import FOLDER, NAMES, execute, problem, read_plan

from forestall.domain.pddl_out import domain_pddl, problem_pddl

pytestmark = pytest.mark.skipif(
    importlib.util.find_spec("up_fast_downward") is None, reason="Fast Downward is not installed"
)

READ_BY_IT = [n for n in NAMES if n not in ("dominoes", "either")]
"""It reads neither a forall inside a when, nor parameters of one of two types."""


def solve(domain: Path, problem_file: Path, folder: Path) -> str:
    """Fast Downward's plan."""
    found = importlib.util.find_spec("up_fast_downward")
    assert found is not None and found.origin is not None
    driver = Path(found.origin).parent / "downward" / "fast-downward.py"
    plan = folder / "plan"
    search = "lazy_greedy([ff()],preferred=[ff()])"
    done = subprocess.run(
        [sys.executable, driver, "--plan-file", plan, domain, problem_file, "--search", search],
        cwd=folder,
        capture_output=True,
        text=True,
        timeout=60,
        check=False,
    )
    assert plan.is_file(), done.stdout + done.stderr
    return plan.read_text()


@pytest.mark.parametrize("name", READ_BY_IT)
def test_plans_of_fast_downward_reach_the_goal_here(name: str, tmp_path: Path) -> None:
    steps = solve(FOLDER / f"{name}.pddl", FOLDER / f"{name}.problem.pddl", tmp_path)
    state, goal = problem(name)
    assert execute(state, read_plan(steps)).true(goal)


@pytest.mark.parametrize("name", NAMES)
def test_what_is_written_is_the_same_problem(name: str, tmp_path: Path) -> None:
    state, goal = problem(name)
    written = domain_pddl(state.domain)
    domain, problem_file = tmp_path / "domain.pddl", tmp_path / "problem.pddl"
    domain.write_text(written.text)
    problem_file.write_text(problem_pddl(state, goal))
    steps = solve(domain, problem_file, tmp_path)
    assert execute(state, read_plan(steps)).true(goal)
