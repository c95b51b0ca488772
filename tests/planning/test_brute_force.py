"""Whatever `apply` reaches in a few steps the planner reaches, or does not call unsolvable."""

from __future__ import annotations

import random
from itertools import product

import pytest

from forestall.planning.execute import Refusal, apply
from forestall.planning.planner import plan_goal
from forestall.planning.state import State
from forestall.planning.validate import observed
from forestall.types.facts import Literal
from forestall.types.plan import Subtask
from forestall.types.task import Goal
from forestall.types.verdict import ReplanOutcome
from planning.corpus import DOMAIN, scene

FIXTURES = "CounterTop-1, Sink-1, Faucet-1, Fridge-1, Microwave-1, StoveBurner-1, StoveBurner-2"
CHOICES = (
    (
        "Mug-1 on CounterTop-1",
        "Mug-1 in Sink-1, Mug-1 is coffee",
        "Mug-1 in Fridge-1",
        "Mug-1 held",
    ),
    (
        "Plate-1 on CounterTop-1, Plate-1 is dirty",
        "Plate-1 in Microwave-1",
        "Pan-1 on StoveBurner-1",
    ),
    (
        "Potato-1 on CounterTop-1",
        "Potato-1 on Plate-1",
        "Potato-1 in Pan-1",
        "Bread-1 on CounterTop-1",
    ),
    ("Egg-1 in Fridge-1", "Egg-1 in Bowl-1", "Egg-1 on CounterTop-1, Egg-2 in Fridge-1"),
    (
        "Knife-1 on CounterTop-1",
        "Knife-1 on CounterTop-1, Mug-2 on CounterTop-1, Mug-1 blocks Mug-2",
    ),
    ("Fridge-1 is open", "Microwave-1 is open", "Faucet-1 is on", "StoveBurner-1 is on", ""),
)


def kitchen(rng: random.Random) -> State:
    """A small kitchen drawn at random; what a fact names without a place stands on the counter."""
    where = ", ".join([FIXTURES, *(rng.choice(c) for c in CHOICES)])
    named = {
        w
        for line in where.split(",")
        for w in line.split()
        if w.startswith(("Bowl", "Pan", "Plate"))
    }
    placed = {line.split()[0] for line in where.split(",") if " on " in line or " in " in line}
    extra = [f"{n} on CounterTop-1" for n in sorted(named - placed)]
    return observed(scene(where, *extra), DOMAIN)


def steps(state: State) -> list[Subtask]:
    """Every subtask over the things of a state."""
    return [
        Subtask(name, args)
        for name, skill in sorted(DOMAIN.skills.items())
        for args in product(sorted(state.kinds), repeat=len(skill.parameters))
    ]


def reached(state: State, depth: int, rng: random.Random) -> State:
    """A state that is up to so many skills away."""
    for _ in range(depth):
        several = [s for s in steps(state) if not DOMAIN.skills[s.skill].drives]
        rng.shuffle(several)
        first = rng.choice(list(DOMAIN.skills))
        several = [s for s in several if s.skill == first] + several
        after = (a for s in several if not isinstance(a := apply(state, s), Refusal))
        state = next(after, state)
    return state


def drawn_goal(before: State, after: State, rng: random.Random) -> Goal:
    """Up to three facts that have become so."""
    facts = [
        Literal(a, (x,), v) for (x, a), v in after.values.items() if before.values.get((x, a)) != v
    ]
    facts += [Literal(f[0], f[1:]) for f in sorted(after.facts - before.facts)]
    facts += [
        Literal(f[0], f[1:], "false")
        for f in sorted(before.facts - after.facts)
        if f[1] in after.kinds
    ]
    chosen = rng.sample(sorted(facts), min(len(facts), rng.randint(1, 3)))
    return Goal("", literals=tuple(chosen))


def wrong(count: int, seed: int) -> list[str]:
    """Goals that can be reached and are not, with what the planner says."""
    rng, found = random.Random(seed), []
    drawn = 0
    while drawn < count:
        before = kitchen(rng)
        after = reached(before, rng.randint(1, 4), rng)
        wanted = drawn_goal(before, after, rng)
        if not wanted.literals:
            continue
        drawn += 1
        planned = plan_goal(before, wanted)
        if planned.outcome is not ReplanOutcome.SOLVED:
            found.append(
                f"{planned.outcome.value}: {[str(x) for x in wanted.literals]} {planned.note}"
            )
        else:
            assert planned.final is not None
            assert all(planned.final.holds(x) for x in wanted.literals)
    return found


def test_what_can_be_reached_is_never_called_unsolvable() -> None:
    assert not [w for w in wrong(25, 1) if w.startswith("unsolvable")]


@pytest.mark.slow
def test_four_hundred_goals_that_can_be_reached() -> None:
    assert not [w for w in wrong(400, 2) if w.startswith("unsolvable")]
