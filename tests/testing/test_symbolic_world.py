# mypy: disable-error-code="union-attr"
from typing import Any

import pytest

from forestall.domain.load import build_domain, shipped
from forestall.domain.model import Domain
from forestall.errors import InputError, PerceptionError
from forestall.perception.given_graph import GraphPassthrough
from forestall.seams import Environment
from forestall.tasks.execution_faults import FaultyEnvironment
from forestall.tasks.faults import Drop, FailedAction
from forestall.testing.conformance import check_environment
from forestall.testing.symbolic_scene import relation_at, start_scene
from forestall.testing.symbolic_world import SymbolicWorld
from forestall.types.episode import SkillOutcome, SkillStatus
from forestall.types.facts import Literal
from forestall.types.graph import ObjectNode, SceneGraph, Seen
from forestall.types.observation import GripperState, Observation
from forestall.types.plan import Subtask
from forestall.types.scene import ObjectNeed, SceneNeeds

HOUSEHOLD, BENCH = shipped("household"), shipped("bench")
KITCHEN_NEEDS = SceneNeeds(
    objects=(
        ObjectNeed("Mug-1", "Mug", ("CounterTop", "DiningTable")),
        ObjectNeed("Egg-1", "Egg", ("Fridge",)),
        ObjectNeed("Pan-1", "Pan", ("CounterTop",), (("dirty", "dirty"),)),
    ),
    fixtures=(("StoveBurner-2", "toggled", "on"),),
)
BENCH_NEEDS = SceneNeeds(
    "bench",
    (
        ObjectNeed("Jaws-1", "Jaws", ("Arm",)),
        ObjectNeed("Screwdriver-1", "Screwdriver", ("ToolChanger",)),
        ObjectNeed("Bolt-1", "Bolt", ("Tray", "Workbench")),
        ObjectNeed("Nut-1", "Nut", ("PartsBox",)),
    ),
)
WHERE = {"kind": "relation", "group": "where"}
# Two arms with a hand each, no containers, no ground, no history: the least that can be said.
SORTING = build_domain(
    {
        "name": "sorting",
        "tags": ["movable", "fixture", "support"],
        "roles": {"holding": "held"},
        "robot": {"hands": ["left", "right"]},
        "predicates": {
            "at": WHERE | {"parameters": ["thing", "place"], "contains": True},
            "held": WHERE | {"parameters": ["thing", "hand"]},
        },
        "categories": {
            "Parcel": {"tags": ["movable"]},
            "Shelf": {"tags": ["fixture", "support"]},
        },
        "skills": {
            "take": {
                "parameters": ["thing - movable", "hand"],
                "needs": ["not some ?x: held(?x, ?hand)"],
                "effects": ["held(?thing, ?hand)"],
                "at": "thing",
            },
            "rest": {},
        },
    }
)


def _run(world: Environment, *steps: str) -> list[SkillOutcome]:
    return [world.execute(Subtask.parse(s)) for s in steps]


@pytest.mark.parametrize(
    ("domain", "needs", "steps"),
    [
        (HOUSEHOLD, KITCHEN_NEEDS, ("pick_up(Mug)", "put_in(Mug, Sink)", "toggle_on(Faucet)")),
        (BENCH, BENCH_NEEDS, ("pick(Bolt)", "insert(Bolt, BoltHole)", "pick(Nut)")),
        (SORTING, SceneNeeds(objects=(ObjectNeed("Parcel-1", "Parcel"),)), ("take(Parcel, left)",)),
    ],
)
def test_a_symbolic_world_conforms_whatever_its_domain(
    domain: Domain, needs: SceneNeeds, steps: tuple[str, ...]
) -> None:
    plan = [Subtask.parse(s) for s in steps]
    assert check_environment(lambda: SymbolicWorld(domain, needs), 3, plan, domain) == []


def test_a_skill_takes_its_own_time_and_that_of_driving_there() -> None:
    world = SymbolicWorld(BENCH, BENCH_NEEDS)
    world.reset(1)
    first, second = _run(world, "open_lid(PartsBox)", "pick(Nut)")
    assert first.duration_s > BENCH.skill("open_lid").duration_s
    assert second.duration_s == BENCH.skill("pick").duration_s  # it stands there already
    assert world.time_s == first.duration_s + second.duration_s


def test_what_is_in_a_shut_container_is_not_in_view_but_is_remembered() -> None:
    world, perceiver = SymbolicWorld(BENCH, BENCH_NEEDS), GraphPassthrough(BENCH)
    graph = perceiver.perceive(world.scan())
    assert graph.get("Nut-1") is None
    assert graph.hidden == ("PartsBox-1",)
    assert world.truth().get("Nut-1") is not None
    _run(world, "open_lid(PartsBox)")
    assert perceiver.perceive(world.observe()).get("Nut-1").seen is Seen.VISIBLE
    _run(world, "close_lid(PartsBox)")
    graph = perceiver.perceive(world.observe())
    assert graph.get("Nut-1").seen is Seen.UNOBSERVED
    assert any(r.subject == "Nut-1" and r.object == "PartsBox-1" for r in graph.relations)
    perceiver.reset()
    assert perceiver.perceive(world.observe()).get("Nut-1") is None


def test_what_no_camera_sees_is_left_open() -> None:
    world = SymbolicWorld(HOUSEHOLD, KITCHEN_NEEDS)
    assert world.states("Mug-1")["temperature"] == "room"
    assert world.scan().graph.get("Mug-1").state("temperature") is None


