"""A wrong perception that is shared: what is looked at bears the wrong name, and is meant by it."""

from __future__ import annotations

from typing import Any

import pytest

from forestall.domain.load import shipped
from forestall.tasks.faults import apply_scene_faults, wrap
from forestall.tasks.files import load_scenario, load_task, scenario_names
from forestall.tasks.judging import play
from forestall.testing.part import SymbolicWorlds
from forestall.testing.symbolic_world import SymbolicWorld
from forestall.types.episode import SkillStatus
from forestall.types.plan import Subtask
from forestall.worlds.kitchen.flat_world import flat_environment

DOMAIN = shipped("household")
NAME = "eyes-heat-potato-1"


def _worlds() -> tuple[Any, Any]:
    """The world behind, and the environment of the robot that takes an apple for the potato."""
    scenario = load_scenario(NAME)
    needs = apply_scene_faults(load_task("heat-potato").task.scene, scenario.faults, DOMAIN)
    world = SymbolicWorld(DOMAIN, needs)
    env = wrap(world, scenario.faults, world, DOMAIN)
    env.reset(10_000)
    return world, env


def test_the_wrong_thing_is_seen_as_another_of_the_right_kind() -> None:
    world, env = _worlds()
    graph = env.scan().graph
    assert world.truth().get("Apple-1") is not None
    assert graph.get("Apple-1") is None
    seen = graph.get("Potato-2")
    assert seen.category == "Potato"
    assert dict(seen.states).keys() <= set(DOMAIN["Potato"].attributes)
    assert graph.parents("Potato-2", DOMAIN.containing) == world.truth().parents(
        "Apple-1", DOMAIN.containing
    )


@pytest.mark.parametrize("name", ["Potato", "Potato-2"])
def test_what_is_held_by_mistake_feels_and_looks_right(name: str) -> None:
    world, env = _worlds()
    env.scan()
    assert env.execute(Subtask("pick_up", (name,))).status is SkillStatus.SUCCEEDED
    seen = env.observe()
    assert world.truth().in_hands(("gripper",)) == ("Apple-1",)
    assert seen.gripper.holding == "Potato-2"
    assert seen.graph.in_hands(("gripper",)) == ("Potato-2",)
    step = Subtask("put_on", (name, "Plate"))
    assert env.execute(step).status is SkillStatus.SUCCEEDED
    assert world.truth().parents("Apple-1", DOMAIN.containing) == ("Plate-1",)
    assert env.observe().graph.parents("Potato-2", DOMAIN.containing) == ("Plate-1",)


def test_pictures_bear_the_wrong_name_too() -> None:
    scenario = load_scenario(NAME)
    needs = apply_scene_faults(load_task("heat-potato").task.scene, scenario.faults, DOMAIN)
    kitchen = flat_environment(needs, DOMAIN)
    env = wrap(kitchen, scenario.faults, kitchen, DOMAIN)
    env.reset(10_000)
    env.approach("Apple-1")
    before = kitchen.observe().frames[-1].instance_names
    after = env.observe().frames[-1].instance_names
    assert "Apple-1" in before and "Potato-2" not in before
    assert after == tuple("Potato-2" if n == "Apple-1" else n for n in before)


def test_the_seven_of_robofail_differ_from_them_in_what_is_shared_alone() -> None:
    names = scenario_names("eyes")
    assert len(names) == 7
    theirs = {s.source: s for s in map(load_scenario, scenario_names("robofail"))}
    for name in names:
        mine = load_scenario(name)
        other = theirs[mine.source]
        assert (mine.known, mine.effect, mine.kind) == ("end", other.effect, "wrong_perception")
        plain = [f.model_dump(exclude={"shared"}) for f in mine.faults]
        assert plain == [f.model_dump(exclude={"shared"}) for f in other.faults]
        assert [getattr(f, "shared", None) for f in mine.faults] == [None, True]
        assert not play(SymbolicWorlds(), load_task(mine.task), mine, 3).success
