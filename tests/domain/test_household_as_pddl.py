"""The household, written as PDDL and read again, takes and refuses the same steps."""

from __future__ import annotations

import random
from dataclasses import replace
from itertools import product

import pytest
from pddl_corpus import subtask

from forestall.domain.formula import TRUE
from forestall.domain.load import shipped
from forestall.domain.pddl_in import read_pddl
from forestall.domain.pddl_out import domain_pddl
from forestall.domain.pddl_state import problem_pddl
from forestall.planning.execute import Refusal, apply
from forestall.planning.pddl_problem import read_problem
from forestall.planning.state import State

MAKERS = ("slice_obj", "crack_obj")
HOUSEHOLD = replace(
    shipped("household"),
    processes=(),
    skills={n: s for n, s in shipped("household").skills.items() if n not in MAKERS},
)
WRITTEN = domain_pddl(HOUSEHOLD)
AGAIN = read_pddl(WRITTEN.text, "household.pddl")
THINGS = (
    "CounterTop-1", "Cabinet-1", "Fridge-1", "Microwave-1", "Sink-1", "Faucet-1", "StoveBurner-1",
    "StoveBurner-2", "StoveKnob-1", "StoveKnob-2", "Mug-1", "Mug-2", "Plate-1", "Pot-1", "Tomato-1",
    "Television-1", "RemoteControl-1", "Floor-1",
)  # fmt: skip
PLACES = ("CounterTop-1", "Cabinet-1", "Fridge-1", "Microwave-1", "Sink-1", "StoveBurner-2",
          "Pot-1", "Plate-1")  # fmt: skip


def kitchen(rng: random.Random) -> State:
    state = State(HOUSEHOLD, {t: t.partition("-")[0] for t in THINGS})
    for thing in THINGS:
        for attribute in HOUSEHOLD[thing].attributes:
            state.values[thing, attribute] = rng.choice(HOUSEHOLD.values(attribute))
    for thing in ("Pot-1", "Plate-1", "Mug-1", "Mug-2", "Tomato-1", "RemoteControl-1"):
        able = [p for p in PLACES if HOUSEHOLD.static("accepts", p, thing)]
        place = rng.choice(able)
        relation = "inside" if HOUSEHOLD.is_a(place, "takes_inside") else "on_top_of"
        state.add((relation, thing, place))
    if rng.random() < 0.5:
        state.add(("held_by", rng.choice(("Mug-1", "Pot-1", "RemoteControl-1")), "gripper"))
    if rng.random() < 0.5:
        state.add(("blocking", "Pot-1", rng.choice(("Mug-1", "Cabinet-1"))))
    if rng.random() < 0.3:
        state.lost = frozenset(("Mug-2",))
    return state


def plain(name: str) -> str:
    return name.lower().replace("-", "_")


@pytest.mark.parametrize("seed", range(6))
def test_random_steps_are_taken_and_refused_alike(seed: int) -> None:
    rng = random.Random(seed)
    ours = kitchen(rng)
    taken = 0
    for _ in range(40):
        theirs, _goal = read_problem(problem_pddl(ours, TRUE), AGAIN)
        skill = HOUSEHOLD.skills[rng.choice(sorted(HOUSEHOLD.skills))]
        args = [rng.choice(THINGS) for _ in skill.parameters]
        if skill.hand and ours.held and rng.random() < 0.7:
            args[0] = ours.held
        binding = {p.name: a for p, a in zip(skill.parameters, args, strict=True)}
        done = skill.done_when is not None and not skill.choices
        if done and skill.done_when is not None and ours.true(skill.done_when, binding):
            continue  # succeeds without doing anything: no action of the text
        after = apply(ours, subtask(skill.name, *args))
        found = []
        for name, action in WRITTEN.actions.items():
            if action.skill == skill.name:
                more = len(AGAIN.skills[plain(name)].parameters) - action.arguments
                for rest in product(THINGS, repeat=more):
                    step = subtask(plain(name), *map(plain, (*args, *rest)))
                    then = apply(theirs, step)
                    found += [] if isinstance(then, Refusal) else [then]
        if isinstance(after, Refusal):
            assert not found, f"{skill.name}({args}): {after.reason}"
            continue
        if not found:  # what is on already
            assert skill.name == "toggle_on" and after.values == ours.values
            continue
        assert len(found) == 1
        expected, _goal = read_problem(problem_pddl(after, TRUE), AGAIN)
        assert found[0].facts == expected.facts
        ours = after
        taken += 1
    assert taken > 3
