"""Fast Downward and this project agree about PDDL files, where it is installed."""

from __future__ import annotations

import importlib.util
import subprocess
import sys
from pathlib import Path

import pytest
from pddl_corpus import FOLDER, NAMES, execute, problem, read_plan, subtask

from forestall.domain.formula import parse_formula
from forestall.domain.load import shipped
from forestall.domain.pddl_out import domain_pddl
from forestall.domain.pddl_state import problem_pddl
from forestall.planning.execute import Refusal, apply
from forestall.planning.state import State

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


def test_household_is_planned_for_by_fast_downward(tmp_path: Path) -> None:
    household = shipped("household")
    state = State(
        household,
        {"Mug-1": "Mug", "Cabinet-1": "Cabinet", "CounterTop-1": "CounterTop", "Pot-1": "Pot",
         "StoveKnob-2": "StoveKnob", "StoveBurner-1": "StoveBurner", "StoveBurner-2": "StoveBurner",
         "Floor-1": "Floor"},
        {},
        [("inside", "Mug-1", "Cabinet-1"), ("on_top_of", "Pot-1", "CounterTop-1"),
         ("blocking", "Pot-1", "Cabinet-1")],
    )  # fmt: skip
    for thing, category in state.kinds.items():
        for attribute, value in household.default_states(category).items():
            state.values[thing, attribute] = value
    wanted = (
        "on_top_of(Mug-1, CounterTop-1) and open(Cabinet-1)=closed and toggled(StoveBurner-2)=off"
        " and on_top_of(Pot-1, StoveBurner-1) and hand_empty() and accessible(Mug-1)"
    )
    state.set_value("StoveBurner-2", "toggled", "on")
    goal = parse_formula(wanted)
    assert not state.true(goal)
    written = domain_pddl(household, without_processes=True, without_makers=True)
    domain, problem_file = tmp_path / "domain.pddl", tmp_path / "problem.pddl"
    domain.write_text(written.text)
    problem_file.write_text(problem_pddl(state, goal, without_makers=True))
    things = {name.lower(): name for name in state.kinds}
    for line in solve(domain, problem_file, tmp_path).splitlines():
        if line.startswith("("):
            name, *args = line.strip("()").split()
            action = written.actions[name]
            step = subtask(action.skill, *(things[a] for a in args[: action.arguments]))
            after = apply(state, step)
            assert not isinstance(after, Refusal), f"{step}: {after.reason}"
            state = after
    assert state.true(goal)
