from __future__ import annotations

import pytest

from forestall.domain.load import read_domain, shipped
from forestall.domain.words import Names, Words
from forestall.errors import InputError
from forestall.types.facts import category_of
from forestall.types.plan import Subtask

WORDS = Words(shipped("household"))

KNOWN = {
    "DiningTable": ("dining table", "Dining Table", "dining_table", "table", "DINING-TABLE"),
    "Mug": ("mug", "025_mug", "coffee mug", "Mug|+00.10|-01.2|+3.0", "mug.n.04_2", "mug-3"),
    "CounterTop": ("countertop", "Counter Top", "countertop.n.01", "Kitchen Counter #2"),
    "Sink": ("SinkBasin", "sink basin", "Sink|-1|2|SinkBasin"),
    "WineBottle": ("wine bottle", "WineBottle_a12f4c9e"),
    "CellPhone": ("cell phone",),
    "Bowl": ("024_bowl", "ｂｏｗｌ"),
}


@pytest.mark.parametrize(("category", "said"), [(c, s) for c, all_ in KNOWN.items() for s in all_])
def test_known_words_are_matched(category: str, said: str) -> None:
    assert WORDS.knows(said)
    assert WORDS.category(said) == category


UNKNOWN = {
    "potted meat can": "potted meat can",
    "010_potted_meat_can": "potted_meat_can",
    "Mango": "Mango",  # near "Mug", and no mug
    "mugs": "mugs",
    "Arbeitsfläche": "Arbeitsfläche",
    "杯子": "杯子",
    "toy (red), small": "toy red small",
    "Gizmo|+1.0|-2.0": "Gizmo",
    "gizmo-12": "gizmo",
    "7": "7",
}


@pytest.mark.parametrize("said", UNKNOWN)
def test_unknown_words_are_things_of_their_own(said: str) -> None:
    assert not WORDS.knows(said)
    category = WORDS.category(said)
    assert category == UNKNOWN[said]
    assert category_of(f"{category}-1") == category
    assert Subtask.parse(f"take({category}, {category}-2)").args == (category, f"{category}-2")


@pytest.mark.parametrize("said", ["", "  ", "()", "|1|2", "x" * 200])
def test_no_word_is_no_category(said: str) -> None:
    with pytest.raises(InputError, match="must be a word"):
        WORDS.category(said)


def test_a_word_of_two_categories_means_neither() -> None:
    text = """
    name = "shop"
    tags = ["fixture"]
    [categories.Box]
    words = "case"
    [categories.Suitcase]
    synonyms = ["case", "trunk"]
    """
    words = Words(read_domain(text, "shop.toml"))
    assert not words.knows("case")
    assert words.category("trunk") == "Suitcase"
    assert words.category("box") == "Box"


def test_names_of_things_stay_the_same() -> None:
    names = Names(shipped("household"))
    assert names.instance("Mug|+0.1|2.0") == "Mug-1"
    assert names.instance("coffee mug_1") == "Mug-2"
    assert names.instance("Mug|+0.1|2.0") == "Mug-1"
    assert names.instance("mug-7") == "Mug-7"
    assert names.instance("17", "Bowl") == "Bowl-17"
    assert names.next("Mug") == "Mug-3"
    assert "mug-7" in names and "mug-8" not in names


def test_names_that_are_right_already_are_not_given_away() -> None:
    names = Names(shipped("household"))
    names.reserve("Mug-1")
    names.reserve("mug-2")  # not in our words: nothing to keep
    assert names.instance("Mug|+0.1|2.0") == "Mug-2"
    assert names.instance("Mug-1") == "Mug-1"


def test_arguments_of_subtasks_are_in_the_users_words() -> None:
    said = Subtask("put_in", ("025_mug", "microwave-2"))
    assert WORDS.subtask(said) == Subtask("put_in", ("Mug", "Microwave-2"))
    strange = Subtask("insert", ("potted meat can", "gripper"))
    assert WORDS.subtask(strange) == strange


def test_a_slip_of_the_pen_is_told_from_a_strange_word() -> None:
    assert WORDS.slip("Plaet") and WORDS.slip("Microwav-1")
    assert not any(map(WORDS.slip, ("plate", "potted meat can", "Arbeitsfläche", "Peg")))
