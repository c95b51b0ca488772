"""The shipped household domain, its extension, and the kitchen's catalogue of the same things."""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Any

import pytest

from forestall.domain.load import extend, shipped
from forestall.domain.model import Domain
from forestall.domain.schema import PredicateKind
from forestall.errors import InputError, UnknownNameError
from forestall.worlds.kitchen.catalogue import Catalogue, catalogue, shipped_catalogue

HOUSEHOLD = shipped("household")
KITCHEN = shipped_catalogue()


def with_category(name: str, table: Mapping[str, Any]) -> Domain:
    return extend(HOUSEHOLD, {name: table}, {})


def with_attribute(name: str, table: Mapping[str, Any]) -> Domain:
    return extend(HOUSEHOLD, {}, {name: table})


def test_every_reference_inside_the_domain_exists() -> None:
    for predicate, facts in HOUSEHOLD.statics.items():
        assert facts, predicate
        assert HOUSEHOLD.predicates[predicate].kind is PredicateKind.STATIC
        assert {n for fact in facts for n in fact} <= set(HOUSEHOLD.categories), predicate
    for category in HOUSEHOLD.categories.values():
        assert category.tags <= set(HOUSEHOLD.tags), category.name
        assert set(category.attributes) <= set(HOUSEHOLD.attributes), category.name


def test_every_reference_inside_the_catalogue_exists() -> None:
    for category in KITCHEN.categories.values():
        r = category.receptacle
        named = [*(r.accepts if r else ()), *(r.refuses if r else ())]
        named += [n for n in (category.slices_into, category.cracks_into, category.controls) if n]
        if category.device:
            device = category.device
            named += [n for n in (device.acts_on, device.needs_held) if n]
            named += [*device.cooks_only, *device.cooks_not]
        assert {n for n in named if n != "*"} <= set(KITCHEN.categories), category.name
        assert set(category.attributes) <= set(KITCHEN.attributes)


@pytest.mark.parametrize("words", [HOUSEHOLD, KITCHEN], ids=["domain", "catalogue"])
@pytest.mark.parametrize(
    ("place", "thing", "taken"),
    [
        ("Microwave", "Plate", True),
        ("Microwave-1", "Pan", False),
        ("CoffeeMachine", "Bowl", False),
        ("CounterTop-2", "Knife", True),
        ("SinkBasin", "Mug-1", True),
        ("Drawer", "Pot", False),
        ("Knife", "Mug", False),
        ("Bowl", "Bowl", False),
    ],
)
def test_what_goes_where(words: Domain | Catalogue, place: str, thing: str, taken: bool) -> None:
    assert words.accepts(place, thing) is taken


@pytest.mark.parametrize("words", [HOUSEHOLD, KITCHEN], ids=["domain", "catalogue"])
def test_defaults_and_aliases(words: Domain | Catalogue) -> None:
    assert words.default_states("WineBottle-1")["filled"] == "wine"
    assert words.canonical("SinkBasin-2") == "Sink-2"
    assert words.encloses("Fridge") and not words.encloses("Bowl")
    with pytest.raises(UnknownNameError, match="did you mean Microwave"):
        words["Mikrowave"]


def test_the_catalogue_describes_the_things_of_the_domain() -> None:
    assert set(KITCHEN.categories) == set(HOUSEHOLD.categories)
    for name, thing in KITCHEN.categories.items():
        known = HOUSEHOLD[name]
        assert thing.attributes == known.attributes, name
        assert KITCHEN.default_states(name) == HOUSEHOLD.default_states(name)
        assert KITCHEN.encloses(name) == HOUSEHOLD.encloses(name), name
        flags = ("pickupable", "fixture", "food", "soaks", "drains", "fragile")
        assert {f for f in flags if getattr(thing, f)} == known.tags & set(flags), name
        relation = None if thing.receptacle is None else thing.receptacle.relation
        assert relation == HOUSEHOLD.offers(name), name
        for other in KITCHEN.categories:
            assert KITCHEN.accepts(name, other) == HOUSEHOLD.accepts(name, other), (name, other)
    assert catalogue(HOUSEHOLD) == KITCHEN
    assert set(KITCHEN.lasting) == set(HOUSEHOLD.lasting)


