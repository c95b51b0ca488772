"""The domain out of a PDDL file like the packages' own."""

from pathlib import Path

import pytest
from flats import FETCH, installed

from forestall.domain.model import Domain
from forestall.domain.truth import truth
from forestall.planning.validate import GraphValidator
from forestall.types.facts import Literal, Truth
from forestall.types.graph import SceneGraph
from forestall.types.plan import Plan
from forestall.types.symbolic import scene_graph
from forestall.types.task import Goal
from forestall.worlds.virtualhome.packages import Packages, read_start
from forestall.worlds.virtualhome.pddl import Kinds, as_published

HANDS: dict[str, dict[str, str]] = {"left_gripper": {}, "right_gripper": {}}


@pytest.fixture
def domain(tmp_path: Path) -> Domain:
    packages = Packages.found(installed(tmp_path, {"a": FETCH}))
    kinds = Kinds()
    kinds.see(read_start(packages.programs()[0].graphs))
    return as_published(packages.pddl, kinds)


def scene(*relations: str, opening: str = "closed") -> SceneGraph:
    return scene_graph(
        {
            "objects": {
                "character-1": {"sitting": "no", "lying": "no"},
                "fridge-3": {"opening": opening, "power": "neither", "dirt": "clean"},
                "plate-4": {"dirt": "dirty"},
                "cup-6": {"dirt": "clean"},
                **HANDS,
            },
            "relations": list(relations),
        }
    )


def test_what_changes_is_an_attribute_and_what_never_does_a_tag(domain: Domain) -> None:
    assert domain.values("opening") == ("closed", "open", "neither")
    assert domain["plate-4"].tags >= {"grabbable"}
    assert domain["fridge-3"].attributes == ("opening", "dirt")
    assert not {"closed", "grabbable", "holds_rh"} & domain.predicates.keys()
    assert domain.robot.hands == ("right_gripper", "left_gripper")


def test_two_hands(domain: Domain) -> None:
    free = Literal("hand_free", ())
    one, both = "cup-6 held_by right_gripper", "plate-4 held_by left_gripper"
    assert truth(scene(one), free, domain) is Truth.TRUE
    assert truth(scene(one, both), free, domain) is Truth.FALSE


def test_a_plan_is_checked_by_it(domain: Domain) -> None:
    check = GraphValidator(domain).check
    grab = Plan.parse(["grab(character-1, plate-4)"])
    inside, near = "plate-4 obj_inside fridge-3", "character-1 next_to plate-4"
    by = "character-1 next_to fridge-3"
    opened = Plan.parse(["open(character-1, fridge-3)", "grab(character-1, plate-4)"])
    assert not check(grab, scene(inside, near), Goal("")).ok
    assert check(grab, scene(inside, near, opening="open"), Goal("")).ok
    assert check(opened, scene(inside, near, by), Goal("")).ok
    assert not check(opened, scene(inside, near), Goal("")).ok
    full = ("cup-6 held_by right_gripper", "fridge-3 held_by left_gripper")
    assert not check(grab, scene(near, *full), Goal("")).ok


def test_a_value_that_ends_without_another_leaves_neither(domain: Domain) -> None:
    close = domain.skills["close"].effects
    assert [str(f) for e in close for f in e.facts] == [
        "opening(?obj)=closed",
        "power(?obj)=neither",
    ]
    up = domain.skills["standup"].effects
    assert {str(f) for e in up for f in e.facts} == {"sitting(?char)=no", "lying(?char)=no"}
