from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
import numpy.typing as npt
import pytest

from forestall.domain.load import shipped
from forestall.domain.truth import truth
from forestall.perception.given import GivenStateEstimator
from forestall.perception.perceiver import GraphPerceiver
from forestall.perception.segmenters import InstanceSegmenter
from forestall.perception.support import circular
from forestall.types.facts import Literal, Truth
from forestall.types.graph import Relation, SceneGraph
from forestall.types.observation import Intrinsics

from .synthetic import Solid, at, hollow, looking, observed

EYE = looking((0.0, -0.7, 1.65), (0.0, 0.3, 0.9))
FLOOR_EYE = looking((0.0, -1.2, 1.5), (0.0, 0.0, 0.0))
COUNTER = Solid("CounterTop-1", (-1.0, 0.0, 0.86), (1.0, 0.6, 0.9))
MUG = (0.085, 0.085, 0.10)
SHARP = Intrinsics.from_vertical_fov(640, 480, 43.0)


def graph_of(
    solids: Sequence[Solid],
    *poses: npt.NDArray[np.float64],
    states: Mapping[str, Mapping[str, str]] | None = None,
    holding: str | None = None,
    hand: tuple[float, float, float] = (0.0, -0.5, 1.2),
) -> SceneGraph:
    perceiver = GraphPerceiver(
        InstanceSegmenter(), GivenStateEstimator(states or {}), shipped("household")
    )
    return perceiver.perceive(observed(solids, *(poses or (EYE,)), holding=holding, hand=hand))


def parents(graph: SceneGraph) -> dict[str, tuple[str, str]]:
    return {
        r.subject: (r.predicate, r.object)
        for r in graph.relations
        if r.predicate in ("inside", "on_top_of")
    }


def microwave() -> list[Solid]:
    return hollow("Microwave-1", (-0.25, 0.2, 0.9), (0.25, 0.58, 1.2), 0.02, "front")


CASES = {
    "bowl in open microwave": (
        [COUNTER, *microwave(), *hollow("Bowl-1", (-0.1, 0.3, 0.92), (0.1, 0.5, 1.0))],
        {"Microwave-1": {"open": "open"}},
        {"Bowl-1": ("inside", "Microwave-1")},
    ),
    "potato on plate on counter": (
        [
            COUNTER,
            at("Plate-1", 0.1, 0.3, 0.9, (0.22, 0.22, 0.02), True),
            at("Potato-1", 0.1, 0.3, 0.92, (0.1, 0.07, 0.065)),
        ],
        {},
        {"Plate-1": ("on_top_of", "CounterTop-1"), "Potato-1": ("on_top_of", "Plate-1")},
    ),
    "pot covers its burner": (
        [
            COUNTER,
            at("StoveBurner-1", -0.2, 0.3, 0.9, (0.24, 0.24, 0.01), True),
            at("StoveBurner-2", 0.2, 0.3, 0.9, (0.24, 0.24, 0.01), True),
            at("Pot-1", -0.2, 0.3, 0.91, (0.2, 0.2, 0.13), True),
        ],
        {},
        {"Pot-1": ("on_top_of", "StoveBurner-1")},
    ),
    "egg in a pan": (
        [
            COUNTER,
            *hollow("Pan-1", (-0.12, 0.2, 0.9), (0.12, 0.44, 0.95)),
            at("EggCracked-1", 0.0, 0.32, 0.91, (0.11, 0.1, 0.02)),
        ],
        {},
        {"EggCracked-1": ("inside", "Pan-1"), "Pan-1": ("on_top_of", "CounterTop-1")},
    ),
    "potato beside a pan, not in it": (
        [
            COUNTER,
            *hollow("Pan-1", (-0.12, 0.2, 0.9), (0.12, 0.44, 0.95)),
            at("Potato-1", 0.19, 0.32, 0.9, (0.1, 0.07, 0.065)),
        ],
        {},
        {"Potato-1": ("on_top_of", "CounterTop-1"), "Pan-1": ("on_top_of", "CounterTop-1")},
    ),
    "egg in a bowl in an open fridge": (
        [
            *hollow("Fridge-1", (-0.35, 0.0, 0.0), (0.35, 0.65, 1.7), 0.03, "front"),
            Solid("Fridge-1", (-0.35, 0.05, 0.9), (0.35, 0.65, 0.92)),
            *hollow("Bowl-1", (-0.1, 0.2, 0.92), (0.1, 0.4, 1.005)),
            at("Egg-1", 0.0, 0.3, 0.93, (0.045, 0.045, 0.058)),
            at("Mug-1", -0.22, 0.3, 0.92, MUG, True),
        ],
        {"Fridge-1": {"open": "open"}},
        {
            "Bowl-1": ("inside", "Fridge-1"),
            "Egg-1": ("inside", "Bowl-1"),
            "Mug-1": ("inside", "Fridge-1"),
        },
    ),
    "plate in the sink of a counter": (
        [
            Solid("CounterTop-1", (-1.0, 0.0, 0.86), (-0.25, 0.6, 0.9)),
            Solid("CounterTop-1", (0.25, 0.0, 0.86), (1.0, 0.6, 0.9)),
            Solid("CounterTop-1", (-0.25, 0.0, 0.86), (0.25, 0.1, 0.9)),
            Solid("CounterTop-1", (-0.25, 0.5, 0.86), (0.25, 0.6, 0.9)),
            *hollow("Sink-1", (-0.25, 0.1, 0.7), (0.25, 0.5, 0.89)),
            at("Plate-1", 0.0, 0.3, 0.71, (0.22, 0.22, 0.02), True),
            at("Mug-1", 0.32, 0.3, 0.9, MUG, True),
        ],
        {},
        {"Plate-1": ("inside", "Sink-1"), "Mug-1": ("on_top_of", "CounterTop-1")},
    ),
    "mug beside a plate is not on it": (
        [
            COUNTER,
            at("Plate-1", 0.0, 0.3, 0.9, (0.22, 0.22, 0.025), True),
            at("Mug-1", 0.12, 0.4, 0.9, MUG, True),
        ],
        {},
        {"Plate-1": ("on_top_of", "CounterTop-1"), "Mug-1": ("on_top_of", "CounterTop-1")},
    ),
    "mug on a closed microwave is in nothing": (
        [
            COUNTER,
            Solid("Microwave-1", (-0.25, 0.2, 0.9), (0.25, 0.58, 1.2)),
            at("Mug-1", 0.0, 0.3, 1.2, MUG, True),
        ],
        {"Microwave-1": {"open": "closed"}},
        {},
    ),
    "mug on the floor": (
        [
            Solid("Floor-1", (-2.0, -2.0, -0.01), (2.0, 2.0, 0.0)),
            at("Mug-1", 0.0, 0.0, 0.0, MUG, True),
        ],
        {},
        {"Mug-1": ("on_top_of", "Floor-1")},
    ),
}


