"""The planner: from an observed state and a goal to a readable plan.

Called by `replanning`; calls `relevance`, `ground`, `number`, `search`, `driving`. First on what
matters for the goal, and where that has no plan on everything; only then is something unsolvable.
One deadline goes through all of it.
"""

from __future__ import annotations

import threading
import time
from collections import OrderedDict
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace

from forestall.deadline import Deadline, TimeUp
from forestall.planning.drafts import Grounding
from forestall.planning.driving import gathered, with_driving
from forestall.planning.goals import (
    Alternatives,
    Conjunction,
    alternatives,
    negated,
    shown,
)
from forestall.planning.ground import ground
from forestall.planning.grounder import Universe
from forestall.planning.needs import useful
from forestall.planning.number import UnsupportedError, number
from forestall.planning.problem import Operator, Problem
from forestall.planning.refused import barred_by, is_refused
from forestall.planning.relevance import everything, narrowed
from forestall.planning.search import SearchConfig, SearchOutcome, solve
from forestall.planning.state import State
from forestall.planning.validate import unmet
from forestall.types.facts import Literal
from forestall.types.plan import Subtask
from forestall.types.task import Goal
from forestall.types.verdict import ReplanOutcome

OUTCOMES = {
    SearchOutcome.SOLVED: ReplanOutcome.SOLVED,
    SearchOutcome.UNSOLVABLE: ReplanOutcome.NOT_FOUND,
    SearchOutcome.CUT_SHORT: ReplanOutcome.NOT_FOUND,
    SearchOutcome.TIMEOUT: ReplanOutcome.TIMEOUT,
}

_RECENT = 16
SEARCHING = 0.8
"""Share of the time that is left for finding a plan; what is then left is for improving it."""
MANY = 16
"""From so many things in a goal on, its most promising alternatives are tried alone at first."""
FEW = 4
"""So many of them."""
LARGE = 40
"""Among more things than this only those skills are grounded that the goal can depend on."""


@dataclass(frozen=True, slots=True)
class Planned:
    """What planning gave: subtasks when solved, the state after them, and what it cost."""

    outcome: ReplanOutcome
    subtasks: tuple[Subtask, ...] = ()
    final: State | None = None
    expanded: int = 0
    seconds: float = 0.0
    note: str = ""


def plan_to(
    state: State,
    goals: Alternatives,
    config: SearchConfig | None = None,
    also: Iterable[str] = (),
    widen: bool = True,
    deadline: Deadline | None = None,
    refused: frozenset[Subtask] = frozenset(),
) -> Planned:
    """Plan from a state to any one of some ground conjunctions.

    Args:
        state: the first state.
        goals: what to reach.
        config: bounds of the search.
        also: further things to keep in the narrowed problem.
        widen: go on with everything where the narrowed problem has no plan.
        deadline: when to stop, however much time `config` gives. Where it is over, or somebody
            cancels it, the outcome is `TIMEOUT`, within some milliseconds.
        refused: steps that no plan may contain; a category in one stands for all of its things.
    """
    start_s = time.perf_counter()
    config = config or SearchConfig()
    if not goals.conjunctions:
        return Planned(ReplanOutcome.UNSOLVABLE, note="nothing that is known can meet the goal")
    with _planning(state, config, deadline, refused) as planning:
        planned = planning.to(goals, also)
        if widen and planning.may_widen(planned):
            planned = planning.on_everything(goals, planned)
    return replace(planned, seconds=time.perf_counter() - start_s)


def plan_goal(
    state: State,
    goal: Goal,
    config: SearchConfig | None = None,
    deadline: Deadline | None = None,
    refused: frozenset[Subtask] = frozenset(),
) -> Planned:
    """Plan from a state to a task's goal, whatever binding of its variables is nearest.

    Arguments as those of `plan_to`.
    """
    start_s = time.perf_counter()
    with _planning(state, config or SearchConfig(), deadline, refused) as planning:
        try:
            planned = planning.goal(goal)
        except TimeUp:
            planned = Planned(ReplanOutcome.TIMEOUT, note=_too_many(len(state.kinds)))
    return replace(planned, seconds=time.perf_counter() - start_s)


@contextmanager
def _planning(
    state: State, config: SearchConfig, outer: Deadline | None, refused: frozenset[Subtask]
) -> Iterator[_Planning]:
    """One call at a time plans in a domain, since they share what was grounded.

    One that another thread has given up ends within milliseconds.
    """
    deadline = (outer or Deadline()).within(config.time_limit_s)
    with state.domain.__dict__.setdefault("_turn", threading.RLock()):
        yield _Planning(state, config, deadline, refused)


