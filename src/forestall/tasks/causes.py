"""Why a run, left alone, will not do: the true facts that are the reason, for scoring.

Called by the experiments with the trace of the truth; calls planning. Nothing of a run sees it. The
facts come from three places: what the scenario changed (`fault_facts`), what came otherwise than
the last good moment let expect, and what the first step that cannot run lacks, traced back through
definitions to what is so (`reasons`).
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace
from difflib import SequenceMatcher
from itertools import product
from typing import Any

from forestall.domain.formula import normal
from forestall.domain.model import LOCATED, Domain
from forestall.planning.settle import settle
from forestall.planning.state import State
from forestall.planning.validate import Trace, run, unmet
from forestall.tasks.fault_facts import fault_facts
from forestall.tasks.reasons import because, denied
from forestall.tasks.scene_faults import SceneFault
from forestall.tasks.truth import Left, TruthTrace, must_never_be
from forestall.types.facts import Literal
from forestall.types.plan import Plan

Unit = tuple[str, ...]
"""One thing that differs between two states: a value, a place, a fact, whether a thing exists."""


def causes(
    trace: TruthTrace, faults: Iterable[Any], domain: Domain, at: int
) -> tuple[Literal, ...]:
    """The facts that are the reason why the run is lost from a moment on, sorted.

    They say what is so, with the world's own names: `inside(Bowl-1, Microwave-1)`, and what is
    defined by it: `not vacant(Microwave-1)`. Of what should be in a place, both where it is and
    where it is not.

    Args:
        trace: of a run that nobody interrupted.
        faults: of its scenario; none where the scenario is harmless.
        domain: as the world has it, whatever model the monitor had.
        at: position in `trace.moments` of the first moment of the loss, its length for one that
            showed only after the last step; see `losses.losses`.

    Returns:
        Nothing where the loss is no fact of the scene: a plan that names what cannot be done.
    """
    if not 0 <= at < len(trace.left):
        return ()
    left = trace.left[at]
    state = left.state(domain)
    played = run(state, left.plan.subtasks)
    found = set(_of_faults(tuple(faults), trace.left[0], state))
    found |= _unexpected(trace, at, domain)
    found |= _misplanned(trace, domain) if at == 0 else set()
    failing = state
    if played.refusal is not None:
        failing = played.final
        for lacking in _ground(played.refusal.lacking, failing):
            found |= {x for x in (denied(lacking),) if x is not None}
            found |= because(normal(lacking, False), failing)
    elif not found:
        found = _before_harm(left, played) or _of_the_goal(left, played)
    return tuple(sorted(found | _defined(found, state) | _defined(found, failing)))


def _of_faults(faults: Sequence[Any], first: Left, state: State) -> set[Literal]:
    """What the scenario's faults make so, and what of the scene fails the run, if that shows."""
    start = first.state(state.domain)
    scene = [f for f in faults if isinstance(f, SceneFault)]
    later = [f for f in faults if not isinstance(f, SceneFault)]
    found = set(fault_facts(later, state.domain, (state,)))
    facts = fault_facts(scene, state.domain, (start,), named=later)
    so = [f for f in facts if start.holds(f)]
    missing = {f for f in facts if f not in so}
    if not so or _good(start, first):
        return found | missing
    if not _good(_without(start, so), first):
        return found | set(facts)  # the plan is wrong besides, or something is missing
    alone = [f for f in so if not _good(_without(start, [o for o in so if o != f]), first)]
    return found | missing | set(alone or so)


def _without(state: State, facts: Iterable[Literal]) -> State:
    """A state in which some facts do not hold: a value is the one that is usual."""
    other = state.copy()
    for fact in facts:
        if fact.is_state:
            usual = state.domain.default_states(state.category(fact.args[0]))
            other.set_value(fact.args[0], fact.predicate, usual[fact.predicate])
        else:
            other.remove((fact.predicate, *fact.args))
    settle(other)
    return other


# --- what came otherwise -------------------------------------------------------------------------


