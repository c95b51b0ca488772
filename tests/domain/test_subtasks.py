"""What a domain says of subtasks and plans: skills, roles, words."""

from __future__ import annotations

from dataclasses import replace

import pytest

from forestall.domain.load import shipped
from forestall.domain.schema import Robot
from forestall.errors import InputError, UnknownNameError
from forestall.types.plan import Plan, Subtask

DOMAIN = shipped("household")


def test_roles_and_words() -> None:
    pick = Subtask.parse("pick_up(Mug-1)")
    assert DOMAIN.bound(pick) == {"?object": "Mug-1"}
    put = Subtask.parse("put_in(Plate-1, Microwave-1)")
    assert DOMAIN.bound(put) == {"?object": "Plate-1", "?target": "Microwave-1"}
    assert DOMAIN.words(Subtask.parse("navigate_to_obj(Mug)")) == "navigate to Mug"
    assert DOMAIN.words(Subtask.parse("slice_obj(Apple)")) == "slice Apple"
    assert DOMAIN.check(pick) is pick


@pytest.mark.parametrize(
    ("text", "error", "says"),
    [
        ("grab(Mug)", UnknownNameError, "unknown skill 'grab'"),
        ("pickup(Mug)", UnknownNameError, "did you mean pick_up"),
        ("put_in(Mug)", InputError, "takes 2 argument"),
    ],
)
def test_bad_subtasks(text: str, error: type[Exception], says: str) -> None:
    with pytest.raises(error, match=says):
        DOMAIN.check(Subtask.parse(text))
    good = Subtask.parse("pick_up(Mug)")
    with pytest.raises(InputError, match=f"step 2, .*{says}"):
        DOMAIN.check_plan(Plan((good, Subtask.parse(text))))


def test_a_robot_that_lacks_a_skill() -> None:
    domain = replace(DOMAIN, robot=Robot(skills=("navigate_to_obj", "open_obj")))
    assert domain.check(Subtask.parse("open_obj(Fridge)"))
    with pytest.raises(UnknownNameError, match="skill of the robot of household 'pick_up'"):
        domain.check(Subtask.parse("pick_up(Mug)"))


def test_a_plan_of_the_domain() -> None:
    plan = Plan.parse(["pick_up(Mug)", "put_on(Mug, CounterTop)"])
    assert DOMAIN.check_plan(plan) is plan
