"""Domains written as PDDL: the text never changes, and reads back as the same domain."""

from __future__ import annotations

import pytest
from pddl_corpus import FOLDER, NAMES, problem

from forestall.domain.load import load_domain, shipped
from forestall.domain.pddl_in import read_pddl
from forestall.domain.pddl_out import domain_pddl
from forestall.domain.pddl_state import problem_pddl
from forestall.errors import DomainError
from forestall.planning.pddl_problem import read_problem

PLAIN = [n for n in NAMES if n not in ("coffee", "either", "lamps")]
"""Without what PDDL cannot say or planners do not read: annotations, unions of types."""


@pytest.mark.parametrize("name", PLAIN)
def test_a_domain_reads_back_as_it_was(name: str) -> None:
    domain = load_domain(str(FOLDER / f"{name}.pddl"))
    text = domain_pddl(domain).text
    again = read_pddl(text, "again.pddl")
    assert again == domain
    assert domain_pddl(again).text == text


@pytest.mark.parametrize("name", PLAIN)
def test_a_problem_reads_back_as_it_was(name: str) -> None:
    state, goal = problem(name)
    text = problem_pddl(state, goal)
    again, wanted = read_problem(text, state.domain)
    assert (again.kinds, again.facts, again.values) == (state.kinds, state.facts, state.values)
    assert wanted == goal
    assert problem_pddl(again, wanted) == text


def test_text_is_sorted() -> None:
    text = domain_pddl(shipped("household"), without_processes=True, without_makers=True).text
    actions = [x for x in text.splitlines() if x.startswith("  (:action")]
    assert actions == sorted(actions)
    assert text.count("(") == text.count(")")


def test_what_pddl_cannot_say_is_refused_by_name() -> None:
    household = shipped("household")
    with pytest.raises(DomainError, match=r"happens by itself .*\(wash, run_water, .*without proc"):
        domain_pddl(household)
    with pytest.raises(DomainError, match=r"come or go \(slice_obj, crack_obj\)"):
        domain_pddl(household, without_processes=True)