@pytest.mark.parametrize("name", CASES)
def test_each_thing_has_its_one_parent(name: str) -> None:
    solids, states, expected = CASES[name]
    pose = FLOOR_EYE if "floor" in name else EYE
    assert parents(graph_of(solids, pose, states=states)) == expected


def blocked(graph: SceneGraph) -> set[tuple[str, str]]:
    return {(r.subject, r.object) for r in graph.relations if r.predicate == "blocking"}


def test_pot_before_a_knife_blocks_it() -> None:
    knife = at("Knife-1", 0.0, 0.45, 0.9, (0.3, 0.035, 0.02))
    before = at("Pot-1", 0.0, 0.25, 0.9, (0.2, 0.2, 0.13), True)
    assert ("Pot-1", "Knife-1") in blocked(graph_of([COUNTER, knife, before]))


@pytest.mark.parametrize("x", [-0.45, 0.45])
def test_pot_beside_a_knife_does_not_block_it(x: float) -> None:
    knife = at("Knife-1", 0.0, 0.35, 0.9, (0.3, 0.035, 0.02))
    beside = at("Pot-1", x, 0.35, 0.9, (0.2, 0.2, 0.13), True)
    assert blocked(graph_of([COUNTER, knife, beside])) == set()


@pytest.mark.parametrize(
    ("front", "size", "blocks"),
    [
        ((0.0, 0.15), (0.05, 0.05, 0.05), True),
        ((0.0, 0.15), (0.05, 0.05, 0.02), False),  # the hand passes over it
        ((0.09, 0.15), (0.05, 0.05, 0.05), False),  # beside the hand's way
        ((0.06, 0.15), (0.05, 0.05, 0.05), True),  # in the way of its edge
        ((0.0, 0.05), (0.05, 0.05, 0.05), False),  # before the wrist
    ],
)
def test_a_hand_has_a_width_a_length_and_a_height(
    front: tuple[float, float], size: tuple[float, float, float], blocks: bool
) -> None:
    mug = at("Mug-1", 0.0, 0.5, 0.9, MUG, True)
    other = at("Knife-1", *front, 0.9, size)
    assert (("Knife-1", "Mug-1") in blocked(graph_of([COUNTER, mug, other]))) == blocks


def test_nothing_blocks_what_stands_before_it() -> None:
    knife = at("Knife-1", 0.0, 0.45, 0.9, (0.3, 0.035, 0.02))
    before = at("Pot-1", 0.0, 0.25, 0.9, (0.2, 0.2, 0.13), True)
    assert ("Knife-1", "Pot-1") not in blocked(graph_of([COUNTER, knife, before]))


