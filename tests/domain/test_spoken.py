"""Words for things, facts and steps: articles, numbers, plurals, negation, a domain without any."""

import pytest

from forestall.domain.load import shipped
from forestall.domain.spoken import Spoken, listed, plural, sentence, told
from forestall.types.facts import Literal
from forestall.types.graph import SceneGraph
from forestall.types.plan import Subtask
from forestall.types.symbolic import scene_graph

HOUSEHOLD = shipped("household")


def scene(*names: str) -> SceneGraph:
    return scene_graph({"objects": {n: {} for n in names}, "relations": []})


def spoken(*names: str) -> Spoken:
    return Spoken(HOUSEHOLD, scene(*names))


def test_a_number_is_said_only_where_there_are_several() -> None:
    assert spoken("Mug-2").the("Mug-2") == "the mug"
    assert spoken("Mug-2", "Mug-5").the("Mug-5") == "the second mug"
    burners = [f"StoveBurner-{k}" for k in (1, 2, 3, 4)]
    assert spoken(*burners).the("StoveBurner-4") == "stove burner 4"
    assert spoken("CounterTop-1").the("CounterTop") == "the counter"
    assert spoken("CounterTop-1", "CounterTop-2").the("CounterTop") == "a counter"
    assert spoken().the("gripper") == "the gripper"
    assert spoken("SoupLadle-1").the("SoupLadle-1") == "the soup ladle"


def test_things_that_come_up_are_counted() -> None:
    words = spoken("Apple-1", "Apple-2", "Knife-1", "Mug-1", "Mug-2", "Mug-3")
    assert words.several(["Apple-1", "Knife-1", "Apple-2"]) == "two apples and a knife"
    assert words.several(["Apple-1"]) == "an apple"
    assert words.several(["Mug-1"], beside=["Mug-2"]) == "another mug"
    assert words.all_of(["Knife-1", "Apple-1", "Apple-2"]) == "the knife and both apples"
    assert words.all_of(["Mug-1", "Mug-3"]) == "the first mug and the third mug"


@pytest.mark.parametrize(
    ("one", "several"),
    [("mug", "mugs"), ("potato", "potatoes"), ("knife", "knives"), ("dish", "dishes"),
     ("box", "boxes"), ("tray", "trays"), ("berry", "berries"), ("loaf", "loaves")],
)  # fmt: skip
def test_plurals(one: str, several: str) -> None:
    assert plural(one) == several


@pytest.mark.parametrize(
    ("fact", "holds", "not_so", "in_the_end"),
    [
        ("dirty(Pan-1)=clean", "the pan is clean", "the pan is not clean",
         "the pan would not be clean"),
        ("filled(Mug-1)=water", "the mug is filled with water", "the mug is not filled with water",
         "the mug would not be filled with water"),
        ("inside(Egg-1, Pan-1)", "the egg is inside the pan", "the egg is not inside the pan",
         "the egg would not be inside the pan"),
        ("not inside(Egg-1, Pan-1)", "the egg is not inside the pan", "the egg is inside the pan",
         "the egg would be inside the pan"),
        ("held_by(Egg-1, gripper)", "I am holding the egg", "I am not holding the egg",
         "I would not be holding the egg"),
        ("vacant(Pan-1)", "nothing is in or on the pan", "something is in or on the pan",
         "something would be in or on the pan"),
        ("blocking(Mug-1, Pan-1)", "the mug stands in front of the pan",
         "the mug does not stand in front of the pan",
         "the mug would not stand in front of the pan"),
        ("accessible(Egg-1)", "the hand can come to the egg", "the hand cannot come to the egg",
         "the hand could not come to the egg"),
        ("located(Egg-1)", "I know where the egg is", "I do not know where the egg is",
         "I do not know where the egg would be"),
        ("spoiled(Egg-1)", "the egg is spoiled", "the egg is not spoiled",
         "the egg would not be spoiled"),
    ],
)  # fmt: skip
def test_facts_and_their_contraries(fact: str, holds: str, not_so: str, in_the_end: str) -> None:
    words = spoken("Pan-1", "Mug-1", "Egg-1")
    literal = Literal.parse(fact)
    assert words.fact(literal) == holds
    assert words.fact(literal, False) == not_so
    assert words.would(literal, False) == in_the_end


