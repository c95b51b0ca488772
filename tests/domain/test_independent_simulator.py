"""Steps in PDDL domains do what an independent simulator says, where one is installed."""

from __future__ import annotations

import importlib.util
import random
from itertools import product

import pytest
from pddl_corpus import FOLDER, NAMES, problem, subtask

from forestall.planning.execute import Refusal, apply
from forestall.types.plan import Subtask

pytestmark = [
    pytest.mark.skipif(
        importlib.util.find_spec("unified_planning") is None,
        reason="unified-planning is not installed",
    ),
    pytest.mark.filterwarnings("ignore"),  # the reader's own
]

NOT_READ = ("blocks-derived", "coffee", "dominoes", "either", "museum", "roads")
"""It reads no derived predicates, no unions of types, and no action without parameters."""


@pytest.mark.parametrize("name", [n for n in NAMES if n not in NOT_READ])
def test_random_steps_are_taken_and_refused_alike(name: str) -> None:
    from unified_planning.engines import UPSequentialSimulator
    from unified_planning.io import PDDLReader

    read = PDDLReader().parse_problem(
        str(FOLDER / f"{name}.pddl"), str(FOLDER / f"{name}.problem.pddl")
    )
    simulator = UPSequentialSimulator(read, error_on_failed_checks=False)
    steps = [
        (action, args)
        for action in read.actions
        for args in product(*(list(read.objects(p.type)) for p in action.parameters))
    ]

    def same(action: object, args: object) -> Subtask:
        names = [str(x).replace("-", "_") for x in args]  # type: ignore[attr-defined]
        return subtask(action.name.replace("-", "_"), *names)  # type: ignore[attr-defined]

    rng = random.Random(name)
    theirs, (ours, goal) = simulator.get_initial_state(), problem(name)
    for _ in range(10):
        tried = rng.sample(steps, min(12, len(steps)))
        able = []
        for action, args in tried:
            applicable = simulator.is_applicable(theirs, action, args)
            assert applicable != isinstance(apply(ours, same(action, args)), Refusal)
            able += [(action, args)] if applicable else []
        if able:
            action, args = able[0]
            theirs = simulator.apply(theirs, action, args)
            after = apply(ours, same(action, args))
            assert theirs is not None and not isinstance(after, Refusal)
            ours = after
            assert simulator.is_goal(theirs) == ours.true(goal)
