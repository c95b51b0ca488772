"""Three-valued truth of the facts of a domain on a scene graph."""

from __future__ import annotations

from dataclasses import replace

import pytest

from forestall.domain.checks import check_literal
from forestall.domain.load import shipped
from forestall.domain.truth import truth
from forestall.errors import InputError, UnknownNameError
from forestall.types.facts import GRIPPER, Literal, Truth
from forestall.types.graph import Box, ObjectNode, Relation, SceneGraph, Seen
from forestall.types.plan import Subtask

DOMAIN = shipped("household")
BOX = Box((0.0, 0.0, 0.0), (1.0, 1.0, 1.0))


def kitchen(*, microwave: str | None = "closed", hidden: tuple[str, ...] = ()) -> SceneGraph:
    return SceneGraph(
        (
            ObjectNode("Plate-1", "Plate", (("dirty", "clean"),), (0.5, 0.5, 0.5), BOX),
            ObjectNode("Bowl-1", "Bowl", (("filled", None),), None, None, Seen.UNOBSERVED),
            ObjectNode("Microwave-1", "Microwave", (("open", microwave),), (0.5, 0.5, 0.5), BOX),
            ObjectNode(GRIPPER, "Gripper"),
        ),
        (
            Relation("Plate-1", "held_by", GRIPPER),
            Relation("Bowl-1", "inside", "Microwave-1"),
        ),
        Subtask.parse("put_in(Plate-1, Microwave-1)"),
        hidden,
    )


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("dirty(Plate-1)=clean", Truth.TRUE),
        ("dirty(Plate-1)=dirty", Truth.FALSE),
        ("filled(Bowl-1)=wine", Truth.UNOBSERVED),
        ("open(Microwave-1)=open", Truth.FALSE),
        ("held_by(Plate-1, gripper)", Truth.TRUE),
        ("not held_by(Plate-1, gripper)", Truth.FALSE),
        ("held_by(Bowl-1, gripper)", Truth.FALSE),
        ("hand_empty()", Truth.FALSE),
        ("inside(Bowl, Microwave)", Truth.TRUE),
        ("not inside(Bowl, Microwave)", Truth.FALSE),
        ("vacant(Microwave-1)", Truth.FALSE),
        ("vacant(Plate-1)", Truth.TRUE),
        ("accessible(Bowl-1)", Truth.FALSE),
        ("accessible(Plate-1)", Truth.TRUE),
        ("located(Bowl-1)", Truth.FALSE),
        ("located(Mug-1)", Truth.FALSE),
        ("unblocked(Plate-1)", Truth.TRUE),
        ("dirty(Cup-1)=clean", Truth.UNOBSERVED),
        ("dirty(Cup)=clean", Truth.UNOBSERVED),
        ("spoiled(Bowl-1)", Truth.UNOBSERVED),
    ],
)
def test_truth(text: str, expected: Truth) -> None:
    assert truth(kitchen(), Literal.parse(text), DOMAIN) is expected


def test_an_empty_looking_closed_container_is_unobserved() -> None:
    graph = SceneGraph(
        (ObjectNode("Microwave-1", "Microwave", (("open", "closed"),)),), hidden=("Microwave-1",)
    )
    assert truth(graph, Literal.parse("vacant(Microwave-1)"), DOMAIN) is Truth.UNOBSERVED


@pytest.mark.parametrize("seen", list(Seen))
def test_what_is_in_sight_is_not_in_a_container_that_no_view_reached(seen: Seen) -> None:
    egg = ObjectNode("Egg-1", "Egg", (), BOX.centre, BOX, seen)
    graph = SceneGraph((ObjectNode("Fridge-1", "Fridge"), egg), hidden=("Fridge-1",))
    expected = Truth.FALSE if seen is Seen.VISIBLE else Truth.UNOBSERVED
    inside = Literal.parse("inside(Egg-1, Fridge-1)")
    assert truth(graph, inside, DOMAIN) is expected
    assert truth(replace(graph, hidden=()), inside, DOMAIN) is Truth.FALSE
    lost = SceneGraph(
        (ObjectNode("Fridge-1", "Fridge"), replace(egg, box_m=None)), (), None, ("Fridge-1",)
    )
    assert truth(lost, inside, DOMAIN) is Truth.UNOBSERVED


@pytest.mark.parametrize(
    ("text", "error", "says"),
    [
        ("eats(Plate-1, Bowl-1)", UnknownNameError, "unknown predicate in the goal 'eats'"),
        ("insid(Plate-1, Bowl-1)", UnknownNameError, "did you mean inside"),
        ("inside(Plate-1)", InputError, r"inside takes 2 argument\(s\)"),
        ("open(Plate-1)=ajar", UnknownNameError, "known: closed, open"),
        ("open(Plate-1)", UnknownNameError, "known: closed, open"),
        ("inside(Plate-1, Bowl-1)=open", InputError, "inside is true or false"),
    ],
)
def test_facts_that_a_domain_does_not_know(text: str, error: type[Exception], says: str) -> None:
    with pytest.raises(error, match=says):
        check_literal(DOMAIN, "the goal", Literal.parse(text))
