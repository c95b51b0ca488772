"""Where a run stands: plan and position, what is believed, what names mean, time spent.

Owned and changed by the monitor only; calls name resolution (`grounding.py`).
"""

from __future__ import annotations

import time
from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from forestall.domain.brought import came_about
from forestall.domain.names import executable, ground_subtask
from forestall.errors import InputError
from forestall.in_a_row import Streaks
from forestall.senses import Senses
from forestall.types.episode import ExecutedRecord, SkillOutcome, SkillStatus
from forestall.types.facts import Truth, category_of, is_instance
from forestall.types.graph import SceneGraph
from forestall.types.observation import Observation, Vec3
from forestall.types.plan import Plan, Subtask, same_step
from forestall.types.runtime import BoundaryContext, When
from forestall.types.task import Task

if TYPE_CHECKING:
    from forestall.domain.model import Domain


OFTEN = 2
"""So often in a row something comes to nothing before another way is looked for: once is a slip."""


@dataclass(frozen=True, slots=True)
class Refusal:
    """What the robot refused: it will again, as long as nothing about its arguments changes.

    Args:
        subtask: as it was meant, every argument an instance where it was known.
        reason: in the robot's words, "" where it gave none.
        around: what was known of the arguments then.
    """

    subtask: Subtask
    reason: str
    around: frozenset[object]


def around(graph: SceneGraph, subtask: Subtask, domain: Domain) -> frozenset[object]:
    """What is known of a subtask's arguments and of what they are in: states, and relations.

    Only relations that skills are about count.
    """
    names, pending = set(subtask.args), list(subtask.args)
    while pending:
        above = set(graph.parents(pending.pop(), domain.containing)) - names
        names |= above
        pending += above
    found: set[object] = {(n.id, n.states) for n in graph.nodes if n.id in names}
    found |= {
        r
        for r in graph.relations
        if (r.subject in subtask.args or r.object in subtask.args)
        and (r.predicate in domain.moved or r.predicate in domain.containing)
    }
    return frozenset(found)


