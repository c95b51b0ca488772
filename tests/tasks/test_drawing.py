"""Sets of starts drawn from a seed: composed over any domain, judged by playing, written, read."""

from __future__ import annotations

import tomllib
from collections import Counter
from dataclasses import replace

import numpy as np
import pytest

from forestall.tasks.aftermath import superfluous
from forestall.tasks.composing import Candidate
from forestall.tasks.drawing import Drawer, moments
from forestall.tasks.faults import (
    Meanwhile,
    apply_plan_faults,
    apply_scene_faults,
    check_steps,
    parse_fault,
    wrap,
)
from forestall.tasks.files import Scenario, load_task, task_names
from forestall.tasks.judging import Label, Played, fixtures_in, label, play
from forestall.tasks.midrun_candidates import MidrunComposer
from forestall.tasks.plan_errors import RATES, ErringPlanner, divergence
from forestall.tasks.scene_candidates import SceneComposer
from forestall.tasks.scene_faults import MoveObject, SetState
from forestall.tasks.schemas import ScenarioSetFile
from forestall.tasks.writing import set_file
from forestall.testing.part import SymbolicWorlds
from forestall.testing.symbolic_scene import start_scene
from forestall.types.facts import Literal
from forestall.types.plan import Plan

WORLD = SymbolicWorlds()


def _rooms(place: int) -> list[int]:
    return [place % 10, 100 + place % 10]


def _drawer(task: str, seed: int = 0) -> Drawer:
    return Drawer(load_task(task), WORLD, _rooms, seed)


@pytest.mark.parametrize("task", task_names(None))
def test_differences_are_composed_over_every_task_of_every_domain(task: str) -> None:
    loaded = load_task(task)
    rng = np.random.default_rng(0)
    room = fixtures_in(WORLD, loaded, 0)
    scene = SceneComposer(loaded, rng, room).scene()
    midrun = MidrunComposer(loaded, rng, room).midrun(loaded.task.plan)
    assert {"missing", "second"} <= {c.kind for c in scene}
    assert {"failed-action", "in-the-hand"} <= {c.kind for c in midrun}
    for candidate in (*scene, *midrun):
        plan = apply_plan_faults(loaded.task.plan, candidate.faults, loaded.domain)
        check_steps(plan, candidate.faults, loaded.domain)
        assert candidate.task == task
        assert candidate.title[0].isupper() or "(" in candidate.title
        assert candidate.cause.endswith(".") and 0 <= candidate.since <= len(plan)


def test_what_is_put_away_is_in_something_shut_or_open() -> None:
    loaded = load_task("heat-potato")
    found = SceneComposer(loaded, np.random.default_rng(0), ["Cabinet"]).scene()
    by_kind = {c.kind: c for c in found if c.kind.startswith("put-away")}
    shut, is_open = by_kind["put-away"], by_kind["put-away-open"]
    assert [f.kind for f in shut.faults] == ["move_object"]
    assert [f.kind for f in is_open.faults] == ["move_object", "set_state"]
    assert is_open.faults[0] == MoveObject(object="Plate-1", places=("Microwave-1",))
    assert isinstance(is_open.faults[1], SetState) and is_open.faults[1].value == "open"
    tried = [Scenario("x", "heat-potato", "", "", "", c.faults) for c in (shut, is_open)]
    assert [play(WORLD, loaded, s, 1).success for s in tried] == [False, True]


@pytest.mark.parametrize("task", ["heat-potato", "cook-egg", "fasten-plate"])
def test_an_erring_planner_makes_every_kind_of_error_it_says(task: str) -> None:
    loaded = load_task(task)
    planner = ErringPlanner(loaded, np.random.default_rng(1), fixtures_in(WORLD, loaded, 0))
    found = [c for c in (planner.draw() for _ in range(150)) if c is not None]
    counts = Counter(c.kind for c in found)
    assert counts.keys() == set(RATES) or counts.keys() >= set(RATES) - {"wrong-place"}
    assert counts["missing-step"] == max(counts.values())
    for candidate in found:
        plan = apply_plan_faults(loaded.task.plan, candidate.faults, loaded.domain)
        assert plan != loaded.task.plan
        assert candidate.since == divergence(loaded.task.plan, plan)


def test_a_drawn_set_fails_or_succeeds_as_it_says_and_the_same_seed_draws_the_same() -> None:
    drawer = _drawer("boil-water")
    scene = SceneComposer(drawer.loaded, np.random.default_rng(0), drawer._fixtures).scene()
    drawer.fill("composed", scene, Label.FAILS, 4)
    drawer.fill("everyday", scene, Label.SUCCEEDS, 4)
    drawer.plans("planner", 3)
    sets = drawer.drawn.scenarios
    assert [len(sets[s]) for s in ("composed", "everyday", "planner")] == [4, 4, 3]
    for of in sets:
        for place, scenario in enumerate(sets[of]):
            plays = [play(WORLD, drawer.loaded, scenario, seed) for seed in _rooms(place)]
            assert {p.success for p in plays} == {scenario.harmless}
            assert (scenario.known is None) == scenario.harmless
    again = _drawer("boil-water")
    again.fill("composed", scene, Label.FAILS, 4)
    assert again.drawn.scenarios["composed"] == sets["composed"]
    assert len({s.kind for s in sets["composed"]}) > 2


