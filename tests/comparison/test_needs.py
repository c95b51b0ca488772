"""Needs counted over arguments, tasks and kinds of things, and told from habit by variation."""

from __future__ import annotations

from collections.abc import Sequence

import pytest
from adding import medians
from graph_pairs import scene
from hypothesis import given
from hypothesis import strategies as st

from forestall.assembly.sources import demonstrations_from
from forestall.comparison.needs import Needs
from forestall.comparison.preconditions import needed
from forestall.comparison.tally import VARIED, Tally, weight
from forestall.comparison.unasked import not_judged, unasked
from forestall.domain.load import shipped
from forestall.learning.learn import learn
from forestall.types.demonstration import Demonstration, DemonstrationStep
from forestall.types.plan import Subtask
from forestall.types.verdict import Precondition, Specificity

DOMAIN = shipped("household")
Step = tuple[str, str, str]
"""Objects, relations, subtask."""


def run(task: str, name: str, *steps: Step) -> Demonstration:
    graphs = [scene(*s) for s in steps]
    return Demonstration(
        task,
        "room",
        1,
        tuple(
            DemonstrationStep(i, Subtask.parse(s[2]), g, g)
            for i, (s, g) in enumerate(zip(steps, graphs, strict=True))
        ),
        id=name,
    )


def pick(thing: str, states: str = "", relations: str = "", category: str = "") -> Step:
    name = f"{category or thing}-1"
    return (f"gripper; {name} {states}; Pot-1; Sink-1", relations, f"pick_up({name})")


def mined(
    runs: Sequence[Demonstration], subtask: str, task: str | None = "now"
) -> dict[str, Precondition]:
    found = needed(Needs.of(runs, DOMAIN), Subtask.parse(subtask), task, None)
    return {str(p.literal): p for p in found}


def test_weights_are_the_documented_ones() -> None:
    assert weight(1, 1) == pytest.approx(2 / 3), "the rule of succession"
    assert weight(4, 4) == pytest.approx(5 / 6)
    assert weight(0, 0) == pytest.approx(1 / 2)
    never_varied, varied = weight(4, 4, (4, 0)), weight(4, 4, (4, 4))
    assert never_varied == pytest.approx(1 / (1 + (5 / 9 + 1 / 5) / 2))
    assert never_varied < weight(4, 4) < varied < weight(4, 4, (0, 4)) < weight(9, 9, (0, 9))
    assert weight(3, 4) < 0.5, "what was false once of four times is no need"
    assert weight(25, 28, (30, 29)) < 0.2, "a strong habit, whatever is so at other times"
    assert weight(39, 40, (20, 20)) > 0.9, "one exception of forty may be a mistake of the eyes"
    assert weight(39, 40, (20, 20), exception=0) == 0, "nobody can have seen wrong"


@given(st.integers(1, 10**6), st.integers(0, 10**6))
def test_what_never_varied_stays_below_a_bound_however_often_it_was_seen(n: int, more: int) -> None:
    assert weight(n, n, (n + more, 0)) < VARIED


def test_a_tally_counts_runs_and_takes_back() -> None:
    tally = Tally()
    for values in ({"a"}, {"a", "b"}, set[str]()):
        tally.add(values)
    assert (tally.runs, tally.seen, tally.always("a"), tally.ever("a")) == (3, 2, 1, (2, 1))
    assert tally.ever("b") == (1, 2)
    tally.add({"a", "b"}, -1)
    assert (tally.seen, tally.ever("a"), tally.ever("b")) == (1, (1, 0), (0, 1))


def test_support_is_told_at_each_level_with_the_one_that_it_was_kept_at() -> None:
    runs = [run("now", "a", pick("Mug")), run("other", "b", pick("Mug"))]
    runs += [run("third", f"c{i}", pick("Cup")) for i in range(3)]
    found = mined(runs, "pick_up(Mug-1)")["unblocked(?object)"]
    assert [(s.level, s.true, s.seen) for s in found.levels] == [
        (Specificity.TASK, 1, 1),
        (Specificity.CATEGORY, 2, 2),
        (Specificity.PART, 5, 5),
    ]
    assert (found.kept, found.support, found.total) == (Specificity.PART, 5, 5)


