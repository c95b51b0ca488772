"""A skill is added to a domain as one table in one file, and nothing else."""

from importlib.resources import files

import pytest

from forestall.domain.load import load_domain
from forestall.domain.model import Domain
from forestall.planning.observed import state_of
from forestall.planning.planner import plan_goal
from forestall.testing.symbolic_world import SymbolicWorld
from forestall.types.episode import SkillStatus
from forestall.types.facts import Literal
from forestall.types.plan import Subtask
from forestall.types.scene import ObjectNeed, SceneNeeds
from forestall.types.task import Goal
from forestall.types.verdict import ReplanOutcome

WIPE = """
[skills.wipe]
parameters = ["object - has_dirty"]
words = "wipe"
needs = [
  { fact = "some ?s - Sponge: held_by(?s, gripper)", else = "no sponge is in the gripper", lacks = ["held_by(Sponge, gripper)"] },
  { fact = "located(?object)", else = "{object} is lost: its place is not known", lacks = ["located(?object)"] },
  { fact = "accessible(?object)", else = "{object} is inside {?c}, which is closed", lacks = ["open(?c)=open"], find = "some ?c: confined(?object, ?c)" },
]
effects = ["dirty(?object)=clean"]
at = "object"

[categories.Sponge]
words = "sponge"
tags = ["pickupable"]
"""  # noqa: E501


@pytest.fixture(scope="module")
def household(tmp_path_factory: pytest.TempPathFactory) -> Domain:
    text = files("forestall").joinpath("domains", "household", "domain.toml").read_text("utf-8")
    file = tmp_path_factory.mktemp("domain") / "household.toml"
    file.write_text(text + WIPE, encoding="utf-8")
    return load_domain(str(file))


@pytest.fixture
def world(household: Domain) -> SymbolicWorld:
    needs = SceneNeeds(
        objects=(
            ObjectNeed("Plate-1", "Plate", ("CounterTop",), (("dirty", "dirty"),)),
            ObjectNeed("Sponge-1", "Sponge", ("CounterTop",)),
        )
    )
    return SymbolicWorld(household, needs)


def test_wiping_is_planned(household: Domain, world: SymbolicWorld) -> None:
    state = state_of(world.truth(), household)
    goal = Goal("the plate is clean", literals=(Literal.parse("dirty(Plate-1)=clean"),))
    planned = plan_goal(state, goal)
    assert planned.outcome is ReplanOutcome.SOLVED
    assert "wipe(Plate-1)" in map(str, planned.subtasks)
    outcomes = [world.execute(s) for s in planned.subtasks]
    assert {o.status for o in outcomes} == {SkillStatus.SUCCEEDED}, outcomes
    assert world.states("Plate-1")["dirty"] == "clean"


def test_wiping_is_executed(world: SymbolicWorld) -> None:
    wipe, pick = Subtask.parse("wipe(Plate)"), Subtask.parse("pick_up(Sponge)")
    refused = world.execute(wipe)
    assert refused.status is SkillStatus.REFUSED
    assert refused.reason == "no sponge is in the gripper"
    assert world.execute(Subtask.parse("wipe(Sponge)")).reason == "Sponge-1 is no has_dirty"
    assert [world.execute(s).status for s in (pick, wipe)] == [SkillStatus.SUCCEEDED] * 2
    assert world.states("Plate-1")["dirty"] == "clean"
    assert world.events()[-1].text == "dirty(Plate-1)=clean"