@dataclass(frozen=True, slots=True)
class _Planning:
    """One call: from where, within what bounds, without which steps."""

    state: State
    config: SearchConfig
    deadline: Deadline
    refused: frozenset[Subtask]

    def goal(self, goal: Goal) -> Planned:
        """To a task's goal; raises TimeUp."""
        state = self.state
        goals = alternatives(state, goal, deadline=self.deadline)
        if not goals.conjunctions:
            goals = alternatives(state, goal, True, self.deadline)
        if not goals.conjunctions:
            missing = [c for _, c in goal.variables if not _anywhere(state, c)]
            missing += [a for x in goal.literals for a in x.args if _nowhere(state, a)]
            names = ", ".join(dict.fromkeys(missing))
            note = f"{names}: its place is not known" if names else _too_few(goal)
            return Planned(ReplanOutcome.UNSOLVABLE, note=note)
        planned = _met(self.to(goals), goal)
        if self.may_widen(planned):
            goals = alternatives(state, goal, True, self.deadline)
            planned = _met(self.on_everything(goals, planned), goal)
        return planned

    def to(self, goals: Alternatives, also: Iterable[str] = ()) -> Planned:
        """Among what matters for the goals, of many only for the first at first."""
        if len(goals.conjunctions) > FEW and len(goals.names) >= MANY:
            few = Alternatives(goals.conjunctions[:FEW], False)
            planned = self._narrowed(few, also, self.deadline.within(0.3 * self.deadline.left()))
            if planned.outcome in (ReplanOutcome.SOLVED, ReplanOutcome.UNSUPPORTED):
                return planned
        return self._narrowed(goals, also, self.deadline)

    def _narrowed(self, goals: Alternatives, also: Iterable[str], deadline: Deadline) -> Planned:
        shunned = frozenset(a for s in self.refused for a in s.args)
        try:
            kept = narrowed(self.state, goals.conjunctions, also, shunned, deadline)
        except TimeUp:
            return Planned(ReplanOutcome.TIMEOUT, note=_too_many(len(self.state.kinds)))
        planned = Planned(ReplanOutcome.NOT_FOUND)
        for careful in (True, False):
            tried = self._attempt(goals, kept, careful, deadline)
            planned = replace(tried, expanded=planned.expanded + tried.expanded)
            if planned.outcome not in (ReplanOutcome.NOT_FOUND, ReplanOutcome.REJECTED):
                break
        return planned

    def may_widen(self, planned: Planned) -> bool:
        """Whether there is reason, and time, to look among everything."""
        failed = planned.outcome in (ReplanOutcome.NOT_FOUND, ReplanOutcome.REJECTED)
        return failed and planned.expanded < self.config.max_expansions

    def on_everything(self, goals: Alternatives, before: Planned) -> Planned:
        """The search that proves something, or finds what narrowing has hidden."""
        deadline = self.deadline.within(self.config.whole_limit_s)
        tried = self._attempt(goals, everything(self.state), False, deadline)
        if tried.outcome is ReplanOutcome.TIMEOUT and not self.deadline.over:
            tried = replace(tried, outcome=ReplanOutcome.NOT_FOUND)
        return replace(tried, expanded=before.expanded + tried.expanded)

    def _attempt(
        self, goals: Alternatives, kept: Universe, careful: bool, deadline: Deadline
    ) -> Planned:
        finding = deadline.within(SEARCHING * deadline.left())
        try:
            grounding = _grounding(self.state, kept, self._useful(goals, kept), finding)
            barred = barred_by(self.state, self.refused)
            problem = number(grounding, self.state, goals.conjunctions, careful, barred, finding)
        except UnsupportedError as error:
            return Planned(ReplanOutcome.UNSUPPORTED, note=str(error))
        except TimeUp:
            return Planned(ReplanOutcome.TIMEOUT, note=_too_many(len(kept.things)))
        found = solve(problem, self.config, finding)
        outcome, expanded = OUTCOMES[found.outcome], found.expanded
        if found.outcome is SearchOutcome.SOLVED:
            steps = [problem.operators[i] for i in found.steps]
            loose = frozenset(x for x in kept.supports if x not in goals.names)
            return replace(self._driven(problem, steps, loose), expanded=expanded)
        if found.outcome is not SearchOutcome.UNSOLVABLE:
            note = f"no plan within the limits ({expanded} states expanded)"
            return Planned(outcome, expanded=expanded, note=note)
        if kept.purposeful is None and goals.complete and not problem.bounded and not careful:
            outcome = ReplanOutcome.UNSOLVABLE
        note = _why_not(self.state, goals.conjunctions, self.refused)
        return Planned(outcome, expanded=expanded, note=note)

    def _useful(self, goals: Alternatives, kept: Universe) -> frozenset[str] | None:
        """The skills to ground: of a small problem all, since other goals then share it."""
        if len(kept.things) <= LARGE:
            return None
        return useful(self.state.domain, (p for c in goals.conjunctions for p in c))

    def _driven(self, problem: Problem, steps: list[Operator], loose: frozenset[str]) -> Planned:
        """A plan that was found, with driving; made shorter as long as there is time."""
        deadline, state = self.deadline, self.state
        steps = gathered(problem, state, steps, deadline)
        try:
            free = loose if not self.refused else frozenset[str]()  # a category may mean any
            subtasks, final, note = with_driving(state, steps, free, deadline)
        except TimeUp:
            return Planned(ReplanOutcome.TIMEOUT, note="a plan was found too late to be checked")
        if final is None:
            return Planned(ReplanOutcome.REJECTED, note=note)
        denied = is_refused(subtasks, self.refused)
        if denied is not None:
            return Planned(ReplanOutcome.REJECTED, note=f"{denied} was refused")
        if deadline.cancelled:
            return Planned(ReplanOutcome.TIMEOUT, note="cancelled")
        return Planned(ReplanOutcome.SOLVED, subtasks, final, note=note)