def test_a_new_category_is_taken_where_anything_is() -> None:
    words = with_category("Ladle", {"tags": ["pickupable"], "attributes": ["dirty"]})
    assert words.accepts("CounterTop", "Ladle")
    assert catalogue(words).accepts("CounterTop", "Ladle")
    assert "Ladle" not in HOUSEHOLD.categories
    assert "Ladle" not in KITCHEN.categories


@pytest.mark.parametrize(
    ("table", "says"),
    [
        ({"colour": "red"}, "unknown field of category Thing 'colour'"),
        ({"attributes": ["soggy"]}, "soggy"),
        ({"attributes": ["dirty"], "defaults": {"dirty": "muddy"}}, "muddy"),
        ({"tags": ["takes_under"], "accepts": []}, "takes_under"),
        ({"receptacle": {"relation": "inside"}}, "unknown field of category Thing 'receptacle'"),
        ({"tags": ["boils"]}, "boils"),
        ({"pickupable": True}, r'pickupable is a tag: write tags = \["pickupable"\]'),
        ({"accepts": ["Mikrowave"]}, "did you mean Microwave"),
        ({"accepts_of": ["#pickupabel"]}, "did you mean pickupable"),
        ({"name": "Other"}, "unknown field of category Thing 'name'"),
        ({"attributes": "dirty"}, "attributes: Input should be a valid list"),
        ({"synonyms": ["ladle", ""]}, "synonyms: '' is empty"),
        ({"synonyms": "ladle"}, "synonyms must be a list"),
        ({"words": "ковш"}, "words: 'ковш': the encoder reads Latin letters only"),
    ],
)
def test_bad_categories(table: dict[str, object], says: str) -> None:
    with pytest.raises(InputError, match=says):
        with_category("Thing", table)


def test_a_shape_that_the_kitchen_cannot_build() -> None:
    words = with_category("Thing", {"world": {"shape": {"kind": "vesel"}}})
    with pytest.raises(UnknownNameError, match=r"shape of Thing.*did you mean vessel"):
        catalogue(words)


RIPE = {"values": ["unripe", "ripe"], "phrases": {"ripe": ["a red {thing}", "a ripe {thing}"]}}


def test_the_shipped_attributes_are_those_of_the_catalogue() -> None:
    found = {name: a.values for name, a in HOUSEHOLD.attributes.items()}
    assert list(found.items()) == list(KITCHEN.attributes.items())
    assert [a.name for a in HOUSEHOLD.attributes.values() if not a.camera] == ["temperature"]


def test_every_shipped_value_has_several_plain_and_different_phrases() -> None:
    for category in HOUSEHOLD.categories.values():
        for attribute in category.attributes:
            values = HOUSEHOLD.values(attribute)
            told = {v: HOUSEHOLD.phrases(category.name, attribute, v) for v in values}
            if attribute == "temperature":
                assert set(told.values()) == {()}
                continue
            everything = [p for phrases in told.values() for p in phrases]
            assert len(set(everything)) == len(everything), (category.name, attribute)
            for phrases in told.values():
                assert 3 <= len(phrases) <= 5, (category.name, attribute)
                assert all("{" not in p and p == p.strip() for p in phrases)
                assert len(phrases[0]) <= min(map(len, phrases)) + 12


def test_synonyms_belong_to_one_category() -> None:
    owners: dict[str, str] = {}
    for category in HOUSEHOLD.categories.values():
        assert 2 <= len(category.synonyms) <= 5
        for name in (category.words, *category.synonyms):
            assert owners.setdefault(name, category.name) == category.name, name


@pytest.mark.parametrize(
    ("category", "attribute", "value", "first"),
    [
        ("Microwave", "open", "open", "an open microwave"),
        ("Microwave-1", "open", "closed", "a closed microwave"),
        ("Egg", "broken", "intact", "an intact egg"),
        ("AppleSliced", "sliced", "sliced", "an apple slice"),
        ("HousePlant", "filled", "water", "a house plant with wet soil"),
        ("Mug", "filled", "coffee", "a mug filled with coffee"),
        ("BreadSliced", "cooked", "cooked", "a toasted bread slice"),
    ],
)
def test_the_first_phrase_is_the_plain_one(
    category: str, attribute: str, value: str, first: str
) -> None:
    assert HOUSEHOLD.phrases(category, attribute, value)[0] == first


