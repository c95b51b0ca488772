"""What is wrong or not supported in PDDL is refused by name and line."""

from __future__ import annotations

import pytest
from pddl_corpus import FOLDER

from forestall.domain.load import load_domain
from forestall.domain.pddl_in import read_pddl
from forestall.errors import DomainError, FileFormatError
from forestall.planning.pddl_problem import read_problem

LAMPS = (FOLDER / "lamps.pddl").read_text()
NOTES = (FOLDER / "lamps.annotations.toml").read_text()
PROBLEM = (FOLDER / "lamps.problem.pddl").read_text()

CASES = """
durative actions required
:negative-preconditions :durative-actions) <- :negative-preconditions)
:durative
unknown or unsupported requirement ':durative-actions'

fluents required
:negative-preconditions :fluents) <- :negative-preconditions)
:fluents
unknown or unsupported requirement ':fluents'

preferences required
:negative-preconditions :preferences) <- :negative-preconditions)
:preferences
unknown or unsupported requirement ':preferences'

a misspelt requirement
:negative-precondition) <- :negative-preconditions)
:negative-pre
unknown or unsupported requirement ':negative-precondition': did you mean :negative-preconditions

numeric fluents
(:functions (total-cost)) (:action lift <- (:action lift
(:functions
numeric fluents are not supported: (:functions ...)

a durative action
(:durative-action lift <- (:action lift
(:durative
durative actions are not supported: (:durative-action ...)

a numeric effect
(increase (total-cost) 1) (free-hand) (not (held ?t))) <- (free-hand) (not (held ?t)))
(increase
numeric effects are not supported: (increase (total-cost) 1)

a numeric condition
(> (weight ?t) 3) (cracked ?t)) <- (cracked ?t))
(> (w
numeric fluents are not supported: (> (weight ?t) 3)

an unknown section
(:actions lift <- (:action lift
(:actions
unknown section ':actions': did you mean :action?

an unknown predicate
(hled ?t) (cracked ?t)) <- (held ?t) (cracked ?t))
(hled
unknown predicate 'hled': did you mean held

an unbound variable
(held ?s) (cracked ?t)) <- (held ?t) (cracked ?t))
(held ?s
unknown variable: nothing binds it: '?s': known: ?t

an unknown type
(?t - thng ?r - room) <- (?t - thing ?r - room)
thng
unknown type 'thng': did you mean thing?

an unknown thing
(stands-in vase ?r) (free-hand)) <- (stands-in ?t ?r) (free-hand))
(stands-in vase ?r) (free
unknown thing 'vase': known: none

another number of arguments
(held ?t ?t) (cracked ?t)) <- (held ?t) (cracked ?t))
(held ?t ?t
(held ?t ?t): held takes 1 argument(s)

two actions of one name
(:action lift <- (:action mend
(:action lift|2
action lift stands twice: first in line 16

two predicates of one name
(held ?t - room) (free-hand)) <- (free-hand))
(held ?t - room
predicate held is declared twice

a type under itself
thing room - lamp <- room thing - object
thing room
type thing stands under itself

an effect on a derived predicate
(:derived (free-hand) (exists (?t - thing) (held ?t))) (:action lift <- (:action lift
(not (free-hand))
free_hand is derived and cannot be changed: change what it is defined by

a part of an action that there is not
:preconditions (held ?t) <- :precondition (held ?t)
:preconditions
unknown part of action set-in ':preconditions': did you mean :precondition

a parenthesis too few
(not (free-hand))) <- (not (free-hand))))
(:action lift
the section that begins here is not closed: a parenthesis is missing

a parenthesis too many
(held ?t))))) ) <- (held ?t)))))
(held ?t)))))
')' stands after the end of (define ...)

a value that is taken away
(not (whole ?t)) (not (cracked ?t))) <- (whole ?t) (not (cracked ?t)))
(not (whole
not whole(?t): whole is a value of the attribute state, which is left without one
"""
"""Name; what is written in place of what; where the fault is (the how-manieth); what is said."""

WRONG = {case[0]: case[1:] for case in (c.strip().split("\n") for c in CASES.split("\n\n"))}


def line_of(text: str, place: str) -> int:
    place, _, number = place.partition("|")
    at = -1
    for _ in range(int(number or 1)):
        at = text.index(place, at + 1)
    return text.count("\n", 0, at) + 1


