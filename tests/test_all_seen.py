"""Strategies in development kitchens in which everything that is not shut in is seen as it is.

What is lost here is lost by judging and planning, and not by perception: the truth is handed on as
the scene graph of every look, without what is shut in and without what no camera sees.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import pytest

from forestall.assembly.configuration import Given, run_config
from forestall.assembly.make import prepare, run_episode
from forestall.domain.load import shipped
from forestall.domain.truth import is_shut
from forestall.statistics.cases import SPLITS, room
from forestall.tasks.files import load_scenario
from forestall.types.decision import Outcome
from forestall.types.episode import EpisodeRecord
from forestall.types.facts import Truth
from forestall.types.graph import SceneGraph, Seen
from forestall.types.observation import Observation
from forestall.worlds.kitchen.environment import KitchenEnvironment

DOMAIN = shipped("household")


def open_to_view(graph: SceneGraph) -> SceneGraph:
    """What a camera that misses nothing would tell."""
    shut = {
        n.id
        for n in graph.nodes
        if DOMAIN.encloses(n.category) and is_shut(DOMAIN, n.category, dict(n.states)) is Truth.TRUE
    }
    inside, pending = set[str](), shut
    while pending:
        within = {r.subject for r in graph.relations if r.object in pending}
        pending = {n for n in within if graph.parents(n, DOMAIN.containing)} - inside
        inside |= pending
    nodes = [
        replace(
            n,
            states=tuple((a, v if DOMAIN.attributes[a].camera else None) for a, v in n.states),
            seen=Seen.VISIBLE,
        )
        for n in graph.nodes
        if n.id not in inside
    ]
    relations = [r for r in graph.relations if not {r.subject, r.object} & inside]
    return SceneGraph(tuple(nodes), tuple(relations), None, tuple(shut))


@pytest.fixture(autouse=True)
def everything_seen(monkeypatch: pytest.MonkeyPatch) -> None:
    def look(self: Any, *_: Any, **__: Any) -> Observation:
        household = self._acting.household
        return Observation(
            (),
            self._gripper(),
            household.time_s,
            robot_position_world_m=self._stage.robot_position_world_m,
            graph=open_to_view(household.truth()),
        )

    monkeypatch.setattr(KitchenEnvironment, "scan", look)
    monkeypatch.setattr(KitchenEnvironment, "observe", look)


def run(scenario: str, place: int) -> EpisodeRecord:
    """A run with the plan check in one of the development rooms."""
    given = {"strategy": "plan-check", "perceiver": "given-graph", "world.profile": "kind"}
    task = load_scenario(scenario).task
    config = run_config(
        task, scenario, seed=room(SPLITS["development"], place), given=Given.named(given)
    )
    return run_episode(prepare(config), ())


def did(record: EpisodeRecord, skill: str) -> bool:
    return any(e.subtask.skill == skill for e in record.executed)


@pytest.mark.parametrize(("task", "place"), [("cook-egg", 7), ("store-egg", 3)])
def test_what_was_looked_for_and_found_is_missed_again_once_the_plan_uses_it_up(
    task: str, place: int
) -> None:
    """The egg was in the shut fridge; later the plan cracks it where it must not."""
    record = run(f"irreversible-{task}-{place + 1}-counter", place)
    assert record.success, record.failures
    assert any(b.replan is not None and b.replan.looking_for for b in record.boundaries)
    assert not any(e.kind == "spoiled" for e in record.events)


def test_going_to_look_is_no_fault_for_a_plan_that_is_wrong_anyhow() -> None:
    """Before, the same search was planned at every moment, until the robot was held."""
    record = run("irreversible-store-egg-3-cracked", 2)
    assert record.success, record.failures
    searches = [b for b in record.boundaries if b.replan is not None and b.replan.looking_for]
    assert len(searches) == 1


@pytest.mark.parametrize(
    ("scenario", "place"), [("robofail-boil-water-8", 7), ("robofail-heat-potato-8", 7)]
)
def test_where_no_fact_would_help_something_else_is_planned_for_the_goal(
    scenario: str, place: int
) -> None:
    """A burner that does not take a bowl, a microwave that does not take a pan."""
    record = run(scenario, place)
    assert record.success, record.failures


@pytest.mark.parametrize(
    ("scenario", "place"), [("irreversible-cook-egg-10-instead", 9), ("robofail-cook-egg-6", 5)]
)
def test_what_is_yet_to_be_made_is_looked_for_as_what_it_is_made_of(
    scenario: str, place: int
) -> None:
    """The plan cracks no egg; nobody has seen one, and it is in the shut fridge."""
    record = run(scenario, place)
    assert record.success, record.failures
    assert did(record, "crack_obj")


@pytest.mark.parametrize("task", ["make-coffee", "make-salad", "boil-water"])
def test_of_two_of_a_kind_the_rest_of_the_plan_means_the_one_that_was_taken(task: str) -> None:
    """Before, the rest was checked with the lowest number, and the mug in the hand was empty."""
    thing = {"make-salad": "bowl", "boil-water": "pot"}.get(task, "mug")
    record = run(f"harmless-{task}-second-{thing}", 7)
    assert record.success, record.failures
    skills = [step.skill for step in record.initial_plan]
    early = [
        b for b in record.boundaries if b.outcome is Outcome.REPLAN and b.index < len(skills) - 3
    ]
    assert not early, early[0].why
