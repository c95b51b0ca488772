from __future__ import annotations

import numpy as np

from forestall.domain.load import shipped
from forestall.embeddings.captions import ListingCaptioner
from forestall.embeddings.views import sentences
from forestall.seams import Captioner
from forestall.types.facts import GRIPPER
from forestall.types.graph import ObjectNode, Relation, SceneGraph, Seen
from forestall.types.observation import Frame, GripperState, Intrinsics, Observation

OBSERVATION = Observation(
    (
        Frame(
            np.zeros((2, 2, 3), np.uint8),
            np.zeros((2, 2), np.float32),
            Intrinsics.from_vertical_fov(2, 2, 60.0),
            np.eye(4),
        ),
    ),
    GripperState(None, (0.0, 0.0, 0.0)),
    0.0,
)


def caption(*nodes: ObjectNode, links: tuple[Relation, ...] = ()) -> str:
    captioner: Captioner = ListingCaptioner(shipped("household"))
    hand = ObjectNode(GRIPPER, GRIPPER)
    return captioner.caption(OBSERVATION, SceneGraph((hand, *nodes), links))


MICROWAVE = ObjectNode("Microwave-1", "Microwave", (("open", "open"), ("toggled", None)))
MUG = ObjectNode("Mug-2", "Mug", (("dirty", "clean"), ("filled", "coffee")))


def test_things_and_their_states_in_alphabetical_order() -> None:
    assert caption(MUG, MICROWAVE) == "A clean mug. A mug filled with coffee. An open microwave."
    assert caption() == ""


def test_two_of_a_kind_are_said_twice() -> None:
    plates = [ObjectNode(f"Plate-{i}", "Plate", (("dirty", "dirty"),)) for i in (1, 2)]
    assert caption(*plates) == "A dirty plate. A dirty plate."


def test_relations_and_names_are_not_said() -> None:
    links = (Relation("Mug-2", "inside", "Microwave-1"), Relation("Mug-2", "held_by", GRIPPER))
    assert caption(MUG, MICROWAVE, links=links) == caption(MUG, MICROWAVE)
    assert "-2" not in caption(MUG)


def test_what_is_out_of_view_is_not_said() -> None:
    away = [
        ObjectNode("Pan-1", "Pan", (("dirty", "dirty"),), seen=seen)
        for seen in (Seen.REMEMBERED, Seen.UNOBSERVED)
    ]
    for node in away:
        assert caption(MICROWAVE, node) == "An open microwave."


def test_a_thing_without_a_visible_state_is_named() -> None:
    bare = ObjectNode("StoveBurner-3", "StoveBurner", (("toggled", None),))
    assert caption(bare) == "A stove burner."
    unseen = [a.name for a in shipped("household").attributes.values() if not a.camera]
    warm = ObjectNode(
        "Mug-1", "Mug", tuple((a, shipped("household").values(a)[-1]) for a in unseen)
    )
    assert caption(warm) == "A mug."
    assert caption(ObjectNode("Umbrella-1", "Umbrella")) == "An Umbrella."


def test_sentences_of_a_caption() -> None:
    assert sentences(caption(MUG)) == ("A clean mug", "A mug filled with coffee")
    assert sentences("") == sentences(" . - .") == ()
    assert sentences("a kitchen with a sink") == ("a kitchen with a sink",)
