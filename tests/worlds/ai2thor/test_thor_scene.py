"""AI2-THOR's metadata as names, places and states; worked by hand, without the package."""

from typing import Any

import pytest

from forestall.domain.load import shipped
from forestall.worlds.ai2thor.effects import undone
from forestall.worlds.ai2thor.naming import Names
from forestall.worlds.ai2thor.scene import Scene

DOMAIN = shipped("ai2thor")


def _thing(object_id: str, *parents: str, at: tuple[float, float] = (0, 0), **more: Any) -> Any:
    kind = object_id.rpartition("|")[2].rstrip("_0123456789")
    kind = kind if kind.isalpha() else object_id.partition("|")[0]
    box = {"center": {"x": at[0], "y": 1.0, "z": at[1]}, "size": {"x": 0.2, "y": 0.2, "z": 0.2}}
    place = {"x": at[0], "y": 0.9, "z": at[1]}
    return {
        "objectId": object_id, "objectType": kind, "position": place, "visible": True,
        "parentReceptacles": list(parents) or None, "axisAlignedBoundingBox": box,
        "temperature": "RoomTemp", **more,
    }  # fmt: skip


COUNTER, SINK, BASIN = "CounterTop|1", "Sink|1", "Sink|1|SinkBasin"
OTHER_SINK = "Sink|9"


def _scene(*things: Any, held: str | None = None) -> Scene:
    metadata = {"objects": things, "inventoryObjects": [{"objectId": held}] if held else []}
    return Scene(metadata, Names(things, {}), DOMAIN)


def test_numbers_go_by_the_ids_and_those_that_a_task_names_go_first() -> None:
    things = [_thing(f"Mug|{i}") for i in (3, 1, 2)]
    names = Names(things, {})
    assert [names.name(f"Mug|{i}") for i in (1, 2, 3)] == ["Mug-1", "Mug-2", "Mug-3"]
    wanted = Names(things, {"Mug-1": "Mug|3"})
    assert [wanted.name(f"Mug|{i}") for i in (1, 2, 3)] == ["Mug-2", "Mug-3", "Mug-1"]
    wanted.learn([_thing("Mug|0"), *things])
    assert wanted.name("Mug|0") == "Mug-4"  # what comes later changes no name
    assert wanted.id("Mug-1") == "Mug|3" and wanted.id("Mug-9") is None


def test_a_knob_has_its_burner_s_number_and_a_faucet_its_basin_s() -> None:
    burners = [_thing(f"StoveBurner|{i}") for i in (1, 2)]
    knobs = [
        _thing("StoveKnob|1", controlledObjects=["StoveBurner|2"]),
        _thing("StoveKnob|2", controlledObjects=["StoveBurner|1"]),
    ]
    sinks = [_thing(SINK, at=(0, 0)), _thing(OTHER_SINK, at=(5, 0))]
    faucets = [_thing("Faucet|1", at=(5, 0.2)), _thing("Faucet|2", at=(0, 0.2))]
    names = Names([*burners, *knobs, *sinks, *faucets], {})
    assert names.name("StoveKnob|1") == "StoveKnob-2"
    assert names.name("StoveKnob|2") == "StoveKnob-1"
    assert names.name("Faucet|1") == "Faucet-2" and names.name("Faucet|2") == "Faucet-1"


def test_a_basin_is_a_part_of_its_sink() -> None:
    scene = _scene(
        _thing(SINK), _thing(BASIN, receptacle=True), _thing("Mug|1", SINK, BASIN, pickupable=True)
    )
    assert set(scene.things) == {"Sink-1", "Mug-1"}
    assert scene.parent("Mug-1") == "Sink-1"
    place = scene.receptacle("Sink-1")
    assert place is not None and place["objectId"] == BASIN
    assert ("Mug-1", "inside", "Sink-1") in {
        (r.subject, r.predicate, r.object) for r in scene.graph(0.0).relations
    }


def test_of_all_that_has_a_thing_the_innermost_counts() -> None:
    things = (
        _thing(COUNTER, receptacle=True),
        _thing("Plate|1", COUNTER, receptacle=True, pickupable=True),
        _thing("Potato|1", COUNTER, "Plate|1", pickupable=True, cookable=True),
    )
    scene = _scene(*things)
    assert scene.parent("Potato-1") == "Plate-1"
    assert scene.ancestors("Potato-1") == ["Plate-1", "CounterTop-1"]
    assert scene.within("CounterTop-1") == ["Plate-1", "Potato-1"]
    held = _scene(*things, held="Plate|1")
    assert held.parent("Plate-1") is None and held.held == "Plate-1"


