"""A PDDL problem as a state and a goal.

Called by whoever plans for a problem file; calls `domain.pddl_problem` and `state`.
"""

from __future__ import annotations

from forestall.domain.formula import Formula
from forestall.domain.model import Domain
from forestall.domain.pddl_problem import parse_problem
from forestall.planning.state import State


def read_problem(text: str, domain: Domain, source: str = "problem") -> tuple[State, Formula]:
    """The first state of a problem file, and its goal.

    Raises:
        DomainError: something in the file is wrong, not supported, or not of this domain.
    """
    problem = parse_problem(text, domain, source)
    return State(domain, dict(problem.things), dict(problem.values), problem.facts), problem.goal