def test_a_demonstration_is_counted_once_on_however_many_kinds_a_skill_was_used_in_it() -> None:
    both = [run("now", f"d{i}", pick("Mug"), pick("Cup")) for i in range(4)]
    found = mined(both, "pick_up(Mug-1)")["unblocked(?object)"]
    assert (found.kept, found.support, found.total) == (Specificity.PART, 4, 4)
    assert [(s.true, s.seen) for s in found.levels] == [(4, 4)] * 3
    assert found.weight == pytest.approx(weight(8, 8)), "each kind of thing is evidence of its own"


def test_what_held_for_one_kind_and_not_for_another_did_not_hold_in_that_demonstration() -> None:
    blocked = pick("Cup", relations="Pot-1 blocking Cup-1")
    runs = [run("now", f"d{i}", pick("Mug"), pick("Cup")) for i in range(59)]
    counts = Needs.of([*runs, run("now", "odd", pick("Mug"), blocked)], DOMAIN)
    slot, kinds = ("unblocked", ("?object",)), (("Mug",), ("Cup",))
    family = DOMAIN.family(Subtask.parse("pick_up(Mug-1)"))
    assert counts.in_demonstrations(family, slot, kinds, "true") == (59, 60, 60)
    assert counts.in_demonstrations(family, slot, kinds, "false") == (0, 60, 60)
    assert counts.in_demonstrations(family, slot, kinds[:1], "true") == (60, 60, 60)


def test_a_task_without_demonstrations_is_judged_by_those_of_others() -> None:
    runs = [run("other", f"b{i}", pick("Mug")) for i in range(3)]
    for task in ("new", None):
        assert mined(runs, "pick_up(Mug-1)", task)["unblocked(?object)"].support == 3
        assert mined(runs, "pick_up(Cup-1)", task)["unblocked(?object)"].kept is Specificity.PART


def test_the_narrower_level_has_the_last_word() -> None:
    blocked = pick("Mug", relations="Pot-1 blocking Mug-1")
    runs = [run("other", f"b{i}", pick("Cup")) for i in range(20)] + [run("now", "a", blocked)]
    assert "unblocked(?object)" in mined(runs, "pick_up(Cup-1)")
    assert "unblocked(?object)" not in mined(runs, "pick_up(Mug-1)")


def test_what_the_task_makes_of_a_thing_stays_there_unless_it_varied_elsewhere() -> None:
    washed = (pick("Mug", "dirty=clean"), ("gripper; Mug-1 dirty=dirty; Sink-1", "", "wait()"))
    plain = [run(t, t, pick("Mug", "dirty=clean")) for t in ("a", "b")]
    assert "dirty(?object)=clean" not in mined(plain, "pick_up(Mug-1)", "new")
    assert "dirty(?object)=clean" in mined(plain, "pick_up(Mug-1)", "a")
    drive = ("gripper; Mug-1 dirty=dirty; Sink-1", "", "navigate_to_obj(Mug-1)")
    varied = [run(t, f"{t}{i}", drive, washed[0]) for t in ("a", "b") for i in range(2)]
    found = mined(varied, "pick_up(Mug-1)", "new")["dirty(?object)=clean"]
    assert found.elsewhere == (0, 4) and found.weight == pytest.approx(weight(4, 4, (0, 4)))
    assert found.kept is Specificity.CATEGORY


def test_what_another_task_asks_is_told_where_the_one_at_hand_was_not_shown() -> None:
    clean = [run(t, f"{t}{i}", pick("Mug", "dirty=clean")) for t in ("a", "b") for i in range(2)]
    soiled = [run("c", f"c{i}", pick("Mug", "dirty=dirty")) for i in range(2)]
    step = Subtask.parse("pick_up(Mug-1)")
    same, mixed = Needs.of(clean, DOMAIN), Needs.of([*clean, *soiled], DOMAIN)

    def tasks(memory: Needs, task: str) -> dict[str, tuple[str, ...]]:
        return {str(u.precondition.literal): u.tasks for u in unasked(memory, step, task)}

    a_and_b, alone = {"dirty(?object)=clean": ("a", "b")}, {"dirty(?object)=dirty": ("c",)}
    assert tasks(same, "") == tasks(same, "new") == a_and_b
    assert tasks(mixed, "") == a_and_b | alone
    assert tasks(mixed, "new") == tasks(same, "a") == {}
    assert unasked(same, Subtask.parse("pick_up(Cup-1)"), "") == ()
    for scene_of, said in (("dirty=dirty", True), ("dirty=clean", False), ("dirty=?", False)):
        graph = scene(*pick("Mug", scene_of))
        text = not_judged(unasked(same, step, "new"), graph, step, "new", same)
        assert text.endswith("in the task new: dirty(Mug-1)=clean, as in a and b") is said
        assert bool(text) is said


