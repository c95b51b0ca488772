"""The world's edge: the simulator's names stay behind it, and commands mean what is at a place."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import fields, is_dataclass, replace
from typing import Any

import numpy as np
import pytest

from forestall.domain.load import shipped
from forestall.perception.given_graph import GraphPassthrough
from forestall.runtime import Runtime
from forestall.seams import Unnamed
from forestall.strategies.none import NoReplanning
from forestall.tasks.edge import WorldsEdge, bare
from forestall.tasks.faults import apply_scene_faults, wrap
from forestall.tasks.files import load_scenario, load_task
from forestall.tasks.goals import TruthGoalChecker
from forestall.tasks.truth import TrueMoment, TruthTrace
from forestall.testing.conformance import check_environment
from forestall.testing.symbolic_world import SymbolicWorld
from forestall.types.episode import SkillStatus
from forestall.types.facts import category_of
from forestall.types.observation import Frame, Intrinsics
from forestall.types.plan import Plan, Subtask
from forestall.types.scene import ObjectNeed, SceneNeeds
from forestall.worlds.kitchen.flat_world import flat_environment

DOMAIN = shipped("household")
NEEDS = SceneNeeds(
    objects=(
        ObjectNeed("Mug-71", "Mug", ("CounterTop-1",)),
        ObjectNeed("Mug-72", "Mug", ("DiningTable-1",)),
        ObjectNeed("Pot-73", "Pot", ("CounterTop-2",)),
    )
)


def _worlds(told: tuple[str, ...] = ()) -> tuple[SymbolicWorld, WorldsEdge]:
    world = SymbolicWorld(DOMAIN, NEEDS)
    edge = WorldsEdge(world, world.truth, DOMAIN, told)
    edge.reset(10_000)
    return world, edge


def _where(world: SymbolicWorld, name: str) -> tuple[float, float, float]:
    node = world.truth().get(name)
    assert node is not None and node.centroid_m is not None
    return node.centroid_m


def _do(edge: WorldsEdge, text: str, **where: Any) -> Any:
    return edge.execute_at(
        Subtask.parse(text), {n.replace("_", "-"): at for n, at in where.items()}
    )


def test_it_is_an_environment_that_is_told_where_things_are() -> None:
    _, edge = _worlds()
    assert isinstance(edge, Unnamed)
    assert not isinstance(SymbolicWorld(DOMAIN, NEEDS), Unnamed)


@pytest.mark.parametrize("burner", ["StoveBurner-1", "StoveBurner-3"])
def test_of_two_burners_the_right_one_is_meant_by_its_place(burner: str) -> None:
    world, edge = _worlds()
    place = _where(world, burner)
    assert _do(edge, "pick_up(Pot-1)", Pot_1=_where(world, "Pot-73")).status is (
        SkillStatus.SUCCEEDED
    )
    edge.observe()
    done = _do(edge, "put_on(Pot-1, StoveBurner-9)", Pot_1=(9.0, 9.0, 9.0), StoveBurner_9=place)
    assert done.status is SkillStatus.SUCCEEDED
    assert world.truth().parents("Pot-73", DOMAIN.containing) == (burner,)


def test_a_thing_that_was_moved_is_found_where_it_is_seen_now() -> None:
    world, edge = _worlds()
    assert world.rearrange("Mug-71", "Sink")
    assert _do(edge, "pick_up(Mug-1)", Mug_1=_where(world, "Mug-71")).status is (
        SkillStatus.SUCCEEDED
    )
    assert world.truth().in_hands(("gripper",)) == ("Mug-71",)


def test_a_wrong_place_is_refused_and_nothing_else_is_taken() -> None:
    world, edge = _worlds()
    old = _where(world, "Mug-71")
    assert world.rearrange("Mug-71", "Sink")
    said = _do(edge, "pick_up(Mug-1)", Mug_1=old)
    assert said.status is SkillStatus.REFUSED
    assert said.reason == "nothing like Mug-1 is there"
    assert not world.truth().in_hands(("gripper",))


def test_what_is_driven_to_and_not_there_is_refused_at_the_place() -> None:
    world, edge = _worlds()
    old = _where(world, "Mug-72")
    assert world.rearrange("Mug-72", "CounterTop-1")
    said = _do(edge, "navigate_to_obj(Mug-1)", Mug_1=old)
    assert said.status is SkillStatus.REFUSED
    x, _, _ = edge.observe().robot_position_world_m
    assert abs(x - _where(world, "DiningTable-1")[0]) < 1.0


def test_a_category_and_a_thing_whose_place_is_lost_mean_what_the_world_takes_them_for() -> None:
    for name, where in (("Mug", {}), ("Mug-5", {"Mug-5": None})):
        world, edge = _worlds()
        done = edge.execute_at(Subtask("pick_up", (name,)), where)
        assert done.status is SkillStatus.SUCCEEDED
        assert world.truth().in_hands(("gripper",)) in (("Mug-71",), ("Mug-72",))


@pytest.mark.parametrize("name", ["Mug-71", "Mug-5"])
def test_a_name_that_perception_has_not_given_means_nothing(name: str) -> None:
    _, edge = _worlds()
    assert edge.execute(Subtask("pick_up", (name,))).status is SkillStatus.REFUSED
    assert edge.approach(name) == 0.0


def test_the_hand_says_what_it_was_told_to_take_or_only_of_which_kind_it_is() -> None:
    world, edge = _worlds()
    _do(edge, "pick_up(Mug-4)", Mug_4=_where(world, "Mug-72"))
    assert edge.observe().gripper.holding == "Mug-4"
    _do(edge, "put_on(Mug-4, CounterTop)")
    assert edge.observe().gripper.released == "Mug-4"
    kitchen = flat_environment(NEEDS, DOMAIN)
    edge = WorldsEdge(kitchen, kitchen.oracle.truth, DOMAIN)
    edge.reset(10_000)
    assert kitchen.rearrange("Pot-73", "gripper")
    assert edge.observe().gripper.holding == "Pot"


def test_reasons_name_what_was_meant_and_of_the_rest_the_kind_alone() -> None:
    world, edge = _worlds()
    assert world.rearrange("Mug-71", "gripper")
    said = _do(edge, "pick_up(Pot-1)", Pot_1=_where(world, "Pot-73"))
    assert said.status is SkillStatus.REFUSED
    assert "Mug" in said.reason and "71" not in said.reason
    world, edge = _worlds()
    said = _do(edge, "put_on(Pot-1, StoveBurner)", Pot_1=_where(world, "Pot-73"))
    assert "73" not in said.reason and "Pot-1" in said.reason


def test_somebody_may_point_at_what_a_plan_names() -> None:
    world, edge = _worlds(("StoveBurner-4",))
    assert dict(edge.scan().told) == {"StoveBurner-4": _where(world, "StoveBurner-4")}
    _do(edge, "pick_up(Pot)")
    done = _do(edge, "put_on(Pot, StoveBurner-4)")
    assert done.status is SkillStatus.SUCCEEDED
    assert world.truth().parents("Pot-73", DOMAIN.containing) == ("StoveBurner-4",)


def test_pictures_tell_kinds_and_no_number_lasts_from_one_to_the_next() -> None:
    camera = Intrinsics.from_vertical_fov(4, 2, 60.0)
    ids = np.array([[2, 2, -1, 0], [2, 1, 1, 0]], dtype=np.int32)
    names = ("Mug-71", "Sink-1", "Mug-72")
    depth = np.ones((2, 4), dtype=np.float32)
    frame = Frame(np.zeros((2, 4, 3), np.uint8), depth, camera, np.eye(4), ids, names)
    shown = bare(frame)
    assert shown.instance_ids is not None
    assert shown.instance_names == ("Mug", "Mug", "Sink")
    assert shown.instance_ids.tolist() == [[0, 0, -1, 1], [0, 2, 2, 1]]
    turned = bare(Frame(frame.rgb, depth, camera, np.eye(4), ids[:, ::-1].copy(), names))
    assert turned.instance_ids is not None
    assert turned.instance_ids.tolist() == [[0, -1, 1, 1], [0, 2, 2, 1]]


def test_the_kitchen_behind_its_edge_conforms() -> None:
    def make() -> WorldsEdge:
        kitchen = flat_environment(NEEDS, DOMAIN)
        return WorldsEdge(kitchen, kitchen.oracle.truth, DOMAIN)

    plan = [Subtask.parse(t) for t in ("navigate_to_obj(Pot)", "pick_up(Pot)", "put_on(Pot, Sink)")]
    assert check_environment(make, 10_000, plan, DOMAIN) == []


# --- the whole loop ---


def _strings(value: object, passed: set[int]) -> Iterator[str]:
    """Every text in a value, at any depth."""
    if isinstance(value, str):
        yield value
    if id(value) in passed or isinstance(value, str | bytes | int | float | np.ndarray):
        return
    passed.add(id(value))
    inner: list[object] = []
    if is_dataclass(value) and not isinstance(value, type):
        inner = [getattr(value, f.name) for f in fields(value)]
    elif isinstance(value, dict):
        inner = [*value, *value.values()]
    elif isinstance(value, list | tuple | set | frozenset):
        inner = list(value)
    for one in inner:
        yield from _strings(one, passed)


class Overhearing(NoReplanning):
    """Writes down every text that a strategy gets."""

    def __init__(self) -> None:
        super().__init__()
        self.heard: set[str] = set()

    def before_subtask(self, context: Any) -> Any:
        self.heard |= set(_strings(context, set()))
        return super().before_subtask(context)

    def after_subtask(self, context: Any, outcome: Any) -> Any:
        self.heard |= set(_strings((context, outcome), set()))
        return super().after_subtask(context, outcome)

    def after_episode(self, context: Any) -> Any:
        self.heard |= set(_strings(context, set()))
        return super().after_episode(context)


def _renamed(needs: SceneNeeds, names: dict[str, str]) -> SceneNeeds:
    objects = tuple(
        replace(o, id=names[o.id], places=tuple(names.get(p, p) for p in o.places))
        for o in needs.objects
    )
    return replace(needs, objects=objects)


@pytest.mark.parametrize("task", ["boil-water", "heat-potato", "make-coffee", "make-salad"])
def test_no_name_of_the_simulator_reaches_a_strategy_and_the_task_is_done(task: str) -> None:
    loaded = load_task(task)
    sentinels = {o.id: f"{o.category}-9{k}7" for k, o in enumerate(loaded.task.scene.objects)}
    world = SymbolicWorld(loaded.domain, _renamed(loaded.task.scene, sentinels))
    told = sorted({a for s in loaded.task.plan for a in s.args if "-" in a})
    edge = WorldsEdge(world, world.truth, loaded.domain, told)
    strategy, trace = Overhearing(), TruthTrace()
    trace.attach(world, loaded.domain, edge)
    perceiver = GraphPassthrough(loaded.domain)
    record = Runtime(edge, perceiver, strategy, loaded.domain, [trace]).run(
        loaded.task, loaded.task.plan, 10_000
    )
    checked = TruthGoalChecker(loaded.domain).check(loaded.task.goal, world)
    assert checked[0], checked[2]
    assert strategy.heard
    assert not [t for t in strategy.heard for s in sentinels.values() if s in t]
    assert not [t for t in map(repr, record.executed) for s in sentinels.values() if s in t]
    assert set(trace.moments) == {TrueMoment(True, True)}
    true = {n.id for n in world.truth().nodes} | set(loaded.domain.categories)
    made = {a for s in trace.executed for a in s.args if a not in true}
    assert {category_of(a) for a in made} <= {"Lettuce", "Potato", "Tomato"}  # what was cut


def test_the_truth_of_a_plan_for_a_thing_that_is_not_there_is_that_it_cannot_be_done() -> None:
    world, edge = _worlds()
    graph = edge.scan().graph
    assert graph is not None
    there = graph.of_category("Mug")
    assert {edge.truly(Subtask("pick_up", (n.id,)), graph).args for n in there} == {
        ("Mug-71",),
        ("Mug-72",),
    }
    moved = edge.truly(Subtask("pick_up", (there[0].id,)), graph).args[0]
    assert world.rearrange(moved, "Sink")
    assert edge.truly(Subtask("pick_up", (there[0].id,)), graph).args == ("Mug-0",)


def test_a_robot_that_mistakes_a_thing_is_told_by_place_too() -> None:
    scenario = load_scenario("eyes-heat-potato-1")
    needs = apply_scene_faults(load_task("heat-potato").task.scene, scenario.faults, DOMAIN)
    world = SymbolicWorld(DOMAIN, needs)
    eyes = wrap(world, scenario.faults, world, DOMAIN)
    edge = WorldsEdge(eyes, world.truth, DOMAIN)
    edge.reset(10_000)
    graph = edge.scan().graph
    assert graph is not None
    apple = _where(world, "Apple-1")
    name = graph.nearest("Potato", apple, 0.1)
    assert name is not None
    assert edge.execute_at(Subtask("pick_up", (name,)), graph.places()).status is (
        SkillStatus.SUCCEEDED
    )
    assert world.truth().in_hands(("gripper",)) == ("Apple-1",)
    assert edge.observe().gripper.holding == name


def test_a_plan_is_read_for_the_names_that_somebody_must_point_at() -> None:
    from forestall.tasks.edge import named

    plan = Plan.parse(["pick_up(Pot)", "put_on(Pot, StoveBurner-4)"])
    assert named(plan) == ("StoveBurner-4",)
