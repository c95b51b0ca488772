"""The household vocabulary and its extension."""

import pytest

from forestall.errors import InputError, UnknownNameError
from forestall.vocabulary import (
    ATTRIBUTES,
    Attribute,
    Category,
    parse_attribute,
    parse_category,
)


def test_every_reference_inside_the_vocabulary_exists() -> None:
    words = shipped("household")
    for category in words.categories.values():
        r = category.receptacle
        named = [*(r.accepts if r else ()), *(r.refuses if r else ())]
        named += [n for n in (category.slices_into, category.cracks_into, category.controls) if n]
        if category.device:
            device = category.device
            named += [n for n in (device.acts_on, device.needs_held) if n]
            named += [*device.cooks_only, *device.cooks_not]
        assert {n for n in named if n != "*"} <= set(words.categories), category.name
        assert set(category.attributes) <= set(ATTRIBUTES)


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
def test_what_goes_where(place: str, thing: str, taken: bool) -> None:
    assert shipped("household").accepts(place, thing) is taken


def test_defaults_and_aliases() -> None:
    words = shipped("household")
    assert words.default_states("WineBottle-1")["filled"] == "wine"
    assert words.canonical("SinkBasin-2") == "Sink-2"
    assert words.encloses("Fridge") and not words.encloses("Bowl")
    with pytest.raises(UnknownNameError, match="did you mean Microwave"):
        words["Mikrowave"]


def test_a_new_category_is_taken_where_anything_is() -> None:
    spoon = parse_category("Ladle", {"pickupable": True, "attributes": ["dirty"]})
    words = shipped("household").extended({"Ladle": spoon})
    assert words.accepts("CounterTop", "Ladle")
    assert "Ladle" not in shipped("household").categories


@pytest.mark.parametrize(
    ("table", "says"),
    [
        ({"colour": "red"}, "unknown field colour"),
        ({"attributes": ["soggy"]}, "soggy"),
        ({"attributes": ["dirty"], "defaults": {"dirty": "muddy"}}, "muddy"),
        ({"receptacle": {"relation": "under", "accepts": []}}, "under"),
        ({"device": {"boils": True}}, "boils"),
        ({"name": "Other"}, "unknown field name"),
        ({"attributes": "dirty"}, "attributes must be a list"),
        ({"synonyms": ["ladle", ""]}, "synonyms: '' is empty"),
        ({"synonyms": "ladle"}, "synonyms must be a list"),
        ({"words": "ковш"}, "words: 'ковш': the encoder reads Latin letters only"),
    ],
)
def test_bad_categories(table: dict[str, object], says: str) -> None:
    with pytest.raises(InputError, match=says):
        parse_category("Thing", table)


RIPE = {"values": ["unripe", "ripe"], "phrases": {"ripe": ["a red {thing}", "a ripe {thing}"]}}


def test_the_shipped_attributes_are_those_of_the_constant() -> None:
    found = {name: a.values for name, a in shipped("household").attributes.items()}
    assert list(found.items()) == list(ATTRIBUTES.items())
    assert [a.name for a in shipped("household").attributes.values() if not a.camera] == ["temperature"]


def test_every_shipped_value_has_several_plain_and_different_phrases() -> None:
    words = shipped("household")
    for category in words.categories.values():
        for attribute in category.attributes:
            told = {v: words.phrases(category.name, attribute, v) for v in words.values(attribute)}
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
    for category in shipped("household").categories.values():
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
    assert shipped("household").phrases(category, attribute, value)[0] == first


def test_phrases_of_what_is_not_there() -> None:
    with pytest.raises(UnknownNameError, match="known: closed, open"):
        shipped("household").phrases("Mug", "open", "ajar")
    with pytest.raises(UnknownNameError, match="attribute 'opened': did you mean open"):
        shipped("household").phrases("Mug", "opened", "open")
    with pytest.raises(UnknownNameError, match="Mikrowave"):
        shipped("household").phrases("Mikrowave", "open", "open")


