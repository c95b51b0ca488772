"""Planning in a domain of another kind: types, quantifiers, counts, processes, new things."""

from __future__ import annotations

import time

import pytest

from forestall.domain.load import read_domain
from forestall.domain.model import Domain
from forestall.planning.execute import Refusal, apply
from forestall.planning.goals import alternatives
from forestall.planning.planner import plan_goal, plan_to
from forestall.planning.state import State
from forestall.types.facts import Literal
from forestall.types.plan import Subtask
from forestall.types.task import Goal
from forestall.types.verdict import ReplanOutcome

TEXT = r"""
name = "depot"
tags = ["crate", "carrier", "bay", "bolted"]

[predicates.in_bay]
kind = "relation"
parameters = ["thing", "bay"]
contains = true
group = "where"

[predicates.loaded]
kind = "relation"
parameters = ["thing", "carrier"]
contains = true
group = "where"

[predicates.linked]
kind = "relation"
parameters = ["one - bay", "other - bay"]

[predicates.connected]
kind = "derived"
parameters = ["one - bay", "other - bay"]
definition = "linked(?one, ?other) or some ?mid: linked(?one, ?mid) and connected(?mid, ?other)"

[predicates.cleared]
kind = "derived"
parameters = ["bay"]
definition = "every ?x - crate: not in_bay(?x, ?bay)"

[predicates.stamped]
kind = "history"
parameters = ["thing"]

[predicates.packs_into]
kind = "static"
parameters = ["thing", "pack"]

[attributes.sealed]
values = ["no", "yes"]

[attributes.lamp]
values = ["off", "amber", "green"]

[categories.Crate]
tags = ["crate"]
attributes = ["sealed"]
packs_into = ["Pallet"]

[categories.Pallet]
tags = ["crate", "bolted"]

[categories.Cart]
tags = ["carrier"]
capacity = 2

[categories.Bay]
tags = ["bay"]
attributes = ["lamp"]

[skills.load]
parameters = ["thing - crate", "cart - carrier", "bay - bay"]
needs = [
  { fact = "in_bay(?thing, ?bay) and in_bay(?cart, ?bay)", else = "{thing} is not beside {cart}" },
  { fact = "fewer than capacity(?cart) of ?y: loaded(?y, ?cart)", else = "{cart} is full" },
  { fact = "not bolted(?thing)", else = "{thing} is bolted down" },
]
effects = ["loaded(?thing, ?cart)"]

[skills.unload]
parameters = ["thing - crate", "cart - carrier", "bay - bay"]
needs = [
  { fact = "loaded(?thing, ?cart) and in_bay(?cart, ?bay)", else = "{thing} is not on {cart}" },
]
effects = [
  "in_bay(?thing, ?bay)",
  { when = "lamp(?bay)=green", then = ["stamped(?thing)"] },
]

[skills.roll]
parameters = ["cart - carrier", "start - bay", "end - bay"]
needs = [
  { fact = "in_bay(?cart, ?start)", else = "{cart} is not in {start}" },
  { fact = "connected(?start, ?end)", else = "no way leads from {start} to {end}" },
]
effects = ["in_bay(?cart, ?end)"]

[skills.seal_all]
parameters = ["bay - bay"]
needs = [{ fact = "some ?x - crate: in_bay(?x, ?bay)", else = "nothing is in {bay}" }]
effects = [{ every = ["?x - crate"], when = "in_bay(?x, ?bay)", then = ["sealed(?x)=yes"] }]

[skills.pack]
parameters = ["thing - Crate", "bay - bay"]
makes = [{ variable = "pallet", source = "thing", by = "packs_into" }]
needs = [
  { fact = "in_bay(?thing, ?bay) and sealed(?thing)=yes", else = "{thing} is not sealed in {bay}" },
]
effects = ["in_bay(?pallet, ?bay)", "gone(?thing)"]

[processes.signal]
parameters = ["bay - bay"]
when = "cleared(?bay) and not lamp(?bay)=green"
effects = ["lamp(?bay)=green"]
"""


@pytest.fixture(scope="module")
def depot() -> Domain:
    return read_domain(TEXT, "depot.toml")


