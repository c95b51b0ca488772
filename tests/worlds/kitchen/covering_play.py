"""Written episodes, and playing them in the kitchen and in the domain file at once.

Used by `covering`, `mutants` and `test_domain_covers`; calls the kitchen and the executor.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any
from unittest.mock import patch

from small_kitchen import SmallKitchen

from forestall.domain.model import Domain
from forestall.planning import execute
from forestall.planning.execute import Refusal
from forestall.planning.observed import state_of
from forestall.planning.state import State
from forestall.types.episode import SkillStatus
from forestall.types.facts import GRIPPER
from forestall.types.plan import Subtask

CORPUS = Path(__file__).with_name("covering_corpus.json")
"""Episodes that `covering_search` found."""

ROOM = 99
"""Things that find a spot on one support: geometry is not what is tested here."""


@dataclass(frozen=True)
class Episode:
    """A start and what is done from it.

    Args:
        things: as `SmallKitchen` reads them.
        blocked: thing → what stands in front of it.
        steps: subtasks as text.
    """

    things: tuple[str, ...]
    blocked: Mapping[str, str] = field(default_factory=dict)
    steps: tuple[str, ...] = ()


@dataclass(frozen=True)
class Step:
    """One subtask in both: the belief before it, what the domain makes of it, the truth after."""

    before: State
    subtask: Subtask
    after: State | Refusal
    refused: bool
    reason: str
    truth: Mapping[Any, Any]

    @cached_property
    def middle(self) -> State | Refusal:
        """What the domain makes of it before anything happens by itself."""
        return unsettled(self.before, self.subtask)

    @property
    def differences(self) -> list[str]:
        """What the kitchen and the domain do not agree on."""
        if isinstance(self.after, Refusal) != self.refused:
            said = self.after.reason if isinstance(self.after, Refusal) else "succeeds"
            return [
                f"{self.subtask}: the domain {said!r}, the kitchen {self.reason or 'succeeds'!r}"
            ]
        known = belief(self.before if isinstance(self.after, Refusal) else self.after)
        return [
            f"{self.subtask}: {key} is {self.truth.get(key)!r}, believed {known.get(key)!r}"
            for key in sorted({*known, *self.truth}, key=str)
            if known.get(key) != self.truth.get(key)
        ]


class Run:
    """An episode that can be played on step by step."""

    def __init__(self, episode: Episode, domain: Domain) -> None:
        self.episode = episode
        names = [t.split()[0].partition("@")[0] for t in episode.things]
        places = {t.split()[0].partition("@")[2] for t in episode.things} - {""}
        spots = dict.fromkeys({*names, *places, "Floor-1", "Sink-1", "CounterTop-1"}, ROOM)
        self.kitchen = SmallKitchen(
            *episode.things, blocked=episode.blocked, spots=_Always(spots), cool_down_s=1e9
        )
        self.state = state_of(self.kitchen.env.oracle.truth(), domain)
        for name in self.kitchen.spoiled:
            self.state.add(("spoiled", name))

    def do(self, subtask: Subtask) -> Step:
        """Do one subtask in both."""
        before = self.state
        outcome = self.kitchen.env.execute(subtask)
        after = execute.apply(before, subtask)
        refused = outcome.status is SkillStatus.REFUSED
        if isinstance(after, State):
            self.state = after
        return Step(before, subtask, after, refused, outcome.reason, truth(self.kitchen))


class _Always(dict[str, int]):
    """So many spots wherever something lies."""

    def get(self, key: str, default: Any = None) -> int:
        return ROOM


def unsettled(state: State, subtask: Subtask) -> State | Refusal:
    """What a skill does, without what happens by itself."""
    with patch.object(execute, "settle", lambda state: None):
        return execute.apply(state.copy(), subtask)


def truth(kitchen: SmallKitchen) -> dict[Any, Any]:
    """Everything that is so in the kitchen."""
    graph = kitchen.env.oracle.truth()
    facts: dict[Any, Any] = {(n.id, a): v for n in graph.nodes for a, v in n.states}
    facts |= {
        (n.id, "parent"): graph.parents(n.id, ("inside", "on_top_of"))
        for n in graph.nodes
        if n.id != GRIPPER
    }
    places = {(r.subject, r.predicate, r.object) for r in graph.relations}
    return facts | {
        "held": graph.in_hands(("gripper",)),
        "spoiled": kitchen.spoiled,
        "relations": places,
    }


def belief(state: State) -> dict[Any, Any]:
    """The same of what the domain makes of it."""
    facts: dict[Any, Any] = dict(state.values)
    for name in state.kinds:
        place = state.place(name)
        facts[name, "parent"] = () if place is None else (place.parent,)
    places = {(f[1], f[0], f[2]) for f in state.facts if len(f) == 3}
    spoiled = {f[1] for f in state.facts if f[0] == "spoiled"}
    return facts | {
        "held": tuple(filter(None, [state.held])),
        "spoiled": spoiled,
        "relations": places,
    }


def load_corpus() -> list[Episode]:
    """The recorded episodes."""
    return [
        Episode(tuple(e["things"]), e["blocked"], tuple(e["steps"]))
        for e in json.loads(CORPUS.read_text(encoding="utf-8"))
    ]