def test_of_any_of_several_it_is_said_that_none_is() -> None:
    words = spoken("BreadSliced-1", "BreadSliced-2", "Toaster-1")
    fact = Literal.parse("inside(BreadSliced, Toaster-1)")
    assert words.fact(fact, False) == "no bread slice is inside the toaster"


def test_steps_are_said_in_the_words_of_the_domain() -> None:
    words = spoken("Mug-1", "Sink-1")
    step = Subtask.parse("put_in(Mug-1, Sink-1)")
    assert words.step(step) == "put the mug into the sink"
    assert words.step(step, {"Sink-1": "it"}) == "put the mug into it"
    assert words.step(Subtask.parse("toggle_on(Mug-1)")) == "turn the mug on"
    assert words.step(Subtask.parse("polish(Mug-1)")) == "polish the mug"
    assert words.step(Subtask.parse("lean_on(Mug-1, Sink-1)")) == "lean the mug on the sink"


def test_texts_of_programs_are_put_into_words() -> None:
    words = spoken("Mug-1", "CoffeeMachine-1", "RemoteControl-1")
    said = "CoffeeMachine-1 has no room: it already has Mug-1"
    assert words.text(said) == "the coffee machine has no room: it already has the mug"
    assert words.text("not open(Mug-1)=open") == "the mug is not open"
    assert words.text("pick_up(Mug-1) was refused") == '"pick the mug up" was refused'
    assert words.text("turned on with the RemoteControl") == "turned on with the remote control"
    assert words.text("f(x) and 3 of 4 (see below)") == "f(x) and 3 of 4 (see below)"


def test_a_domain_that_was_learnt_is_said_by_its_names() -> None:
    lies = scene_graph({"objects": ["peg-1", "tray-1"], "relations": ["peg-1 lies_in tray-1"]})
    domain = HOUSEHOLD.knowing(("peg", "tray"))
    words = Spoken(domain, lies)
    fact = Literal.parse("lies_in(peg-1, tray-1)")
    assert words.fact(fact) == "the peg lies in the tray"
    assert words.fact(fact, False) == "the peg does not lie in the tray"
    assert words.place("lies_in", "tray-1") == "lying in the tray"
    assert words.fact(Literal.parse("seated_in(peg-1, tray-1)"), False) == (
        "the peg is not seated in the tray"
    )
    assert words.step(Subtask.parse("insert(peg-1, tray-1)")) == (
        'do "insert" with the peg and the tray'
    )


@pytest.mark.parametrize(
    ("fact", "holds", "not_so"),
    [
        ("inside(Cup-1, Fridge-1)", "Cup-1 is inside Fridge-1", "Cup-1 is not inside Fridge-1"),
        ("not inside(Cup-1, Sink-1)", "Cup-1 is not inside Sink-1", "Cup-1 is inside Sink-1"),
        ("held_by(Cup-1, gripper)", "the gripper holds Cup-1", "the gripper does not hold Cup-1"),
        ("lies_in(peg-1, tray-1)", "peg-1 lies in tray-1", "peg-1 does not lie in tray-1"),
        ("near(Cup-1, gripper)", "Cup-1 is near the gripper", "Cup-1 is not near the gripper"),
    ],
)
def test_things_may_keep_their_names(fact: str, holds: str, not_so: str) -> None:
    literal = Literal.parse(fact)
    assert (told(literal, HOUSEHOLD), told(literal, HOUSEHOLD, False)) == (holds, not_so)


def test_sentences_and_lists() -> None:
    assert listed(["a", "b", "c"]) == "a, b and c" and listed([]) == ""
    assert sentence("the pan is dirty") == "The pan is dirty." and sentence(" ") == ""
