"""The validator: executes any plan, whoever made it, on an observed scene graph.

Called by replanners, strategies and tests; calls `execute`. It names the first step that cannot run
and why, and then the goal facts that the plan leaves unmet.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Iterator, Mapping
from dataclasses import dataclass, replace
from itertools import islice

from forestall.domain.model import LOCATED, Domain
from forestall.planning.execute import Refusal, perform
from forestall.planning.goals import different
from forestall.planning.observed import state_of
from forestall.planning.settle import settle
from forestall.planning.state import State, decided
from forestall.types.facts import Literal, category_of
from forestall.types.graph import SceneGraph
from forestall.types.plan import Plan, Subtask
from forestall.types.task import Goal
from forestall.types.verdict import PlanCheck

MAX_BINDINGS = 2000


@dataclass(frozen=True, slots=True)
class Trace:
    """What executing subtasks gave: every state, and where it stopped, if it did."""

    states: tuple[State, ...]
    step: int | None = None
    refusal: Refusal | None = None
    touched: frozenset[str] = frozenset()
    meant: tuple[Subtask, ...] = ()  # what ran, every argument an instance

    @property
    def final(self) -> State:
        """The last state that was reached."""
        return self.states[-1]


@dataclass(frozen=True, slots=True)
class GraphValidator:
    """Implements `PlanValidator`: what `execute.apply` says on the observed graph."""

    domain: Domain

    def check(self, plan: Plan, graph: SceneGraph, goal: Goal) -> PlanCheck:
        """Execute the plan on the observed graph, then check the goal and what never may happen."""
        trace = run(observed(graph, self.domain), plan.subtasks)
        assumed = _relied_on(trace, goal)
        meant = Plan((*trace.meant, *plan.subtasks[len(trace.meant) :]), plan.goal)
        if trace.refusal is not None:
            reason, lacking = trace.refusal.reason, trace.refusal.lacking
            return PlanCheck(False, trace.step, reason, lacking, (), assumed, meant)
        missing = unmet(trace.states, goal, trace.touched)
        reason = ""
        if missing:
            reason = "the plan runs, but its goal is not met: " + ", ".join(map(str, missing))
        return PlanCheck(not missing, None, reason, (), missing, assumed, meant)


@dataclass(frozen=True, slots=True)
class AcceptAll:
    """Accepts every plan unseen (implements `PlanValidator`): the ablation without validation."""

    def check(self, plan: Plan, graph: SceneGraph, goal: Goal) -> PlanCheck:
        """Say yes."""
        return PlanCheck(True, plan=plan)


def observed(graph: SceneGraph, domain: Domain) -> State:
    """The state of a graph, after what the running devices have done by now.

    Whoever judges several plans on one graph gets the same state, which nobody changes.
    """
    found = domain.__dict__.get("_observed")
    if found is None or found[0] is not graph:
        state = state_of(graph, domain)
        settle(state)
        found = domain.__dict__["_observed"] = (graph, state)
    known: State = found[1]
    return known


def run(state: State, subtasks: Iterable[Subtask]) -> Trace:
    """Execute subtasks one after the other until one is refused."""
    states: list[State] = [state]
    touched: set[str] = set()
    meant: list[Subtask] = []
    for step, subtask in enumerate(subtasks):
        before = states[-1]
        done = perform(before, subtask)
        if isinstance(done, Refusal):
            return Trace(tuple(states), step, done, frozenset(touched), tuple(meant))
        after, args = done
        for name in args:
            touched.update((name, *(p.parent for p in before.chain(name))))
        meant.append(Subtask(subtask.skill, args))
        states.append(after)
    return Trace(tuple(states), None, None, frozenset(touched), tuple(meant))


def unmet(
    states: tuple[State, ...], goal: Goal, handled: Collection[str] = ()
) -> tuple[Literal, ...]:
    """Goal literals that fail under the best binding of the goal's variables; () if it is met.

    Of bindings under which as few fail, the one of things that a plan deals with is the best:
    those in `handled`, or in what it handles. A literal of `never` that held at any time is
    returned as it stands, bound. What is nowhere is said to lack, and of the rest of the goal then
    only what was never to happen. Where there are more bindings than are gone through, a goal may
    be called unmet that is met, and never the other way round.
    """
    final = states[-1]
    known: dict[Literal, bool] = {}
    once: dict[Literal, bool] = {}

    def fails(literal: Literal) -> bool:
        if literal not in known:
            known[literal] = not final.holds(literal)
        return known[literal]

    def happened(literal: Literal) -> bool:
        if literal not in once:
            once[literal] = any(s.holds(literal) for s in states)
        return once[literal]

    def dealt_with(binding: Mapping[str, str]) -> int:
        return sum(_dealt_with(states[0], thing, handled) for thing in binding.values())

    best: tuple[Literal, ...] | None = None
    fewest = (0, 0)
    for binding in bindings(final, goal, fails, happened):
        missing = tuple(g for x in goal.literals if fails(g := x.bind(binding)))
        never = tuple(g for x in goal.never if happened(g := x.bind(binding)))
        if not missing and not never:
            return ()
        if best is None or len(missing) + len(never) <= len(best):
            rank = (len(missing) + len(never), -dealt_with(binding))
            if best is None or rank < fewest:
                best, fewest = missing + never, rank
    if best is not None:
        return best
    lacking = dict.fromkeys(c for _, c in goal.variables if not final.matches(c))
    lacking = lacking or dict.fromkeys(c for _, c in goal.variables)  # fewer than are asked for
    rest = tuple((v, c) for v, c in goal.variables if c not in lacking)
    never = tuple(x for x in goal.never if _variables(x) <= {v for v, _ in rest})
    spoilt = unmet(states, replace(goal, variables=rest, literals=(), never=never), handled)
    return (*(Literal(LOCATED, (c,)) for c in lacking), *spoilt)


def _dealt_with(state: State, thing: str, handled: Collection[str]) -> bool:
    """Whether a plan that handles some things deals with one: with it, or with what it is in.

    Places of which any will do say nothing.
    """
    if thing in handled:
        return True
    places = [p.parent for p in state.chain(thing)]
    return any(p in handled and not state.domain.is_open_support(p) for p in places)


def bindings(
    state: State,
    goal: Goal,
    fails: Callable[[Literal], bool],
    happened: Callable[[Literal], bool],
) -> Iterator[dict[str, str]]:
    """Bindings of the goal's variables to different things (bounded).

    First those of which no variable alone makes anything fail, then all, in a fixed order.

    Args:
        state: says which things there are.
        goal: with variables.
        fails: whether a ground literal of the goal does not hold.
        happened: whether a ground literal that may never hold has held.
    """
    names = [v for v, _ in goal.variables]
    every = [state.matches(c) for _, c in goal.variables]
    faultless: list[list[str]] = []
    for variable, things in zip(names, every, strict=True):
        alone = [x for x in goal.literals if _only(x, variable)]
        never = [x for x in goal.never if _only(x, variable)]
        faultless.append([])
        for thing in things:
            bound = {variable: thing}
            wrong = any(fails(x.bind(bound)) for x in alone)
            if not wrong and not any(happened(x.bind(bound)) for x in never):
                faultless[-1].append(thing)
    for choices in (faultless, every):
        for values in islice(different(choices, [True] * len(names)), MAX_BINDINGS):
            yield dict(zip(names, values, strict=True))


def _only(literal: Literal, variable: str) -> bool:
    """Whether a literal speaks of this variable and of no other."""
    return _variables(literal) == {variable}


def _variables(literal: Literal) -> set[str]:
    return {a for a in literal.args if a.startswith("?")}


def as_checked(plan: Plan, check: PlanCheck, state: State) -> Plan:
    """The plan to send: with the instances that it was checked with.

    A category stays for a support of which any will do, for what the state does not have yet, and
    where something else stands in for it.
    """
    if check.plan is None:
        return plan
    domain, steps = state.domain, []

    def sent(given: str, meant: str) -> str:
        same = domain.canonical(category_of(given)) == state.kinds.get(meant)
        return meant if same and not domain.is_a(given, domain.roles.support) else given

    for step, meant in zip(plan.subtasks, check.plan.subtasks, strict=True):
        args = tuple(map(sent, step.args, meant.args))
        steps.append(Subtask(step.skill, args))
    return Plan(tuple(steps), plan.goal)


def unsupported(literals: Iterable[Literal], domain: Domain) -> tuple[Literal, ...]:
    """Literals that no symbolic state can decide (geometry, unknown predicates)."""
    return tuple(x for x in literals if not decided(domain, x))


def _relied_on(trace: Trace, goal: Goal) -> tuple[Literal, ...]:
    """Assumed facts about what the plan handles or the goal asks for."""
    final = trace.final
    wanted = {m for x in goal.literals for a in x.args for m in final.matches(a)}
    wanted |= {m for _, c in goal.variables for m in final.matches(c) if len(final.matches(c)) == 1}
    concerned = trace.touched | wanted
    facts = {f for s in (trace.states[0], final) for f in s.assumed}
    return tuple(sorted(f for f in facts if f.args and f.args[0] in concerned))
