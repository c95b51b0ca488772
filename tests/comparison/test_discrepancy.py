from __future__ import annotations

from dataclasses import replace

import pytest
from graph_pairs import (
    BLOCKED,
    CLOSED,
    DIRTY,
    EXPECTED,
    KNIFE,
    MUG_DROPPED,
    MUG_HELD,
    OCCUPIED,
    SPREAD,
    TOGETHER,
    scene,
)

from forestall.comparison.score import ScoreConfig, compare
from forestall.domain.load import shipped
from forestall.domain.model import Domain
from forestall.embeddings import HashedTextEncoder
from forestall.types.graph import SceneGraph, Seen
from forestall.types.verdict import Change, Discrepancy

DOMAIN = shipped("household")


def differences(
    observed: SceneGraph,
    expected: SceneGraph,
    config: ScoreConfig | None = None,
    domain: Domain = DOMAIN,
) -> tuple[Discrepancy, ...]:
    config = config or ScoreConfig()
    return compare(observed, expected, config, HashedTextEncoder(), domain).discrepancies


def test_no_differences() -> None:
    assert differences(EXPECTED, EXPECTED) == ()
    assert differences(SPREAD, TOGETHER) == ()


def test_occupied_microwave() -> None:
    found = differences(OCCUPIED, EXPECTED)
    assert [d.change for d in found] == [Change.EXTRA_RELATION, Change.EXTRA_OBJECT]
    assert found[0].subject == "Bowl-1"
    assert found[0].text == "Bowl-1 is inside Microwave-1; the demonstration shows nothing there"
    assert found[1].text == "Bowl-1 is here; the demonstration has no Bowl"


def test_an_inside_that_the_demonstration_did_not_see_is_not_called_empty() -> None:
    unseen = SceneGraph(EXPECTED.nodes, EXPECTED.relations, EXPECTED.subtask, ("Microwave-1",))
    text = differences(OCCUPIED, unseen)[0].text
    assert "could not be seen" in text
    assert "nothing" not in text


def test_a_changed_state_is_a_state_and_not_two_objects() -> None:
    found = differences(DIRTY, EXPECTED)
    assert [(d.change, d.subject) for d in found] == [(Change.STATE, "Plate-1")]
    assert (found[0].expected, found[0].observed) == ("dirty=clean", "dirty=dirty")
    assert found == differences(DIRTY, EXPECTED, ScoreConfig(state_changes_match=True))
    assert differences(CLOSED, EXPECTED)[0].text == (
        "Microwave-1 is closed; the demonstration shows it open"
    )


def test_dropped_mug() -> None:
    found = differences(MUG_DROPPED, MUG_HELD)
    assert [d.change for d in found] == [Change.EXTRA_RELATION, Change.MISSING_RELATION]
    assert "the gripper does not hold Mug-1 (Mug-1 is on top of Floor-1)" in found[1].text


def test_blocked_knife_first() -> None:
    found = differences(BLOCKED, KNIFE)
    assert found[0].text == (
        "Pot-1 stands in front of Knife-1; in the demonstration nothing blocks it"
    )
    assert Change.EXTRA_OBJECT in {d.change for d in found}


@pytest.mark.parametrize(
    ("words", "so", "not_so"),
    [
        ("{0} rests on {1}", "Cup-1 rests on Shelf-1", "Cup-1 does not rest on Shelf-1"),
        ("{1} carries {0}", "Shelf-1 carries Cup-1", "it is not so that Shelf-1 carries Cup-1"),
        ("", "Cup-1 rests on Shelf-1", "Cup-1 does not rest on Shelf-1"),
    ],
)
def test_a_difference_is_said_in_the_words_of_the_domain(words: str, so: str, not_so: str) -> None:
    on = replace(DOMAIN.predicates["on_top_of"], name="rests_on", words=words)
    own = replace(DOMAIN, predicates={**DOMAIN.predicates, "rests_on": on})
    config = ScoreConfig(predicates=("rests_on",))
    there, away = scene("Cup-1; Shelf-1", "Cup-1 rests_on Shelf-1"), scene("Cup-1; Shelf-1")
    (more,) = differences(there, away, config, own)
    assert more.text == f"{so}; the demonstration does not have it there"
    (less,) = differences(away, there, config, own)
    assert less.text == f"{not_so}; the demonstration has it so"


def test_a_difference_of_states_is_said_in_the_words_of_the_domain() -> None:
    (found,) = differences(scene("Mug-1 filled=empty"), scene("Mug-1 filled=water"))
    assert found.text == "Mug-1 is empty; the demonstration shows it filled with water"


def test_missing_things() -> None:
    expected = scene("Fridge-1; Bowl-1; Bowl-2", "Bowl-2 inside Fridge-1")
    found = differences(scene("Fridge-1; Bowl-1"), expected)
    assert [(d.change, d.subject) for d in found] == [
        (Change.MISSING_RELATION, "Bowl-2"),
        (Change.MISSING_OBJECT, "Bowl-2"),
    ]
    assert found[1].text == "only 1 of Bowl was seen here; the demonstration has Bowl-2"


def test_a_closed_inside_is_unobserved_and_not_empty() -> None:
    expected = scene("Fridge-1; Egg-1", "Egg-1 inside Fridge-1")
    in_sight = scene("Fridge-1; Egg-1", hidden=("Fridge-1",))
    nodes = (replace(n, seen=Seen.REMEMBERED) if n.id == "Egg-1" else n for n in in_sight.nodes)
    found = differences(replace(in_sight, nodes=tuple(nodes)), expected)
    assert [(d.change, d.observed) for d in found] == [(Change.MISSING_RELATION, "unobserved")]
    found = differences(in_sight, expected)
    assert [(d.change, d.observed) for d in found] == [(Change.MISSING_RELATION, "")]
    assert "Egg-1 is not inside Fridge-1" in found[0].text