def test_two_at_once_are_two_that_fail_each_by_itself() -> None:
    drawer = _drawer("boil-water")
    scene = SceneComposer(drawer.loaded, np.random.default_rng(0), ()).scene()
    drawer.fill("composed", scene, Label.FAILS, 3)
    pairs = list(drawer._pairs())
    failing = {repr(s.faults) for s in drawer.drawn.scenarios["composed"]}
    assert pairs
    for pair in pairs:
        cuts = range(1, len(pair.faults))
        assert any({repr(pair.faults[:k]), repr(pair.faults[k:])} <= failing for k in cuts), (
            pair.kind
        )


def test_two_at_once_are_known_by_what_shows_first() -> None:
    loaded = load_task("boil-water")
    faults = (
        parse_fault({"kind": "add_object", "category": "Potato", "places": ["Pot-1"]}),
        parse_fault({"kind": "move_object", "object": "Pot-1", "places": ["Cabinet"]}),
    )
    scenario = Scenario("x", "boil-water", "", "", "", faults)
    hidden = ("thing", "Potato-1")
    alone = play(WORLD, loaded, scenario, 1, watch=hidden)
    both = play(WORLD, loaded, scenario, 1, watch=hidden, also=((0, ()),))
    later = play(WORLD, loaded, scenario, 1, watch=hidden, also=((3, ()),))
    assert (alone.visible, both.visible, later.visible) == (len(loaded.task.plan), 0, 3)


@pytest.mark.parametrize("task", ["store-egg", "boil-water", "make-salad"])
def test_only_what_is_held_is_lost(task: str) -> None:
    loaded = load_task(task)
    drops = [
        c
        for seed in range(20)
        for c in MidrunComposer(loaded, np.random.default_rng(seed)).midrun(loaded.task.plan)
        if c.kind == "dropped"
    ]
    assert drops
    for candidate in {c.cause: c for c in drops}.values():
        step = loaded.task.plan.subtasks[candidate.since - 1]
        scenario = Scenario("x", task, "", "", "", candidate.faults)
        with WORLD.open(loaded.task.scene, loaded.domain) as opened:
            env = wrap(opened.environment, scenario.faults, opened.disturbance, loaded.domain)
            env.reset(1)
            for done in loaded.task.plan.subtasks[: candidate.since]:
                before = opened.oracle.truth().in_hands(("gripper",))
                env.execute(done)
        assert done == step and before


def test_a_thing_of_the_task_that_is_put_elsewhere_is_missed_where_it_was() -> None:
    loaded = load_task("make-salad")
    composer = MidrunComposer(loaded, np.random.default_rng(0), ["Fridge", "Cabinet"])
    for candidate in composer.midrun(loaded.task.plan):
        change = candidate.faults[-1]
        if isinstance(change, Meanwhile) and change.place is not None:
            own = change.object in {o.id for o in loaded.task.scene.objects}
            assert (candidate.watch == ()) == own


def test_a_change_that_could_not_happen_makes_no_start() -> None:
    table = {"kind": "meanwhile", "object": "Pot-1", "place": "Shelf", "step": "pick_up(Pot)"}
    faults = (parse_fault(table),)
    candidate = Candidate("boil-water", "moved", "Moved", "It is moved.", faults, 2)
    found, _ = _drawer("boil-water").judge(candidate, "midrun", 0)
    assert found is Label.IMPOSSIBLE


@pytest.mark.parametrize(
    ("outcomes", "expected"),
    [
        ([True, True], Label.SUCCEEDS),
        ([False, False], Label.FAILS),
        ([True, False], Label.MIXED),
    ],
)
def test_rooms_must_agree(outcomes: list[bool], expected: Label) -> None:
    assert label([Played(o) for o in outcomes]) is expected
    assert label([*(Played(o) for o in outcomes), Played(False, problem="no room")]) is (
        Label.IMPOSSIBLE
    )


def test_what_nobody_could_have_prevented_or_spoils_something_else_is_neither() -> None:
    assert label([Played(False, harmed=0, lost=True)]) is Label.LOST
    assert label([Played(False, harmed=2, visible=3)]) is Label.LOST
    assert label([Played(False, harmed=3, visible=3)]) is Label.FAILS
    spoiled = frozenset({Literal("spoiled", ("Tomato-1",))})
    assert label([Played(True), Played(True, history=spoiled)]) is Label.SPOILS
    loaded = load_task("water-plant")
    faults = (parse_fault({"kind": "add_object", "category": "Tomato", "places": ["Pot"]}),)
    played = play(WORLD, loaded, Scenario("x", "water-plant", "", "", "", faults), 1)
    assert played.success and played.history == spoiled
    dirty = (parse_fault({"kind": "set_state", "object": "HousePlant", "attribute": "filled",
                          "value": "wine"}),)  # fmt: skip
    assert play(WORLD, loaded, Scenario("x", "water-plant", "", "", "", dirty), 1).lost