def test_held_mug_is_held_and_rests_on_nothing() -> None:
    mug = at("Mug-1", 0.0, -0.3, 1.2, MUG, True)
    graph = graph_of([COUNTER, mug], holding="Mug-1", hand=(0.0, -0.3, 1.25))
    assert graph.in_hands(("gripper",)) == ("Mug-1",)
    assert graph.parents("Mug-1", shipped("household").containing) == ()


def test_directions_are_those_of_the_camera() -> None:
    left = at("Mug-1", -0.15, 0.3, 0.9, MUG, True)
    right = at("Mug-2", 0.15, 0.3, 0.9, MUG, True)
    texts = {str(r) for r in graph_of([COUNTER, left, right]).relations}
    assert "Mug-1 left of Mug-2" in texts
    assert "Mug-2 right of Mug-1" in texts
    other_side = looking((0.0, 1.8, 1.5), (0.0, 0.3, 0.9))
    texts = {str(r) for r in graph_of([COUNTER, left, right], other_side).relations}
    assert "Mug-1 right of Mug-2" in texts


def test_front_is_towards_the_camera_and_near_needs_contact_distance() -> None:
    front = at("Mug-1", 0.0, 0.1, 0.9, MUG, True)
    back = at("Mug-2", 0.0, 0.27, 0.9, MUG, True)
    texts = {str(r) for r in graph_of([COUNTER, front, back]).relations}
    assert {"Mug-1 in front of Mug-2", "Mug-2 behind Mug-1", "Mug-1 near Mug-2"} <= texts
    far = at("Mug-2", 0.0, 0.45, 0.9, MUG, True)
    texts = {str(r) for r in graph_of([COUNTER, front, far]).relations}
    assert "Mug-1 near Mug-2" not in texts


def test_boxes_are_where_things_are() -> None:
    graph = graph_of([COUNTER, at("Mug-1", 0.2, 0.3, 0.9, MUG)])
    node = graph.get("Mug-1")
    assert node is not None and node.box_m is not None
    assert np.allclose(node.box_m.low, (0.1575, 0.2575, 0.9), atol=0.012)
    assert np.allclose(node.box_m.high[0], 0.2425, atol=0.012)
    assert np.allclose(node.box_m.high[2], 1.0, atol=0.012)


# --- things that do not belong where they are -----------------------------------------------------

OVEN = hollow("Microwave-1", (-0.25, 0.15, 0.9), (0.25, 0.55, 1.2), 0.02, "front")
BLOCK = (0.12, 0.1, 0.08)


@pytest.mark.parametrize("name", ["Bowl-1", "Book-1", "Knife-1", "vase-1", "potted meat can-1"])
def test_whatever_is_within_walls_is_in_there(name: str) -> None:
    scene = [COUNTER, *OVEN, at(name, 0.0, 0.35, 0.92, BLOCK)]
    eye = looking((0.0, -0.9, 1.3), (0.0, 0.35, 0.95))
    graph = graph_of(scene, eye, states={"Microwave-1": {"open": "open"}})
    assert Relation(name, "inside", "Microwave-1") in graph.relations
    empty = Literal.parse("vacant(Microwave-1)")
    assert truth(graph, empty, shipped("household")) is Truth.FALSE


def test_a_strange_thing_stands_on_what_it_stands_on() -> None:
    graph = graph_of([COUNTER, at("toaster oven toy-1", 0.0, 0.3, 0.9, BLOCK)], EYE)
    assert Relation("toaster oven toy-1", "on_top_of", "CounterTop-1") in graph.relations


# --- masks that are a pixel too wide --------------------------------------------------------------


def test_what_a_wide_mask_shows_far_behind_is_no_part_of_the_thing() -> None:
    counter = Solid("CounterTop-1", (-1.0, 0.0, 0.86), (1.0, 0.4, 0.9))
    wall = Solid("Wall-1", (-3.0, 2.0, 0.0), (3.0, 2.1, 2.6))
    mug = at("Mug-1", 0.0, 0.3, 0.9, (0.085, 0.085, 0.1), True)
    seen = observed([counter, wall, mug], looking((0.0, -0.9, 1.1), (0.0, 0.3, 0.95)))
    frame = seen.frames[0]
    assert frame.instance_ids is not None
    own = frame.instance_names.index("Mug-1")
    rows, columns = np.nonzero(frame.instance_ids == own)
    ids = frame.instance_ids.copy()
    ids[rows.min() - 2 : rows.min(), columns.min() : columns.max()] = own
    wide = replace(seen, frames=(replace(frame, instance_ids=ids),))
    perceiver = GraphPerceiver(InstanceSegmenter(), GivenStateEstimator({}), shipped("household"))
    node = perceiver.perceive(wide).get("Mug-1")
    assert node is not None and node.box_m is not None
    assert max(node.box_m.size) < 0.13


