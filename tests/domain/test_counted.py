"""Whose contents a subtask's needs and effects ask for, by its formulas and categories alone."""

from __future__ import annotations

from itertools import product

import pytest

from forestall.domain.counted import counted
from forestall.domain.load import read_domain, shipped
from forestall.perception.scope import is_crowded
from forestall.types.plan import Subtask

LAB = """
name = "lab"
tags = ["movable", "support"]

[predicates.held_by]
kind = "relation"
parameters = ["thing", "hand"]

[predicates.rests_on]
kind = "relation"
parameters = ["thing", "place"]
contains = true

[predicates.above]
kind = "derived"
parameters = ["thing", "place"]
definition = "rests_on(?thing, ?place) or some ?x: rests_on(?thing, ?x) and above(?x, ?place)"

[predicates.free]
kind = "derived"
parameters = ["place"]
definition = "not some ?y: rests_on(?y, ?place)"

[categories.Vial]
tags = ["movable"]

[categories.Bench]
tags = ["support"]

[categories.Scale]
tags = ["support"]
capacity = 1

[skills.act]
parameters = ["vial - movable", "place - support"]
needs = ["NEED"]
effects = [{ when = "CONDITION", then = ["rests_on(?vial, ?place)"] }]
"""


def asked(need: str, condition: str = "true", step: str = "act(Vial-1, Scale-1)") -> set[str]:
    domain = read_domain(LAB.replace("NEED", need).replace("CONDITION", condition), "lab.toml")
    return set(counted(Subtask.parse(step), domain))


@pytest.mark.parametrize(
    "need",
    [
        "fewer than capacity(?place) of ?y: rests_on(?y, ?place)",
        "fewer than 2 of ?y - Vial: rests_on(?y, ?place)",
        "not some ?y: rests_on(?y, ?place)",
        "every ?y: rests_on(?y, ?place) implies movable(?y)",
        "free(?place)",
        "some ?y: above(?y, ?place)",
        "Bench(?place) or not rests_on(?vial, ?place) and free(?place)",
    ],
)
def test_a_need_asks_for_the_contents_of_its_argument(need: str) -> None:
    assert asked(need) == {"Scale-1"}
    assert asked("true", need) == {"Scale-1"}


@pytest.mark.parametrize(
    "need",
    [
        "true",
        "rests_on(?vial, ?place)",  # of one thing, which is an argument itself
        "some ?x: rests_on(?vial, ?x)",  # where it stands, not what stands on it
        "Bench(?place) implies free(?place)",
        "fewer than room(?place) of ?y: rests_on(?y, ?place)",  # it has no such number
        "some ?y: held_by(?y, gripper)",
    ],
)
def test_a_need_that_is_decided_or_about_other_things_asks_for_none(need: str) -> None:
    assert asked(need) == set()


def test_a_step_that_is_refused_anyway_asks_for_none() -> None:
    count = "fewer than capacity(?place) of ?y: rests_on(?y, ?place)"
    assert asked(count, step="act(Vial, Bench)") == set()  # no capacity
    assert asked(count, step="act(Vial, Scale)") == {"Scale"}
    assert asked(count, step="act(Bench, Scale)") == set()  # no movable thing
    assert asked("Vial(?place) and free(?place)", "free(?place)") == set()
    assert asked("free(?place)", step="other(Vial, Scale)") == set()
    assert asked("free(?place)", step="act(Vial)") == set()


def test_no_skill_of_the_household_asks_for_what_crowded_things_hold() -> None:
    domain = shipped("household")
    supports = {c for c in domain.categories if is_crowded(c, domain)}
    for name, skill in domain.skills.items():
        for args in product(domain.categories, repeat=len(skill.parameters)):
            if supports & set(args):
                assert not counted(Subtask(name, args), domain) & supports
