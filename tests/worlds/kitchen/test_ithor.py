"""Rooms after AI2-THOR's layouts: furniture free of each other, workable, the same each time."""

from __future__ import annotations

import json
import math
import tomllib
from typing import Any

import numpy as np
import pytest
from honest_rates import blank_kitchen
from ithor_layouts import convert, text_of
from ithor_rates import won
from test_scene_build import DEVICES, FIXTURES, SALAD

from forestall.assembly.configuration import Given
from forestall.assembly.recording import jobs_for, keyed
from forestall.errors import SceneError, UnknownNameError
from forestall.worlds.kitchen import ithor
from forestall.worlds.kitchen.catalogue import shipped_catalogue
from forestall.worlds.kitchen.forms import Rect
from forestall.worlds.kitchen.ithor_layouts import layouts
from forestall.worlds.kitchen.layout import Item, Plan, free_place
from forestall.worlds.kitchen.model import build_scene
from forestall.worlds.kitchen.settled import check_settled
from forestall.worlds.kitchen.world import KitchenWorld

NAMES = ("FloorPlan1", "FloorPlan2", "FloorPlan4", "FloorPlan6", "FloorPlan7", "FloorPlan16",
         "FloorPlan202")  # fmt: skip
WORKED_AT = ("counter", "stove", "fridge", "table", "shelf", "garbage_can", "tv_stand",
             "floor_lamp")  # fmt: skip
FRONT_M = 0.6
"""What the robot takes up before furniture; its radius is 0.24 m."""


def plans(name: str, seeds: int = 12) -> list[Plan]:
    """The floor plans of some seeds; few draws may fail, as the kitchen draws again."""
    draw = ithor.draws(name)[layouts()[name].room]
    found = []
    for seed in range(2 * seeds):
        try:
            found.append(draw(np.random.default_rng(seed), np.random.default_rng(100 + seed)))
        except SceneError:
            continue
        if len(found) == seeds:
            break
    assert len(found) == seeds
    return found


def built(name: str, seed: int) -> KitchenWorld:
    needs = SALAD if layouts()[name].room == "kitchen" else DEVICES
    return build_scene(needs, seed, shipped_catalogue(), draws=ithor.draws(name))


def on_floor(plan: Plan) -> list[Item]:
    return [i for i in plan.items if i.z == 0]


def test_all_seven_are_there() -> None:
    assert tuple(layouts()) == NAMES
    assert set(ithor.draws()) == {"kitchen", "living-room"}


@pytest.mark.parametrize("name", NAMES)
def test_furniture_stands_in_the_room_and_not_in_each_other(name: str) -> None:
    for plan in plans(name):
        room = Rect(-plan.width / 2, -plan.depth / 2, plan.width / 2, plan.depth / 2).grown(0.005)
        rects = [(i.name, i.rect().grown(-0.012)) for i in on_floor(plan)]
        for k, (one, rect) in enumerate(rects):
            inside = room.x0 <= rect.x0 and rect.x1 <= room.x1
            assert inside and room.y0 <= rect.y0 and rect.y1 <= room.y1, one
            assert [n for n, r in rects[k + 1 :] if rect.overlaps(r)] == [], one


@pytest.mark.parametrize("name", NAMES)
def test_the_floor_before_what_is_worked_at_is_free(name: str) -> None:
    for plan in plans(name):
        free_place(plan, np.random.default_rng(0))
        for item in on_floor(plan):
            if item.kind in WORKED_AT:
                front = item.patch(
                    Rect(-item.width / 2, item.depth, item.width / 2, item.depth + FRONT_M)
                ).grown(-0.03)
                met = {o.name for o in on_floor(plan) if front.overlaps(o.rect())}
                if item.kind in ("counter", "stove"):  # the other leg of an L
                    met -= {o.name for o in plan.items if o.kind in ("corner", "counter")}
                assert met == set(), item.name


@pytest.mark.parametrize("name", NAMES)
def test_the_fridge_opens(name: str) -> None:
    for plan in plans(name):
        for fridge in (i for i in plan.items if i.kind == "fridge"):
            low, high = sorted(fridge.hinge * v for v in (fridge.width / 2, fridge.width / 2 + 0.2))
            swing = fridge.patch(Rect(low, 0.66, high, 0.66 + fridge.width))
            assert not any(swing.overlaps(o.rect()) for o in on_floor(plan) if o is not fridge)


def test_furniture_is_where_the_layout_has_it() -> None:
    """The fridge, the stove and the table of a kitchen, in it or in its mirror image."""
    for name in NAMES[:-1]:
        for plan in plans(name, 4):
            chosen = layouts()[name]
            off = min(_off(plan, chosen.pieces), _off(plan, chosen.mirrored().pieces))
            assert off < 0.45, name