def test_phrases_of_what_is_not_there() -> None:
    with pytest.raises(UnknownNameError, match="known: closed, open"):
        HOUSEHOLD.phrases("Mug", "open", "ajar")
    with pytest.raises(UnknownNameError, match="attribute 'opened': did you mean open"):
        HOUSEHOLD.phrases("Mug", "opened", "open")
    with pytest.raises(UnknownNameError, match="Mikrowave"):
        HOUSEHOLD.phrases("Mikrowave", "open", "open")


def test_a_new_attribute_with_its_phrases() -> None:
    words = extend(HOUSEHOLD, {"Tomato": {}, "OldSpoon": {"attributes": ["ripe"]}}, {"ripe": RIPE})
    assert words["Tomato"] == HOUSEHOLD["Tomato"]
    assert words.values("ripe") == ("unripe", "ripe")
    assert words.phrases("Tomato", "ripe", "ripe") == ("a red tomato", "a ripe tomato")
    assert words.phrases("Apple", "ripe", "unripe") == ("an unripe apple",)
    assert words.phrases("OldSpoon", "ripe", "unripe") == ("an unripe old spoon",)
    assert words.default_states("OldSpoon-1") == {"ripe": "unripe"}
    assert words.lasting == ("cooked", "temperature", "ripe")
    assert "ripe" not in HOUSEHOLD.attributes
    kitchen = catalogue(words)
    assert kitchen.values("ripe") == ("unripe", "ripe")
    assert kitchen.default_states("OldSpoon-1") == {"ripe": "unripe"}
    assert kitchen.lasting == ("temperature", "cooked", "ripe")
    assert "ripe" not in KITCHEN.attributes


def test_other_phrases_for_a_known_attribute() -> None:
    known = HOUSEHOLD.attributes["open"]
    before = (known.phrases["open"], dict(known.by_category))
    table = {"phrases": {"open": ["an {thing} ajar"]}, "by_category": {"Book": {"open": ["pages"]}}}
    changed = with_attribute("open", table)
    assert changed.phrases("Fridge", "open", "open") == ("a fridge ajar",)
    assert changed.phrases("Book", "open", "open") == ("pages",)
    for category, value in (("Fridge", "closed"), ("Book", "closed"), ("Laptop", "open")):
        as_shipped = HOUSEHOLD.phrases(category, "open", value)
        assert changed.phrases(category, "open", value) == as_shipped
    assert (known.phrases["open"], dict(known.by_category)) == before
    assert known == HOUSEHOLD.attributes["open"]


def test_a_known_category_is_added_to() -> None:
    table = {"attributes": ["ripe"], "synonyms": ["love apple"], "defaults": {"ripe": "ripe"}}
    before = HOUSEHOLD["Tomato"]
    words = extend(HOUSEHOLD, {"Tomato": table}, {"ripe": RIPE})
    tomato = words["Tomato"]
    assert tomato.attributes == (*before.attributes, "ripe")
    assert tomato.synonyms == (*before.synonyms, "love apple")
    assert (tomato.words, tomato.tags) == ("tomato", before.tags)
    assert words.static("slices_into", "Tomato", "TomatoSliced")
    assert words.statics == HOUSEHOLD.statics
    assert dict(tomato.defaults) == {"ripe": "ripe"}
    kitchen = catalogue(words)["Tomato"]
    assert kitchen.attributes == (*KITCHEN["Tomato"].attributes, "ripe")
    assert kitchen.slices_into == "TomatoSliced"
    assert dict(kitchen.defaults) == {"ripe": "ripe"}


def test_a_known_category_is_given_a_tag() -> None:
    words = with_category("WineBottle", {"tags": ["fragile"]})
    bottle, kitchen = words["WineBottle"], catalogue(words)["WineBottle"]
    assert bottle.tags == HOUSEHOLD["WineBottle"].tags | {"fragile"}
    assert dict(bottle.defaults) == {"filled": "wine"}
    assert kitchen.fragile and dict(kitchen.defaults) == {"filled": "wine"}


def test_a_known_category_is_given_another_default_and_takes_more() -> None:
    words = with_category("Mug", {"defaults": {"filled": "wine"}, "accepts": ["Apple"]})
    kitchen = catalogue(words)
    for of in (words, kitchen):
        assert of.default_states("Mug-1")["filled"] == "wine"
        assert of.accepts("Mug", "Apple") and of.accepts("Mug", "Egg")
        assert not of.accepts("Mug", "Potato") and not of.accepts("Cup", "Apple")