def _unexpected(trace: TruthTrace, at: int, domain: Domain) -> set[Literal]:
    """In what the truth differs, to the run's loss, from what the last good moment let expect."""
    if at == 0 or not trace.moments[at - 1].reachable:
        return set()
    before, left = trace.left[at - 1], trace.left[at]
    done = trace.executed[before.executed : left.executed]
    expected = run(before.state(domain), (*before.plan.subtasks[: before.driven], *done)).final
    state = left.state(domain)
    units = sorted(_differences(expected, state))
    alone = [u for u in units if _good(_with(state, expected, (u,)), left)]
    decisive = alone or _needed(units, state, expected, left)
    return {x for u in decisive for x in _so(u, state, expected)}


def _needed(units: Sequence[Unit], state: State, expected: State, left: Left) -> list[Unit]:
    """The differences of which every one must be mended; all, where mending is not enough."""
    needed = list(units)
    if not _good(_with(state, expected, needed), left):
        return needed
    for unit in units:
        fewer = [u for u in needed if u != unit]
        if _good(_with(state, expected, fewer), left):
            needed = fewer
    return needed


def _differences(expected: State, state: State) -> Iterator[Unit]:
    for name in expected.kinds.keys() ^ state.kinds.keys():
        yield ("thing", name)
    for name, attribute in expected.values.keys() & state.values.keys():
        if expected.values[name, attribute] != state.values[name, attribute]:
            yield ("value", name, attribute)
    for fact in expected.facts ^ state.facts:
        placed = expected.domain.predicates[fact[0]].group is not None
        if fact[1] in expected.kinds and fact[1] in state.kinds:
            yield ("place", fact[1]) if placed else ("fact", *fact)


def _with(state: State, expected: State, units: Iterable[Unit]) -> State:
    """A state in which some differences are mended, and what follows from that has happened."""
    mended = state.copy()
    for sort, *about in units:
        if sort == "value":
            name, attribute = about
            mended.set_value(name, attribute, expected.values[name, attribute])
        elif sort == "place":
            for fact in [f for f in mended.facts if _places(f, about[0], state.domain)]:
                mended.remove(fact)
            for fact in [f for f in expected.facts if _places(f, about[0], state.domain)]:
                mended.add(fact)
            mended.lost = mended.lost - {about[0]}
        elif sort == "fact":
            change = mended.add if tuple(about) in expected.facts else mended.remove
            change(tuple(about))
    settle(mended)
    return mended


def _so(unit: Unit, state: State, expected: State) -> Iterator[Literal]:
    """What is so of a difference, and what of it is not so."""
    sort, *about = unit
    if sort == "value":
        yield Literal(about[1], (about[0],), state.values[about[0], about[1]])
    elif sort == "thing":
        if about[0] not in state.kinds:
            yield Literal(LOCATED, (about[0],), "false")
            return
        yield from _literals(f for f in state.facts if _places(f, about[0], state.domain))
    elif sort == "fact":
        fact = tuple(about)
        yield Literal(fact[0], fact[1:], "true" if fact in state.facts else "false")
    else:
        here = {f for f in state.facts if _places(f, about[0], state.domain)}
        there = {f for f in expected.facts if _places(f, about[0], state.domain)}
        yield from _literals(here - there)
        yield from (Literal(f[0], f[1:], "false") for f in there - here)


def _literals(facts: Iterable[tuple[str, ...]]) -> Iterator[Literal]:
    return (Literal(f[0], f[1:]) for f in facts)


def _places(fact: tuple[str, ...], name: str, domain: Domain) -> bool:
    return fact[1:2] == (name,) and domain.predicates[fact[0]].group is not None


# --- what was not planned ------------------------------------------------------------------------


def _misplanned(trace: TruthTrace, domain: Domain) -> set[Literal]:
    """What is so where the plan first leaves the nominal one, and would not be after that.

    Nothing where the nominal plan would not do either.
    """
    right, wrong = trace.nominal.subtasks, trace.planned.subtasks
    start = trace.left[0].state(domain)
    if right == wrong or not _good(start, replace(trace.left[0], plan=trace.nominal)):
        return set()
    blocks = SequenceMatcher(None, right, wrong, autojunk=False).get_opcodes()
    _, i, i_end, j, j_end = next(b for b in blocks if b[0] != "equal")
    common = run(start, right[:i]).final
    meant, ran = run(common, right[i:i_end]).final, run(common, wrong[j:j_end]).final
    return {x for u in _differences(meant, ran) for x in _so(u, ran, meant)}


