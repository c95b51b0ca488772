"""The planner's picture of the household and the truth say the same, step by step."""

import numpy as np
import pytest
from small_kitchen import CONTAINING, SmallKitchen

from forestall.domain.load import shipped
from forestall.planning.execute import Refusal, apply
from forestall.planning.observed import state_of
from forestall.planning.state import State
from forestall.types.episode import SkillStatus
from forestall.types.facts import GRIPPER
from forestall.types.plan import Subtask

SKILLS = shipped("household").skills
CHOICES = [
    ["Mug-1@CounterTop-1", "Mug-1@CoffeeMachine-1 dirty=dirty", "Mug-1@Sink-1 filled=coffee"],
    ["Plate-1@DiningTable-1 dirty=dirty", "Plate-1@Microwave-1", "Plate-1@CounterTop-1"],
    ["Potato-1@CounterTop-2", "Potato-1@Pan-1", "Potato-1@Plate-1"],
    ["Egg-1@Fridge-1", "Egg-1@Bowl-1", "Egg-1@CounterTop-1"],
    ["Bowl-1@CounterTop-1 filled=wine", "Bowl-1@Sink-1", "Bowl-1@Fridge-1"],
    ["Pan-1@StoveBurner-1", "Pan-1@CounterTop-1 dirty=dirty"],
    ["Knife-1@CounterTop-2"],
    ["Laptop-1@DiningTable-1", "RemoteControl-1@CounterTop-1"],
    ["StoveBurner-1 toggled=on", "StoveBurner-2 toggled=on"],
    ["Faucet-1 toggled=on", "Microwave-1 open=open", "Fridge-1 open=open"],
]


def _truth(kitchen: SmallKitchen) -> dict[object, object]:
    truth = kitchen.env.oracle.truth()
    facts: dict[object, object] = {(n.id, a): v for n in truth.nodes for a, v in n.states}
    facts |= {
        (n.id, "parent"): truth.parents(n.id, CONTAINING) for n in truth.nodes if n.id != GRIPPER
    }
    return facts | {"held": truth.in_hands(("gripper",)), "spoiled": kitchen.spoiled}


def _belief(state: State) -> dict[object, object]:
    facts: dict[object, object] = dict(state.values)
    for name in state.kinds:
        place = state.place(name)
        facts[name, "parent"] = () if place is None else (place.parent,)
    return facts | {
        "held": tuple(filter(None, [state.held])),
        "spoiled": {f[1] for f in state.facts if f[0] == "spoiled"},
    }


def _random_subtask(rng: np.random.Generator, names: list[str], held: str | None) -> Subtask:
    verb = sorted(SKILLS)[int(rng.integers(len(SKILLS)))]
    args = [names[int(i)] for i in rng.integers(len(names), size=len(SKILLS[verb].roles))]
    if held is not None and len(args) == 2 and rng.random() < 0.8:
        args[0] = held
    if verb == "crack_obj" and "Egg-1" in names:
        args = ["Egg-1"]
    if verb == "slice_obj" and "Potato-1" in names:
        args = ["Potato-1"]
    return Subtask(verb, tuple(args))


@pytest.mark.parametrize("seed", range(60))
def test_planning_predicts_what_the_household_does(seed: int) -> None:
    rng = np.random.default_rng(seed)
    chosen = [str(options[int(rng.integers(len(options)))]) for options in CHOICES]
    kitchen = SmallKitchen(*chosen, cool_down_s=1e9)
    state = state_of(kitchen.env.oracle.truth(), shipped("household"))
    for spoiled in kitchen.spoiled:
        state.add(("spoiled", spoiled))
    for _ in range(40):
        subtask = _random_subtask(rng, sorted(state.kinds), state.held)
        outcome = kitchen.env.execute(subtask)
        predicted = apply(state, subtask)
        refused = isinstance(predicted, Refusal)
        assert refused == (outcome.status is SkillStatus.REFUSED), (str(subtask), outcome.reason)
        if not isinstance(predicted, Refusal):
            state = predicted
        assert _belief(state) == _truth(kitchen), str(subtask)
