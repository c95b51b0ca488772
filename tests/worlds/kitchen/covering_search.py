"""Searches the episodes that cover the household's domain file, and writes them down.

    PYTHONPATH=tests/worlds/kitchen python tests/worlds/kitchen/covering_search.py \\
        [SECONDS] [SEED] [parts] [smallest]

Random starts and random subtasks, inclined towards what can be executed. An episode is kept, up to
its last useful step, where it covers a case that no other does or kills a mutant that survived (one
that lacks a whole need, effect or process; with "parts" one that lacks a part of it, too). With
"smallest" the episodes that later ones make needless are left out in the end; episodes may also be
written by hand. What is in the corpus already stays. Stops with the episode in hand where the
kitchen and the domain file disagree.
"""

from __future__ import annotations

import json
import sys
import time
from collections.abc import Sequence
from dataclasses import asdict

import numpy as np
from covering import Coverage, fixed, play
from covering_play import CORPUS, Episode, Run, Step, load_corpus
from equivalent import why_equivalent
from mutants import Mutant, kills, mutants

from forestall.domain.evaluate import evaluate
from forestall.domain.formula import free
from forestall.domain.load import shipped
from forestall.domain.model import Domain
from forestall.domain.schema import Skill
from forestall.domain.view import TRUE
from forestall.planning.execute import Refusal, apply
from forestall.planning.state import State
from forestall.types.facts import Literal
from forestall.types.plan import Subtask
from forestall.worlds.kitchen.catalogue import Catalogue, shipped_catalogue

THINGS = (
    "Mug-1", "Mug-2", "Cup-1", "Bowl-1", "Bowl-2", "Plate-1", "Plate-2", "Pot-1", "Pan-1",
    "Kettle-1", "WineBottle-1", "HousePlant-1", "Potato-1", "Tomato-1", "Lettuce-1", "Apple-1",
    "Bread-1", "Egg-1", "Egg-2", "EggCracked-7", "PotatoSliced-7", "TomatoSliced-7",
    "BreadSliced-7", "BreadSliced-8", "Knife-1", "Book-1", "CellPhone-1", "RemoteControl-1",
    "Laptop-1",
)  # fmt: skip
FIXTURES = (
    "CounterTop-1", "CounterTop-2", "DiningTable-1", "Sink-1", "Faucet-1", "Fridge-1",
    "Microwave-1", "CoffeeMachine-1", "Toaster-1", "StoveBurner-1", "StoveBurner-2",
    "Cabinet-1", "TVStand-1", "Floor-1", "Drawer-1", "GarbageCan-1", "Shelf-1",
)  # fmt: skip
MORE_FIXTURES = ("Drawer-1", "GarbageCan-1", "Shelf-1")
SOMETIMES = ("Sink-2", "Faucet-2", "Faucet-3", "StoveKnob-7", "Fridge-2")
STEPS = 40


def start(rng: np.random.Generator, vocabulary: Catalogue) -> Episode:
    """Some things at places that take them, in any states, some in front of others."""
    extra = [f for f in SOMETIMES if rng.random() < 0.15]
    fixtures = [*FIXTURES, *(f for f in extra if vocabulary[f].receptacle is not None)]
    written: dict[str, str] = {}
    chosen = [t for t in THINGS if rng.random() < 0.45]
    for name in sorted(chosen, key=lambda n: vocabulary[n].receptacle is None):
        places = []
        for place in (*fixtures, *written):
            kind = vocabulary[place].receptacle
            inside = sum(p == place for p in written.values())
            if vocabulary.accepts(place, name) and (
                kind is None or kind.capacity is None or inside < kind.capacity
            ):
                places += [place] * (4 if place in written else 1)
        written[name] = _any(rng, places)
    shown = [
        *(f"{n}@{p}{_states(rng, n, vocabulary, 0.3)}" for n, p in written.items()),
        *(f"{n}{_states(rng, n, vocabulary, 0.35)}" for n in (*MORE_FIXTURES, *extra)),
        *(
            f"{n}{states}"
            for n in ("Faucet-1", "Fridge-1", "Microwave-1", "CoffeeMachine-1", "Toaster-1",
                      "StoveBurner-1", "StoveBurner-2", "Cabinet-1", "Television-1")
            if (states := _states(rng, n, vocabulary, 0.35))
        ),
    ]  # fmt: skip
    blocked: dict[str, str] = {}
    for name, place in written.items():
        others = [o for o, other in written.items() if o != name and other == place]
        if others and rng.random() < 0.15:
            blocked[name] = _any(rng, others)
    return Episode(tuple(shown), blocked)