@dataclass(slots=True)
class RunState:
    """What changes while one run goes on.

    Args:
        task: goal and names.
        first_plan: the plan that the run started with.
        domain: resolves names.
        plan: the plan at hand.
        senses: whether what is seen can be so.
        position: in it, of the subtask that comes next.
        replans: how many plans were adopted, and `searches` how many of them look for something.
        looks: taken at the boundary that is open, 0 where none is.
        boundary: how many boundaries are over.
        ready: whether the newest subtask that was judged may be reported as executed.
        last: what was known before it.
        bound: category → the instance that it means.
        executed: what was tried.
        refusals: what the robot refused.
        acted: what it has done last, so far as it knows; what comes of it is seen next.
        fruitless: how often in a row a subtask came to nothing.
        graph: everything that is believed.
        robot_world_m: where the robot stands.
        worked_at: where the newest skill let go, and where it was to make other things of one:
            nobody knows what is there before it is seen.
        time_s: of the robot's clock.
        streaks: what has gone wrong in a row.
        seconds: measured time by phase; `since` is the same when the boundary began.
    """

    task: Task
    first_plan: Plan
    domain: Domain
    plan: Plan
    senses: Senses
    position: int = 0
    replans: int = 0
    searches: int = 0
    looks: int = 0
    boundary: int = 0
    ready: bool = False
    last: BoundaryContext | None = None
    bound: dict[str, str] = field(default_factory=dict)
    executed: list[ExecutedRecord] = field(default_factory=list)
    refusals: list[Refusal] = field(default_factory=list)
    acted: Subtask | None = None
    fruitless: Counter[Subtask] = field(default_factory=Counter)
    graph: SceneGraph = field(default_factory=lambda: SceneGraph(()))
    final: SceneGraph | None = None
    robot_world_m: Vec3 = (0.0, 0.0, 0.0)
    worked_at: tuple[Vec3, ...] = ()
    time_s: float = 0.0
    streaks: Streaks = field(default_factory=Streaks)
    seconds: dict[str, float] = field(default_factory=dict)
    since: dict[str, float] = field(default_factory=dict)

    @property
    def finished(self) -> bool:
        """Whether the plan has no further subtask."""
        return self.position >= len(self.plan)

    def ground(self) -> Subtask:
        """The next subtask with instance names where they are known."""
        return ground_subtask(
            self.plan.subtasks[self.position],
            self.graph,
            self.domain,
            self.robot_world_m,
            self.bound,
            self.refused(),
        )

    def refused(self) -> dict[Subtask, str]:
        """What was refused and would be again → why: nothing about its arguments has changed."""
        return {
            r.subtask: r.reason
            for r in self.refusals
            if around(self.graph, r.subtask, self.domain) == r.around
        }

    def vain(self) -> tuple[Subtask, ...]:
        """What was tried twice or more in a row and came to nothing each time."""
        counted = self._counted()
        return tuple(sorted(s for s, times in counted.items() if times >= OFTEN))

    def _counted(self) -> Counter[Subtask]:
        """`fruitless`, with what is seen now of what the newest subtask was to bring about.

        Only what is seen not to be so speaks against a robot that says it has done it.
        """
        counted = self.fruitless.copy()
        if self.acted is not None:
            nothing = came_about(self.graph, self.acted, self.domain) is Truth.FALSE
            counted[self.acted] = counted[self.acted] + 1 if nothing else 0
        return counted

    def command(self, subtask: Subtask, position: int) -> Subtask:
        """What to send to the robot for a grounded subtask of the plan."""
        return executable(subtask, self.plan.subtasks[position], self.domain)

    def views(self, subtask: Subtask) -> tuple[Vec3, ...]:
        """Where the hand worked last, and the arguments that it does not hold."""
        points = list(self.worked_at)
        held = self.graph.in_hands(self.domain.robot.hands)
        for name in subtask.args:
            node = self.graph.get(name)
            if node is not None and node.centroid_m is not None and node.id not in held:
                points.append(node.centroid_m)
        return tuple(points)

    def approach(self) -> str | None:
        """The thing at which the next subtask is done, None where nothing is to be driven to."""
        subtask = self.ground()
        node = self.graph.get(subtask.args[-1])
        if (
            self.domain.drives(subtask)
            or node is None
            or node.centroid_m is None
            or self.domain.is_open_support(node.category)
        ):
            return None
        return node.id

    def move_to(self, subtask: Subtask | str | None) -> None:
        """Make a subtask the next one; what lies between is skipped.

        Raises:
            InputError: the plan is finished, or has no such subtask from here on.
        """
        if self.finished:
            raise InputError("the plan is finished: call finish()")
        if subtask is None:
            return
        wanted = Subtask.parse(subtask) if isinstance(subtask, str) else subtask
        for position in range(self.position, len(self.plan)):
            if same_step(self.plan.subtasks[position], wanted):
                if position != self.position:
                    self.close_boundary()
                    self.position = position
                return
        raise InputError(
            f"{wanted} is not in what is left of the plan; "
            f"next is {self.plan.subtasks[self.position]}"
        )

    def adopt(self, plan: Plan, searching: bool) -> None:
        """Go on with another plan; `searching`: it only looks for something."""
        self.plan, self.position = plan, 0
        self.replans += 1
        self.searches += searching

    def close_boundary(self) -> None:
        """The next look is the first of another boundary."""
        self.boundary += self.looks > 0
        self.looks = 0

    def note_executed(self, outcome: SkillOutcome) -> None:
        """The subtask that was judged is over; after a refusal no name means what it meant.

        Raises:
            InputError: none was judged.
        """
        if self.last is None or not self.ready:
            raise InputError("no subtask was judged before: call before(observation) first")
        self.close_boundary()
        self.fruitless, self.acted = self._counted(), None
        subtask = self.last.subtask
        self.bound |= _instances(subtask)
        if outcome.status is SkillStatus.REFUSED:
            self.bound.clear()
            known = around(self.last.graph, subtask, self.domain)
            self.refusals.append(Refusal(subtask, outcome.reason, known))
        command = self.command(subtask, self.position)
        self.worked_at = self._worked_at(command, outcome)
        self.executed.append(ExecutedRecord(command, outcome, self.boundary - 1))
        self.position += 1
        self.ready = False
        self.streaks.executed(outcome.status is SkillStatus.SUCCEEDED)
        if outcome.status is SkillStatus.FAILED:
            self.fruitless[subtask] += 1
        if outcome.status is SkillStatus.SUCCEEDED:
            self.acted = subtask
            self.senses.done(bool(self.domain.skill(command.skill).effects))

    def _worked_at(self, command: Subtask, outcome: SkillOutcome) -> tuple[Vec3, ...]:
        """See `worked_at`; of what is in the hand the views show that anyway."""
        points = () if outcome.hand_world_m is None else (outcome.hand_world_m,)
        skill = self.domain.skills.get(command.skill)
        if skill is None or not skill.makes or self.last is None:
            return points
        known = map(self.last.graph.get, self.last.subtask.args)
        held = self.last.graph.in_hands(self.domain.robot.hands)
        at = (n.centroid_m for n in known if n is not None and n.id not in held)
        return (*points, *(c for c in at if c is not None))

    def context(
        self,
        when: When,
        index: int,
        subtask: Subtask,
        scope: Callable[[SceneGraph, Subtask], SceneGraph],
        observation: Observation | None,
        max_looks: int,
    ) -> BoundaryContext:
        """What a strategy may know now."""
        left = len(self.plan) - index
        look = self.looks + 1
        return BoundaryContext(
            task=self.task,
            plan=self.plan,
            index=index,
            done=max(0, len(self.first_plan) - left),
            subtask=subtask,
            graph=self.graph,
            scoped=scope(self.graph, subtask),
            observation=observation,
            looks=look,
            may_look=look < max_looks,
            replans=self.replans,
            searches=self.searches,
            when=when,
            refused=tuple(self.refused()),
            vain=self.vain(),
            executed=tuple((e.subtask, e.outcome.status) for e in self.executed),
            meant={**self.bound, **_instances(subtask)},
        )

    @contextmanager
    def phase(self, name: str) -> Iterator[None]:
        """Book measured time under a name."""
        started = time.perf_counter()
        try:
            yield
        finally:
            self.book(name, time.perf_counter() - started)

    def book(self, name: str, seconds: float) -> None:
        """Add to the time of a phase."""
        self.seconds[name] = self.seconds.get(name, 0.0) + seconds

    def mark(self) -> None:
        """What is booked from here on belongs to the next boundary."""
        self.since = dict(self.seconds)


def _instances(subtask: Subtask) -> dict[str, str]:
    """What the categories of its arguments mean."""
    return {category_of(name): name for name in subtask.args if is_instance(name)}
