"""What a skill may have changed is not known until it is read again."""

from __future__ import annotations

from collections.abc import Iterable

from forestall.domain.load import shipped
from forestall.perception.given import GivenStateEstimator
from forestall.perception.perceiver import GraphPerceiver
from forestall.perception.segmenters import InstanceSegmenter
from forestall.types.facts import Change
from forestall.types.graph import ObjectNode, SceneGraph
from forestall.types.plan import Subtask

from .synthetic import Solid, at, looking, observed

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
