"""A domain from twelve demonstrations in a stranger's words."""

from __future__ import annotations

import pytest

from forestall.assembly.sources import demonstrations_from
from forestall.domain.load import read_domain
from forestall.domain.toml_out import domain_toml
from forestall.errors import InputError
from forestall.learning.learn import learn
from forestall.planning.execute import Refusal, apply
from forestall.planning.observed import state_of
from forestall.types.plan import Subtask
from forestall.types.symbolic import scene_graph
from stranger import TWELVE, scene

LEARNT = learn(demonstrations_from(TWELVE))
DOMAIN = LEARNT.domain


def needs(skill: str) -> set[str]:
    return {str(n.formula) for n in DOMAIN.skill(skill).needs}


def effects(skill: str) -> set[str]:
    return {str(f) for e in DOMAIN.skill(skill).effects for f in e.facts}


def test_skills_have_the_arity_that_was_shown_and_names_from_categories() -> None:
    assert {s: DOMAIN.skill(s).roles for s in DOMAIN.skills} == {
        "grasp": ("peg",),
        "insert": ("peg", "hole", "driver"),
        "unscrew": ("lid", "hole"),
    }


def test_what_always_held_is_needed() -> None:
    assert needs("insert") == {
        "held_by(?peg, gripper)",
        "lies_in_nothing(?driver)",
        "lies_in_nothing(?hole)",
        "lies_in_nothing(?peg)",
        "seated_in_nothing(?driver)",
        "seated_in_nothing(?hole)",
        "seated_in_nothing(?peg)",
        "surface(?hole)=clean",
        "vacant(?hole)",
    }
    assert "hand_empty()" in needs("grasp")
    assert "thread(?lid)=tight" in needs("unscrew")


def test_what_always_changed_is_done() -> None:
    assert effects("grasp") == {"held_by(?peg, gripper)"}
    assert effects("insert") == {"not held_by(?peg, gripper)", "seated_in(?peg, ?hole)"}
    assert effects("unscrew") == {"thread(?lid)=loose"}


def test_what_a_relation_is_for_follows_from_its_use() -> None:
    assert DOMAIN.roles.holding == "held_by"
    assert set(DOMAIN.containing) == {"lies_in", "seated_in"}
    assert DOMAIN.robot.hands == ("gripper",)
    assert DOMAIN.is_a("peg-1", DOMAIN.roles.movable)
    assert DOMAIN.is_a("hole-1", DOMAIN.roles.fixture)


def test_the_learnt_skills_run() -> None:
    state = state_of(scene_graph(scene()), DOMAIN)
    for text in ("grasp(peg-1)", "insert(peg-1, hole-1, driver-1)"):
        after = apply(state, Subtask.parse(text))
        assert not isinstance(after, Refusal), after
        state = after
    assert state.place("peg-1") is not None
    again = apply(state, Subtask.parse("insert(peg-1, hole-1, driver-1)"))
    assert isinstance(again, Refusal)
    assert again.reason == "peg-1 is not held by gripper, unlike in all 12 demonstrations"


def test_a_draft_is_written_and_read_back() -> None:
    assert read_domain(domain_toml(DOMAIN), "draft.toml") == DOMAIN


def test_it_says_what_it_cannot_do() -> None:
    assert any("may be a habit" in x for x in LEARNT.limits)
    once = learn(demonstrations_from([TWELVE[0][:2]])).limits
    assert any(x.startswith("grasp was shown only once") for x in once)
    assert any(x.startswith("what grasp does is not known") for x in once)


def test_hands_may_be_named_and_there_may_be_none() -> None:
    two = {
        "objects": {"left_gripper": {}, "right_gripper": {}, "cup-1": {}},
        "relations": ["cup-1 held_by left_gripper"],
    }
    assert learn(demonstrations_from([[("pass(cup-1)", two)]])).domain.robot.hands == (
        "left_gripper",
        "right_gripper",
    )
    none = learn(demonstrations_from([[("push(cup-1)", {"objects": ["cup-1"]})]])).domain
    assert none.robot.hands == () and none.roles.holding is None
    named = learn(demonstrations_from([[("pass(cup-1)", two)]]), hands=["left_gripper"])
    assert named.domain.robot.hands == ("left_gripper",)


def step(text: str, box: str, *relations: str) -> tuple[str, dict[str, object]]:
    objects: dict[str, object] = {
        n: {} for n in ("left_gripper", "right_gripper", "cup-1", "cup-2")
    }
    return (text, {"objects": objects | {"box-1": {"door": box}}, "relations": list(relations)})


def kitchen(hand: str) -> list[tuple[str, dict[str, object]]]:
    """A cup out of a box that is shut at first, and back into it, with one of two hands."""
    within, held = "cup-1 lies_in box-1", f"cup-1 held_by {hand}"
    return [
        step("unlock(box-1)", "locked", within),
        step("take(cup-1)", "unlocked", within),
        step("show(cup-1)", "unlocked", held),
        step("put(cup-1, box-1)", "unlocked", held),
        step("lock(box-1)", "unlocked", within),
        step("wait()", "locked", within),
    ]


TWO_HANDED = learn(
    demonstrations_from([kitchen(h) for h in ("left_gripper", "right_gripper") for _ in range(3)])
).domain


def test_which_of_two_hands_has_a_thing_makes_no_difference() -> None:
    assert TWO_HANDED.in_any_hand == "in_hand" and DOMAIN.in_any_hand is None
    needed = {str(n.formula) for n in TWO_HANDED.skill("show").needs}
    assert "in_hand(?cup)" in needed
    assert not any(n.startswith("held_by") for n in needed)
    shown = TWO_HANDED.derived["in_hand"]
    assert shown.words == "{0} is in a hand"


def test_what_shuts_a_thing_in_is_learnt_from_when_things_were_moved() -> None:
    assert "lies_in_nothing_locked" in TWO_HANDED.derived
    assert "lies_in_nothing_unlocked" not in TWO_HANDED.derived, "it was taken out then"
    assert "lies_in_nothing_locked(?cup)" in {
        str(n.formula) for n in TWO_HANDED.skill("take").needs
    }
    state = state_of(scene_graph(step("", "locked", "cup-1 lies_in box-1")[1]), TWO_HANDED)
    refused = apply(state, Subtask.parse("take(cup-1)"))
    assert isinstance(refused, Refusal)
    assert "cup-1 lies in something whose door is locked" in refused.reason


def test_what_is_seen_of_a_thing_that_no_demonstration_had_counts() -> None:
    for door, may in (("locked", False), ("unlocked", True)):
        shown = {"cup-1": {}, "chest-1": {"door": door}, "left_gripper": {}, "right_gripper": {}}
        graph = scene_graph({"objects": shown, "relations": ["cup-1 lies_in chest-1"]})
        after = apply(state_of(graph, TWO_HANDED), Subtask.parse("take(cup-1)"))
        assert isinstance(after, Refusal) is not may, (door, after)


def test_a_draft_with_two_hands_is_written_and_read_back() -> None:
    assert read_domain(domain_toml(TWO_HANDED), "draft.toml") == TWO_HANDED


def test_a_skill_with_changing_arity_is_refused_by_name() -> None:
    other = [("grasp(peg-1, tray-1)", scene())]
    with pytest.raises(InputError, match=r"grasp has not always equally many.*grasp\(peg-1\) and"):
        learn(demonstrations_from([TWELVE[0], other]))


def test_nothing_is_learnt_from_nothing() -> None:
    with pytest.raises(InputError, match="nothing to learn from"):
        learn([])
