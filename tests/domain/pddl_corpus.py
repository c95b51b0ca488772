"""Small PDDL domains of every supported feature, each with a problem and a plan that solves it."""

from __future__ import annotations

import re
from pathlib import Path

from forestall.domain.formula import Formula
from forestall.domain.load import load_domain
from forestall.planning.execute import Refusal, apply
from forestall.planning.pddl_problem import read_problem
from forestall.planning.state import State
from forestall.types.plan import Subtask

FOLDER = Path(__file__).parent / "pddl"
NAMES = sorted(p.stem for p in FOLDER.glob("*.pddl") if not p.stem.endswith(".problem"))


def subtask(skill: str, *args: str) -> Subtask:
    """A subtask of any domain, whatever the household's skills are."""
    made = object.__new__(Subtask)
    object.__setattr__(made, "skill", skill)
    object.__setattr__(made, "args", args)
    return made


def problem(name: str) -> tuple[State, Formula]:
    domain = load_domain(str(FOLDER / f"{name}.pddl"))
    file = FOLDER / f"{name}.problem.pddl"
    return read_problem(file.read_text(), domain, file.name)


def plan(name: str) -> list[Subtask]:
    return read_plan((FOLDER / f"{name}.plan").read_text())


def read_plan(text: str) -> list[Subtask]:
    steps = re.findall(r"^\(([^()]*)\)", text.lower().replace("-", "_"), re.MULTILINE)
    return [subtask(*step.split()) for step in steps]


def execute(state: State, steps: list[Subtask]) -> State:
    for number, step in enumerate(steps, 1):
        after = apply(state, step)
        assert not isinstance(after, Refusal), f"step {number}, {step}: {after.reason}"
        state = after
    return state
