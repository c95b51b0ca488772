"""The domain of AI2-THOR's object types: the household's, over more categories."""

import tomllib
from importlib.resources import files

import pytest

from forestall.domain.load import load_domain, shipped
from forestall.tasks.files import load_task, task_names

DOMAINS = files("forestall").joinpath("domains")
THOR, HOUSEHOLD = shipped("ai2thor"), shipped("household")


def test_all_but_the_categories_is_the_household_s() -> None:
    ours, theirs = (
        tomllib.loads(DOMAINS.joinpath(n, "domain.toml").read_text(encoding="utf-8"))
        for n in ("ai2thor", "household")
    )
    for name in theirs.keys() - {"name", "categories"}:
        assert ours[name] == theirs[name], f"{name}: make the file anew with make_domain.py"
    assert ours.keys() == theirs.keys()
    assert theirs["categories"].keys() <= ours["categories"].keys()


def test_it_has_the_types_of_ai2_thor() -> None:
    assert len(THOR.categories) == 122
    assert {"ArmChair", "LaundryHamper", "Statue", "Toilet", "SprayBottle"} <= set(THOR.categories)
    assert THOR.canonical("SinkBasin") == "Sink"


@pytest.mark.parametrize("task", task_names())
def test_the_household_s_tasks_are_tasks_in_it(task: str) -> None:
    assert load_task(task, THOR).task.plan == load_task(task).task.plan


def test_places_take_what_ai2_thor_puts_there_and_what_the_household_does() -> None:
    assert THOR.accepts("LaundryHamper", "Cloth") and not THOR.accepts("LaundryHamper", "Mug")
    assert THOR.accepts("CoffeeMachine", "Mug") and THOR.accepts("Toaster", "BreadSliced")
    assert not THOR.accepts("Microwave", "Pan") and not THOR.accepts("Plate", "Mug")
    lost = [
        (place, thing)
        for place in HOUSEHOLD.categories
        for thing in HOUSEHOLD.categories
        if HOUSEHOLD.accepts(place, thing) and not THOR.accepts(place, thing)
    ]
    assert lost == []


def test_a_category_has_the_states_that_its_type_can_have() -> None:
    assert set(THOR.default_states("Laptop")) == {"broken", "open", "temperature", "toggled"}
    assert set(THOR.default_states("EggCracked")) == {"cooked", "temperature"}
    assert THOR.default_states("StoveBurner") == {"toggled": "off"}
    assert not THOR.is_a("EggCracked", "pickupable") and THOR.is_a("Statue", "pickupable")
    assert THOR.encloses("Safe") and not THOR.encloses("SideTable")


def test_it_can_be_named() -> None:
    assert load_domain("ai2thor") is THOR
