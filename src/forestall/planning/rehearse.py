"""A whole plan in the mind: every step, what it spoils, and whether the answer hangs on the unseen.

Called by assembly for `forestall plan check`; calls `validate`. What was not observed is taken from
the domain, as the validator does; where another value would change the answer there is none.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from enum import Enum

from forestall.domain.model import LOCATED, Domain
from forestall.domain.schema import SafetyRule
from forestall.planning.execute import said
from forestall.planning.state import State
from forestall.planning.validate import GraphValidator, Trace, observed, run, unmet
from forestall.types.facts import Literal
from forestall.types.graph import ObjectNode, Relation, SceneGraph
from forestall.types.plan import Plan
from forestall.types.task import Goal
from forestall.types.verdict import PlanCheck

_LEAVING = "leaving"
_UNKNOWN = "something"
"""What may be in a place that nobody looked into, as the category of a thing."""

_MOST_TRIED = 200

_BEFORE = "it was so before"


class PlanOutcome(Enum):
    """What comes of a plan."""

    RUNS = "runs"
    FAILS = "does not run"
    OPEN = "not judged"  # it hangs on something that nobody observed


@dataclass(frozen=True, slots=True)
class Spoiled:
    """One thing that must never be true and is.

    Args:
        step: index of the step by which it comes about; None: as the robot leaves.
        what: the safety rule's name, or the fact that the goal forbids.
        sentence: what is said of it.
        excused: why it is no fault of the plan; "" where it is one.
    """

    step: int | None
    what: str
    sentence: str
    excused: str = ""


@dataclass(frozen=True, slots=True)
class Rehearsal:
    """What comes of a plan on a scene.

    Args:
        plan: as it was asked about.
        check: the validator's answer.
        trace: what ran.
        spoils: what must never be true and is.
        unobserved: facts that nobody saw and on which the answer hangs.
    """

    plan: Plan
    check: PlanCheck
    trace: Trace
    spoils: tuple[Spoiled, ...]
    unobserved: tuple[Literal, ...]

    @property
    def outcome(self) -> PlanOutcome:
        """The answer."""
        if self.unobserved:
            return PlanOutcome.OPEN
        return PlanOutcome.RUNS if _good(self.check, self.spoils) else PlanOutcome.FAILS


def rehearse(
    plan: Plan,
    graph: SceneGraph,
    goal: Goal,
    domain: Domain,
    excused: Mapping[str, str] | None = None,
) -> Rehearsal:
    """Execute a plan on a scene in the mind, from its first step to the goal.

    Args:
        plan: of the domain's skills.
        graph: the scene that it starts in.
        goal: that it is to reach; without literals only running counts.
        domain: what skills need and do.
        excused: rule about leaving → why breaking it is no fault here.
    """
    excuses = excused or {}
    check, trace, spoils = _tried(plan, graph, goal, domain, excuses)
    unobserved: dict[Literal, None] = {}
    if all(s.excused for s in spoils):
        unobserved = dict.fromkeys(x for x in check.lacking if x.predicate == LOCATED)
        assumed = _assumed(plan, check, trace)
        unobserved |= dict.fromkeys(assumed[_MOST_TRIED:])  # nobody has tried them otherwise
        for fact in assumed[:_MOST_TRIED]:
            for other in _otherwise(graph, fact, domain):
                found, _, harm = _tried(plan, other, goal, domain, excuses)
                if _good(found, harm) is not check.ok:
                    unobserved[fact] = None
    return Rehearsal(plan, check, trace, spoils, tuple(unobserved))


def left_broken(plan: Plan, graph: SceneGraph, domain: Domain) -> frozenset[str]:
    """Names of the rules about leaving that a plan breaks where it runs to its end."""
    trace = run(observed(graph, domain), plan.subtasks)
    return frozenset(s.what for s in _broken(trace, {}) if s.step is None and not s.excused)


def _good(check: PlanCheck, spoils: tuple[Spoiled, ...]) -> bool:
    return check.ok and all(s.excused for s in spoils)


def _tried(
    plan: Plan, graph: SceneGraph, goal: Goal, domain: Domain, excused: Mapping[str, str]
) -> tuple[PlanCheck, Trace, tuple[Spoiled, ...]]:
    check = GraphValidator(domain).check(plan, graph, goal)
    trace = run(observed(graph, domain), plan.subtasks)
    return check, trace, (*_broken(trace, excused), *_forbidden(trace, goal))


def _assumed(plan: Plan, check: PlanCheck, trace: Trace) -> list[Literal]:
    """Assumed facts about what the plan handles, would handle, or the goal asks for.

    Those first on which the validator's answer rests.
    """
    states = (trace.states[0], trace.final)
    named = {a for step in plan for a in step.args} | {a for x in check.lacking for a in x.args}
    touched = {m for n in named for m in trace.final.matches(n)} | trace.touched
    touched |= {p.parent for n in tuple(touched) for p in trace.final.chain(n)}
    facts = {f for s in states for f in s.assumed if f.args and f.args[0] in touched}
    return sorted(facts | set(check.assumed), key=lambda f: (f not in check.assumed, f))


def _otherwise(graph: SceneGraph, fact: Literal, domain: Domain) -> Iterator[SceneGraph]:
    """The scene as it also may be, where a fact was not observed."""
    name = fact.args[0]
    if fact.is_state:
        for value in domain.values(fact.predicate):
            if value != fact.value:
                yield _with_state(graph, name, fact.predicate, value)
    elif fact.predicate == domain.roles.vacant:
        yield _filled(_opened(graph, name), name, domain)
    elif fact.predicate in domain.containing:
        yield _opened(graph, fact.args[1])


def _with_state(graph: SceneGraph, name: str, attribute: str, value: str) -> SceneGraph:
    nodes = tuple(
        replace(n, states=tuple({**dict(n.states), attribute: value}.items()))
        if n.id == name
        else n
        for n in graph.nodes
    )
    return replace(graph, nodes=nodes)


def _opened(graph: SceneGraph, name: str) -> SceneGraph:
    return replace(graph, hidden=tuple(h for h in graph.hidden if h != name))


def _filled(graph: SceneGraph, name: str, domain: Domain) -> SceneGraph:
    number = 1
    while graph.get(f"{_UNKNOWN}-{number}") is not None:
        number += 1
    thing = ObjectNode(f"{_UNKNOWN}-{number}", _UNKNOWN)
    within = Relation(thing.id, domain.offers(name) or domain.containing[0], name)
    return replace(graph, nodes=(*graph.nodes, thing), relations=(*graph.relations, within))


def _broken(trace: Trace, excused: Mapping[str, str]) -> Iterator[Spoiled]:
    """Safety rules that are broken on the way, and where the robot leaves."""
    for rule in trace.final.domain.safety:
        if rule.when == _LEAVING:
            yield from _on_leaving(rule, trace, excused.get(rule.name, ""))
        elif rule.when:
            for step, meant in enumerate(trace.meant):
                names = rule.at(meant.skill, meant.args)
                if names is not None:
                    state = trace.states[step + rule.after]
                    yield from (_spoiled(rule, c, state, step) for c in _cases(rule, state, names))
        else:
            yield from _on_the_way(rule, trace)


def _on_leaving(rule: SafetyRule, trace: Trace, excuse: str) -> Iterator[Spoiled]:
    if trace.refusal is None:
        before = _cases(rule, trace.states[0])
        for case in _cases(rule, trace.final):
            yield _spoiled(rule, case, trace.final, None, _BEFORE if case in before else excuse)


def _on_the_way(rule: SafetyRule, trace: Trace) -> Iterator[Spoiled]:
    """Each case once, at the step by which it comes about."""
    known = set(_cases(rule, trace.states[0]))
    yield from (_spoiled(rule, c, trace.states[0], None, _BEFORE) for c in sorted(known))
    for step, state in enumerate(trace.states[1:]):
        for case in _cases(rule, state):
            if case not in known:
                known.add(case)
                yield _spoiled(rule, case, state, step)


def _cases(
    rule: SafetyRule, state: State, given: Mapping[str, str] | None = None
) -> list[tuple[str, ...]]:
    """What a rule's variables stand for, each time that it is broken."""
    names, wanted = [v.name for v in rule.variables], (given or {}).items()
    found = state.bindings(rule.variables, rule.never, {})
    return sorted({tuple(b[n] for n in names) for b in found if wanted <= b.items()})


def _spoiled(
    rule: SafetyRule, case: tuple[str, ...], state: State, step: int | None, excused: str = ""
) -> Spoiled:
    names = {v.name: thing for v, thing in zip(rule.variables, case, strict=True)}
    sentence = said(state, rule.sentence, names, {}) or f"{rule.name} ({', '.join(case)})"
    return Spoiled(step, rule.name, sentence, excused)


def _forbidden(trace: Trace, goal: Goal) -> Iterator[Spoiled]:
    """What the goal says must never have happened and does."""
    states = trace.states
    kinds = {(x.predicate, x.value) for x in goal.never}
    for fact in unmet(states, goal):
        step = next((i for i, s in enumerate(states) if s.holds(fact)), None)
        if (fact.predicate, fact.value) in kinds and step is not None:
            already = "" if step else " before the first step"
            sentence = f"{fact}{already}, which the goal forbids"
            yield Spoiled(max(step - 1, 0), str(fact), sentence)
