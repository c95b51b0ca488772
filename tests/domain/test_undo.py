"""Which skills cannot be undone follows from the schemas alone."""

from __future__ import annotations

from dataclasses import replace

from forestall.domain.load import shipped
from forestall.domain.undo import irreversible_skills


def test_of_the_bench() -> None:
    found = irreversible_skills(shipped("bench"))
    assert found == ("glue_up", "hand_over", "place", "screw", "tighten")


def test_of_the_household() -> None:
    found = irreversible_skills(shipped("household"))
    assert {"slice_obj", "crack_obj", "pour", "toggle_on"} <= set(found)
    assert not {"navigate_to_obj", "pick_up", "open_obj", "close_obj", "toggle_off"} & set(found)


def test_what_another_skill_takes_back_can_be_undone() -> None:
    """Glue stays on for good, unless the skill that wipes also takes it off."""
    bench = shipped("bench")
    wiping = bench.skills["clean"]
    (effect,) = wiping.effects
    fact = replace(effect.facts[0], predicate="glue", value="none")
    better = replace(wiping, effects=(replace(effect, facts=(*effect.facts, fact)),))
    skills = {**bench.skills, "clean": better}
    assert "glue_up" not in irreversible_skills(replace(bench, skills=skills))