def _states(rng: np.random.Generator, name: str, vocabulary: Catalogue, share: float) -> str:
    found = ""
    for attribute, default in vocabulary.default_states(name).items():
        if attribute in ("sliced", "broken"):
            continue
        values = [v for v in vocabulary.values(attribute) if v != default]
        if rng.random() < share:
            found += f" {attribute}={_any(rng, values)}"
    on, is_open = "toggled=on" in found, "open=open" in found
    return found.replace(" open=open", "") if on and is_open else found


def _any(rng: np.random.Generator, among: Sequence[str]) -> str:
    return among[int(rng.integers(len(among)))]


def intended(rng: np.random.Generator, state: State) -> list[Subtask]:
    """What to do next: mostly a subtask whose fixed needs hold, after what it lacks."""
    held, domain, names = state.held, state.domain, sorted(state.kinds)
    tools = [n for n in names if domain.is_a(n, "crackable") or domain.is_a(n, "cuts")]
    if held is None and tools and rng.random() < 0.2:
        return [Subtask("pick_up", (_any(rng, tools),))]
    if held is not None and domain.is_a(held, "crackable") and rng.random() < 0.5:
        around = [p for n in names if domain.is_a(n, "has_dirty") for p in (n, state.root(n))]
        faced = _any(rng, names if not around or rng.random() < 0.4 else around)
        return [Subtask("navigate_to_obj", (faced,)), Subtask("crack_obj", (held,))]
    if held is not None and domain.is_a(held, "cuts") and rng.random() < 0.3:
        whole = [n for n in names if domain.is_a(n, "sliceable")]
        return [Subtask("slice_obj", (_any(rng, whole or names),))]
    if held is not None and rng.random() < 0.03:
        return [Subtask("pour", (held, held))]
    skills = [*sorted(domain.skills), "slice_obj", "pour", "put_in", "put_on"]
    skill = domain.skills[_any(rng, skills)]
    wanted = Subtask(skill.name, _arguments(rng, state, skill))
    refusal = apply(state, wanted)
    if not isinstance(refusal, Refusal) or rng.random() < 0.3:
        return [wanted]
    return [wanted, *(s for x in refusal.lacking for s in _towards(rng, state, x)), wanted]


def _arguments(rng: np.random.Generator, state: State, skill: Skill) -> tuple[str, ...]:
    names, domain = sorted(state.kinds), state.domain
    wild = rng.random() < 0.1
    for _ in range(60):
        args = [_any(rng, names) for _ in skill.parameters]
        for i, parameter in enumerate(skill.parameters):
            if parameter.name == skill.hand and state.held is not None and rng.random() < 0.8:
                args[i] = state.held
        bound = {p.name: a for p, a in zip(skill.parameters, args, strict=True)}
        for choice in skill.choices:
            bound.setdefault(choice.variable.name, args[0])
        asked = [n.formula for n in skill.needs if fixed(domain, n.formula)]
        asked = [f for f in asked if free(f) <= set(bound)]
        if wild or all(evaluate(f, state, bound) == TRUE for f in asked):
            break
    return tuple(args)


def _towards(rng: np.random.Generator, state: State, lacking: Literal) -> list[Subtask]:
    """Steps that may bring about a fact."""
    thing, value = (lacking.args or ("",))[0], lacking.value
    if lacking.predicate == "open":
        return [Subtask("open_obj" if value == "open" else "close_obj", (thing,))]
    if lacking.predicate == "toggled":
        return [Subtask(f"toggle_{value}", (thing,))]
    if lacking.predicate == "held_by" and state.matches(thing):
        return [*_away(rng, state, state.held), Subtask("pick_up", state.matches(thing)[:1])]
    if lacking.predicate == "hand_empty":
        return _away(rng, state, state.held)
    if lacking.predicate == "filled" and state.held == thing:
        water = [Subtask("put_in", (thing, "Sink-1")), Subtask("toggle_on", ("Faucet-1",))]
        return [*water, Subtask("pick_up", (thing,))]
    if lacking.predicate in ("vacant", "unblocked"):
        blocking = [f[1] for f in state.facts if f[0] == "blocking" and f[2] == thing]
        first = [*blocking, *state.contents(thing)][:1]
        moved = [Subtask("pick_up", (x,)) for x in first] + _away(rng, state, *first)
        back = [] if state.held is None else [Subtask("pick_up", (state.held,))]
        return [*_away(rng, state, state.held), *moved, *back]
    return []


