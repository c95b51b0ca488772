"""An environment whose skills go wrong now and then, as a scenario says.

Wraps any `Environment` and is one itself. Built by `faults.wrap`; calls point inwards.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol

from forestall.interfaces import Disturbance, Environment
from forestall.types.episode import SkillOutcome, SkillStatus
from forestall.types.facts import is_instance
from forestall.types.observation import Observation, Vec3
from forestall.types.plan import Subtask
from forestall.vocabulary import Vocabulary


class Activation(Protocol):
    """When an execution fault happens: at the n-th execution of a step, so many times."""

    @property
    def kind(self) -> str:
        """What goes wrong."""

    @property
    def step(self) -> str:
        """The subtask concerned, as plans write it."""

    @property
    def occurrence(self) -> int:
        """At which execution of the step it happens first, from 1."""

    @property
    def times(self) -> int:
        """How many times it happens at most."""


class FaultyEnvironment:
    """Hands every call on, and lets faults happen in `execute`."""

    def __init__(
        self,
        environment: Environment,
        faults: Sequence[Activation],
        disturbance: Disturbance,
        vocabulary: Vocabulary,
    ) -> None:
        self._inner = environment
        self._faults = tuple(faults)
        self._disturbance = disturbance
        self._vocabulary = vocabulary
        self._seen = [0] * len(self._faults)
        self._done = [0] * len(self._faults)

    def reset(self, seed: int) -> None:
        """Reset the world and arm every fault again."""
        self._seen = [0] * len(self._faults)
        self._done = [0] * len(self._faults)
        self._inner.reset(seed)

    def scan(self, thorough: bool = False) -> Observation:
        """As the wrapped environment."""
        return self._inner.scan(thorough)

    def observe(self, focus: Sequence[Vec3] = ()) -> Observation:
        """As the wrapped environment."""
        return self._inner.observe(focus)

    def approach(self, name: str) -> float:
        """Drive near, undisturbed."""
        return self._inner.approach(name)

    def execute(self, subtask: Subtask) -> SkillOutcome:
        """Run a skill, with every fault that is due."""
        due = self._due(subtask)
        command, silent = subtask, False
        for index in due:
            fault = self._faults[index]
            if fault.kind == "failed_action":
                silent = True
            elif fault.kind in ("wrong_object", "wrong_receptacle"):
                command = self._misled(command, fault)
            if fault.kind != "drop":
                self._done[index] += 1
        lets_go = command.skill in ("put_on", "put_in")
        if lets_go:
            self._inner.approach(command.args[-1])
            self._drop(due)
        outcome = self._pretend(command) if silent else self._inner.execute(command)
        if not lets_go:
            self._drop(due)
        return outcome

    def _drop(self, due: Sequence[int]) -> None:
        """Lose what is held: on the way for a placing subtask, else after it."""
        for index in due:
            if self._faults[index].kind == "drop" and self._disturbance.drop_held() is not None:
                self._done[index] += 1

    @property
    def time_s(self) -> float:
        """As the wrapped environment."""
        return self._inner.time_s

    def close(self) -> None:
        """As the wrapped environment."""
        self._inner.close()

    def _due(self, subtask: Subtask) -> list[int]:
        due = []
        for index, fault in enumerate(self._faults):
            if not self._means(Subtask.parse(fault.step), subtask):
                continue
            self._seen[index] += 1
            if self._seen[index] >= fault.occurrence and self._done[index] < fault.times:
                due.append(index)
        return due

    def _means(self, named: Subtask, executed: Subtask) -> bool:
        """Whether a step of a scenario names this subtask: categories stand for instances."""
        return named.skill == executed.skill and all(
            self._same(a, b) for a, b in zip(named.args, executed.args, strict=True)
        )

    def _same(self, named: str, given: str) -> bool:
        a, b = self._vocabulary.canonical(named), self._vocabulary.canonical(given)
        if is_instance(a):
            return a == b
        category = self._vocabulary.find(b)
        return a == (b if category is None else category.name)

    def _misled(self, subtask: Subtask, fault: Activation) -> Subtask:
        by = str(getattr(fault, "acts_on", ""))
        position = -1 if fault.kind == "wrong_receptacle" else 0
        args = list(subtask.args)
        args[position] = by
        return Subtask(subtask.skill, tuple(args))

    def _pretend(self, subtask: Subtask) -> SkillOutcome:
        """Drive there as the skill would, do nothing, and report success."""
        before = self._inner.time_s
        if subtask.skill != "navigate_to_obj":
            self._inner.execute(Subtask("navigate_to_obj", subtask.args[-1:]))
        return SkillOutcome(SkillStatus.SUCCEEDED, self._inner.time_s - before)
