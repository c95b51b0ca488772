"""Every skill through the real Controller, against the stand-in for its Unity side."""

from collections.abc import Iterator

import pytest
from builds import leaves_files_open, needs_package, opened

from forestall.domain.load import shipped
from forestall.types.episode import SkillStatus
from forestall.types.facts import Literal
from forestall.types.plan import Subtask
from forestall.worlds.ai2thor.link import Server
from forestall.worlds.ai2thor.skills import SKILLS
from forestall.worlds.ai2thor.world import ThorWorld

pytestmark = [needs_package, leaves_files_open]

PLAN: tuple[tuple[str, tuple[str, ...]], ...] = (
    ("navigate_to_obj(Mug)", ()),
    ("pick_up(Mug)", ("held_by(Mug-1, gripper)",)),
    ("put_in(Mug, Sink)", ("inside(Mug-1, Sink-1)", "not held_by(Mug-1, gripper)")),
    ("toggle_on(Faucet)", ("toggled(Faucet-1)=on", "filled(Mug-1)=water")),
    ("toggle_off(Faucet)", ("toggled(Faucet-1)=off",)),
    ("pick_up(Mug)", ("held_by(Mug-1, gripper)", "filled(Mug-1)=water")),
    ("pour(Mug, HousePlant)", ("filled(Mug-1)=empty", "filled(HousePlant-1)=water")),
    ("put_in(Mug, CoffeeMachine)", ("inside(Mug-1, CoffeeMachine-1)",)),
    ("toggle_on(CoffeeMachine)", ("filled(Mug-1)=coffee", "temperature(Mug-1)=hot")),
    ("open_obj(Fridge)", ("open(Fridge-1)=open",)),
    ("close_obj(Fridge)", ("open(Fridge-1)=closed",)),
    ("pick_up(Knife)", ("held_by(Knife-1, gripper)",)),
    ("slice_obj(Bread)", ("on_top_of(BreadSliced-3, CounterTop-2)",)),
    ("put_on(Knife, CounterTop)", ("not held_by(Knife-1, gripper)",)),
    ("pick_up(BreadSliced)", ("held_by(BreadSliced-1, gripper)",)),
    ("put_in(BreadSliced, Toaster)", ("inside(BreadSliced-1, Toaster-1)",)),
    ("toggle_on(Toaster)", ("cooked(BreadSliced-1)=cooked", "cooked(BreadSliced-2)=raw")),
    ("pick_up(Egg)", ("held_by(Egg-1, gripper)",)),
    ("navigate_to_obj(StoveBurner-2)", ()),
    ("crack_obj(Egg)", ("inside(EggCracked-1, Pan-1)", "cooked(EggCracked-1)=raw")),
    ("toggle_on(StoveBurner-2)", ("toggled(StoveBurner-2)=on", "cooked(EggCracked-1)=cooked")),
    ("toggle_off(StoveKnob-2)", ("toggled(StoveBurner-2)=off",)),
    ("pick_up(Pan)", ("held_by(Pan-1, gripper)", "inside(EggCracked-1, Pan-1)")),
    ("put_on(Pan, StoveBurner-1)", ("on_top_of(Pan-1, StoveBurner-1)",)),
)


@pytest.fixture(scope="module", params=list(Server), ids=lambda s: s.value)
def any_world(
    request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory
) -> Iterator[ThorWorld]:
    with opened(tmp_path_factory.mktemp("build"), request.param) as world:
        yield world


@pytest.fixture(scope="module")
def world(tmp_path_factory: pytest.TempPathFactory) -> Iterator[ThorWorld]:
    with opened(tmp_path_factory.mktemp("build")) as world:
        yield world


def _holds(world: ThorWorld, text: str) -> bool:
    fact, graph = Literal.parse(text), world.oracle.truth()
    if fact.is_state:
        return world.oracle.states(fact.args[0]).get(fact.predicate) == fact.value
    there = any((r.predicate, r.subject, r.object) == (fact.predicate, *fact.args)
                for r in graph.relations)  # fmt: skip
    return there is (fact.value == "true")


