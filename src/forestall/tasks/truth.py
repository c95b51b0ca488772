"""What is true when a run is judged, for scoring: could the next step be done, and the rest?

A listener: it is told what happens and cannot change it. It executes the plan at hand on the true
state in the planning domain; the upper bound that no detector can beat, and the earliest moment at
which a failure exists. Built by `assembly` with the oracle, read by the experiments, and by
`causes` and `losses` beside it.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from typing import Protocol

from forestall.domain.model import Domain
from forestall.planning.state import State
from forestall.planning.validate import Trace, observed, run, unmet
from forestall.seams.acting import OracleView
from forestall.strategies.intervention import rest_of
from forestall.types.episode import BoundaryRecord, EpisodeRecord, ExecutedRecord, SkillStatus
from forestall.types.facts import Literal
from forestall.types.graph import SceneGraph
from forestall.types.plan import Plan, Subtask
from forestall.types.runtime import BoundaryContext, When
from forestall.types.task import Goal


class Meanings(Protocol):
    """Where perception has names of its own: what these truly mean."""

    @property
    def newest(self) -> Subtask | None:
        """The newest command that was sent, in true names."""

    def truly(self, subtask: Subtask, graph: SceneGraph) -> Subtask:
        """What a subtask in the names of a graph would be done with now."""


@dataclass(frozen=True, slots=True)
class TrueMoment:
    """The truth when a subtask came next.

    `possible`: it could be carried out. `reachable`: it and what is left of the plan would lead to
    the goal, with nothing happening on the way that must never happen. `lacking`: what the first
    step that could not be carried out would need, else what the goal would lack in the end; a state
    of a thing that must never be stands there as it is.
    """

    possible: bool
    reachable: bool
    lacking: tuple[Literal, ...] = ()


@dataclass(frozen=True, slots=True)
class Left:
    """The true scene at one moment, and what was left to be done in it.

    Args:
        scene: everything.
        history: what had happened that cannot be undone.
        plan: what was left, with the drive before it, where there was one.
        goal: of the task.
        driven: how many steps of `plan` are over: that drive.
        executed: how many subtasks the run had executed. `events`: how many things had happened.
    """

    scene: SceneGraph
    history: frozenset[Literal]
    plan: Plan
    goal: Goal
    driven: int
    executed: int
    events: int

    def state(self, domain: Domain) -> State:
        """The scene as planning has it, with what has happened."""
        state = observed(self.scene, domain)
        if self.history:
            state = state.copy()
            for fact in self.history:
                state.add((fact.predicate, *fact.args))
        return state

    def played(self, domain: Domain) -> Trace:
        """The rest of the plan, executed on the truth."""
        return run(self.state(domain), self.plan.subtasks)


class TruthTrace:
    """Implements `Listener`.

    Attributes:
        moments: one for each call of a strategy.
        left: likewise, and one more for the end of the run.
        executed: every subtask that was executed, in true names.
        nominal: the task's own plan. `planned`: the one that the run started with.
    """

    def __init__(self) -> None:
        self.moments: list[TrueMoment] = []
        self.left: list[Left] = []
        self.executed: list[Subtask] = []
        self.nominal = self.planned = Plan(())
        self._domain: Domain | None = None
        self._leave: Callable[[Plan, Goal, int], Left] | None = None
        self._meanings: Meanings | None = None
        self._succeeded = True

    def attach(self, oracle: OracleView, domain: Domain, meanings: Meanings | None = None) -> None:
        """Say whose truth is meant; `assembly` does.

        Args:
            oracle: the truth.
            domain: of the run.
            meanings: of perception's names; those of the truth by default.
        """
        self._domain, self._meanings = domain, meanings
        self._leave = partial(self._left, oracle)

    def on_start(self, record: EpisodeRecord) -> None:
        """Forget an earlier run."""
        self.moments.clear()
        self.left.clear()
        self.executed.clear()
        self._succeeded = True
        self.nominal, self.planned = record.task.plan, record.initial_plan

    def on_boundary(self, boundary: BoundaryRecord, context: BoundaryContext) -> None:
        """Look at the truth."""
        assert self._leave is not None and self._domain is not None, "attach() comes first"
        context = replace(context, index=context.index + self._done(context))
        rest = rest_of(context, self._domain)
        if self._meanings is not None:
            steps = (self._meanings.truly(s, context.graph) for s in rest)
            rest = Plan(tuple(steps), rest.goal)
        driven = len(rest) - len(context.remaining())
        left = self._leave(rest, context.task.goal, driven)
        self.left.append(left)
        self.moments.append(_moment(left.played(self._domain), left))

    def on_executed(self, executed: ExecutedRecord, time_s: float) -> None:
        """A refused subtask is still to be done."""
        true = None if self._meanings is None else self._meanings.newest
        self.executed.append(executed.subtask if true is None else true)
        self._succeeded = executed.outcome.status is SkillStatus.SUCCEEDED

    def on_end(self, record: EpisodeRecord) -> None:
        """Look once more, at what came of it."""
        if self._leave is not None:
            self.left.append(self._leave(Plan(()), record.task.goal, 0))

    def _left(self, oracle: OracleView, plan: Plan, goal: Goal, driven: int) -> Left:
        executed, events = len(self.executed), len(oracle.events())
        return Left(oracle.truth(), oracle.history(), plan, goal, driven, executed, events)

    def _done(self, context: BoundaryContext) -> int:
        """How many subtasks of the rest are over: after a subtask it is still the next one's."""
        return int(context.when is When.AFTER and self._succeeded)


def _moment(played: Trace, left: Left) -> TrueMoment:
    if played.refusal is not None and played.step is not None:
        return TrueMoment(played.step > left.driven, False, played.refusal.lacking)
    missing = unmet(played.states, left.goal)
    lacking = (
        replace(x, value="false") if x.value == "true" and must_never_be(x, left.goal) else x
        for x in missing
    )
    return TrueMoment(True, not missing, tuple(lacking))


def must_never_be(fact: Literal, goal: Goal) -> bool:
    """Whether a fact of what a plan leaves unmet is one that was not to happen."""
    asked = {(x.predicate, x.value) for x in goal.literals}
    sort = (fact.predicate, fact.value)
    return sort not in asked and sort in {(x.predicate, x.value) for x in goal.never}
