"""The household vocabulary and its extension."""

import pytest

from forestall.errors import InputError, UnknownNameError
from forestall.vocabulary import ATTRIBUTES, household, parse_category


def test_every_reference_inside_the_vocabulary_exists() -> None:
    words = household()
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
    assert household().accepts(place, thing) is taken


def test_defaults_and_aliases() -> None:
    words = household()
    assert words.default_states("WineBottle-1")["filled"] == "wine"
    assert words.canonical("SinkBasin-2") == "Sink-2"
    assert words.encloses("Fridge") and not words.encloses("Bowl")
    with pytest.raises(UnknownNameError, match="did you mean Microwave"):
        words["Mikrowave"]


def test_a_new_category_is_taken_where_anything_is() -> None:
    spoon = parse_category("Ladle", {"pickupable": True, "attributes": ["dirty"]})
    words = household().extended({"Ladle": spoon})
    assert words.accepts("CounterTop", "Ladle")
    assert "Ladle" not in household().categories


@pytest.mark.parametrize(
    ("table", "says"),
    [
        ({"colour": "red"}, "unknown field colour"),
        ({"attributes": ["soggy"]}, "soggy"),
        ({"attributes": ["dirty"], "defaults": {"dirty": "muddy"}}, "muddy"),
        ({"receptacle": {"relation": "under", "accepts": []}}, "under"),
        ({"device": {"boils": True}}, "boils"),
    ],
)
def test_bad_categories(table: dict[str, object], says: str) -> None:
    with pytest.raises(InputError, match=says):
        parse_category("Thing", table)
