"""PDDL files become domains whose skills do what the files say."""

from __future__ import annotations

import pytest
from pddl_corpus import FOLDER, NAMES, execute, plan, problem, subtask

from forestall.domain.load import load_domain
from forestall.domain.pddl_in import read_pddl
from forestall.errors import DomainError
from forestall.planning.execute import Refusal, apply
from forestall.planning.pddl_problem import read_problem


@pytest.mark.parametrize("name", NAMES)
def test_plan_of_the_corpus_reaches_its_goal(name: str) -> None:
    state, goal = problem(name)
    assert not state.true(goal)
    assert execute(state, plan(name)).true(goal)


def test_types_are_categories_and_what_stands_above_them_tags() -> None:
    domain = load_domain(str(FOLDER / "logistics.pddl"))
    assert domain.categories["truck"].tags == {"vehicle", "physobj"}
    assert domain.categories["vehicle"].tags == {"physobj"}
    assert domain.kinds("airport") == {"airport", "place"}
    assert domain.is_a("truck", "vehicle") and not domain.is_a("package", "vehicle")
    assert set(domain.tags) == {"vehicle", "physobj", "place"}
    assert domain.robot.hands == ()


def test_constants_are_things_of_every_problem() -> None:
    state, _ = problem("coffee")
    assert state.domain.constants == (
        ("coffee_machine", "station"), ("kitchen_desk", "place"), ("robby", "robot"),
    )  # fmt: skip
    assert state.kinds["robby"] == "robot" and state.kinds["office_2"] == "place"


def test_spelling_is_kept() -> None:
    spelling = dict(load_domain(str(FOLDER / "coffee.pddl")).spelling)
    assert spelling["coffee_machine"] == "coffee-machine"
    assert spelling["set_down"] == "set-down" and "take" not in spelling


def test_annotations_say_what_pddl_cannot() -> None:
    domain = load_domain(str(FOLDER / "lamps.pddl"))
    assert domain.attributes["light"].values == ("off", "on")
    assert domain.categories["lamp"].attributes == ("light", "state")
    assert domain.categories["thing"].attributes == ("state",)
    assert domain.categories["lamp"].spoken == "floor lamp"
    assert domain.containing == ("stands_in",)
    assert not domain.predicates["free_hand"].camera
    assert domain.skill("lift").at == "?r" and domain.skill("lift").duration_s == 2.5
    assert domain.phrases("lamp", "light", "on") == ("a floor lamp that shines",)
    assert str(domain.skill("switch_on").effects[0].facts[0]) == "light(?l)=on"
    assert str(domain.skill("switch_off").effects[0].facts[0]) == "light(?l)=off"


def test_refusals_are_said_as_annotated() -> None:
    state, _ = problem("lamps")
    after = execute(state, [subtask("lift", "vase", "den")])
    refused = apply(after, subtask("lift", "l1", "den"))
    assert refused == Refusal("the hand is not free to lift l1")
    plain = apply(after, subtask("switch_off", "l1"))
    assert isinstance(plain, Refusal) and "light(l1)=on" in plain.reason


def test_derived_facts_in_a_circle_support_nothing() -> None:
    state, _ = problem("roads")
    reach = {
        (a, b)
        for a in state.of_kind("town")
        for b in state.of_kind("town")
        if state.says("reachable", a, b)
    }
    circle = ["n1", "n2", "n3"]
    assert reach == {(a, b) for a in circle for b in circle} | {
        ("n4", "n5"), ("n5", "n4"), ("n4", "n4"), ("n5", "n5"),
    }  # fmt: skip


def test_derived_facts_over_many_ways_are_found_in_time() -> None:
    state, _ = problem("roads")
    towns = [f"m{i}" for i in range(14)]
    for town in towns:
        state.create(town, "town")
    for a in towns:
        for b in towns:
            state.add(("road", a, b))
    assert state.says("reachable", "m0", "m13")
    assert not state.says("reachable", "m0", "n1")


def test_wrong_steps_are_refused() -> None:
    state, _ = problem("blocksworld")
    for step in ("pick_up a", "stack a b", "pick_up table", "unstack c"):
        skill, *args = step.split()
        assert isinstance(apply(state, subtask(skill, *args)), Refusal)
    factory, _ = problem("factory")
    refused = apply(factory, subtask("run", "paper", "bolt"))
    assert refused == Refusal("paper is no machine")
    logistics, _ = problem("logistics")
    assert isinstance(apply(logistics, subtask("fly_airplane", "a1", "air2", "post1")), Refusal)


def test_predicates_that_are_called_like_built_in_words_or_types() -> None:
    text = """(define (domain odd)
      (:requirements :typing)
      (:types block)
      (:predicates (block ?x) (located ?x - block) (of ?x ?y))
      (:action do-it :parameters (?x - block) :precondition (block ?x)
        :effect (and (located ?x) (of ?x ?x))))"""
    domain = read_pddl(text, "odd.pddl")
    assert list(domain.predicates) == ["is_block", "is_located", "is_of"]
    assert dict(domain.spelling)["is_block"] == "block"
    given = "(define (problem p) (:domain odd) (:objects b - block)"
    given += " (:init (block b)) (:goal (of b b)))"
    state, goal = read_problem(given, domain)
    assert execute(state, [subtask("do_it", "b")]).true(goal)


def test_goals_over_unions_that_the_domain_does_not_have() -> None:
    state, _ = problem("tidy")
    text = (FOLDER / "tidy.problem.pddl").read_text()
    text = text.replace("(?b - box) (and", "(?b - (either box toy)) (and")
    with pytest.raises(DomainError, match=r"line \d+: no action of tidy is about the types of \?b"):
        read_problem(text, state.domain)


def test_predicates_that_are_defined_with_each_other() -> None:
    text = """(define (domain steps)
      (:predicates (next ?a ?b) (odd ?a ?b) (even ?a ?b) (far ?a ?b))
      (:derived (odd ?a ?b) (or (next ?a ?b) (exists (?c) (and (next ?a ?c) (even ?c ?b)))))
      (:derived (even ?a ?b) (exists (?c) (and (next ?a ?c) (odd ?c ?b))))
      (:derived (far ?a ?b) (and (not (odd ?a ?b)) (even ?a ?b))))"""
    domain = read_pddl(text, "steps.pddl")
    assert domain.recursive["odd"] is domain.recursive["even"]
    assert "far" not in domain.recursive
    given = """(define (problem p) (:domain steps) (:objects a b c d x y z)
      (:init (next a b) (next b c) (next c d) (next d a) (next x y) (next y z) (next z x))
      (:goal (and (odd a b) (even a c) (far b d) (odd x x) (even x x) (not (even a b)))))"""
    state, goal = read_problem(given, domain)
    assert state.true(goal)
    assert not state.says("far", "x", "y") and not state.says("odd", "a", "x")