def _too_many(things: int) -> str:
    return f"no plan in the time that there was ({things} things)"


def _too_few(goal: Goal) -> str:
    kinds = dict.fromkeys(c for _, c in goal.variables)
    return f"there are not {len(goal.variables)} different things of {', '.join(kinds)}"


def _met(planned: Planned, goal: Goal) -> Planned:
    """A plan that names what it makes otherwise than the goal does is none."""
    if planned.final is None:
        return planned
    missing = unmet((planned.final,), goal)
    if not missing:
        return planned
    note = "the plan that was found does not reach " + ", ".join(map(str, missing))
    return replace(planned, outcome=ReplanOutcome.REJECTED, subtasks=(), final=None, note=note)


def pose(
    state: State, goals: Alternatives, also: Iterable[str] = (), whole: bool = False
) -> Problem:
    """The ground problem of a state and goal alternatives.

    Raises:
        UnsupportedError: no alternative can be expressed.
    """
    kept = everything(state) if whole else narrowed(state, goals.conjunctions, also)
    return number(_grounding(state, kept), state, goals.conjunctions, not whole)


def _grounding(
    state: State,
    kept: Universe,
    skills: frozenset[str] | None = None,
    deadline: Deadline | None = None,
) -> Grounding:
    """What can happen among the kept things; the several searches of one replanning share it."""
    known = frozenset(kept.things)
    hands = state.domain.robot.hands
    facts = frozenset(f for f in state.facts if all(a in known or a in hands for a in f[1:]))
    key = (
        tuple((x, state.kinds[x]) for x in kept.things),
        tuple(sorted(state.kinds.items())),
        facts,
        state.lost,
        tuple(sorted(kept.made.items())),
        kept.purposeful,
        kept.supports,
        skills,
    )
    recent = state.domain.__dict__.setdefault("_groundings", OrderedDict())
    found = recent.get(key)
    if found is None:
        found = recent[key] = ground(state, kept, skills, deadline)
        if len(recent) > _RECENT:
            recent.popitem(last=False)
    return found  # type: ignore[no-any-return]


def _anywhere(state: State, category: str) -> bool:
    return any(x not in state.lost for x in state.matches(category))


def _nowhere(state: State, name: str) -> bool:
    hands = state.domain.robot.hands
    return name not in hands and not name.startswith("?") and not _anywhere(state, name)


def _why_not(state: State, goals: Sequence[Conjunction], refused: frozenset[Subtask]) -> str:
    """A reason for a dead end, naming what is lost if something is, and what was refused."""
    names = Alternatives(tuple(goals)).names
    lost = sorted(names & state.lost)
    if lost:
        return f"{', '.join(lost)}: its place is not known"
    facts: list[Literal | str] = [
        x for x in goals[0] if isinstance(x, Literal) and negated(x) is None and not state.holds(x)
    ]
    wanted = ", ".join(map(str, facts or [shown(x) for x in goals[0]]))
    without = f" without {', '.join(map(str, sorted(refused)))}" if refused else ""
    return f"no sequence of skills leads to {wanted}{without}"