def mug_seen(strays: int, away: float) -> tuple[float, ...]:
    """Size of the box of a mug with some pixels in its middle at depths behind it."""
    pose = looking((0.0, -0.72 * away, 0.78 + 0.69 * away), (0.0, 0.0, 0.78))
    table = Solid("DiningTable-1", (-0.6, -0.4, 0.0), (0.6, 0.6, 0.74))
    seen = observed([table, at("Mug-1", 0.0, 0.0, 0.74, MUG, True)], pose, camera=SHARP)
    frame = seen.frames[0]
    assert frame.instance_ids is not None
    own = np.argwhere(frame.instance_ids == frame.instance_names.index("Mug-1"))
    middle = own[np.abs(own - own.mean(axis=0)).max(axis=1) < 10]
    at_pixels = middle[np.linspace(0, len(middle) - 1, strays).astype(int)]
    depth = frame.depth_m.copy()
    depth[at_pixels[:, 0], at_pixels[:, 1]] += np.linspace(0.02, 0.16, strays, dtype=np.float32)
    perceiver = GraphPerceiver(InstanceSegmenter(), GivenStateEstimator({}), shipped("household"))
    node = perceiver.perceive(replace(seen, frames=(replace(frame, depth_m=depth),))).get("Mug-1")
    assert node is not None and node.box_m is not None
    return node.box_m.size


@pytest.mark.parametrize("away", [0.9, 1.3])
def test_a_few_pixels_that_fly_behind_a_thing_do_not_make_it_longer(away: float) -> None:
    """Two in a hundred of its pixels: a camera blurs depth where a thing ends."""
    assert mug_seen(40, away) == pytest.approx(mug_seen(0, away), abs=0.015)


@pytest.mark.parametrize("masked", [True, False])
def test_at_the_short_end_of_a_table_a_hand_comes_over_that_end(masked: bool) -> None:
    """Whichever side looks the longer one, with a part of the table out of the picture."""
    things = [
        at("Pot-1", 0.0, 0.25, 0.74, (0.18, 0.18, 0.14), True),
        at("Mug-1", 0.02, 0.02, 0.74, (0.08, 0.08, 0.1), True),
        at("Bowl-1", -0.22, 0.05, 0.74, (0.14, 0.14, 0.08), True),
        at("Cup-1", 0.2, 0.05, 0.74, (0.07, 0.07, 0.1), True),
    ]
    floor = Solid("Floor-1", (-3, -3, -0.02), (3, 3, 0.0))
    table = Solid("DiningTable-1", (-0.35, -0.5, 0.0), (0.35, 0.9, 0.74))
    pose = looking((0.0, -0.9, 1.35), (0.0, 0.2, 0.78))
    seen = observed([floor, table, *things], pose, camera=SHARP)
    frame = seen.frames[0]
    assert frame.instance_ids is not None
    if not masked:
        of_table = frame.instance_ids == frame.instance_names.index("DiningTable-1")
        ids = np.where(of_table, -1, frame.instance_ids).astype(np.int32)
        seen = replace(seen, frames=(replace(frame, instance_ids=ids),))
    perceiver = GraphPerceiver(InstanceSegmenter(), GivenStateEstimator({}), shipped("household"))
    found = {str(r) for r in perceiver.perceive(seen).relations if r.predicate == "blocking"}
    assert found == {"Mug-1 blocking Pot-1"}


def test_a_strange_thing_carries_what_nothing_else_carries() -> None:
    crate = at("crate-1", 0.0, 0.3, 0.9, (0.3, 0.2, 0.1))
    beside = at("crate-2", 0.35, 0.3, 0.9, (0.2, 0.2, 0.12))
    graph = graph_of([COUNTER, crate, beside, at("tin-1", 0.02, 0.28, 1.0, MUG, True)], EYE)
    found = parents(graph)
    assert found["tin-1"] == ("on_top_of", "crate-1")
    assert found["crate-1"] == found["crate-2"] == ("on_top_of", "CounterTop-1")


def test_nothing_holds_what_holds_it() -> None:
    links = {
        "Bowl-1": ("on_top_of", "Plate-1"),
        "Plate-1": ("on_top_of", "Bowl-1"),
        "Egg-1": ("inside", "Bowl-1"),
        "Pot-1": ("on_top_of", "CounterTop-1"),
    }
    assert circular(links, {"Bowl-1", "Egg-1"}) == ["Plate-1"], "what is only remembered goes"
    assert circular(links, {"Plate-1"}) == ["Bowl-1"]
    assert circular(links, links) == ["Plate-1"]
    assert circular({k: v for k, v in links.items() if k != "Plate-1"}, ()) == []
    longer = {
        "A-1": ("on", "B-1"),
        "B-1": ("on", "C-1"),
        "C-1": ("on", "A-1"),
        "D-1": ("on", "A-1"),
    }
    assert circular(longer, {"A-1", "C-1"}) == ["B-1"]