@pytest.mark.parametrize("name", WRONG)
def test_what_is_wrong_is_said_with_its_line(name: str) -> None:
    change, place, said = WRONG[name]
    new, old = change.split(" <- ")
    assert LAMPS.count(old) >= 1
    text = LAMPS.replace(old, new, 1)
    with pytest.raises(DomainError) as raised:
        read_pddl(text, "lamps.pddl", NOTES)
    line = line_of(text, place)
    assert str(raised.value).startswith(f"lamps.pddl, line {line}: {said}")
    assert "\n" not in str(raised.value)


def test_names_that_become_the_same_are_refused() -> None:
    text = LAMPS.replace("(:action lift", "(:action set_in")
    with pytest.raises(DomainError, match=r"line \d+: set_in and set-in would both be called"):
        read_pddl(text, "lamps.pddl", NOTES)


def test_a_derivation_must_not_depend_on_its_opposite() -> None:
    text = """(define (domain d)
      (:predicates (p ?x) (q ?x))
      (:derived (p ?x) (not (q ?x)))
      (:derived (q ?x) (exists (?y) (p ?y))))"""
    with pytest.raises(DomainError, match=r"d.pddl, line 2: definition of p is cyclic: .*p -> q"):
        read_pddl(text, "d.pddl")


@pytest.mark.parametrize(
    ("new", "old", "said"),
    [
        ("[predicates.stands_inn]", "[predicates.stands_in]",
         r"line \d+: unknown name in the annotations of predicates 'stands_inn': did you mean"),
        ("contain = true", "contains = true",
         r"line \d+: unknown field of annotations: predicates.stands_in 'contain': did you mean"),
        ('on = "lid"', 'on = "lit"',
         r"line \d+: unknown predicate in values of attribute light 'lid': did you mean lit"),
        ('cracked = "", odd = ""', 'cracked = "cracked"',
         "attribute state: values must name a predicate for each value"),
        ('"free_hands()"', '"free_hand()"',
         r"line \d+: unknown need in the refusals of skill lift 'free_hands\(\)': did you mean"),
        ('at = "q"', 'at = "r"', r"line \d+: unknown variable in skill lift: .*'\?q'"),
        ('tags = ["movabel"]\n\n[c', 'tags = ["movable"]\n\n[c',
         r"line \d+: unknown tag of thing 'movabel': did you mean movable"),
    ],
)  # fmt: skip
def test_annotations_are_checked(new: str, old: str, said: str) -> None:
    assert old in NOTES
    with pytest.raises(DomainError, match=f"^notes.toml.*{said}"):
        read_pddl(LAMPS, "lamps.pddl", NOTES.replace(old, new), "notes.toml")


def test_annotations_that_are_no_toml() -> None:
    with pytest.raises(FileFormatError, match=r"notes.toml: not valid TOML"):
        read_pddl(LAMPS, "lamps.pddl", "a =", "notes.toml")


@pytest.mark.parametrize(
    ("new", "old", "said"),
    [
        (
            "(:domain lamp)",
            "(:domain lamps)",
            "the problem is one of domain lamp, and not of lamps",
        ),
        ("l1 l2 - lmp", "l1 l2 - lamp", "unknown type 'lmp': did you mean lamp?"),
        ("(whole vas)", "(whole vase)", "unknown thing 'vas': did you mean vase?"),
        ("(at 5 (lit l2))", "(lit l2)", "timed initial literals (:timed-initial-literals) are not"),
        ("(= (total-cost) 0)", "(lit l2)", "numeric fluents are not supported: (= (total-cost) 0)"),
        (
            "(cracked l1) (whole l1)",
            "(cracked l1)",
            "l1 has two values of state: cracked and",
        ),
        ("(lit l2)", "(whole l2)", "l2 has no value of state in (:init)"),
        ("(:metric minimize (total-cost)) (:goal", "(:goal", "metrics are not supported"),
        ("(lit hal)", "(lit l1)", "unknown thing 'hal': did you mean hall"),
        ("(:target", "(:goal", "unknown section ':target'"),
        ("(preference p (lit l1))", "(lit l1)", "preferences (:preferences) are not supported"),
    ],
)
def test_problems_are_checked(new: str, old: str, said: str) -> None:
    domain = load_domain(str(FOLDER / "lamps.pddl"))
    assert old in PROBLEM
    text = PROBLEM.replace(old, new, 1)
    with pytest.raises(DomainError) as raised:
        read_problem(text, domain, "p.pddl")
    assert str(raised.value).startswith("p.pddl, line ")
    assert said in str(raised.value)


def test_a_problem_without_a_goal() -> None:
    domain = load_domain(str(FOLDER / "lamps.pddl"))
    with pytest.raises(DomainError, match=r"has no section \(:goal"):
        read_problem("(define (problem p) (:domain lamps) (:init))", domain)
