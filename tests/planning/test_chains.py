"""Chains of three hundred: of steps, of derived facts, of things on each other."""

from __future__ import annotations

import sys

import pytest

from forestall.domain.evaluate import literal_truth
from forestall.domain.load import read_domain
from forestall.domain.view import FALSE, TRUE
from forestall.planning.planner import plan_goal
from forestall.planning.search import SearchConfig
from forestall.planning.state import State
from forestall.planning.validate import unmet
from forestall.types.facts import Literal
from forestall.types.task import Goal
from forestall.types.verdict import ReplanOutcome

LONG = 300

DOMAIN = read_domain(
    r"""
name = "hall"
tags = ["crate", "bay"]

[predicates.in_bay]
kind = "relation"
parameters = ["thing", "bay - bay"]
contains = true
group = "where"

[predicates.on]
kind = "relation"
parameters = ["thing", "below - crate"]
contains = true
group = "where"

[predicates.linked]
kind = "relation"
parameters = ["one - bay", "other - bay"]

[predicates.above]
kind = "derived"
parameters = ["thing", "below - crate"]
definition = "on(?thing, ?below) or some ?mid - crate: on(?thing, ?mid) and above(?mid, ?below)"

[predicates.top]
kind = "derived"
parameters = ["thing"]
definition = "every ?x - crate: not on(?x, ?thing)"

[attributes.lit]
values = ["no", "yes"]

[attributes.checked]
values = ["no", "yes"]

[categories.Crate]
tags = ["crate"]
attributes = ["checked"]

[categories.Bay]
tags = ["bay"]
attributes = ["lit"]

[skills.light]
parameters = ["start - bay", "end - bay"]
needs = [{ fact = "lit(?start)=yes and linked(?start, ?end)", else = "{start} is dark" }]
effects = ["lit(?end)=yes"]

[skills.unstack]
parameters = ["thing - crate", "below - crate", "bay - bay"]
needs = [{ fact = "on(?thing, ?below) and top(?thing)", else = "{thing} is not on top" }]
effects = ["in_bay(?thing, ?bay)"]

[skills.check]
parameters = ["thing - crate", "below - crate"]
needs = [{ fact = "above(?thing, ?below)", else = "{thing} is not above {below}" }]
effects = ["checked(?thing)=yes"]
""",
    "hall.toml",
)


def hall(bays: int, crates: int = 0) -> State:
    """Bays in a row, the first of them lit, and one tower of crates."""
    kinds = {f"Bay-{i}": "Bay" for i in range(1, bays + 1)}
    kinds |= {f"Crate-{i}": "Crate" for i in range(1, crates + 1)}
    values = {(f"Bay-{i}", "lit"): "yes" if i == 1 else "no" for i in range(1, bays + 1)}
    values |= {(f"Crate-{i}", "checked"): "no" for i in range(1, crates + 1)}
    facts = [("linked", f"Bay-{i}", f"Bay-{i + 1}") for i in range(1, bays)]
    facts += [("in_bay", "Crate-1", "Bay-1")] if crates else []
    facts += [("on", f"Crate-{i + 1}", f"Crate-{i}") for i in range(1, crates)]
    return State(DOMAIN, kinds, values, facts)


def reached(state: State, text: str) -> int:
    """How many steps it takes to make something true."""
    wanted = Goal("", literals=(Literal.parse(text),))
    planned = plan_goal(state, wanted, SearchConfig(120.0, whole_limit_s=120.0))
    assert planned.outcome is ReplanOutcome.SOLVED, planned.note
    assert planned.final is not None and not unmet((planned.final,), wanted)
    return len(planned.subtasks)


@pytest.fixture(autouse=True)
def _stack_of_usual_size() -> None:
    assert sys.getrecursionlimit() <= 1000


def test_a_plan_of_many_steps() -> None:
    assert reached(hall(LONG), f"lit(Bay-{LONG})=yes") == LONG - 1


def test_a_tower_is_taken_down() -> None:
    assert reached(hall(1, LONG), "top(Crate-1)") == LONG - 1


def test_a_derived_fact_over_a_long_way() -> None:
    state = hall(1, LONG)
    assert state.says("above", f"Crate-{LONG}", "Crate-1")
    assert not state.says("above", "Crate-1", f"Crate-{LONG}")
    assert reached(state, f"not above(Crate-{LONG}, Crate-1)") == 1
    assert literal_truth(Literal("above", (f"Crate-{LONG}", "Crate-2")), state, {}) == TRUE
    assert literal_truth(Literal("above", ("Crate-2", f"Crate-{LONG}")), state, {}) == FALSE


def test_a_need_over_a_long_way() -> None:
    assert reached(hall(1, 100), "checked(Crate-100)=yes") == 1


def test_facts_that_go_in_a_long_circle_support_nothing() -> None:
    state = hall(1, LONG)
    state.remove(("in_bay", "Crate-1", "Bay-1"))
    state.add(("on", "Crate-1", f"Crate-{LONG}"))
    assert state.says("above", "Crate-5", "Crate-5")
    state.create("Crate-999", "Crate")
    assert not state.says("above", "Crate-5", "Crate-999")
    assert literal_truth(Literal("above", ("Crate-5", "Crate-999")), state, {}) == FALSE