def test_every_skill_over_both_servers(any_world: ThorWorld) -> None:
    any_world.reset(0)
    assert {Subtask.parse(s).skill for s, _ in PLAN} | {"put_in"} == set(SKILLS)
    time_s = any_world.time_s
    for step, facts in PLAN:
        outcome = any_world.execute(Subtask.parse(step))
        assert outcome.status is SkillStatus.SUCCEEDED, f"{step}: {outcome.reason}"
        assert any_world.time_s - time_s == pytest.approx(outcome.duration_s)
        time_s = any_world.time_s
        assert [f for f in facts if not _holds(any_world, f)] == [], step
    assert "Bread-1" not in {n.id for n in any_world.oracle.truth().nodes}
    assert any_world.oracle.history() == frozenset()
    made = [e for e in any_world.oracle.events() if e.kind == "made"]
    assert ("Bread-1", "BreadSliced-1") in {e.objects for e in made}


REFUSED: tuple[tuple[tuple[str, ...], str, str], ...] = (
    ((), "put_on(Mug, CounterTop)", "Mug is not in the gripper, which is empty"),
    ((), "slice_obj(Bread)", "no knife is in the gripper"),
    ((), "toggle_on(Television)", "RemoteControl"),
    ((), "open_obj(Mug)", "Mug-1 cannot be opened"),
    ((), "toggle_on(Mug)", "Mug-1 cannot be turned on or off"),
    ((), "crack_obj(Potato)", "Potato-1 cannot be cracked"),
    ((), "pick_up(Tomato)", "Target object not found within the specified visibility"),
    ((), "pick_up(CounterTop)", "is not pickupable"),
    ((), "pick_up(Mug-9)", "there is no Mug-9 here"),
    ((), "fly_to(Mug)", "fly_to"),
    ((), "pick_up()", "takes 1 argument"),
    (("pick_up(Mug)",), "pick_up(Plate)", "the gripper already holds Mug-1"),
    (("pick_up(Mug)",), "put_in(Mug, Microwave)", "CLOSED"),
    (("pick_up(Mug)",), "put_in(Mug, Toaster)", "Mug cannot be placed in Toaster"),
    (("pick_up(Mug)",), "pour(Mug, HousePlant)", "Mug-1 is empty"),
    (("pick_up(Mug)",), "put_on(Mug, Mug)", "itself"),
    (("pick_up(WineBottle)",), "pour(WineBottle, Microwave)", "nothing can be poured"),
    (("pick_up(Pot)",), "put_on(Pot, StoveBurner-2)", "no room: it already has Pan-1"),
    (("pick_up(Knife)",), "slice_obj(Egg)", "Egg-1 cannot be sliced"),
    (("open_obj(Microwave)",), "toggle_on(Microwave)", "must be closed"),
    (("toggle_on(Microwave)",), "open_obj(Microwave)", "must be OFF"),
    (("crack_obj(Egg)",), "pick_up(EggCracked)", "EggCracked-1 cannot be picked up"),
)


def test_what_is_refused_has_the_action_s_own_words(world: ThorWorld) -> None:
    for before, step, reason in REFUSED:
        world.reset(0)
        for each in before:
            assert world.execute(Subtask.parse(each)).status is SkillStatus.SUCCEEDED, each
        truth = [str(r) for r in world.oracle.truth().relations]
        outcome = world.execute(Subtask.parse(step))
        assert outcome.status is SkillStatus.REFUSED, step
        assert reason in outcome.reason, f"{step}: {outcome.reason}"
        assert [str(r) for r in world.oracle.truth().relations] == truth, step


def test_a_remote_control_turns_the_television_on(world: ThorWorld) -> None:
    world.reset(0)
    for step in ("pick_up(RemoteControl)", "toggle_on(Television)"):
        assert world.execute(Subtask.parse(step)).status is SkillStatus.SUCCEEDED
    assert _holds(world, "toggled(Television-1)=on")


def test_what_is_full_keeps_what_it_has(world: ThorWorld) -> None:
    world.reset(0)
    assert world.alter("Bowl-1", "filled", "water")
    for step in ("pick_up(WineBottle)", "pour(WineBottle, Bowl)"):
        assert world.execute(Subtask.parse(step)).status is SkillStatus.SUCCEEDED
    assert _holds(world, "filled(Bowl-1)=water")
    assert _holds(world, "filled(WineBottle-1)=empty")


def test_the_sink_drains(world: ThorWorld) -> None:
    world.reset(0)
    for step in ("pick_up(WineBottle)", "pour(WineBottle, Sink)"):
        assert world.execute(Subtask.parse(step)).status is SkillStatus.SUCCEEDED
    assert _holds(world, "filled(WineBottle-1)=empty")


def test_the_domain_knows_every_skill() -> None:
    assert set(shipped("ai2thor").skills) == set(SKILLS)