def test_the_scope_of_a_subtask_keeps_what_concerns_it() -> None:
    world, perceiver = SymbolicWorld(BENCH, BENCH_NEEDS), GraphPassthrough(BENCH)
    _run(world, "pick(Bolt)")
    graph = perceiver.perceive(world.observe())
    step = Subtask.parse("hand_over(Bolt-1, Person-1, Tray-1)")
    scoped = perceiver.scope(graph, step)
    assert {n.id for n in scoped.nodes} == {"Bolt-1", "Person-1", "Tray-1", "gripper"}
    assert scoped.subtask == step
    assert scoped.in_hands(("gripper",)) == ("Bolt-1",)


def test_seeds_vary_where_things_are_and_what_lies_about() -> None:
    places, extras = set(), set()
    for seed in range(8):
        graph = start_scene(BENCH, BENCH_NEEDS, seed)
        assert graph == start_scene(BENCH, BENCH_NEEDS, seed)
        places |= {r.object for r in graph.relations if r.subject == "Bolt-1"}
        extras.add(len(graph.nodes))
    assert places == {"Tray-1", "Workbench-1"}
    assert len(extras) > 1


def test_a_further_thing_moves_nothing_else() -> None:
    more = SceneNeeds("bench", (*BENCH_NEEDS.objects, ObjectNeed("Washer-1", "Washer")))
    more = SceneNeeds(more.room, more.objects, clutter=more.clutter, undisturbed=BENCH_NEEDS)
    for seed in range(5):
        before, after = (start_scene(BENCH, n, seed) for n in (BENCH_NEEDS, more))
        kept = [r for r in after.relations if r.subject in {o.id for o in BENCH_NEEDS.objects}]
        assert set(kept) <= set(before.relations)


def test_a_relation_is_what_predicates_or_skills_say() -> None:
    assert relation_at(BENCH, "Nut-1", "Bolt-1") == "threaded_on"
    assert relation_at(BENCH, "Nut-1", "PartsBox-1") == "lying_in"
    assert relation_at(HOUSEHOLD, "Mug-1", "CounterTop-1") == "on_top_of"
    assert relation_at(HOUSEHOLD, "Mug-1", "Fridge-1") == "inside"
    with pytest.raises(InputError, match="no relation of bench says"):
        relation_at(BENCH, "Nut-1", "Nut-2")


def test_a_thing_is_not_put_where_nothing_takes_it() -> None:
    with pytest.raises(InputError, match="Cloth-1 is wanted at PartsBox"):
        start_scene(BENCH, SceneNeeds(objects=(ObjectNeed("Cloth-1", "Cloth", ("PartsBox",)),)), 0)


def test_what_is_dropped_lying_on_the_ground() -> None:
    world = SymbolicWorld(BENCH, BENCH_NEEDS)
    _run(world, "pick(Bolt)")
    assert world.drop_held() == "Bolt-1"
    assert world.drop_held() is None
    assert "lying_on(Bolt-1, Floor-1)" in {e.text for e in world.events()}


def test_what_is_dropped_where_there_is_no_ground_is_lost() -> None:
    world = SymbolicWorld(SORTING, SceneNeeds(objects=(ObjectNeed("Parcel-1", "Parcel"),)))
    world.reset(0)
    assert _run(world, "take(Parcel, left)", "rest()")[1].status is SkillStatus.SUCCEEDED
    assert world.drop_held() == "Parcel-1"
    assert world.scan().graph.get("Parcel-1") is None
    assert world.truth().get("Parcel-1").box_m is None


def test_the_faults_of_scenarios_work_on_it() -> None:
    world = SymbolicWorld(BENCH, BENCH_NEEDS)
    faults: list[Any] = [FailedAction(step="open_lid(PartsBox)"), Drop(step="pick(Bolt)")]
    faulty = FaultyEnvironment(world, faults, world, BENCH)
    faulty.reset(0)
    outcomes = _run(faulty, "open_lid(PartsBox)", "pick(Bolt)")
    assert [o.status for o in outcomes] == [SkillStatus.SUCCEEDED] * 2
    assert world.states("PartsBox-1")["lid"] == "down"
    assert faulty.scan().gripper.holding is None


def test_histories_and_what_is_made_are_events() -> None:
    world = SymbolicWorld(HOUSEHOLD, KITCHEN_NEEDS)
    world.reset(0)
    _run(world, "open_obj(Fridge)", "pick_up(Egg)", "navigate_to_obj(Pan)", "crack_obj(Egg)")
    assert {n.id for n in world.truth().nodes} >= {"EggCracked-1"}
    assert ("made", ("Egg-1", "EggCracked-1")) in {(e.kind, e.objects) for e in world.events()}
    _run(world, "pick_up(Pan)", "put_on(Pan, StoveBurner-2)")
    assert (
        Literal("spoiled", ("EggCracked-1",)) in world.history()
    )  # the pan is dirty and the burner on
    assert "spoiled" in {e.kind for e in world.events()}


def test_a_graph_may_start_a_world_and_an_observation_needs_one_or_a_frame() -> None:
    start = SceneGraph((ObjectNode("Tray-1", "Tray"), ObjectNode("Unheard-1", "Unheard")))
    world = SymbolicWorld(BENCH, start)
    world.reset(9)
    assert {n.id for n in world.truth().nodes} == {"Tray-1", "Unheard-1", "gripper"}
    hand = GripperState(None, (0.0, 0.0, 0.0))
    with pytest.raises(PerceptionError, match="at least one frame, or a scene graph"):
        Observation((), hand, 0.0)
