"""Formulas: their text reads back, and what they mean does not change by being normalised."""

from __future__ import annotations

from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from forestall.domain.formula import (
    FALSE,
    TRUE,
    And,
    Every,
    Fewer,
    Formula,
    Not,
    Or,
    Parameter,
    Some,
    bind,
    free,
    normal,
    parse_formula,
    show,
)
from forestall.domain.load import load_domain
from forestall.errors import InputError
from forestall.planning.state import State
from forestall.types.facts import Literal

NAMES = st.sampled_from(["?x", "?y", "?z", "Mug-1", "gripper", "l1"])
PARAMETERS = st.builds(
    Parameter, st.sampled_from(["?x", "?y", "?w"]), st.sampled_from([None, "food", "has_open"])
)
LITERALS = st.builds(
    Literal,
    st.sampled_from(["inside", "open", "p2", "some_thing"]),
    st.lists(NAMES, max_size=3).map(tuple),
    st.sampled_from(["true", "true", "on", "half_open"]),
)


def extended(inner: st.SearchStrategy[Formula]) -> st.SearchStrategy[Formula]:
    several = st.lists(inner, min_size=2, max_size=3).map(tuple)
    variables = st.lists(PARAMETERS, min_size=1, max_size=2).map(tuple)
    return st.one_of(
        st.builds(Not, inner),
        st.builds(And, several),
        st.builds(Or, several),
        st.builds(Some, variables, inner),
        st.builds(Every, variables, inner),
        st.builds(Fewer, st.integers(0, 4), st.just(""), PARAMETERS, inner),
        st.builds(Fewer, st.just("capacity"), NAMES, PARAMETERS, inner),
    )


FORMULAS = st.recursive(st.one_of(LITERALS, st.just(TRUE), st.just(FALSE)), extended, max_leaves=8)


@given(FORMULAS)
def test_the_text_reads_back(formula: Formula) -> None:
    assert parse_formula(show(formula)) == formula


@given(FORMULAS)
def test_normal_form_has_no_not_but_before_counting_and_values(formula: Formula) -> None:
    def check(part: Formula) -> None:
        if isinstance(part, Not):
            assert isinstance(part.part, Fewer) or (
                isinstance(part.part, Literal) and part.part.is_state
            )
            part = part.part
        if isinstance(part, And | Or):
            for p in part.parts:
                check(p)
        elif not isinstance(part, Literal | Not):
            check(part.part)

    check(normal(formula))
    assert free(normal(formula)) == free(formula)


@given(FORMULAS)
def test_binding_what_is_not_free_changes_nothing(formula: Formula) -> None:
    assert bind(formula, {"?nothing": "Mug-1"}) == formula


LAMPS = """
name = "lamps"
[predicates.on]
kind = "relation"
parameters = ["a", "b"]
[attributes.light]
values = ["off", "lit"]
[categories.Lamp]
attributes = ["light"]
capacity = 2
[categories.Box]
"""

TRUTHS = {
    "on(a, b)": True,
    "on(b, a)": False,
    "not on(b, a)": True,
    "light(a)=lit": True,
    "light(a)!=lit": False,
    "light(c)=off": False,
    "light(c)!=off": True,
    "some ?x: on(?x, b)": True,
    "some ?x, ?y: on(?x, ?y) and on(?y, ?x)": True,
    "some ?x, ?y: on(?x, ?y) and on(?y, ?x) and not same(?x, ?y)": False,
    "some ?x: on(?x, ?x)": True,
    "some ?x - Lamp: on(?x, ?x)": False,
    "every ?x - Lamp: light(?x)=lit or on(a, ?x)": True,
    "every ?x: Lamp(?x)": False,
    "every ?x: Lamp(?x) implies has_light(?x)": True,
    "fewer than 2 of ?x: on(a, ?x)": True,
    "fewer than 1 of ?x: on(a, ?x)": False,
    "fewer than capacity(a) of ?x - Lamp: Lamp(?x)": False,
    "fewer than capacity(c) of ?x - Lamp: Lamp(?x)": True,
    "same(a, a) and not same(a, b)": True,
    "same_category(a, b) and not same_category(a, c)": True,
    "true and not false": True,
    "on(b, a) implies on(a, c)": True,
}


@pytest.mark.parametrize("text", TRUTHS)
def test_what_formulas_mean(text: str, tmp_path: Path) -> None:
    file = tmp_path / "lamps.toml"
    file.write_text(LAMPS)
    state = State(
        load_domain(str(file)),
        {"a": "Lamp", "b": "Lamp", "c": "Box"},
        {("a", "light"): "lit", ("b", "light"): "off"},
        [("on", "a", "b"), ("on", "c", "c")],
    )
    assert state.true(parse_formula(text)) == TRUTHS[text]


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("", "a fact is expected at the end"),
        ("on(?x, ?y", "',' is expected at the end"),
        ("on(?x) on(?y)", "the end is expected at 'on"),
        ("some x: on(x, x)", r"a variable such as \?x is expected at 'x"),
        ("every ?x on(?x)", "':' is expected at 'on"),
        ("fewer 2 of ?x: on(?x)", "'than' is expected at '2"),
        ("on(?x) & on(?y)", "as a formula at '& on"),
        ("not", "a fact is expected at the end"),
    ],
)
def test_where_a_text_stops_being_a_formula(text: str, said: str) -> None:
    with pytest.raises(InputError, match=said):
        parse_formula(text)