# --- what could be otherwise ---------------------------------------------------------------------


def _before_harm(left: Left, played: Trace) -> set[Literal]:
    """Facts of which each, were it otherwise before what must never be, would have helped."""
    kinds = dict(left.goal.variables)
    never = [x.bind(kinds) for x in left.goal.never]
    first = next((k for k, s in enumerate(played.states) if any(map(s.holds, never))), 0)
    if first == 0:
        return set()
    state = played.states[first - 1]
    rest = replace(left, plan=replace(left.plan, subtasks=left.plan.subtasks[first - 1 :]))
    return {fact for fact, other in _otherwise(state, played) if _good(other, rest)}


def _otherwise(state: State, played: Trace) -> Iterator[tuple[Literal, State]]:
    """What is so of the things that a plan handles, and states in which it is not."""
    handled = {a for s in played.meant for a in s.args if a in state.kinds}
    handled |= {p.parent for n in handled for p in state.chain(n)}
    handled |= {inside for n in handled for inside in state.contents(n)}
    for (name, attribute), now in state.values.items() if handled else ():
        for value in state.domain.values(attribute) if name in handled else ():
            if value != now:
                changed = state.copy()
                changed.set_value(name, attribute, value)
                settle(changed)
                yield Literal(attribute, (name,), now), changed
    for fact in state.facts:
        if fact[0] in state.domain.relations and fact[1] in handled:
            changed = state.copy()
            changed.remove(fact)
            yield Literal(fact[0], fact[1:]), changed


def _of_the_goal(left: Left, played: Trace) -> set[Literal]:
    """What is so in the place of what the goal asks for, and what would have brought it about."""
    found: set[Literal] = set()
    for missing in unmet(played.states, left.goal):
        if must_never_be(missing, left.goal):
            found |= {x for x in _ground([missing], played.final) if played.final.holds(x)}
            continue
        for fact in _ground([missing], played.final):
            found |= {x for x in (denied(fact),) if x is not None}
            found |= because(normal(fact, False), played.final)
    over = replace(left, plan=Plan(()))
    return found | {x for x, other in _otherwise(played.final, played) if _good(other, over)}


def _good(state: State, left: Left) -> bool:
    played = run(state, left.plan.subtasks)
    return played.refusal is None and not unmet(played.states, left.goal)


# --- words ---------------------------------------------------------------------------------------


def _ground(facts: Iterable[Literal], state: State) -> Iterator[Literal]:
    """Facts about instances; of a category that nothing is of, about the category."""
    hands = state.domain.robot.hands
    for fact in facts:
        choices = [(a,) if a in hands else state.matches(a) or (a,) for a in fact.args]
        yield from (Literal(fact.predicate, c, fact.value) for c in product(*choices))


def _defined(found: set[Literal], state: State) -> set[Literal]:
    """What does not hold by definition where some facts are so, of the things in them."""
    domain, state = state.domain, state.copy()
    for fact in found:  # somebody may bring it about only later
        if fact.value == "true" and fact.predicate in domain.relations:
            state.add((fact.predicate, *fact.args))
    named = {a for x in found for a in x.args if a in state.kinds}
    things = sorted(named.union(*(state.contents(n) for n in named)))
    more = set()
    for known in domain.derived.values():
        if known.definition is None or not known.mined or len(known.parameters) > 1:
            continue
        fit = things
        if known.name == domain.roles.vacant:
            fit = [t for t in things if domain.is_a(state.category(t), domain.roles.vacatable)]
        for args in [(t,) for t in fit] if known.parameters else [()]:
            lacking = Literal(known.name, args)
            behind = because(normal(lacking, False), state, instead=False) & found
            if any(x.args[:1] != args for x in behind):  # more than where the thing itself is
                more.add(Literal(known.name, args, "false"))
    return more
