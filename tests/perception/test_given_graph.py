"""Graphs that somebody else made: what they leave open is presumed of what the robot did."""

from __future__ import annotations

from functools import partial

from forestall.domain.load import shipped
from forestall.perception.given_graph import GraphPassthrough
from forestall.planning.altered import altered
from forestall.types.graph import ObjectNode, Relation, SceneGraph, Seen
from forestall.types.observation import GripperState, Observation
from forestall.types.plan import Subtask

DOMAIN = shipped("household")
ON = Subtask.parse("toggle_on(Microwave-1)")


def microwave(*, toggled: str = "off", **plate: str) -> SceneGraph:
    return SceneGraph(
        (
            ObjectNode("Microwave-1", "Microwave", (("open", "closed"), ("toggled", toggled))),
            ObjectNode("Potato-1", "Potato", tuple(plate.items())),
        ),
        (Relation("Potato-1", "inside", "Microwave-1"),),
    )


def shut(toggled: str) -> SceneGraph:
    states = (("open", "closed"), ("toggled", toggled))
    return SceneGraph((ObjectNode("Microwave-1", "Microwave", states),), hidden=("Microwave-1",))


def given(graph: SceneGraph) -> Observation:
    return Observation((), GripperState(None, (0.0, 0.0, 1.0)), 0.0, graph=graph)


def passthrough() -> GraphPassthrough:
    return GraphPassthrough(DOMAIN, alters=partial(altered, domain=DOMAIN))


def potato(graph: SceneGraph) -> ObjectNode:
    node = graph.get("Potato-1")
    assert node is not None
    return node


def test_a_state_that_no_graph_tells_is_presumed_to_be_what_was_done() -> None:
    eyes = passthrough()
    assert not potato(eyes.perceive(given(microwave()))).presumed
    eyes.acted(ON, True)
    after = potato(eyes.perceive(given(microwave(toggled="on"))))
    assert dict(after.presumed)["temperature"] == "hot"
    assert after.state("temperature") is None, "nobody has read it"
    eyes.reset()
    assert not potato(eyes.perceive(given(microwave()))).presumed


def test_what_the_graph_tells_is_what_it_is() -> None:
    eyes = passthrough()
    eyes.perceive(given(microwave(temperature="room")))
    eyes.acted(ON, True)
    after = potato(eyes.perceive(given(microwave(toggled="on", temperature="room"))))
    assert after.state("temperature") == "room"
    assert "temperature" not in dict(after.presumed)
    later = potato(eyes.perceive(given(microwave(toggled="on"))))
    assert "temperature" not in dict(later.presumed), "what was presumed has been told otherwise"


def test_what_failed_is_presumed_to_be_as_before() -> None:
    eyes = passthrough()
    eyes.perceive(given(microwave(temperature="room")))
    eyes.acted(ON, False)
    after = potato(eyes.perceive(given(microwave())))
    assert dict(after.presumed)["temperature"] == "room"


def test_what_is_shut_away_is_not_believed_to_be_as_it_was_last_seen() -> None:
    eyes = passthrough()
    eyes.perceive(given(microwave(temperature="room", cooked="raw")))
    eyes.acted(ON, True)
    after = potato(eyes.perceive(given(shut("on"))))
    assert after.seen is Seen.UNOBSERVED and after.state("temperature") is None
    assert dict(after.presumed)["temperature"] == "hot"
