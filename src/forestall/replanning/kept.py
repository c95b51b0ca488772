"""What a repair keeps: the hand, what must not be spoiled, what is off, the rest of the plan.

Called by the replanner; calls the planner's state.
"""

from __future__ import annotations

from collections.abc import Sequence

from forestall.domain.formula import literals
from forestall.domain.model import Domain
from forestall.planning.planner import Planned
from forestall.planning.state import State
from forestall.planning.validate import unsupported
from forestall.types.facts import Literal, category_of
from forestall.types.plan import Subtask
from forestall.types.runtime import BoundaryContext
from forestall.types.task import Goal


def hand(state: State, wanted: Sequence[Literal]) -> list[Literal]:
    """What the hands hold, and what lies in or on that, should stay so."""
    roles = state.domain.roles
    if roles.holding is None or any(
        x.predicate in (roles.holding, roles.hand_empty) for x in wanted
    ):
        return []
    held = list(state.in_hands())
    if not held:
        return [] if roles.hand_empty is None else [Literal(roles.hand_empty, ())]
    facts = [Literal(roles.holding, (thing, hand)) for hand, thing in held]
    concerned = {a for x in wanted if x.predicate == roles.vacant for a in x.args}
    for _, thing in held:
        for name in state.contents(thing) if thing not in concerned else ():
            place = state.place(name)
            assert place is not None
            facts.append(Literal(place.relation, (name, thing)))
    return facts


def as_it_is(state: State, literal: Literal) -> Literal | None:
    """A literal that holds, with category names replaced by the instances that make it hold."""
    if unsupported((literal,), state.domain) or not state.holds(literal):
        return None
    if literal.value == "false":
        return literal
    for position, name in enumerate(literal.args):
        if name in state.domain.robot.hands or name in state.kinds:
            continue
        for instance in state.matches(name):
            ground = literal.bind({literal.args[position]: instance})
            if state.holds(ground):
                literal = ground
                break
    return literal


def unspoiled(state: State, goal: Goal, wanted: Sequence[Literal]) -> list[Literal]:
    """What must not happen to what the repair handles, since the goal forbids it for good."""
    kinds = dict(goal.variables)
    handled = {a for x in wanted for a in x.args if a in state.kinds}
    handled |= {h for _, h in state.in_hands()}
    handled |= {y for x in handled for y in state.contents(x)}
    found = []
    for ban in dict.fromkeys(x for x in goal.never if x.predicate in state.domain.histories):
        guarded = {kinds.get(a, category_of(a)) for a in ban.args}
        for name in sorted(handled):
            if state.kinds[name] in guarded and not state.holds(Literal(ban.predicate, (name,))):
                found.append(Literal(ban.predicate, (name,), "false"))
    return list(dict.fromkeys(found))


def left_running(state: State, planned: Planned, facts: Sequence[Literal]) -> list[Literal]:
    """Devices that a repair would leave running although they did not and nothing asks for it."""
    if planned.final is None:
        return []
    found = []
    for attribute, value in _running(state.domain):
        asked = {x.args[0] for x in facts if x.predicate == attribute}
        default = state.domain.values(attribute)[0]
        found += [
            Literal(attribute, (name,), default)
            for name in sorted(state.kinds)
            if state.value(name, attribute) == default
            and planned.final.value(name, attribute) == value
            and name not in asked
        ]
    return found


def _running(domain: Domain) -> list[tuple[str, str]]:
    """Values, other than the default, that let a process go on: that a device is on."""
    found: dict[tuple[str, str], None] = {}
    for process in domain.processes:
        changed = {f.args[0] for e in process.effects for f in e.facts if f.args}
        for literal, positive in literals(process.condition):
            known = domain.attributes.get(literal.predicate)
            if known is None or not positive or literal.args[0] in changed:
                continue
            if literal.value != known.values[0]:
                found[literal.predicate, literal.value] = None
    return list(found)


def rests_of(
    context: BoundaryContext, state: State, repaired: bool
) -> tuple[tuple[Subtask, ...], ...]:
    """What is left of the current plan, with the drive that led to its first step.

    First with categories of which there are several bound to the thing that the robot deals with
    now, or has dealt with, then as it stands.
    """
    rest = context.plan.subtasks[context.index :]
    before = context.plan.subtasks[context.index - 1 : context.index] if context.index else ()
    driving = state.domain.driving()
    if repaired and before and driving is not None and before[0].skill == driving.name:
        rest = (*before, *rest)
    bound = {}
    held = (h for _, h in state.in_hands())
    for name in (*context.meant.values(), *context.subtask.args, *held):
        kind = state.kinds.get(name)
        if kind is None or state.domain.is_a(kind, state.domain.roles.fixture):
            continue
        if len(state.instances(kind)) > 1:
            bound[kind] = name
    named = tuple(Subtask(s.skill, tuple(bound.get(a, a) for a in s.args)) for s in rest)
    return (named,) if named == rest else (named, rest)