def yard(domain: Domain, crates: int = 3, bays: int = 3, carts: int = 1) -> State:
    """Crates and carts in the first bay; each bay is linked to the next."""
    kinds = {f"Bay-{i}": "Bay" for i in range(1, bays + 1)}
    kinds |= {f"Crate-{i}": "Crate" for i in range(1, crates + 1)}
    kinds |= {f"Cart-{i}": "Cart" for i in range(1, carts + 1)}
    values = {(f"Bay-{i}", "lamp"): "off" for i in range(1, bays + 1)}
    values |= {(f"Crate-{i}", "sealed"): "no" for i in range(1, crates + 1)}
    facts = [("in_bay", x, "Bay-1") for x in kinds if not x.startswith("Bay")]
    facts += [("linked", f"Bay-{i}", f"Bay-{i + 1}") for i in range(1, bays)]
    facts += [("linked", f"Bay-{bays}", "Bay-1")]
    return State(domain, kinds, values, facts)


def wanted(*texts: str, **variables: str) -> Goal:
    return Goal(
        "; ".join(texts),
        tuple((f"?{v}", c) for v, c in variables.items()),
        tuple(map(Literal.parse, texts)),
    )


GOALS = {
    "a derived way": wanted("in_bay(Crate-1, Bay-3)"),
    "a count that is full": wanted(*(f"in_bay(Crate-{i}, Bay-2)" for i in (1, 2, 3))),
    "a quantified effect": wanted("sealed(Crate-2)=yes", "in_bay(Crate-2, Bay-2)"),
    "a derived goal": wanted("cleared(Bay-1)"),
    "a process": wanted("lamp(Bay-1)=green"),
    "a conditional effect": wanted("stamped(Crate-1)"),
    "a new thing": wanted("in_bay(?p, Bay-2)", p="Pallet"),
    "two new things": wanted("in_bay(?p, Bay-1)", "in_bay(?q, Bay-2)", p="Pallet", q="Pallet"),
    "a value that is not": wanted("in_bay(Crate-1, Bay-2)", "not in_bay(Crate-2, Bay-1)"),
}


@pytest.mark.parametrize("name", sorted(GOALS))
def test_goals_are_reached(name: str, depot: Domain) -> None:
    state = yard(depot)
    planned = plan_goal(state, GOALS[name])
    assert planned.outcome is ReplanOutcome.SOLVED, planned.note
    for step in planned.subtasks:
        after = apply(state, step)
        assert not isinstance(after, Refusal), after
        state = after
    choices = [n for n in state.kinds if n.startswith("Pallet")]
    bound = {"?p": choices[0], "?q": choices[-1]} if choices else {}
    literals = [x.bind(bound) for x in GOALS[name].literals]
    swapped = [
        x.bind({"?p": choices[-1], "?q": choices[0]} if choices else {})
        for x in GOALS[name].literals
    ]
    assert all(map(state.holds, literals)) or all(map(state.holds, swapped))


@pytest.mark.parametrize(
    "text", ["in_bay(Bay-1, Bay-2)", "lamp(Bay-2)=amber", "sealed(Cart-1)=yes"]
)
def test_what_nothing_brings_about_is_proven_unsolvable(text: str, depot: Domain) -> None:
    planned = plan_goal(yard(depot), wanted(text))
    assert planned.outcome is ReplanOutcome.UNSOLVABLE


def test_what_is_bolted_down_stays(depot: Domain) -> None:
    state = yard(depot)
    state.create("Pallet-1", "Pallet")
    state.add(("in_bay", "Pallet-1", "Bay-1"))
    planned = plan_goal(state, wanted("in_bay(Pallet-1, Bay-2)"))
    assert planned.outcome is not ReplanOutcome.SOLVED


def test_unknown_skill_and_arity_are_refusals(depot: Domain) -> None:
    assert isinstance(apply(yard(depot), Subtask("fly", ("Cart-1",))), Refusal)
    assert isinstance(apply(yard(depot), Subtask("load", ("Crate-1",))), Refusal)


def test_two_hundred_things(depot: Domain) -> None:
    state = yard(depot, crates=180, bays=15, carts=5)
    goal = wanted("in_bay(Crate-7, Bay-9)", "in_bay(Crate-90, Bay-2)", "sealed(Crate-90)=yes")
    start_s = time.process_time()
    planned = plan_to(state, alternatives(state, goal))
    assert planned.outcome is ReplanOutcome.SOLVED
    assert time.process_time() - start_s < 1.0