def test_what_never_varied_weighs_less_than_what_varied_at_other_times() -> None:
    steps = (
        ("gripper; Mug-1 dirty=clean filled=water; Sink-1", "", "navigate_to_obj(Mug-1)"),
        pick("Mug", "dirty=clean filled=empty"),
    )
    found = mined([run("now", f"d{i}", *steps) for i in range(4)], "pick_up(Mug-1)")
    habit, need = found["dirty(?object)=clean"], found["filled(?object)=empty"]
    assert (habit.elsewhere, need.elsewhere) == ((4, 0), (0, 4))
    assert (habit.support, need.support) == (4, 4)
    assert habit.weight == pytest.approx(weight(4, 4, (4, 0))) and need.weight > 0.9


def test_unobserved_counts_on_neither_side() -> None:
    steps = (
        ("gripper; Mug-1 dirty=?; Sink-1", "", "navigate_to_obj(Mug-1)"),
        pick("Mug", "dirty=clean"),
    )
    runs = [run("now", f"d{i}", *steps) for i in range(3)]
    found = mined([*runs, run("now", "e", pick("Mug", "dirty=?"))], "pick_up(Mug-1)")
    kept = found["dirty(?object)=clean"]
    assert (kept.support, kept.total, kept.elsewhere) == (3, 4, (0, 0))


def test_what_a_skill_always_changed_is_known() -> None:
    closed = ("gripper; Fridge-1 open=closed", "", "open_obj(Fridge-1)")
    opened = ("gripper; Fridge-1 open=open", "", "close_obj(Fridge-1)")
    counts = Needs.of([run("now", "a", closed, opened)], DOMAIN)
    assert "open(Fridge-2)=open" in map(
        str, counts.brings_about(Subtask.parse("open_obj(Fridge-2)"))
    )
    assert not counts.brings_about(Subtask.parse("close_obj(Fridge-2)"))


def test_counting_one_after_another_and_all_at_once_are_the_same() -> None:
    runs = [run("now", "a", pick("Mug")), run("b", "b", pick("Cup", "dirty=dirty"))]
    one = Needs(DOMAIN)
    for r in runs:
        one.learn(r)
    for subtask in ("pick_up(Mug-1)", "pick_up(Cup-1)"):
        parsed = Subtask.parse(subtask)
        assert needed(one, parsed, "now", 0) == needed(Needs.of(runs, DOMAIN), parsed, "now", 0)


def test_one_more_costs_the_same_in_a_large_memory() -> None:
    small, large = medians((20, 400), repeats=15)
    assert large <= 2 * small


def test_what_another_fact_says_already_is_no_need_of_its_own() -> None:
    objects: dict[str, object] = {n: {} for n in ("gripper", "robot-1", "lamp-1")}
    far: dict[str, object] = {"objects": objects, "relations": []}
    near = {"objects": objects, "relations": ["robot-1 next_to lamp-1"]}
    shown = demonstrations_from(
        [[("walk(robot-1, lamp-1)", far), ("push(robot-1, lamp-1)", near)] for _ in range(6)]
    )
    domain = learn(shown).domain
    found = needed(Needs.of(shown, domain), Subtask.parse("push(robot-1, lamp-1)"), None, None)
    said = {str(p.literal) for p in found}
    assert "next_to(?robot, ?lamp)" in said
    assert "not next_to_nothing(?robot)" not in said
    assert "next_to_nothing(?lamp)" in said, "nothing else says it"
    walked = needed(Needs.of(shown, domain), Subtask.parse("walk(robot-1, lamp-1)"), None, None)
    assert "next_to_nothing(?robot)" in {str(p.literal) for p in walked}, "it is there to be said"
