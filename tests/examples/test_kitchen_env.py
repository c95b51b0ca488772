"""The household as a Gymnasium environment: conforms, repeats, and its tasks can be done."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env

import kitchen_env
from forestall import Subtask

KITCHEN = "forestall/Kitchen-v0"


def action(env: kitchen_env.Kitchen, step: Subtask) -> Any:
    """The numbers of a subtask."""
    skill = [s.name for s in env.skills].index(step.skill)
    first, second = [env.things.index(a) for a in (*step.args, *step.args)][:2]
    return np.array([skill, first, second])


def played(env: Any, seed: int) -> list[tuple[Any, ...]]:
    """The nominal plan from one seed."""
    inner = env.unwrapped
    seen: list[tuple[Any, ...]] = [(env.reset(seed=seed)[0].tolist(),)]
    for step in inner.opened.plan.subtasks:
        observation, reward, over, cut, info = env.step(action(inner, step))
        seen.append((observation.tolist(), reward, over, cut, info))
    return seen


@pytest.mark.parametrize("task", ["heat-potato", "make-coffee"])
def test_it_conforms_to_gymnasium(task: str) -> None:
    env = gymnasium.make(KITCHEN, task=task)
    check_env(env.unwrapped, skip_render_check=True)
    env.close()


@pytest.mark.simulator
def test_the_kitchen_with_bodies_conforms_too() -> None:
    env = gymnasium.make(KITCHEN, world="kitchen", scenario="microwave-occupied")
    check_env(env.unwrapped, skip_render_check=True)
    env.close()


def test_a_plan_reaches_the_goal_and_repeats_from_its_seed() -> None:
    first, second = gymnasium.make(KITCHEN), gymnasium.make(KITCHEN)
    run = played(first, 3)
    assert run == played(second, 3) == played(first, 3)
    assert run != played(first, 4)
    assert [r[1] for r in run[1:]] == [0.0] * (len(run) - 2) + [1.0]
    assert [r[2] for r in run[1:]] == [False] * (len(run) - 2) + [True]
    assert all(r[4]["refused"] == "" for r in run[1:])


def test_observations_say_where_things_are_and_how() -> None:
    env = kitchen_env.Kitchen()
    env.reset(seed=1)
    potato, microwave = env.things.index("Potato"), env.things.index("Microwave")
    door = len(env.things) + env.states.index((microwave, "open"))
    held = env.step(action(env, Subtask("pick_up", ("Potato",))))[0]
    shut, opened = held, env.step(action(env, Subtask("open_obj", ("Microwave",))))[0]
    assert held[potato] == 2 and shut[door] != opened[door]
    within = env.step(action(env, Subtask("put_in", ("Potato", "Microwave"))))[0]
    assert within[potato] == 3 + microwave
    assert within in env.observation_space and env.action_space.contains(np.array([0, 0, 0]))


def test_a_refused_action_changes_nothing_and_says_why() -> None:
    env = kitchen_env.Kitchen()
    before, _ = env.reset(seed=1)
    after, reward, over, cut, info = env.step(action(env, Subtask("toggle_on", ("Plate",))))
    assert after.tolist() == before.tolist() and (reward, over, cut) == (0.0, False, False)
    assert info["refused"] and info["unmet"]


def test_a_scenario_changes_the_scene_and_the_plan_no_longer_works() -> None:
    env = gymnasium.make(KITCHEN, scenario="microwave-occupied")
    run = played(env, 3)
    assert run[-1][1] == 0.0 and any(r[4]["refused"] for r in run[1:])


def test_what_is_spoilt_for_good_ends_an_episode() -> None:
    env = gymnasium.make(KITCHEN, task="cook-egg", scenario="pan-dirty")
    env.reset(seed=2)
    inner: Any = env.unwrapped
    for step in inner.opened.plan.subtasks:
        *_, reward, over, _, _ = env.step(action(inner, step))
        if over:
            break
    assert over and reward == 0.0 and inner.opened.spoilt()
    inner.opened.environment.reset(2)
    assert inner.opened.spoilt() == ()


def test_a_world_that_cannot_be_opened_is_named() -> None:
    with pytest.raises(Exception, match="heat-potato"):
        kitchen_env.Kitchen(task="heat-potatoe")
    with pytest.raises(Exception, match="symbolic"):
        kitchen_env.Kitchen(world="symbolc")


@pytest.mark.parametrize("example", sorted(Path(kitchen_env.__file__).parent.glob("*.py")))
def test_an_example_fits_on_a_screen(example: Path) -> None:
    assert len(example.read_text("utf-8").splitlines()) <= 60
