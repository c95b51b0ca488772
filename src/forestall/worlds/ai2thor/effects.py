"""What happens by itself, where AI2-THOR has left it undone.

Its water fills and cleans only what its stream meets, and what a device cooks depends on triggers;
the tasks count on both. Called after every skill by `world`; calls `link`.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from forestall.worlds.ai2thor.link import Link
from forestall.worlds.ai2thor.naming import type_of
from forestall.worlds.ai2thor.scene import Scene

COOKS = ("Microwave", "StoveBurner", "Toaster")
NOT_TOASTED = ("Microwave",)
"""What warms a slice of bread and does not toast it."""


def undone(scene: Scene) -> Iterator[tuple[str, Mapping[str, Any]]]:
    """Actions that bring about what running devices should have done."""
    for name, thing in scene.things.items():
        if scene.states(name).get("toggled") != "on":
            continue
        kind = type_of(thing)
        if kind == "Faucet":
            for wet in _in_basin(scene, name):
                yield from _under_water(scene.things[wet])
        elif kind == "CoffeeMachine":
            for cup in scene.contents(name):
                yield from _filled(scene.things[cup], "coffee")
        elif kind in COOKS:
            for each in scene.within(name):
                food = scene.things[each]
                bread = type_of(food) == "BreadSliced" and kind in NOT_TOASTED
                if food.get("cookable") and not food.get("isCooked") and not bread:
                    yield "CookObject", {"objectId": food["objectId"]}


def settle(link: Link, scene: Scene) -> None:
    """Do what is left undone, reach and sight apart."""
    for action, said in list(undone(scene)):
        link.step(action, forceAction=True, **said)


def _in_basin(scene: Scene, faucet: str) -> list[str]:
    """What stands under a faucet: in the sink of its number, or the only one there is."""
    sinks = scene.of("Sink")
    own = f"Sink-{faucet.rpartition('-')[2]}"
    basin = own if own in sinks else next(iter(sinks), None)
    return [] if basin is None else scene.contents(basin)


def _under_water(thing: Mapping[str, Any]) -> Iterator[tuple[str, Mapping[str, Any]]]:
    if thing.get("dirtyable") and thing.get("isDirty"):
        yield "CleanObject", {"objectId": thing["objectId"]}
    yield from _filled(thing, "water")


def _filled(thing: Mapping[str, Any], liquid: str) -> Iterator[tuple[str, Mapping[str, Any]]]:
    if thing.get("canFillWithLiquid") and not thing.get("isFilledWithLiquid"):
        yield "FillObjectWithLiquid", {"objectId": thing["objectId"], "fillLiquid": liquid}