def test_a_new_attribute_with_its_phrases() -> None:
    tomato = shipped("household")["Tomato"]
    spoon = Category("OldSpoon", attributes=("ripe",))
    words = shipped("household").extended(
        {"Tomato": tomato, "OldSpoon": spoon}, {"ripe": parse_attribute("ripe", RIPE)}
    )
    assert words.values("ripe") == ("unripe", "ripe")
    assert words.phrases("Tomato", "ripe", "ripe") == ("a red tomato", "a ripe tomato")
    assert words.phrases("Apple", "ripe", "unripe") == ("an unripe apple",)
    assert words.phrases("OldSpoon", "ripe", "unripe") == ("an unripe old spoon",)
    assert words.default_states("OldSpoon-1") == {"ripe": "unripe"}
    assert words.lasting == ("temperature", "cooked", "ripe")
    assert "ripe" not in shipped("household").attributes


def test_other_phrases_for_a_known_attribute() -> None:
    known = shipped("household").attributes["open"]
    table = {"phrases": {"open": ["an {thing} ajar"]}, "by_category": {"Book": {"open": ["pages"]}}}
    changed = shipped("household").extended({}, {"open": parse_attribute("open", table, known)})
    assert changed.phrases("Fridge", "open", "open") == ("a fridge ajar",)
    assert changed.phrases("Book", "open", "open") == ("pages",)
    for category, value in (("Fridge", "closed"), ("Book", "closed"), ("Laptop", "open")):
        before = shipped("household").phrases(category, "open", value)
        assert changed.phrases(category, "open", value) == before
    assert known == shipped("household").attributes["open"]


def test_a_known_category_is_added_to() -> None:
    table = {"attributes": ["ripe"], "synonyms": ["love apple"], "defaults": {"ripe": "ripe"}}
    values = {**ATTRIBUTES, "ripe": ("unripe", "ripe")}
    before = shipped("household")["Tomato"]
    tomato = parse_category("Tomato", table, values, before)
    assert tomato.attributes == (*before.attributes, "ripe")
    assert tomato.synonyms == (*before.synonyms, "love apple")
    assert (tomato.words, tomato.slices_into) == ("tomato", "TomatoSliced")
    assert dict(tomato.defaults) == {"ripe": "ripe"}
    bottle = parse_category("WineBottle", {"fragile": True}, values, shipped("household")["WineBottle"])
    assert bottle.fragile and dict(bottle.defaults) == {"filled": "wine"}


@pytest.mark.parametrize(
    ("name", "table", "says"),
    [
        ("ripe", {**RIPE, "values": ["ripe"]}, "attribute ripe: values must name two or more"),
        ("ripe", {"values": ["ripe", "ripe"]}, "values must name two or more different"),
        ("ripe", {}, "values must name two or more"),
        ("ripe", {"values": ["no", "ripe!"]}, "value 'ripe!' must be letters"),
        ("ripe", {"values": ["false", "true"]}, "value 'false' must be letters"),
        ("ripe", {**RIPE, "colour": "red"}, "unknown field colour: known: values, phrases"),
        ("ripe", {**RIPE, "camera": "no"}, "camera must be true or false"),
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
        ("vacant", RIPE, "'vacant' is the name of a derived fact"),
        ("pick_up", RIPE, "'pick_up' is the name of a skill"),
        ("Ripe", RIPE, "lower-case letters"),
    ],
)
def test_bad_attributes(name: str, table: dict[str, object], says: str) -> None:
    with pytest.raises(InputError, match=says):
        parse_attribute(name, table)


def test_values_of_a_known_attribute_stay() -> None:
    known = shipped("household").attributes["open"]
    with pytest.raises(InputError, match=r"open exists: its values \(closed, open\)"):
        parse_attribute("open", {"values": ["closed", "ajar", "open"]}, known)
    with pytest.raises(InputError, match="camera = true stay"):
        parse_attribute("open", {"camera": False}, known)
    assert parse_attribute("open", {"values": ["closed", "open"]}, known) == known


def test_phrases_for_a_category_that_does_not_exist() -> None:
    ripe = parse_attribute("ripe", {**RIPE, "by_category": {"Tomatoe": {"ripe": ["red"]}}})
    with pytest.raises(UnknownNameError, match=r"by_category of attribute ripe.*mean Tomato"):
        shipped("household").extended({}, {"ripe": ripe})


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
    odd = Attribute("odd", ("no", "yes"), {"yes": (template,)})
    assert shipped("household").extended({}, {"odd": odd}).phrases("Apple", "odd", "yes") == (text,)