def _away(rng: np.random.Generator, state: State, thing: str | None = None) -> list[Subtask]:
    takes = [] if thing is None else [p for p in sorted(state.kinds)
                                      if state.domain.static("accepts", p, thing)]  # fmt: skip
    return [Subtask("put_on", (str(thing), _any(rng, takes)))] if takes else []


def geometric(episode: Episode, state: State, step: Subtask) -> bool:
    """Whether only geometry tells what a step leads to.

    Where a blocker stands that is brought back, and what on the floor is within reach of an egg.
    """
    thing = step.args[0]
    if step.skill == "pick_up" and state.domain.is_a(thing, "crackable"):
        roots = [state.root(x) for x in (thing, state.at) if x in state.kinds]
        return any(state.domain.is_a(r, state.domain.roles.ground) for r in roots)
    others = {b if thing == a else a for a, b in episode.blocked.items() if thing in (a, b)}
    places = {state.place(o) for o in others}
    return len(step.args) > 1 and any(p is not None and p.parent == step.args[1] for p in places)


def search(seconds: float, seed: int, domain: Domain, left: list[Mutant]) -> list[Episode]:
    """Episodes that cover what they can in a time, and kill what they can of some mutants."""
    rng, vocabulary, end = (
        np.random.default_rng(seed),
        shipped_catalogue(),
        time.monotonic() + seconds,
    )
    coverage, corpus = Coverage(domain), load_corpus() if CORPUS.exists() else []
    for episode in corpus:
        _, left = _worth([*play(episode, domain, coverage)], left)
    said = 0.0
    while time.monotonic() < end and (coverage.open or left):
        run = Run(start(rng, vocabulary), domain)
        coverage.begin()
        done: list[Step] = []
        agenda: list[Subtask] = []
        useful = 0
        for _ in range(STEPS):
            agenda = agenda or intended(rng, run.state)
            chosen = agenda.pop(0)
            if geometric(run.episode, run.state, chosen):
                continue
            before = len(coverage.open)
            with coverage.watching():
                done.append(run.do(chosen))
            if done[-1].differences:
                steps = tuple(str(s.subtask) for s in done)
                _say(json.dumps(asdict(Episode(run.episode.things, run.episode.blocked, steps))))
                write(corpus)
                raise SystemExit("\n".join(done[-1].differences))
            useful = len(done) if len(coverage.open) < before else useful
        last, left = _worth(done, left)
        useful = max(useful, last)
        if useful:
            steps = tuple(str(s.subtask) for s in done[:useful])
            corpus.append(Episode(run.episode.things, run.episode.blocked, steps))
        if time.monotonic() - said > 10:
            said = time.monotonic()
            _say(f"{len(corpus)} episodes, {len(coverage.open)} cases, {len(left)} mutants left")
    _say("\n".join(["not covered:", *sorted(coverage.open), "alive:", *(str(m) for m in left)]))
    return corpus


def _say(text: str) -> None:
    sys.stdout.write(f"{text}\n")
    sys.stdout.flush()


def _worth(steps: list[Step], left: list[Mutant]) -> tuple[int, list[Mutant]]:
    """Up to which step an episode kills mutants, and which it leaves alive."""
    last, alive = 0, []
    for mutant in left:
        at = kills(mutant, steps)
        last = max(last, at)
        if not at:
            alive.append(mutant)
    return last, alive


def smallest(corpus: list[Episode], domain: Domain, left: list[Mutant]) -> list[Episode]:
    """The episodes without those that the later ones make needless."""
    kept: list[Episode] = []
    coverage = Coverage(domain)
    for episode in reversed(corpus):
        before, alive = len(coverage.open), len(left)
        _, left = _worth([*play(episode, domain, coverage)], left)
        if (len(coverage.open), len(left)) != (before, alive):
            kept.append(episode)
    return kept[::-1]


def write(corpus: list[Episode]) -> None:
    """Write the corpus, one episode a line."""
    lines = ",\n".join(json.dumps(asdict(e)) for e in corpus)
    CORPUS.write_text(f"[\n{lines}\n]\n", encoding="utf-8")


if __name__ == "__main__":
    limit = float(sys.argv[1]) if len(sys.argv) > 1 else 120.0
    number = int(sys.argv[2]) if len(sys.argv) > 2 else 0
    household_domain = shipped("household")
    wanted = [m for m in mutants(household_domain) if why_equivalent(str(m)) is None]
    wanted = [m for m in wanted if m.kind != "part" or "parts" in sys.argv]
    write(search(limit, number, household_domain, wanted))
    if "smallest" in sys.argv:
        write(smallest(load_corpus(), household_domain, wanted))