def test_the_step_that_does_the_harm_is_the_one_that_is_named() -> None:
    loaded = load_task("store-egg")
    table = {"kind": "set_state", "object": "Bowl", "attribute": "filled", "value": "wine"}
    wine = Scenario("x", "store-egg", "", "", "", (parse_fault(table),))
    played = play(WORLD, loaded, wine, 1)
    assert played.harmed is not None and not played.lost
    assert str(loaded.task.plan.subtasks[played.harmed]) == "put_in(Egg, Bowl)"


def test_known_and_effect_are_steps_of_the_plan() -> None:
    plan = Plan.parse(["go(A)", "take(A)", "go(A)", "take(A)"])
    seen = Played(False, refused=((1, ""), (3, "")), visible=2)
    assert moments(plan, [seen]) == ("go(A) #2", "take(A) #2")
    assert moments(plan, [Played(False, visible=0), seen]) == ("go(A)", "take(A)")
    assert moments(plan, [Played(False, harmed=1, visible=4)]) == ("end", "take(A)")


def test_what_is_written_reads_as_what_was_drawn() -> None:
    drawer = _drawer("water-plant")
    scene = SceneComposer(drawer.loaded, np.random.default_rng(0), ["Cabinet", "Shelf"]).scene()
    drawer.fill("composed", scene, Label.FAILS, 5)
    drawer.plans("planner", 4)
    for scenarios in filter(None, drawer.drawn.scenarios.values()):
        read = ScenarioSetFile.model_validate(tomllib.loads(set_file("water-plant", scenarios)))
        assert [tuple(s.faults) for s in read.scenarios] == [s.faults for s in scenarios]
        for field in ("name", "title", "kind", "cause", "known", "effect", "compared"):
            assert [getattr(s, field) for s in read.scenarios] == [
                getattr(s, field) for s in scenarios
            ]


def test_what_reaches_the_goal_is_not_harmless_for_that_alone() -> None:
    assert label([Played(True, stumbled=True), Played(True)]) is Label.STUMBLES
    left = Played(True, left=frozenset({"heat_left_on"}))
    assert label([left]) is Label.LEAVES
    assert label([left], usual=left.left) is Label.SUCCEEDS
    tables: dict[str, dict[str, object]] = {
        "make-coffee": {"kind": "drop_step", "step": "toggle_off(Faucet)"},
        "heat-potato": {"kind": "drop_step", "step": "put_on(Plate, CounterTop)"},
        "warm-water": {"kind": "drop_step", "step": "pick_up(Mug)", "occurrence": 2},
    }
    found = {}
    for task, table in tables.items():
        scenario = Scenario("x", task, "", "", "", (parse_fault(table),))
        found[task] = play(WORLD, load_task(task), scenario, 1)
        assert found[task].success
    assert found["make-coffee"].left == {"water_left_running"}
    assert found["heat-potato"].refused and not found["heat-potato"].stumbled
    assert found["warm-water"].refused and found["warm-water"].stumbled


@pytest.mark.parametrize(
    ("step", "expected"),
    [
        ("put_on(Potato, Plate)", False),
        ("put_on(Plate, Potato)", False),
        ("put_on(Potato, CounterTop-1)", True),
        ("toggle_off(Sink)", False),
        ("pick_up(Potato)", False),
        ("pick_up(Ladle)", False),
        ("close_obj(Microwave)", True),
    ],
)
def test_a_step_is_superfluous_where_all_that_it_brings_about_is_so(
    step: str, expected: bool
) -> None:
    loaded = load_task("heat-potato")
    scene = replace(loaded.task.scene, clutter=(0, 0))
    needs = apply_scene_faults(scene, (MoveObject(object="Potato-1", places=("CounterTop-1",)),),
                               loaded.domain)  # fmt: skip
    graph = start_scene(loaded.domain, needs, 1)
    assert superfluous(graph, Plan.parse([step]).subtasks[0], loaded.domain) is expected


def test_a_helper_does_nothing_that_the_plan_has_still_to_prepare() -> None:
    loaded = load_task("heat-potato")
    plan = loaded.task.plan
    shut = [str(s) for s in plan].index("close_obj(Microwave)")
    for seed in range(10):
        composer = MidrunComposer(loaded, np.random.default_rng(seed), ())
        for candidate in composer.midrun(plan):
            if candidate.kind == "helped" and "toggle_on(Microwave)" in candidate.title:
                assert candidate.since > shut


def test_things_are_called_as_people_count_them() -> None:
    loaded = load_task("toast-bread")
    scene = SceneComposer(loaded, np.random.default_rng(0), ())
    assert scene.a("Bread") == "a loaf of bread" and scene.a("BreadSliced") == "a bread slice"
    titles = {c.title for c in scene.scene()}
    assert {"A second loaf of bread", "No bread", "A second knife"} <= titles
