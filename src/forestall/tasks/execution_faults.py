"""An environment whose skills go wrong now and then, as a scenario says.

Wraps any `Environment` and is one itself. Built by `faults.wrap`; calls point inwards.

A robot that has picked up the wrong thing goes on taking it for the right one: what is done with
the one is done with the other, until a subtask names the wrong thing, which shows that the mistake
was noticed, or the right one is picked up.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol

from forestall.domain.model import Domain
from forestall.seams.acting import Disturbance, Environment
from forestall.seams.around import Around
from forestall.types.episode import SkillOutcome, SkillStatus
from forestall.types.facts import is_instance
from forestall.types.plan import Subtask


class Activation(Protocol):
    """When an execution fault happens: at the n-th execution of a step, so many times."""

    @property
    def kind(self) -> str:
        """What goes wrong."""

    @property
    def step(self) -> str | None:
        """The subtask concerned, as plans write it; None: before the robot does anything."""

    @property
    def occurrence(self) -> int:
        """At which execution of the step it happens first, from 1."""

    @property
    def times(self) -> int:
        """How many times it happens at most."""


class FaultyEnvironment(Around):
    """Hands every call on, and lets faults happen in `execute`."""

    def __init__(
        self,
        environment: Environment,
        faults: Sequence[Activation],
        disturbance: Disturbance,
        domain: Domain,
    ) -> None:
        super().__init__(environment)
        self._faults = tuple(faults)
        self._disturbance = disturbance
        self._domain = domain
        self._seen = [0] * len(self._faults)
        self._done = [0] * len(self._faults)
        self._mistaken: set[int] = set()
        self._undone = 0

    def reset(self, seed: int) -> None:
        """Reset the world and arm every fault again."""
        self._seen = [0] * len(self._faults)
        self._done = [0] * len(self._faults)
        self._mistaken = set()
        self._undone = 0
        self._inner.reset(seed)
        for index, fault in enumerate(self._faults):
            if fault.step is None:
                self._meddle(fault)
                self._done[index] += 1

    @property
    def idle(self) -> int:
        """How many faults have not happened so far, or could not."""
        return self._done.count(0) + self._undone

    def execute(self, subtask: Subtask) -> SkillOutcome:
        """Run a skill, with every fault that is due."""
        self._notice(subtask)
        due = self._due(subtask)
        command, silent = self._mixed_up(subtask), False
        for index in due:
            fault = self._faults[index]
            if fault.kind == "failed_action":
                silent = True
            elif fault.kind in ("wrong_object", "wrong_receptacle"):
                command = self._misled(command, fault)
            if fault.kind != "drop":
                self._done[index] += 1
        places = lets_go(self._domain, command)
        if places:
            self._inner.approach(command.args[-1])
            self._drop(due)
        outcome = self._pretend(command) if silent else self._inner.execute(command)
        if not places:
            self._drop(due)
        for index in due:
            if self._faults[index].kind == "meanwhile":
                self._meddle(self._faults[index])
        if takes_up(self._domain, subtask) and outcome.status is SkillStatus.SUCCEEDED:
            self._mistaken -= {i for i in self._mistaken if self._is_right(i, subtask.args[0])}
            self._mistaken |= {i for i in due if self._faults[i].kind == "wrong_object"}
        return outcome

    def _meddle(self, fault: Activation) -> None:
        """Somebody else changes the world, as far as it can be done."""
        thing, place = str(getattr(fault, "object", "")), getattr(fault, "place", None)
        if place is not None:
            happened = self._disturbance.rearrange(thing, place)
        else:
            changed = str(getattr(fault, "attribute", "")), str(getattr(fault, "value", ""))
            happened = self._disturbance.alter(thing, *changed)
        self._undone += not happened

    def _notice(self, subtask: Subtask) -> None:
        """A mistake ends for good when a subtask names the wrong thing."""
        for index in sorted(self._mistaken):
            by = _acts_on(self._faults[index])
            if any(self._same(by, a) for a in subtask.args):
                self._mistaken.discard(index)
                self._done[index] = self._faults[index].times

    def _mixed_up(self, subtask: Subtask) -> Subtask:
        """The subtask with what is taken for something else; picking up looks anew."""
        args = subtask.args
        for index in sorted(self._mistaken) if not takes_up(self._domain, subtask) else ():
            by = _acts_on(self._faults[index])
            args = tuple(by if self._is_right(index, a) else a for a in args)
        return Subtask(subtask.skill, args)

    def _is_right(self, index: int, name: str) -> bool:
        """Whether a name means the thing that a fault mistakes something for."""
        step = self._faults[index].step
        return step is not None and self._same(Subtask.parse(step).args[0], name)

    def _drop(self, due: Sequence[int]) -> None:
        """Lose what is held: on the way for a placing subtask, else after it."""
        for index in due:
            fault = self._faults[index]
            if fault.kind != "drop":
                continue
            hard = bool(getattr(fault, "hard", False))
            if self._disturbance.drop_held(hard) is not None:
                self._done[index] += 1

    def _due(self, subtask: Subtask) -> list[int]:
        due = []
        for index, fault in enumerate(self._faults):
            if fault.step is None or not self._means(Subtask.parse(fault.step), subtask):
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
        a, b = self._domain.canonical(named), self._domain.canonical(given)
        if is_instance(a):
            return a == b
        category = self._domain.find(b)
        return a == (b if category is None else category.name)

    def _misled(self, subtask: Subtask, fault: Activation) -> Subtask:
        by = _acts_on(fault)
        position = -1 if fault.kind == "wrong_receptacle" else 0
        args = list(subtask.args)
        args[position] = by
        return Subtask(subtask.skill, tuple(args))

    def _pretend(self, subtask: Subtask) -> SkillOutcome:
        """Drive there as the skill would, do nothing, and report success."""
        before = self._inner.time_s
        drive = self._domain.driving()
        if drive is not None and subtask.skill != drive.name:
            self._inner.execute(Subtask(drive.name, subtask.args[-1:]))
        return SkillOutcome(SkillStatus.SUCCEEDED, self._inner.time_s - before)


def takes_up(domain: Domain, step: Subtask) -> bool:
    """Whether a step takes something into a hand."""
    effects = domain.skill(step.skill).effects
    holding = domain.roles.holding
    return any(f.predicate == holding and f.value == "true" for e in effects for f in e.facts)


def lets_go(domain: Domain, step: Subtask) -> bool:
    """Whether a step puts what the hand holds somewhere."""
    skill = domain.skill(step.skill)
    return skill.hand is not None and any(
        f.predicate in domain.containing and f.args[:1] == (skill.hand,)
        for e in skill.effects
        for f in e.facts
    )


def _acts_on(fault: Activation) -> str:
    """What a misled subtask acts on instead."""
    return str(getattr(fault, "acts_on", ""))
