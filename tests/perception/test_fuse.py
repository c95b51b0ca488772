from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest

from forestall.domain.load import shipped
from forestall.domain.truth import truth as truth_of
from forestall.perception.given import GivenStateEstimator
from forestall.perception.perceiver import GraphPerceiver
from forestall.perception.segmenters import InstanceSegmenter
from forestall.types.facts import Literal, Truth
from forestall.types.graph import SceneGraph, Seen

from .synthetic import Solid, at, hollow, looking, observed

EYE = looking((0.0, -0.7, 1.65), (0.0, 0.3, 0.9))
AWAY = looking((0.0, -0.7, 1.65), (0.0, -3.0, 0.9))
FLOOR = Solid("Floor-1", (-4.0, -6.0, -0.02), (4.0, 4.0, 0.0))
COUNTER = Solid("CounterTop-1", (-1.0, 0.0, 0.86), (1.0, 0.6, 0.9))
MUG = (0.085, 0.085, 0.10)
HAND = (0.0, -0.3, 1.2)


class Robot:
    """Feeds one scene after the other to a perceiver, a second apart."""

    def __init__(self) -> None:
        self.states: dict[str, dict[str, str]] = {}
        self._perceiver = GraphPerceiver(
            InstanceSegmenter(), GivenStateEstimator({}), shipped("household")
        )
        self._time_s = 0.0

    def sees(
        self,
        solids: Sequence[Solid],
        *poses: np.ndarray,
        holding: str | None = None,
        states: dict[str, dict[str, str]] | None = None,
    ) -> SceneGraph:
        self._time_s += 1.0
        self._perceiver._estimator = GivenStateEstimator(states or {})
        return self._perceiver.perceive(
            observed(solids, *(poses or (EYE,)), holding=holding, hand=HAND, time_s=self._time_s)
        )


def truth(graph: SceneGraph, text: str) -> Truth:
    return truth_of(graph, Literal.parse(text), shipped("household"))


def seen(graph: SceneGraph, name: str) -> Seen:
    node = graph.get(name)
    assert node is not None
    return node.seen


def test_what_ought_to_be_visible_and_is_not_has_gone() -> None:
    robot = Robot()
    robot.sees([COUNTER, at("Mug-1", 0.0, 0.3, 0.9, MUG, True)])
    graph = robot.sees([COUNTER])
    assert truth(graph, "located(Mug-1)") is Truth.FALSE
    assert truth(graph, "on_top_of(Mug-1, CounterTop-1)") is Truth.FALSE
    assert seen(graph, "Mug-1") is Seen.UNOBSERVED


def test_what_is_out_of_view_is_remembered() -> None:
    robot = Robot()
    robot.sees([COUNTER, at("Mug-1", 0.0, 0.3, 0.9, MUG, True)])
    graph = robot.sees([COUNTER, FLOOR], AWAY)
    assert seen(graph, "Mug-1") is Seen.REMEMBERED
    assert seen(graph, "CounterTop-1") is Seen.REMEMBERED
    assert truth(graph, "on_top_of(Mug-1, CounterTop-1)") is Truth.TRUE


def test_what_is_occluded_is_kept_as_unobserved() -> None:
    robot = Robot()
    mug = at("Mug-1", 0.0, 0.4, 0.9, MUG, True)
    robot.sees([COUNTER, mug])
    screen = at("Book-1", 0.0, 0.2, 0.9, (0.5, 0.05, 0.5))
    graph = robot.sees([COUNTER, screen, mug])
    assert seen(graph, "Mug-1") is Seen.UNOBSERVED
    assert truth(graph, "on_top_of(Mug-1, CounterTop-1)") is Truth.TRUE


def test_the_newest_place_wins() -> None:
    robot = Robot()
    robot.sees([COUNTER, at("Mug-1", -0.3, 0.3, 0.9, MUG, True)])
    node = robot.sees([COUNTER, at("Mug-1", 0.3, 0.3, 0.9, MUG, True)]).get("Mug-1")
    assert node is not None and node.centroid_m is not None
    assert node.centroid_m[0] == pytest.approx(0.3, abs=0.02)
    assert node.box_m is not None and node.box_m.size[0] < 0.11


def test_an_open_door_does_not_stay_when_it_is_closed() -> None:
    robot = Robot()
    body = hollow("Fridge-1", (-0.35, 0.0, 0.0), (0.35, 0.65, 1.7), 0.03, "front")
    body += [Solid("Wall-1", (-3.0, 1.0, 0.0), (3.0, 1.1, 3.0))]
    body += [Solid("Floor-1", (-3.0, -3.0, -0.1), (3.0, 3.0, 0.0))]
    door = Solid("Fridge-1", (-0.35, -0.6, 0.0), (-0.33, 0.0, 1.7))
    view = looking((0.3, -1.8, 1.5), (0.0, 0.0, 0.9))
    opened = robot.sees([*body, door], view, states={"Fridge-1": {"open": "open"}}).get("Fridge-1")
    assert opened is not None and opened.box_m is not None and opened.box_m.low[1] < -0.5
    shut = Solid("Fridge-1", (-0.35, -0.02, 0.0), (0.35, 0.0, 1.7))
    closed = robot.sees([*body, shut], view, states={"Fridge-1": {"open": "closed"}})
    node = closed.get("Fridge-1")
    assert node is not None and node.box_m is not None and node.box_m.low[1] > -0.1


