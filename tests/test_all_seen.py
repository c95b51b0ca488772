"""What judging and planning lost where everything is seen as it is (`all_seen.py`)."""

from __future__ import annotations

import pytest

from all_seen import run
from forestall.types.decision import Outcome


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
    ("scenario", "place", "needs"),
    [
        ("robofail-boil-water-8", 7, "put_in"),  # a burner that does not take a bowl
        ("robofail-heat-potato-8", 7, "put_in"),  # a microwave that does not take a pan
        ("irreversible-cook-egg-10-instead", 9, "crack_obj"),  # no egg was seen, none is cracked
        ("robofail-cook-egg-6", 5, "crack_obj"),
    ],
)
def test_what_a_wrong_plan_leaves_out_is_planned_for_the_goal(
    scenario: str, place: int, needs: str
) -> None:
    """No fact would help the plan, or what it needs has yet to be made of what nobody has seen."""
    record = run(scenario, place)
    assert record.success, record.failures
    assert any(e.subtask.skill == needs for e in record.executed)


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


def test_a_door_that_stayed_shut_unseen_is_tried_again() -> None:
    """With two drives about it the scene had not changed over three subtasks: held."""
    record = run("robofail-cook-egg-4", 3)
    assert record.success, record.failures
