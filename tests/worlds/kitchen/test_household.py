import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from small_kitchen import CONTAINING, SmallKitchen

from forestall.domain.load import shipped
from forestall.domain.truth import truth as truth_of
from forestall.errors import UnknownNameError
from forestall.types.facts import Literal, Truth
from forestall.types.graph import SceneGraph
from forestall.types.plan import Subtask
from forestall.worlds.kitchen.catalogue import shipped_catalogue
from forestall.worlds.kitchen.flat_world import FlatInstance, FlatScene, FlatWorld
from forestall.worlds.kitchen.household import Household, natural_key


def _home(*instances: FlatInstance) -> Household:
    return Household(shipped_catalogue(), FlatWorld(FlatScene(instances)), instances)


def _fact(truth: SceneGraph, text: str) -> Truth:
    return truth_of(truth, Literal.parse(text), shipped("household"))


def test_truth_has_everything_with_all_states_and_no_prepared_things() -> None:
    kitchen = SmallKitchen("Plate-1@Microwave-1 dirty=dirty", "Potato-1@Plate-1")
    truth = kitchen.env.oracle.truth()
    plate = truth.get("Plate-1")
    assert plate is not None
    assert plate.states == (
        ("broken", "intact"), ("dirty", "dirty"), ("temperature", "room")
    )  # fmt: skip
    assert truth.contents("Plate-1", CONTAINING) == ("Potato-1",)
    assert truth.contents("Microwave-1", CONTAINING) == ("Plate-1",)
    assert truth.get("PotatoSliced-1") is None
    assert truth.hidden == ()
    assert _fact(truth, "accessible(Potato-1)") is Truth.FALSE


def test_truth_says_what_is_held_and_what_blocks() -> None:
    kitchen = SmallKitchen(
        "Knife-1@CounterTop-1", "Pot-1@CounterTop-1", "Mug-1@CounterTop-1",
        blocked={"Knife-1": "Pot-1"},
    )  # fmt: skip
    kitchen.do("pick_up(Mug)")
    truth = kitchen.env.oracle.truth()
    assert truth.in_hands(("gripper",)) == ("Mug-1",)
    assert truth.parents("Mug-1", CONTAINING) == ()
    assert _fact(truth, "blocking(Pot-1, Knife-1)") is Truth.TRUE


def test_events_tell_the_history_in_facts() -> None:
    kitchen = SmallKitchen("Mug-1@CounterTop-1")
    kitchen.do("pick_up(Mug)", "put_in(Mug, Sink)", "toggle_on(Faucet)")
    events = kitchen.env.oracle.events()
    assert [e.text for e in events] == [
        "held_by(Mug-1, gripper)",
        "inside(Mug-1, Sink-1)",
        "toggled(Faucet-1)=on",
        "filled(Mug-1)=water",
    ]
    assert [e.time_s for e in events] == sorted(e.time_s for e in events)


def test_a_state_that_does_not_change_is_neither_shown_nor_recorded() -> None:
    home = _home(FlatInstance("Mug-1", "Mug"))
    assert not home.set_state("Mug-1", "dirty", "clean")
    assert not home.set_state("Mug-1", "open", "open")
    assert home.events() == ()
    assert home.set_state("Mug-1", "dirty", "dirty")
    assert [e.text for e in home.events()] == ["dirty(Mug-1)=dirty"]


def test_a_value_that_does_not_exist_is_an_error_that_names_the_valid_ones() -> None:
    home = _home(FlatInstance("Mug-1", "Mug"))
    with pytest.raises(UnknownNameError, match="known: clean, dirty"):
        home.set_state("Mug-1", "dirty", "filthy")


def test_names_come_in_natural_order() -> None:
    names = ["Cabinet-10", "Cabinet-2", "Bowl-1"]
    assert sorted(names, key=natural_key) == ["Bowl-1", "Cabinet-2", "Cabinet-10"]


def test_spoiling_is_noted_once() -> None:
    home = _home(FlatInstance("Mug-1", "Mug"))
    home.spoil("Mug-1", "first")
    home.spoil("Mug-1", "second")
    assert [e.text for e in home.events()] == ["first"]
    assert home.spoiled() == {"Mug-1"}


THINGS = [
    "Mug",
    "Plate",
    "Potato",
    "Egg",
    "Bowl",
    "Knife",
    "Fridge",
    "Microwave",
    "CounterTop",
    "Sink",
    "Faucet",
    "StoveBurner",
    "Pan",
    "EggCracked",
    "PotatoSliced",
    "Nonsense",
]


@settings(max_examples=40, deadline=None)
@given(seed=st.integers(0, 2**32 - 1))
def test_whatever_the_robot_is_told_the_truth_stays_a_possible_state(seed: int) -> None:
    """No exception, at most one thing held, one place for each thing, capacities kept."""
    rng = np.random.default_rng(seed)
    kitchen = SmallKitchen(
        "Mug-1@CounterTop-1 dirty=dirty", "Plate-1@DiningTable-1", "Potato-1@CounterTop-2",
        "Egg-1@Fridge-1", "Bowl-1@CounterTop-1 filled=wine", "Knife-1@CounterTop-2",
        "Pan-1@StoveBurner-1", "StoveBurner-1 toggled=on",
    )  # fmt: skip
    catalogue = shipped_catalogue()
    skills = shipped("household").skills
    verbs = sorted(skills)
    clock = 0.0
    for _ in range(40):
        verb = verbs[int(rng.integers(len(verbs)))]
        args = tuple(
            THINGS[int(k)] for k in rng.integers(len(THINGS), size=len(skills[verb].roles))
        )
        kitchen.env.execute(Subtask(verb, args))
        if rng.random() < 0.05:
            kitchen.env.drop_held()
        assert kitchen.env.time_s >= clock
        clock = kitchen.env.time_s
    truth = kitchen.env.oracle.truth()
    for node in truth.nodes:
        assert len(truth.parents(node.id, CONTAINING)) <= 1
        kind = catalogue.find(node.category) and catalogue[node.category].receptacle
        contents = truth.contents(node.id, CONTAINING)
        if kind and kind.capacity is not None and "PotatoSliced-1" not in contents:
            assert len(contents) <= kind.capacity
    assert sum(r.predicate == "held_by" for r in truth.relations) <= 1
    assert all(truth.parents(held, CONTAINING) == () for held in truth.in_hands(("gripper",)))
    assert {n: p for n, p in kitchen.world._parents.items() if p} == {
        n.id: truth.parents(n.id, CONTAINING)[0]
        for n in truth.nodes
        if truth.parents(n.id, CONTAINING)
    }