def microwave(front: Solid | None = None) -> list[Solid]:
    body = hollow("Microwave-1", (-0.25, 0.2, 0.9), (0.25, 0.58, 1.2), 0.02, "front")
    return [COUNTER, *body, *([] if front is None else [front])]


DOOR = Solid("Microwave-1", (-0.25, 0.18, 0.9), (0.25, 0.2, 1.2))
BOWL = hollow("Bowl-1", (-0.1, 0.3, 0.92), (0.1, 0.5, 1.0))
LOW_EYE = looking((0.0, -0.8, 1.3), (0.0, 0.4, 1.05))


def test_the_inside_of_a_closed_microwave_is_unobserved() -> None:
    graph = Robot().sees(
        [*microwave(DOOR), *BOWL], LOW_EYE, states={"Microwave-1": {"open": "closed"}}
    )
    assert graph.hidden == ("Microwave-1",)
    assert truth(graph, "vacant(Microwave-1)") is Truth.UNOBSERVED


def test_an_open_empty_microwave_is_vacant() -> None:
    graph = Robot().sees(microwave(), LOW_EYE, states={"Microwave-1": {"open": "open"}})
    assert graph.hidden == ()
    assert truth(graph, "vacant(Microwave-1)") is Truth.TRUE


def test_an_open_microwave_into_which_nobody_looked_is_unobserved() -> None:
    from_behind = looking((0.0, 1.9, 1.3), (0.0, 0.4, 1.05))
    graph = Robot().sees(microwave(), from_behind, states={"Microwave-1": {"open": "open"}})
    assert truth(graph, "vacant(Microwave-1)") is Truth.UNOBSERVED


def test_a_container_whose_state_was_never_seen_hides_its_inside() -> None:
    assert Robot().sees(microwave(DOOR), LOW_EYE).hidden == ("Microwave-1",)


def test_what_was_seen_going_in_is_remembered_inside_after_closing() -> None:
    robot = Robot()
    robot.sees([*microwave(), *BOWL], LOW_EYE, states={"Microwave-1": {"open": "open"}})
    graph = robot.sees(
        [*microwave(DOOR), *BOWL], LOW_EYE, states={"Microwave-1": {"open": "closed"}}
    )
    assert truth(graph, "inside(Bowl-1, Microwave-1)") is Truth.TRUE
    assert truth(graph, "accessible(Bowl-1)") is Truth.FALSE
    assert seen(graph, "Bowl-1") is Seen.UNOBSERVED
    assert graph.hidden == ("Microwave-1",)


def test_what_was_taken_out_of_a_container_is_no_longer_in_it() -> None:
    robot = Robot()
    opened = {"Microwave-1": {"open": "open"}}
    robot.sees([*microwave(), *BOWL], LOW_EYE, states=opened)
    graph = robot.sees(microwave(), LOW_EYE, holding="Bowl-1", states=opened)
    assert graph.in_hands(("gripper",)) == ("Bowl-1",)
    assert truth(graph, "inside(Bowl-1, Microwave-1)") is Truth.FALSE
    assert truth(graph, "vacant(Microwave-1)") is Truth.TRUE


def test_what_lies_on_the_held_plate_moves_along_unseen() -> None:
    robot = Robot()
    plate = at("Plate-1", 0.1, 0.3, 0.9, (0.22, 0.22, 0.02), True)
    potato = at("Potato-1", 0.1, 0.3, 0.92, (0.1, 0.07, 0.065))
    robot.sees([COUNTER, plate, potato])
    graph = robot.sees([COUNTER], holding="Plate-1")
    assert truth(graph, "on_top_of(Potato-1, Plate-1)") is Truth.TRUE
    assert truth(graph, "on_top_of(Plate-1, CounterTop-1)") is Truth.FALSE
    node = graph.get("Potato-1")
    assert node is not None and node.centroid_m is not None
    assert node.centroid_m[1] < 0.0


def test_what_was_dropped_out_of_view_is_nowhere() -> None:
    robot = Robot()
    mug = at("Mug-1", 0.0, 0.3, 0.9, MUG, True)
    robot.sees([COUNTER, mug])
    robot.sees([COUNTER], holding="Mug-1")
    graph = robot.sees([COUNTER])
    assert truth(graph, "located(Mug-1)") is Truth.FALSE
    assert truth(graph, "hand_empty()") is Truth.TRUE
    found = robot.sees([COUNTER, at("Mug-1", 0.4, 0.3, 0.9, MUG, True)])
    assert truth(found, "on_top_of(Mug-1, CounterTop-1)") is Truth.TRUE