def _off(plan: Plan, pieces: Any) -> float:
    return max(
        math.dist((p.x, p.y), (i.x, i.y))
        for p in pieces
        for i in plan.items
        if p.kind == i.kind and p.kind in ("fridge", "stove", "table")
    )


def test_a_seed_draws_one_room_and_seeds_draw_them_all() -> None:
    draw = ithor.draws()["kitchen"]

    def drawn(seed: int, places: int = 0) -> Plan:
        return draw(np.random.default_rng(seed), np.random.default_rng(places))

    assert drawn(3) == drawn(3)
    sizes = {(round(p.width, 2), round(p.depth, 2)) for p in map(drawn, range(40))}
    assert len(sizes) == 6
    fridges = [i.x for p in plans("FloorPlan1") for i in p.items if i.kind == "fridge"]
    assert min(fridges) < 0 < max(fridges)
    one, other = drawn(3), drawn(3, 1)
    same = {i.name for i in one.items} & {i.name for i in other.items if i in one.items}
    assert {"Fridge-1", "stove", "CounterTop-1"} <= same
    assert "DiningTable-1" not in same


@pytest.mark.simulator
@pytest.mark.parametrize("name", NAMES)
def test_built_rooms_are_complete_and_settled_with_all_doors_open_too(name: str) -> None:
    world = built(name, 10001)
    assert FIXTURES[layouts()[name].room] <= {i.name for i in world.instances}
    assert check_settled(world) == ()
    for instance in world.instances:
        world.show(instance.name, "open", "open")
    assert check_settled(world) == ()


@pytest.mark.simulator
def test_the_same_seed_builds_the_same_room_to_the_last_bit() -> None:
    one, two = built("FloorPlan7", 3), built("FloorPlan7", 3)
    assert one.instances == two.instances
    assert one.robot_position_world_m == two.robot_position_world_m
    assert np.array_equal(one.model.geom_pos, two.model.geom_pos)
    assert one.data.qpos.tobytes() == two.data.qpos.tobytes()


@pytest.mark.simulator
@pytest.mark.parametrize("name", NAMES)
def test_a_nominal_plan_reaches_its_goal(name: str) -> None:
    task = "store-egg" if layouts()[name].room == "kitchen" else "switch-devices"
    assert won(task, layouts()[name], range(10001, 10002)) == (1, [])


def test_an_unknown_layout_is_named() -> None:
    with pytest.raises(UnknownNameError, match="FloorPlan16"):
        ithor.draws("FloorPlan61")


@pytest.mark.simulator
def test_a_room_of_a_kind_that_no_layout_has_is_refused() -> None:
    env = blank_kitchen("switch-devices", None, False, ithor.draws("FloorPlan1"))
    with pytest.raises(SceneError, match="no floor plan for a living-room, only for kitchen"):
        env.reset(10000)


def test_demonstrations_of_other_rooms_are_other_recordings() -> None:
    given = Given.named({"world.rooms": "ithor"})
    own, other = jobs_for(["store-egg"]), jobs_for(["store-egg"], given=given)
    assert not set(keyed(own)) & set(keyed(other))
    with pytest.raises(UnknownNameError, match="known: ithor, own"):
        keyed(jobs_for(["store-egg"], given=Given.named({"world.rooms": "ithr"})))


def _object(kind: str, low: tuple[float, ...], high: tuple[float, ...], turn: float = 0) -> Any:
    axes = dict(zip("xyz", zip(low, high, strict=True), strict=True))
    box = {
        "center": {k: (a + b) / 2 for k, (a, b) in axes.items()},
        "size": {k: b - a for k, (a, b) in axes.items()},
    }
    return {
        "objectId": f"{kind}|{low}", "objectType": kind, "axisAlignedBoundingBox": box,
        "rotation": {"x": 0, "y": turn, "z": 0},
    }  # fmt: skip


def test_a_dump_is_converted() -> None:
    objects = [
        _object("Floor", (0, 0, 0), (5, 0, 4)),
        _object("Sofa", (1, 0, 0.2), (3, 0.9, 1.1)),
        _object("TVStand", (1.5, 0, 3.4), (2.7, 0.7, 3.9)),
        _object("Window", (-0.1, 1, 1), (0, 2, 2.5)),
    ]
    dump = json.loads(json.dumps({o["objectId"]: o for o in objects}))
    table = tomllib.loads(text_of({"FloorPlan202": convert("FloorPlan202", dump)}))
    assert table["FloorPlan202"] == {
        "room": "living-room",
        "bounds": [0.0, 0.0, 5.0, 4.0],
        "pieces": [["tv_stand", 2.1, 4.0, 2, 1.2, 0.5], ["sofa", 2.0, 0.0, 0, 2.0, 0.9]],
        "windows": [[3, 1.75, 1.5, 1.0, 2.0]],
    }