def test_furniture_has_no_parent_although_the_metadata_says_so() -> None:
    scene = _scene(
        _thing(COUNTER, "Plate|1", receptacle=True), _thing("Plate|1", COUNTER, receptacle=True)
    )
    assert scene.parent("CounterTop-1") is None
    assert scene.parent("Plate-1") == "CounterTop-1"


def test_what_was_sliced_is_no_more() -> None:
    scene = _scene(
        _thing("Bread|1", isSliced=True, sliceable=True),
        _thing("Bread|1|BreadSliced_0", COUNTER, cookable=True, isCooked=True),
        _thing("Bread|1|BreadSliced_1", COUNTER, cookable=True),
        _thing(COUNTER, receptacle=True),
    )
    assert set(scene.things) == {"BreadSliced-1", "BreadSliced-2", "CounterTop-1"}
    assert scene.states("BreadSliced-1") == {
        "cooked": "cooked", "sliced": "sliced", "temperature": "room",
    }  # fmt: skip


@pytest.mark.parametrize(
    ("thing", "says"),
    [
        (_thing("Mug|1", canFillWithLiquid=True, isFilledWithLiquid=True, fillLiquid="coffee"),
         {"filled": "coffee", "dirty": "clean", "broken": "intact", "temperature": "room"}),
        (_thing("Fridge|1", openable=True, isOpen=True), {"open": "open"}),
        (_thing("Egg|1", sliceable=True, breakable=True, temperature="Cold"),
         {"broken": "intact", "temperature": "cold"}),
        (_thing("Pot|1", dirtyable=True, isDirty=True, temperature="Hot"),
         {"filled": "empty", "dirty": "dirty", "temperature": "hot"}),
        (_thing("Gizmo|1", openable=True), {}),
    ],
)  # fmt: skip
def test_flags_are_the_domain_s_states(thing: Any, says: dict[str, str]) -> None:
    scene = _scene(thing)
    assert scene.states(next(iter(scene.things))) == says


def test_a_burner_is_on_while_its_knob_is() -> None:
    knob = _thing("StoveKnob|1", controlledObjects=["StoveBurner|1"], toggleable=True)
    burner = _thing("StoveBurner|1", receptacle=True)
    assert _scene(knob, burner).states("StoveBurner-1") == {"toggled": "off"}
    on = _scene(knob | {"isToggled": True}, burner)
    assert on.states("StoveBurner-1") == {"toggled": "on"} and on.knob("StoveBurner-1") == (
        "StoveKnob-1"
    )


def test_what_is_in_something_closed_is_closed_in() -> None:
    door: dict[str, Any] = {"receptacle": True, "openable": True}
    shut = _scene(_thing("Fridge|1", **door), _thing("Egg|1", "Fridge|1"))
    assert shut.closed_around("Egg-1") == "Fridge-1"
    ajar = _scene(_thing("Fridge|1", isOpen=True, **door), _thing("Egg|1", "Fridge|1"))
    assert ajar.closed_around("Egg-1") is None


def test_what_running_devices_leave_undone_is_named() -> None:
    on: dict[str, Any] = {"toggleable": True, "isToggled": True}
    scene = _scene(
        _thing("Microwave|1", receptacle=True, **on),
        _thing("Potato|1", "Microwave|1", cookable=True),
        _thing("Bread|1|BreadSliced_0", "Microwave|1", cookable=True),
        _thing("Faucet|1", **on), _thing(SINK), _thing(BASIN, receptacle=True),
        _thing("Bowl|1", BASIN, canFillWithLiquid=True, dirtyable=True, isDirty=True),
        _thing("CoffeeMachine|1", receptacle=True, **on),
        _thing("Mug|1", "CoffeeMachine|1", canFillWithLiquid=True),
    )  # fmt: skip
    assert sorted(
        (a, said["objectId"], said.get("fillLiquid", "")) for a, said in undone(scene)
    ) == [
        ("CleanObject", "Bowl|1", ""),
        ("CookObject", "Potato|1", ""),
        ("FillObjectWithLiquid", "Bowl|1", "water"),
        ("FillObjectWithLiquid", "Mug|1", "coffee"),
    ]
