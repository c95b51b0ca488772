"""What a skill may have changed is not known until it is read again."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from functools import partial
from itertools import product

from forestall.domain.load import shipped
from forestall.perception.given import GivenStateEstimator
from forestall.perception.perceiver import GraphPerceiver
from forestall.perception.segmenters import InstanceSegmenter
from forestall.planning.altered import altered
from forestall.types.facts import Change
from forestall.types.graph import ObjectNode, SceneGraph
from forestall.types.plan import Subtask

from .synthetic import Solid, at, hollow, looking, observed

NEAR = looking((0.0, -0.7, 1.65), (0.0, 0.3, 0.9))
COUNTER = Solid("CounterTop-1", (-1.0, 0.0, 0.86), (1.0, 0.6, 0.9))
SCENE = [COUNTER, at("Mug-1", 0.1, 0.3, 0.9, (0.085, 0.085, 0.10), True)]
STEP = Subtask.parse("toggle_on(Faucet-1)")


def test_a_state_is_unobserved_after_what_may_have_changed_it_and_known_again_when_read() -> None:
    states: dict[str, dict[str, str]] = {"Mug-1": {"filled": "empty", "dirty": "clean"}}
    asked: list[tuple[SceneGraph, Subtask]] = []

    def fills(graph: SceneGraph, subtask: Subtask) -> Iterable[Change]:
        asked.append((graph, subtask))
        return [Change(name, "filled", "empty", "water") for name in ("Mug-1", "Mug-9")]

    eyes = GraphPerceiver(
        InstanceSegmenter(), GivenStateEstimator(states), shipped("household"), alters=fills
    )

    def mug(time_s: float) -> ObjectNode:
        node = eyes.perceive(observed(SCENE, NEAR, time_s=time_s)).get("Mug-1")
        assert node is not None
        return node

    assert mug(0.0).state("filled") == "empty"
    states["Mug-1"] = {}
    assert mug(1.0).state("filled") == "empty", "nothing was done: it is as it was"
    eyes.acted(STEP, succeeded=True)
    assert asked[0][1] == STEP and asked[0][0].get("Mug-1") is not None
    unread = mug(2.0)
    assert (unread.state("filled"), unread.state("dirty")) == (None, "clean")
    assert unread.presumed == (("filled", "water"),)
    eyes.acted(STEP, succeeded=False)
    assert mug(2.5).presumed == (("filled", "empty"),), "it is said not to have come about"
    states["Mug-1"] = {"filled": "water"}
    assert (mug(3.0).state("filled"), mug(3.0).presumed) == ("water", ())


def test_without_a_model_of_what_skills_change_what_was_read_stands() -> None:
    states = {"Mug-1": {"filled": "empty"}}
    eyes = GraphPerceiver(InstanceSegmenter(), GivenStateEstimator(states), shipped("household"))
    eyes.perceive(observed(SCENE, NEAR))
    states["Mug-1"] = {}
    eyes.acted(STEP, succeeded=True)
    node = eyes.perceive(observed(SCENE, NEAR, time_s=1.0)).get("Mug-1")
    assert node is not None and dict(node.states)["filled"] == "empty"


def test_what_was_cut_and_is_out_of_sight_is_nowhere_until_it_is_seen() -> None:
    """A bowl stands before the slices, or before what the knife has only glanced off."""
    domain = shipped("household")
    lettuce = at("Lettuce-1", 0.1, 0.4, 0.9, (0.14, 0.14, 0.12), True)
    knife = at("Knife-1", 0.3, -0.3, 1.0, (0.02, 0.2, 0.02), True)
    wall = Solid("Pot-1", (-0.2, 0.1, 0.9), (0.4, 0.14, 1.3), True)
    cut = Subtask.parse("slice_obj(Lettuce-1)")
    for succeeded, shown in product((True, False), (True, False)):
        eyes = GraphPerceiver(
            InstanceSegmenter(),
            GivenStateEstimator({}),
            domain,
            gate=None,
            alters=partial(altered, domain=domain),
        )
        seen = partial(observed, holding="Knife-1", hand=(0.3, -0.3, 1.0))
        first = eyes.perceive(seen([COUNTER, lettuce, knife], NEAR))
        node = first.get("Lettuce-1")
        assert node is not None and node.box_m is not None
        eyes.acted(cut, succeeded)
        before = [] if shown else [wall]
        scene = [COUNTER, lettuce, knife, *before]
        node = eyes.perceive(seen(scene, NEAR, time_s=1.0)).get("Lettuce-1")
        assert node is not None
        assert (node.box_m is None) is (succeeded and not shown)


def test_what_shows_of_a_thing_where_it_was_put_is_enough_and_elsewhere_it_is_not() -> None:
    """A deep sink of which the rim and the far wall show: too few walls around a mug in it."""
    domain = shipped("household")
    view = looking((0.22, -0.6, 1.65), (0.22, 0.3, 0.8))
    kitchen = [
        Solid("CounterTop-1", (-1.0, -0.4, 0.86), (1.0, 0.1, 0.9)),
        *hollow("Sink-1", (-0.3, 0.1, 0.7), (0.3, 0.5, 0.9)),
        Solid("Sink-1", (-0.3, 0.08, 0.89), (0.3, 0.12, 0.9)),
        Solid("Sink-1", (-0.3, 0.48, 0.89), (0.3, 0.5, 0.9)),
        Solid("Sink-1", (-0.32, 0.08, 0.89), (-0.28, 0.5, 0.9)),
        Solid("Sink-1", (0.28, 0.08, 0.89), (0.32, 0.5, 0.9)),
    ]
    cup = (0.085, 0.085, 0.1)
    carried = at("Mug-1", 0.4, -0.3, 1.1, cup, True)
    inside, beside = at("Mug-1", 0.22, 0.25, 0.71, cup, True), at("Mug-1", 0.0, 0.0, 0.9, cup, True)
    for mug, done, place in (
        (inside, True, ("inside", "Sink-1")),
        (inside, False, None),
        (beside, True, ("on_top_of", "CounterTop-1")),
    ):
        eyes = GraphPerceiver(
            InstanceSegmenter(),
            GivenStateEstimator({}),
            domain,
            gate=None,
            alters=lambda graph, subtask: [Change("Mug-1", "inside", "", "Sink-1")],
        )
        held = observed([*kitchen, carried], view, holding="Mug-1", hand=(0.4, -0.3, 1.2))
        eyes.perceive(held)
        eyes.acted(Subtask.parse("put_in(Mug-1, Sink-1)"), succeeded=done)
        for time_s in (1.0, 2.0):
            found = eyes.perceive(observed([*kitchen, mug], view, time_s=time_s))
            at_rest = [
                (r.predicate, r.object)
                for r in found.relations
                if r.subject == "Mug-1" and r.predicate in domain.containing
            ]
            assert at_rest == ([] if place is None else [place])


def test_what_was_put_into_something_that_then_fell_shut_is_in_it() -> None:
    """Nobody sees it any more; the arm knows where it let go."""
    domain = shipped("household")
    view = looking((0.0, -0.9, 1.4), (0.0, 0.3, 1.0))
    inside = (-0.25, 0.2, 0.9), (0.25, 0.5, 1.2)
    opened = [COUNTER, *hollow("Microwave-1", *inside, open_side="front")]
    fallen_shut = [COUNTER, Solid("Microwave-1", *inside)]
    plate = (0.2, 0.2, 0.02)
    for done, place in ((True, ("inside", "Microwave-1")), (False, ("on_top_of", "CounterTop-1"))):
        states = {"Microwave-1": {"open": "open"}}
        eyes = GraphPerceiver(
            InstanceSegmenter(),
            GivenStateEstimator(states),
            domain,
            gate=None,
            alters=lambda graph, subtask: [Change("Plate-1", "inside", "", "Microwave-1")],
        )
        carried = at("Plate-1", 0.1, -0.3, 1.1, plate, True)
        held = observed([*opened, carried], view, holding="Plate-1", hand=(0.1, -0.3, 1.2))
        eyes.perceive(held)
        eyes.acted(Subtask.parse("put_in(Plate-1, Microwave-1)"), succeeded=done)
        states["Microwave-1"] = {"open": "closed"}
        shut = observed(fallen_shut, view, time_s=1.0)
        hand = replace(shut.gripper, released="Plate-1", released_world_m=(0.0, 0.36, 0.93))
        for now in (replace(shut, gripper=hand), observed(fallen_shut, view, time_s=2.0)):
            graph = eyes.perceive(now)
            found = [
                (r.predicate, r.object)
                for r in graph.relations
                if r.subject == "Plate-1" and r.predicate in domain.containing
            ]
            assert found == [place]