def test_a_held_thing_that_was_never_seen_is_in_the_graph() -> None:
    graph = Robot().sees([COUNTER], holding="Mug-1")
    assert graph.in_hands(("gripper",)) == ("Mug-1",)
    node = graph.get("Mug-1")
    assert node is not None and node.category == "Mug"


def test_slices_replace_the_whole() -> None:
    robot = Robot()
    robot.sees([COUNTER, at("Lettuce-1", 0.0, 0.3, 0.9, (0.15, 0.15, 0.12))])
    slices = [
        at(f"LettuceSliced-{i}", -0.1 + 0.1 * i, 0.3, 0.9, (0.075, 0.07, 0.03)) for i in range(3)
    ]
    graph = robot.sees([COUNTER, *slices])
    assert graph.get("Lettuce-1") is None
    assert len(graph.of_category("LettuceSliced")) == 3


def test_an_egg_cracked_in_the_hand_is_replaced() -> None:
    robot = Robot()
    pan = hollow("Pan-1", (-0.12, 0.2, 0.9), (0.12, 0.44, 0.95))
    robot.sees([COUNTER, *pan], holding="Egg-1")
    cracked = at("EggCracked-1", 0.0, 0.32, 0.91, (0.11, 0.1, 0.02))
    graph = robot.sees([COUNTER, *pan, cracked])
    assert graph.get("Egg-1") is None
    assert truth(graph, "inside(EggCracked-1, Pan-1)") is Truth.TRUE


def test_states_outlive_a_view_that_does_not_show_them() -> None:
    robot = Robot()
    mug = at("Mug-1", 0.0, 0.3, 0.9, MUG, True)
    robot.sees([COUNTER, mug], states={"Mug-1": {"dirty": "dirty"}})
    graph = robot.sees([COUNTER, mug])
    assert truth(graph, "dirty(Mug-1)=dirty") is Truth.TRUE
    assert truth(graph, "filled(Mug-1)=empty") is Truth.UNOBSERVED
    clean = robot.sees([COUNTER, mug], states={"Mug-1": {"dirty": "clean"}})
    assert truth(clean, "dirty(Mug-1)=clean") is Truth.TRUE


def test_every_attribute_of_the_category_is_there() -> None:
    node = Robot().sees([COUNTER, at("Mug-1", 0.0, 0.3, 0.9, MUG, True)]).get("Mug-1")
    assert node is not None
    assert dict(node.states) == {"filled": None, "dirty": None, "broken": None, "temperature": None}


def test_a_pot_hides_its_burner_and_still_stands_on_it() -> None:
    robot = Robot()
    burner = at("StoveBurner-1", 0.0, 0.3, 0.9, (0.18, 0.18, 0.01), True)
    robot.sees([COUNTER, burner])
    graph = robot.sees([COUNTER, burner, at("Pot-1", 0.0, 0.3, 0.91, (0.24, 0.24, 0.13), True)])
    assert truth(graph, "on_top_of(Pot-1, StoveBurner-1)") is Truth.TRUE


def test_reset_forgets() -> None:
    robot = Robot()
    robot.sees([COUNTER, at("Mug-1", 0.0, 0.3, 0.9, MUG, True)])
    robot._perceiver.reset()
    assert robot.sees([COUNTER]).get("Mug-1") is None


def test_what_is_held_is_placed_from_one_view_because_it_turns_with_the_robot() -> None:
    robot = Robot()
    robot.sees([COUNTER, at("Plate-1", 0.1, 0.3, 0.9, (0.22, 0.22, 0.02), True)])
    plate = at("Plate-1", 0.0, 0.0, 1.2, (0.22, 0.22, 0.02), True)
    potato = at("Potato-1", 0.0, 0.0, 1.22, (0.1, 0.07, 0.065))
    first = observed([COUNTER, plate, potato], EYE, holding="Plate-1", hand=HAND, time_s=5.0)
    shift = (0.15, 0.0, 0.0)
    second = observed(
        [COUNTER, plate.moved(shift), potato.moved(shift)],
        EYE,
        holding="Plate-1",
        hand=HAND,
        time_s=5.0,
    )
    graph = robot._perceiver.perceive(replace(second, frames=(*first.frames, *second.frames)))
    for name in ("Plate-1", "Potato-1"):
        node = graph.get(name)
        assert node is not None and node.centroid_m is not None
        assert node.centroid_m[0] == pytest.approx(0.15, abs=0.02)
    assert truth(graph, "on_top_of(Potato-1, Plate-1)") is Truth.TRUE