@pytest.mark.parametrize(
    ("name", "table", "says"),
    [
        ("ripe", {**RIPE, "values": ["ripe"]}, "attribute ripe: values must name two or more"),
        ("ripe", {"values": ["ripe", "ripe"]}, "values must name two or more different"),
        ("ripe", {}, "values must name two or more"),
        ("ripe", {"values": ["no", "ripe!"]}, "value 'ripe!' must be letters"),
        ("ripe", {"values": ["false", "true"]}, "value 'false' must be letters"),
        ("ripe", {**RIPE, "colour": "red"}, "unknown field of attribute ripe 'colour': known"),
        ("ripe", {**RIPE, "camera": "no"}, "camera: Input should be a valid boolean"),
        ("ripe", {**RIPE, "camera": False}, "camera = false"),
        ("ripe", {**RIPE, "phrases": {"rotten": ["bad"]}}, "'rotten': known: ripe, unripe"),
        ("ripe", {**RIPE, "phrases": {"ripe": []}}, "phrases.ripe must be a list of texts"),
        ("ripe", {**RIPE, "phrases": {"ripe": "red"}}, "phrases.ripe must be a list of texts"),
        ("ripe", {**RIPE, "phrases": {"ripe": ["a {thing}", " "]}}, "phrases.ripe: ' ' is empty"),
        ("ripe", {**RIPE, "phrases": {"ripe": ["{thing} 熟"]}}, "phrases.ripe.*Latin letters only"),
        ("ripe", {**RIPE, "phrases": {"ripe": ["спелый томат"]}}, "Latin letters only"),
        ("ripe", {**RIPE, "phrases": {"ripe": ["123"]}}, "Latin letters only"),
        ("ripe", {**RIPE, "phrases": {"ripe": ["a {colour} {thing}"]}}, "only {thing} may stand"),
        (
            "ripe",
            {**RIPE, "phrases": {"ripe": ["a {thing}"], "unripe": ["a {thing}"]}},
            "'a {thing}' stands for both unripe and ripe",
        ),
        (
            "ripe",
            {**RIPE, "by_category": {"Tomato": {"unripe": ["a ripe {thing}"]}}},
            "by_category.Tomato: 'a ripe {thing}' stands for both",
        ),
        ("ripe", {**RIPE, "by_category": {"Tomato": {"red": ["x"]}}}, "by_category.Tomato 'red'"),
        ("near", RIPE, "'near' is the name of a relation"),
        ("vacant", RIPE, "'vacant' is the name of a derived"),
        ("located", RIPE, "'located' is the name of a"),
        ("pick_up", RIPE, "'pick_up' is the name of a skill"),
        ("Ripe", RIPE, "lower-case letters"),
    ],
)
def test_bad_attributes(name: str, table: dict[str, object], says: str) -> None:
    with pytest.raises(InputError, match=says):
        with_attribute(name, table)


def test_the_error_of_an_attribute_names_the_fields_that_there_are() -> None:
    with pytest.raises(UnknownNameError) as caught:
        with_attribute("ripe", {**RIPE, "colour": "red"})
    assert re.search(r"known: .*phrases.*values", str(caught.value))


def test_values_of_a_known_attribute_stay() -> None:
    with pytest.raises(InputError, match=r"open exists: its values \(closed, open\)"):
        with_attribute("open", {"values": ["closed", "ajar", "open"]})
    with pytest.raises(InputError, match="camera = true stay"):
        with_attribute("open", {"camera": False})
    same = with_attribute("open", {"values": ["closed", "open"]})
    assert same.attributes["open"] == HOUSEHOLD.attributes["open"]


def test_phrases_for_a_category_that_does_not_exist() -> None:
    with pytest.raises(UnknownNameError, match=r"by_category of attribute ripe.*mean Tomato"):
        with_attribute("ripe", {**RIPE, "by_category": {"Tomatoe": {"ripe": ["red"]}}})


@pytest.mark.parametrize(
    ("template", "text"),
    [
        ("a {thing}", "an apple"),
        ("An unlit {thing} on a oven", "An unlit apple on an oven"),
        ("an used {thing} in an unit", "a used apple in a unit"),
        ("a uninjured {thing}, vitamin a too", "an uninjured apple, vitamin a too"),
    ],
)
def test_articles(template: str, text: str) -> None:
    words = with_attribute("odd", {"values": ["no", "yes"], "phrases": {"yes": [template]}})
    assert words.phrases("Apple", "odd", "yes") == (text,)
